"""Directions in which a state is probed."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import ClassVar

import numpy as np

from rendulic.foundation.checks import finite_array, whole_number
from rendulic.foundation.errors import InvalidInput
from rendulic.tensors.increment_sphere import DEVIATORIC_AXES
from rendulic.tensors.rendulic_plane import increment_along

__all__ = ["Directions", "SphereDirections", "as_directions", "axisymmetric", "rendulic", "sphere"]


@dataclass(frozen=True)
class Directions:
    """Angles in the Rendulic plane.

    Parameters
    ----------
    alpha : tuple of float
        In degrees.
    """

    alpha: tuple[float, ...]

    dimension: ClassVar[str] = "alpha"

    def __len__(self) -> int:
        return len(self.alpha)

    def coordinates(self, kind: str) -> dict[str, tuple]:
        """Labels of the directions for a dataset of probes in strain or stress."""
        about = {"long_name": f"direction of {kind} increment", "units": "degree"}
        return {"alpha": ("alpha", np.array(self.alpha), about)}

    def increments(self, norm: float) -> np.ndarray:
        """(n, 3) principal increments of this norm."""
        return increment_along(np.array(self.alpha), norm)


@dataclass(frozen=True, eq=False)
class SphereDirections:
    """Directions in the space of the three principal increments.

    Parameters
    ----------
    unit : (n, 3) array
        Unit vectors.
    weight : (n,) array
        Share of the sphere that each stands for; positive, of sum 1.

    Raises
    ------
    InvalidInput
        If a vector is not of length 1, or the weights are no shares.
    """

    unit: np.ndarray
    weight: np.ndarray

    dimension: ClassVar[str] = "direction"

    def __post_init__(self) -> None:
        unit = finite_array("directions", self.unit, (None, 3))
        weight = finite_array("weights of directions", self.weight, (len(unit),))
        if len(unit) == 0 or np.abs(np.linalg.norm(unit, axis=1) - 1.0).max() > 1e-9:
            raise InvalidInput("directions on a sphere must be at least one, and unit vectors")
        if (weight <= 0.0).any() or abs(weight.sum() - 1.0) > 1e-9:
            raise InvalidInput(f"weights of directions must be positive and of sum 1, got a sum of {weight.sum():.12g}")
        object.__setattr__(self, "unit", unit)
        object.__setattr__(self, "weight", weight)

    def __len__(self) -> int:
        return len(self.unit)

    def increments(self, norm: float) -> np.ndarray:
        """(n, 3) principal increments of this norm."""
        return norm * self.unit

    @property
    def spacing(self) -> float:
        """Typical distance between neighbours in degrees: what is narrower can be missed."""
        return float(np.degrees(np.sqrt(4.0 * np.pi / len(self))))

    def coordinates(self, kind: str) -> dict[str, tuple]:
        """Labels of the directions for a dataset of probes in strain or stress."""
        named = {
            f"along_{k + 1}": (
                "direction",
                self.unit[:, k],
                {"long_name": f"{kind} increment along axis {k + 1}, unit"},
            )
            for k in range(3)
        }
        return {
            "direction": ("direction", np.arange(len(self)), {"long_name": f"direction of {kind} increment"}),
            **named,
            "weight": ("direction", self.weight, {"long_name": "share of the sphere of directions", "units": "1"}),
        }


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


def as_directions(given: object) -> Directions | SphereDirections:
    """Directions as they are, or a list of angles in degrees in the Rendulic plane.

    >>> as_directions([90.0, 125.3]).alpha
    (90.0, 125.3)

    Raises
    ------
    InvalidInput
        If they are neither.
    """
    if isinstance(given, Directions | SphereDirections):
        return given
    try:
        return axisymmetric(given)
    except (TypeError, ValueError):
        raise InvalidInput(
            "expected directions, such as rd.directions.rendulic(step=10) or a list of angles in degrees, got "
            f"{type(given).__name__}"
        ) from None


def sphere(n: int = 500) -> SphereDirections:
    """Directions all over the sphere of principal increments, evenly spaced on a spiral, of equal weight.

    The whole sphere, as the response to an increment and to its opposite differ. The spiral winds around the
    isotropic axis, from compression to expansion.

    Parameters
    ----------
    n : int
        At least 12.

    Examples
    --------
    >>> around = sphere(500)
    >>> len(around), round(around.spacing, 1)
    (500, 9.1)
    """
    n = whole_number("number of directions", n, 12)
    height = 1.0 - (2.0 * np.arange(n) + 1.0) / n
    turn = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(n)
    across = np.sqrt(1.0 - height**2)
    axes = np.array(DEVIATORIC_AXES)
    unit = np.column_stack((across * np.cos(turn), across * np.sin(turn), height)) @ axes
    return SphereDirections(unit / np.linalg.norm(unit, axis=1)[:, None], np.full(n, 1.0 / n))
