"""The sphere of principal increments, seen along its isotropic axis."""

from __future__ import annotations

import numpy as np

__all__ = ["DEVIATORIC_AXES", "equal_area"]

# rows: isochoric compression along axis 1; across it, from axis 3 to axis 2; isotropic compression
DEVIATORIC_AXES = (
    (2.0 / np.sqrt(6.0), -1.0 / np.sqrt(6.0), -1.0 / np.sqrt(6.0)),
    (0.0, np.sqrt(0.5), -np.sqrt(0.5)),
    (1.0 / np.sqrt(3.0), 1.0 / np.sqrt(3.0), 1.0 / np.sqrt(3.0)),
)


def equal_area(unit, *, expansion: bool = False) -> np.ndarray:
    """Lambert's equal-area projection about the isotropic axis.

    Isotropic compression (or expansion) is the centre, isochoric increments are the circle of radius 1, compression
    along axis 1 is up, and increments with equal components 2 and 3, the Rendulic plane, are the vertical diameter.

    Parameters
    ----------
    unit : (..., 3) array
        Unit vectors of principal increments.
    expansion : bool
        Project about isotropic expansion instead; up stays compression along axis 1.

    Returns
    -------
    (..., 2) array
        Abscissa and ordinate; beyond radius 1 in the other hemisphere, up to sqrt(2) at the opposite pole.

    Examples
    --------
    >>> equal_area([2 / 6**0.5, -1 / 6**0.5, -1 / 6**0.5]).round(12).tolist()
    [0.0, 1.0]
    """
    along, across, up = np.moveaxis(np.asarray(unit, dtype=float) @ np.array(DEVIATORIC_AXES).T, -1, 0)
    pole = -up if expansion else up
    # |projected| = sqrt(2) sin(half the angle to the pole), 1 at right angles
    scale = 1.0 / np.sqrt(np.maximum(1.0 + pole, 1e-300))
    return np.stack((across * scale, along * scale), axis=-1)
