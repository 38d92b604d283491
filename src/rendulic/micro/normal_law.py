"""Which elastic law the normal forces follow, told by forces, overlaps and radii alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rendulic.specimen.snapshot import Snapshot

__all__ = ["NormalLaw", "normal_law"]

# shape of each law: force over modulus, by overlap and radii; all moduli are in Pa but that of "one stiffness", N/m
Shapes = dict[str, Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]]
SHAPES: Shapes = {
    "K (R1 + R2) overlap": lambda overlap, one, other: (one + other) * overlap,
    "4 K R1 R2 / (R1 + R2) overlap": lambda overlap, one, other: 4.0 * one * other / (one + other) * overlap,
    "k overlap": lambda overlap, one, other: overlap,
    "4/3 E sqrt(R1 R2 / (R1 + R2)) overlap^(3/2)": lambda overlap, one, other: (
        4.0 / 3.0 * np.sqrt(one * other / (one + other)) * overlap**1.5
    ),
}
WALL_SHAPES: Shapes = {
    "K R overlap": lambda overlap, one, _: one * overlap,
    "k overlap": lambda overlap, *_: overlap,
    "4/3 E sqrt(R) overlap^(3/2)": lambda overlap, one, _: 4.0 / 3.0 * np.sqrt(one) * overlap**1.5,
}
CLOSE = 1e-2  # a contact follows a law that it is as near to
MOST = 0.5  # of the contacts must follow it
FEWEST = 5  # contacts that can tell a law


@dataclass(frozen=True)
class NormalLaw:
    """One law of all contacts between grains, and one of those with walls.

    Parameters
    ----------
    name : str
        The formula between grains; on a wall, R2 is infinite.
    modulus : float
        The median over the contacts between grains.
    force_n : (n_contacts,) array
        Normal forces by these laws in N; 0 where bodies are apart, NaN on walls if these contacts follow no law.
    """

    name: str
    modulus: float
    force_n: np.ndarray


def normal_law(snapshot: Snapshot, overlap: np.ndarray) -> NormalLaw | None:
    """The law that most contacts between spheres follow within a hundredth; None if they follow none of those known.

    Parameters
    ----------
    overlap : (n_contacts,) array
        In m, see `micro.overlapping.overlaps`.
    """
    wall = snapshot.is_wall
    one, other = snapshot.radius[snapshot.first], snapshot.radius[np.where(wall, 0, snapshot.second)]
    closed = np.maximum(overlap, 0.0)
    name, modulus, force_n = _followed(snapshot.force_n, closed, one, other, ~wall, SHAPES)
    if name is None:
        return None
    _, _, on_wall = _followed(snapshot.force_n, closed, one, one, wall, WALL_SHAPES)
    return NormalLaw(name, modulus, np.where(wall, on_wall, force_n))


def _followed(
    force_n: np.ndarray, overlap: np.ndarray, one: np.ndarray, other: np.ndarray, which: np.ndarray, shapes: Shapes
) -> tuple[str | None, float, np.ndarray]:
    """Name, modulus and forces of the law that most of some contacts follow; None and NaN if there is none."""
    telling = which & (overlap > 0.0) & (force_n != 0.0)
    best: tuple[str | None, float, np.ndarray] = (None, np.nan, np.full(len(force_n), np.nan))
    following = MOST
    for name, shape in shapes.items() if telling.sum() >= FEWEST else ():
        force = shape(overlap, one, other)
        each = force_n[telling] / force[telling]
        modulus = float(np.median(each))
        share = float((np.abs(each - modulus) <= CLOSE * abs(modulus)).mean())
        if modulus > 0.0 and share > following:
            best, following = (name, modulus, modulus * force), share
    return best
