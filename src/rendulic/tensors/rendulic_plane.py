"""The Rendulic plane of axisymmetric increments: abscissa `sqrt(2) d_3`, ordinate `d_1`."""

from __future__ import annotations

import numpy as np

__all__ = [
    "AXIAL_COMPRESSION",
    "ISOCHORIC_COMPRESSION",
    "ISOTROPIC_COMPRESSION",
    "direction_of",
    "increment_along",
]

ISOTROPIC_COMPRESSION = float(np.degrees(np.arctan2(1.0, np.sqrt(2.0))))  # 35.26 deg
AXIAL_COMPRESSION = 90.0  # at constant radius
ISOCHORIC_COMPRESSION = float(np.degrees(np.arctan2(1.0, -0.5 * np.sqrt(2.0))))  # 125.26 deg


def increment_along(alpha, norm: float = 1.0) -> np.ndarray:
    """Principal increments `N (sin a, cos a / sqrt 2, cos a / sqrt 2)` of direction `alpha`.

    Parameters
    ----------
    alpha : float or array
        Direction in degrees.
    norm : float
        Euclidean norm of the increment, in its own unit.

    Returns
    -------
    (..., 3) array

    Examples
    --------
    >>> bool(abs(increment_along(ISOCHORIC_COMPRESSION).sum()) < 1e-12)
    True
    >>> float(np.linalg.norm(increment_along(77.0, 5e-5)))
    5e-05
    """
    angle = np.radians(np.asarray(alpha, dtype=float))
    lateral = np.cos(angle) / np.sqrt(2.0)
    return norm * np.stack((np.sin(angle), lateral, lateral), axis=-1)


def direction_of(increment) -> np.ndarray:
    """Direction in degrees, 0 <= alpha < 360, of principal increments (..., 3); lateral ones averaged.

    >>> float(direction_of([1.0, 0.0, 0.0]))
    90.0
    """
    increment = np.asarray(increment, dtype=float)
    lateral = (increment[..., 1] + increment[..., 2]) / np.sqrt(2.0)
    return np.degrees(np.arctan2(increment[..., 0], lateral)) % 360.0
