"""Neighbour lists that cannot miss a contact.

A list holds every pair closer than the contact distance plus `margin`. It is valid while no grain
and no wall has moved more than half the margin since it was built. The kernels check that after
every motion and *before* the forces, so even a grain expelled at metres per second triggers a
rebuild in time.
"""

from __future__ import annotations

import numpy as np

from rendulic.dem.kernels.arrays import Contacts, Grains, WallContacts, Walls
from rendulic.dem.kernels.layout import N_CONTACT
from rendulic.dem.kernels.neighbours import candidate_pairs, carry_history, wall_candidates
from rendulic.foundation.errors import UnstableTimeStep

__all__ = ["find_contacts", "size_levels"]

MOST_CELLS = 64  # for each grain


def size_levels(radius: np.ndarray, margin: float, volume: float) -> tuple[np.ndarray, np.ndarray]:
    """Sort grains into octaves of size.

    Returns
    -------
    level : (n,) int64 array
        0 for the finest octave present.
    sizes : (n_levels,) array
        Cell size of each level in m, not decreasing: its largest diameter plus `margin`, or more where
        cells would outnumber the grains (a few specks among boulders).
    """
    octave = np.floor(np.log2(radius.max() / radius)).astype(np.int64)
    present, inverse = np.unique(-octave, return_inverse=True)
    sizes = 2.0 * radius.max() / 2.0 ** (-present.astype(float)) + margin
    sizes = np.maximum(sizes, (volume / max(4 * len(radius), 64)) ** (1.0 / 3.0))
    return inverse.astype(np.int64).ravel(), sizes


def coarse_enough(sizes: np.ndarray, lengths: np.ndarray, n_grains: int) -> np.ndarray:
    """Cell sizes (n_levels,) in m, doubled where a long thin box of edges `lengths` (3,) would have far more cells than grains.

    Larger cells find the same pairs.
    """
    sizes = sizes.copy()
    most = MOST_CELLS * max(n_grains, 64)
    for level in range(len(sizes)):
        while np.prod(np.maximum(np.floor(lengths / sizes[level]), 1.0)) > most:
            sizes[level:] = np.maximum(sizes[level:], 2.0 * sizes[level])
    return sizes


def find_contacts(
    grains: Grains, walls: Walls, contacts: Contacts | None, margin: float
) -> tuple[Contacts, WallContacts]:
    """Build the candidate lists for the present positions, keeping the history of closed contacts.

    Raises
    ------
    UnstableTimeStep
        If a position is not finite, a grain's centre has left the box, or a closed contact of the
        old list lies beyond the new one: the motion has diverged.
    """
    position, radius = grains.position.copy(), grains.radius.copy()  # contiguous
    if not np.isfinite(position).all():
        raise UnstableTimeStep(
            f"{int((~np.isfinite(position).all(axis=1)).sum())} grains have positions that are not numbers: "
            "the motion diverged; use a smaller time step or a slower loading"
        )
    if not np.isfinite(walls.position).all():
        raise UnstableTimeStep(
            f"wall positions are not numbers ({walls.position.tolist()}): check the strain rates and stresses asked for"
        )
    low, high = walls.position[0::2], walls.position[1::2]
    outside = ((position < low) | (position > high)).any(axis=1)
    if outside.any():
        raise UnstableTimeStep(
            f"{int(outside.sum())} grains (first: {int(np.flatnonzero(outside)[0])}) have their centre outside the "
            "walls: the motion diverged; use a smaller time step or a slower loading"
        )
    level, sizes = size_levels(radius, margin, float(np.prod(high - low)))
    sizes = coarse_enough(sizes, high - low, len(radius))
    first, second = candidate_pairs(position, radius, margin, level, sizes, low.copy(), high.copy())
    force = np.zeros((len(first), N_CONTACT))
    if contacts is not None:
        force, lost = carry_history(contacts.first, contacts.second, contacts.force, first, second)
        if lost:
            # contacts that opened during the last motion by more than the margin
            raise UnstableTimeStep(
                f"{lost} closed contacts were torn apart by more than the neighbour margin {margin:.3g} m in one step; "
                "use a smaller time step"
            )
    grain, wall = wall_candidates(position, radius, walls.position, margin)
    return Contacts(first, second, force), WallContacts(grain, wall, np.zeros(len(grain)))
