"""Which elastic law the normal forces follow, told by forces, overlaps and radii alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rendulic.specimen.snapshot import Snapshot

__all__ = ["NormalLaw", "normal_law"]

# shape of each law: force over modulus, by overlap and radii; all moduli are in Pa but that of "one stiffness", N/m
SHAPES: dict[str, Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]] = {
    "K (R1 + R2) overlap": lambda overlap, one, other: (one + other) * overlap,
    "4 K R1 R2 / (R1 + R2) overlap": lambda overlap, one, other: 4.0 * one * other / (one + other) * overlap,
    "k overlap": lambda overlap, one, other: overlap,
    "4/3 E sqrt(R1 R2 / (R1 + R2)) overlap^(3/2)": lambda overlap, one, other: (
        4.0 / 3.0 * np.sqrt(one * other / (one + other)) * overlap**1.5
    ),
}
CLOSE = 1e-2  # a contact follows a law that it is as near to
MOST = 0.5  # of the contacts must follow it
FEWEST = 5  # contacts that can tell a law


@dataclass(frozen=True)
class NormalLaw:
    """One law of all contacts between grains.

    Parameters
    ----------
    name : str
        Its formula.
    modulus : float
        The median over the contacts.
    force_n : (n_contacts,) array
        Normal forces by this law in N; NaN for contacts with walls, 0 where grains are apart.
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
    between = ~snapshot.is_wall
    closed = between & (overlap > 0.0) & (snapshot.force_n != 0.0)
    if closed.sum() < FEWEST:
        return None
    one, other = snapshot.radius[snapshot.first], snapshot.radius[np.where(between, snapshot.second, 0)]
    best, following = None, MOST
    for name, shape in SHAPES.items():
        force = shape(np.maximum(overlap, 0.0), one, other)
        each = snapshot.force_n[closed] / force[closed]
        modulus = float(np.median(each))
        share = float((np.abs(each - modulus) <= CLOSE * abs(modulus)).mean())
        if modulus > 0.0 and share > following:
            best, following = NormalLaw(name, modulus, np.where(between, modulus * force, np.nan)), share
    return best
