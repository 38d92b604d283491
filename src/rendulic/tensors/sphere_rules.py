"""Quadrature over the directions of the unit sphere, one point per pair of opposite directions."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from rendulic.foundation.checks import finite_array, whole_number
from rendulic.foundation.errors import InvalidInput

__all__ = ["DEFAULT_DEGREE", "LEBEDEV_DEGREES", "SphereRule", "bazant_oh_37", "between", "lebedev"]

# Bazant and Oh (1986), 2 x 37 points: a point of each orbit of the cube's symmetries, its weight, its size
BAZANT_OH = (
    ((1.0, 0.0, 0.0), 0.0107238857303),
    ((np.sqrt(0.5), np.sqrt(0.5), 0.0), 0.0211416095198),
    ((0.951077869651, 0.308951267775, 0.0), 0.00535505590837),
    ((0.335154591939, 0.335154591939, 0.880535518310), 0.0167770909156),
    ((np.sqrt(1 / 3), np.sqrt(1 / 3), np.sqrt(1 / 3)), 0.0188482309508),
)


LEBEDEV_DEGREES = (3, 5, 7, 9, 11, 15, 17, 19, 21, 23, 29, 31, *range(35, 132, 6))
# of the planes of a sand: the least whose response stays within 0.5 % of its mean as a general stress is rotated
DEFAULT_DEGREE = 41


@dataclass(frozen=True, eq=False)
class SphereRule:
    """Directions and weights that average even functions over the sphere.

    Only one of each pair of opposite directions is kept, so that odd functions average to nothing
    meaningful: what depends on a contact plane is even.

    Parameters
    ----------
    name : str
        For tables.
    normals : (n, 3) array
        Unit vectors.
    weights : (n,) array
        Positive, of sum 1.
    degree : int
        Highest degree of polynomials whose mean is exact.
    """

    name: str
    normals: np.ndarray = field(repr=False)
    weights: np.ndarray = field(repr=False)
    degree: int

    def __post_init__(self) -> None:
        normals = finite_array("normals of a sphere rule", self.normals, (None, 3))
        weights = finite_array("weights of a sphere rule", self.weights, (len(normals),))
        lengths = np.linalg.norm(normals, axis=1)
        if len(normals) == 0 or np.abs(lengths - 1.0).max() > 1e-6:
            raise InvalidInput("the normals of a sphere rule must be unit vectors")
        if (weights <= 0.0).any() or abs(weights.sum() - 1.0) > 1e-6:
            raise InvalidInput(
                "the weights of a sphere rule must be positive and of sum 1, got "
                f"{weights.min():.3g} to {weights.max():.3g} of sum {weights.sum():.12g}"
            )
        object.__setattr__(self, "normals", normals / lengths[:, None])
        object.__setattr__(self, "weights", weights / weights.sum())

    def __len__(self) -> int:
        return len(self.weights)

    @property
    def inclination(self) -> np.ndarray:
        """(n,) angle between normal and axis 1 in degrees, 0 to 90."""
        return np.degrees(np.arccos(np.clip(np.abs(self.normals[:, 0]), 0.0, 1.0)))

    def mean(self, values: np.ndarray) -> np.ndarray:
        """Mean over the sphere of an even function given at the normals, (n, ...)."""
        return np.tensordot(self.weights, values, axes=1)

    def rotated(self, rotation: np.ndarray) -> SphereRule:
        """The same rule in a frame turned by the orthogonal matrix `rotation` (3, 3)."""
        turn = finite_array("a rotation", rotation, (3, 3))
        if np.abs(turn @ turn.T - np.eye(3)).max() > 1e-9:
            raise InvalidInput("a rotation must be an orthogonal matrix")
        return SphereRule(f"{self.name}, turned", self.normals @ turn.T, self.weights, self.degree)


def bazant_oh_37() -> SphereRule:
    """The 37 planes of the paper's Fig. 8, exact to degree 11: coarse, as `docs/chang_hicher.md` measures.

    Z. P. Bazant and B. H. Oh, ZAMM 66 (1986) 37-49.

    >>> rule = bazant_oh_37()
    >>> len(rule), float(abs(rule.mean(rule.normals[:, 0] ** 4) - 1 / 5)) < 1e-12
    (37, True)
    """
    normals, weights = [], []
    for point, weight in BAZANT_OH:
        for orbit_point in _orbit(point):
            normals.append(orbit_point)
            weights.append(2.0 * weight)
    return SphereRule("Bazant-Oh 37", np.array(normals), np.array(weights), 11)


def lebedev(degree: int) -> SphereRule:
    """The Lebedev rule of a degree (SciPy): those of `LEBEDEV_DEGREES`, all of positive weights.

    V. I. Lebedev and D. N. Laikov, Doklady Mathematics 59 (1999) 477-481.

    Raises
    ------
    InvalidInput
        If there is no rule of that degree.
    """
    degree = whole_number("degree of a Lebedev rule", degree, 3)
    if degree not in LEBEDEV_DEGREES:
        raise InvalidInput(
            f"there is no Lebedev rule of degree {degree} with positive weights: "
            f"there are {', '.join(map(str, LEBEDEV_DEGREES))}"
        )
    return _lebedev(degree)


@lru_cache(maxsize=len(LEBEDEV_DEGREES))
def _lebedev(degree: int) -> SphereRule:
    from scipy.integrate import lebedev_rule

    points, weights = lebedev_rule(degree)
    upper = np.array([_is_upper(point) for point in points.T])
    return SphereRule(f"Lebedev {degree}", points.T[upper], weights[upper] / weights[upper].sum(), degree)


def between(rule: SphereRule, other: SphereRule) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Where the directions of another rule lie among those of `rule`: how to carry values over, linearly.

    Returns
    -------
    nearest : (m,) array of int
        The nearest direction of `rule`, for every one of the other.
    corners : (m, 3) array of int
        The three directions of `rule` that it lies between.
    shares : (m, 3) array
        Their weights, none negative and of sum 1.
    signs : (m, 3) array
        -1 where it is the opposite direction of a corner that counts: what is odd changes its sign.
    """
    return _between(rule.normals.tobytes(), other.normals.tobytes())


