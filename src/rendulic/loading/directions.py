"""Directions in which a state is probed."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

import numpy as np

from rendulic.errors import InvalidInput
from rendulic.tensors.rendulic_plane import increment_along

__all__ = ["Directions", "axisymmetric", "rendulic"]


@dataclass(frozen=True)
class Directions:
    """Angles in the Rendulic plane.

    Parameters
    ----------
    alpha : tuple of float
        In degrees.
    """

    alpha: tuple[float, ...]

    def __len__(self) -> int:
        return len(self.alpha)

    def increments(self, norm: float) -> np.ndarray:
        """(n, 3) principal increments of this norm."""
        return increment_along(np.array(self.alpha), norm)


def rendulic(step: float = 10.0) -> Directions:
    """Directions all around the Rendulic plane, from 0, `step` degrees apart.

    >>> len(rendulic(step=10))
    36
    """
    if not (isfinite(step) and 0.0 < step <= 180.0):
        raise InvalidInput(f"the step between directions must be in (0, 180] degrees, got {step!r}")
    count = round(360.0 / step)
    if abs(count * step - 360.0) > 1e-9 * 360.0:
        raise InvalidInput(f"the step between directions must divide 360 degrees, got {step!r}")
    return Directions(tuple(float(k * step) for k in range(count)))


def axisymmetric(alpha) -> Directions:
    """Given directions in degrees, in the Rendulic plane."""
    angles = np.atleast_1d(np.asarray(alpha, dtype=float))
    if angles.ndim != 1 or len(angles) == 0 or not np.isfinite(angles).all():
        raise InvalidInput(f"directions must be a list of finite angles in degrees, got {alpha!r}")
    return Directions(tuple(angles.tolist()))
