"""Second-order work of contacts: which pairs, which class, how much (theory, section 3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rendulic.foundation.errors import InvalidInput
from rendulic.specimen.snapshot import Snapshot, as_snapshot

__all__ = ["CLASSES", "ContactWork", "contact_work"]

CLASSES = ("elastic", "sliding", "opened", "created", "wall")


@dataclass(frozen=True)
class ContactWork:
    """Second-order work of every pair in contact before or after.

    Parameters
    ----------
    first, second : (n_pairs,) int arrays
        Bodies, as in `Snapshot`.
    work : (n_pairs,) array
        `w2 = df . dl` in J, `df` the change of the force on `second`, `dl = dx_first - dx_second`.
    apart : (n_pairs, 3) array
        `dl` in m: how the two bodies moved against each other.
    contact_class : (n_pairs,) int array
        Index into `CLASSES`; a grain-wall pair is `wall` whatever it does.
    in_before, in_after : (n_pairs,) int arrays
        Index of the contact in each snapshot, -1 where it is not in contact.
    """

    first: np.ndarray
    second: np.ndarray
    work: np.ndarray
    apart: np.ndarray
    contact_class: np.ndarray
    in_before: np.ndarray
    in_after: np.ndarray

    @property
    def persists(self) -> np.ndarray:
        """(n_pairs,) bool: in contact in both states."""
        return (self.in_before >= 0) & (self.in_after >= 0)

    def sum_of(self, name: str) -> float:
        """Summed work of one class in J."""
        return float(self.work[self.contact_class == CLASSES.index(name)].sum())


def contact_work(before: Snapshot, after: Snapshot) -> ContactWork:
    """Second-order work per pair between two snapshots of one specimen.

    Pairs are counted that touch in either state; an absent contact has zero force. That makes
    Eq. 17 of the paper exact (it leaves opened contacts out).

    Raises
    ------
    InvalidInput
        If the two snapshots are not of the same grains.
    """
    before, after = as_snapshot(before), as_snapshot(after)
    if before.n_grains != after.n_grains:
        raise InvalidInput(
            f"before and after must hold the same grains: {before.n_grains} grains before, {after.n_grains} after"
        )
    if not np.allclose(before.radius, after.radius, rtol=1e-6):
        different = int((~np.isclose(before.radius, after.radius, rtol=1e-6)).sum())
        raise InvalidInput(f"before and after must hold the same grains in the same order: {different} radii differ")
    if before.is_periodic != after.is_periodic:
        raise InvalidInput(
            "before and after must be in the same kind of box: one of them is periodic, the other is not"
        )
    after = after.following(before)
    furthest = int(max(np.abs(snapshot.across).max(initial=0) for snapshot in (before, after)))
    shape = (*(before.n_grains + 6,) * 2, *(2 * furthest + 1,) * 3)
    key_before, force_before = _keyed(before, shape)
    key_after, force_after = _keyed(after, shape)
    key = np.union1d(key_before, key_after)
    at_before, at_after = np.searchsorted(key, key_before), np.searchsorted(key, key_after)
    d_force = np.zeros((len(key), 3))
    d_force[at_after] += force_after
    d_force[at_before] -= force_before
    in_before, in_after = np.full(len(key), -1), np.full(len(key), -1)
    in_before[at_before], in_after[at_after] = np.arange(len(at_before)), np.arange(len(at_after))
    slides = np.zeros(len(key), dtype=bool)
    slides[at_after] = after.is_sliding
    first, second, *cells = np.unravel_index(key, shape)
    moved = after.body_position - before.body_position
    # the image of `second` moves with the cell, too
    apart = moved[first] - moved[second] - (np.stack(cells, axis=1) - furthest) * (after.lengths - before.lengths)
    work = (d_force * apart).sum(axis=1)
    of_class = np.where(slides, CLASSES.index("sliding"), CLASSES.index("elastic"))
    of_class[in_after < 0] = CLASSES.index("opened")
    of_class[in_before < 0] = CLASSES.index("created")
    of_class[second >= before.n_grains] = CLASSES.index("wall")
    return ContactWork(first, second, work, apart, of_class, in_before, in_after)


def _keyed(snapshot: Snapshot, shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """One number per pair (bodies, lower one first, and cells between them), and the force on the higher body."""
    across = snapshot.across
    # a grain that touches its own image does so on both sides: the sign of the cells tells which one is listed
    backward = np.sign(across) @ np.array([9, 3, 1]) < 0
    swap = (snapshot.first > snapshot.second) | ((snapshot.first == snapshot.second) & backward)
    low, high = np.where(swap, snapshot.second, snapshot.first), np.where(swap, snapshot.first, snapshot.second)
    sign = np.where(swap, -1, 1)[:, None]
    cells = sign * across + (shape[-1] - 1) // 2
    key = np.ravel_multi_index((low, high, *cells.T), shape)
    if len(np.unique(key)) != len(key):
        raise InvalidInput("a snapshot lists the same pair of bodies twice; each contact must appear once")
    return key, sign * snapshot.force