@lru_cache(maxsize=8)
def _between(own: bytes, other: bytes) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    from scipy.spatial import ConvexHull

    normals, wanted = (np.frombuffer(part).reshape(-1, 3) for part in (own, other))
    both = np.concatenate((normals, -normals))
    triangles = ConvexHull(both).simplices
    # barycentric coordinates in every triangle; a direction lies in the one where the least of them is largest
    coordinates = np.einsum("tij,mj->mti", np.linalg.inv(both[triangles].swapaxes(1, 2)), wanted)
    inside = coordinates.min(axis=2).argmax(axis=1)
    shares = np.maximum(coordinates[np.arange(len(wanted)), inside], 0.0)
    corners = triangles[inside]
    return (
        np.abs(wanted @ normals.T).argmax(axis=1),
        corners % len(normals),
        shares / shares.sum(axis=1, keepdims=True),
        np.where(corners < len(normals), 1.0, -1.0),
    )


def _is_upper(point: np.ndarray) -> bool:
    """Whether the last component that differs from zero is positive: one of each opposite pair is."""
    return bool(point[np.flatnonzero(np.abs(point) > 1e-12)[-1]] > 0.0)


def _orbit(point: tuple[float, float, float]) -> list[tuple[float, ...]]:
    """All different permutations and signs of a point, the upper ones."""
    from itertools import permutations, product

    orbit = {
        tuple(sign * value + 0.0 for sign, value in zip(signs, order, strict=True))
        for order in permutations(point)
        for signs in product((1.0, -1.0), repeat=3)
    }
    return sorted(p for p in orbit if _is_upper(np.array(p)))
