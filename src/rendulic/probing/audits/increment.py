"""Audits of two states together: whether they are of the same grains, a small increment apart.

Each function takes a `Pair` and returns residual and limit, or raises `NotPossible`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rendulic.probing.audits.audit import NotPossible
from rendulic.probing.audits.one_state import Found, Reading
from rendulic.specimen.snapshot import Snapshot

__all__ = ["AUDITS", "IncrementAudit", "Pair"]

SMALL_STRAIN = 1e-2  # strains squared, which the measures of W2 leave out, are then below a hundredth
ONE_RADIUS = 1.0  # a grain that bears cannot pass its neighbours
HALF = 0.5
SAME_LAW = 1e-3
FIVEFOLD = float(np.log10(5.0))  # more than a strain of a hundredth does to the stress of a packing that bears
ALL_DIGITS = 1e-14
ERRORS = 5.0  # standard errors
BEARING = 3  # contacts, at least, of a grain that cannot move by itself


@dataclass
class Pair:
    """Two states, the second with its grains in the copies of the cell that are nearest to the first."""

    before: Reading
    after: Reading

    @cached_property
    def moved(self) -> np.ndarray:
        """(n, 3) displacements of the grains in m."""
        return self.after.snapshot.position - self.before.snapshot.position

    @cached_property
    def elongation(self) -> np.ndarray:
        """(3,) change of the box's lengths over its lengths before."""
        return self.after.snapshot.lengths / self.before.snapshot.lengths - 1.0

    @cached_property
    def affine(self) -> np.ndarray:
        """(n, 3) displacements if the grains moved as the box does, in m."""
        low, moved_low = (each.snapshot.wall_position[0::2] for each in (self.before, self.after))
        return moved_low - low + (self.before.snapshot.position - low) * self.elongation

    @cached_property
    def bears(self) -> np.ndarray:
        """(n,) bool: grains with enough contacts in both states to be held."""
        return np.logical_and(*(_contacts_of(each) >= BEARING for each in (self.before, self.after)))


def _contacts_of(state: Reading) -> np.ndarray:
    snapshot = state.snapshot
    n = snapshot.n_grains
    return (np.bincount(snapshot.first, minlength=n + 6) + np.bincount(snapshot.second, minlength=n + 6))[:n]


@dataclass(frozen=True)
class IncrementAudit:
    """An audit of an increment; the texts are those of `Audit`."""

    name: str
    ask: Callable[[Pair], Found]
    compares: str
    catches: str
    failure: str


def _small(pair: Pair) -> Found:
    return float(np.linalg.norm(pair.elongation)), SMALL_STRAIN


def _order(pair: Pair) -> Found:
    steps = [each.recorded.step for each in (pair.before, pair.after)]
    if steps[0] is None or steps[1] is None:
        raise NotPossible("the data do not say the number of the time step")
    if steps[0] == steps[1]:
        return float(np.abs(pair.moved).max(initial=0.0) > 0.0), 0.0
    return float(max(steps[0] - steps[1], 0)), 0.0


def _moved(pair: Pair) -> Found:
    if not pair.bears.any():
        raise NotPossible("no grain bears in both states")
    beyond = np.linalg.norm(pair.moved - pair.affine, axis=1) / pair.before.snapshot.radius.mean()
    return float(beyond[pair.bears].max()), ONE_RADIUS


def _strain(pair: Pair) -> Found:
    """Slopes of displacements over positions, of the grains that bear, against the strain of the box."""
    size = float(np.linalg.norm(pair.elongation))
    if size == 0.0:
        raise NotPossible("the box has no strain")
    place, moved = pair.before.snapshot.position[pair.bears], pair.moved[pair.bears]
    if len(place) <= 2 * BEARING:
        raise NotPossible("too few grains bear in both states")
    design = np.column_stack((np.ones(len(place)), place - place.mean(axis=0)))
    found, *_ = np.linalg.lstsq(design, moved, rcond=None)
    scatter = (moved - design @ found).var(axis=0) * len(place) / (len(place) - 4)
    try:
        error = ERRORS * np.sqrt(scatter * np.diag(np.linalg.inv(design.T @ design))[1:])
    except np.linalg.LinAlgError:
        raise NotPossible("the grains that bear lie in one plane") from None
    off = np.abs(np.diag(found[1:]) - pair.elongation)
    return _beyond_scatter(pair, off / size, error / size)


def _mean(pair: Pair) -> Found:
    """Mean displacement of the grains that bear against that of the box, over its scatter."""
    if pair.bears.sum() <= 2 * BEARING:
        raise NotPossible("too few grains bear in both states")
    off = (pair.moved - pair.affine)[pair.bears]
    size = float(np.linalg.norm(pair.elongation * pair.before.snapshot.lengths))
    if size == 0.0:
        raise NotPossible("the box has no strain")
    error = ERRORS * off.std(axis=0) / np.sqrt(len(off))
    return _beyond_scatter(pair, np.abs(off.mean(axis=0)) / size, error / size)


def _beyond_scatter(pair: Pair, off: np.ndarray, error: np.ndarray) -> Found:
    """The axis that is farthest beyond its error; a layer of a radius at each wall moves with the wall, not with the box."""
    if not (error < 1.0).all():
        raise NotPossible("the displacements of the grains scatter by more than the box has moved")
    worst = int(np.argmax(off - error))
    layer = 2.0 * float(pair.before.snapshot.radius.mean()) / float(pair.before.snapshot.lengths.min())
    return float(off[worst]), layer + float(error[worst])


def _pair_keys(snapshot: Snapshot) -> np.ndarray:
    """A number for each contact, by its two bodies."""
    low, high = np.minimum(snapshot.first, snapshot.second), np.maximum(snapshot.first, snapshot.second)
    return low * (snapshot.n_grains + 6) + high


def _persist(pair: Pair) -> Found:
    before, after = (each.snapshot for each in (pair.before, pair.after))
    keys = [_pair_keys(each) for each in (before, after)]
    carried = np.linalg.norm(before.force, axis=1)
    if not carried.any():
        raise NotPossible("no contact carries a force")
    return float(carried[~np.isin(keys[0], keys[1])].sum() / carried.sum()), HALF


def _carried_over(pair: Pair) -> Found:
    """How the force of the median contact that stays has changed, as a power of ten."""
    sizes = []
    for state, other in ((pair.before, pair.after), (pair.after, pair.before)):
        key, keys = _pair_keys(state.snapshot), _pair_keys(other.snapshot)
        sizes.append(np.linalg.norm(state.snapshot.force, axis=1)[np.isin(key, keys)])
    if not len(sizes[0]) or not np.median(sizes[0]) or not np.median(sizes[1]):
        raise NotPossible("no contact carries a force in both states")
    return abs(float(np.log10(np.median(sizes[1]) / np.median(sizes[0])))), FIVEFOLD


def _forces_change(pair: Pair) -> Found:
    if not pair.elongation.any():
        raise NotPossible("the box has no strain")
    before, after = (each.snapshot for each in (pair.before, pair.after))
    same = before.force.shape == after.force.shape and bool(
        np.all(np.abs(after.force - before.force) <= ALL_DIGITS * np.abs(before.force).max(initial=0.0))
    )
    return float(same and len(before.first) > 0), 0.0


def _same_law(pair: Pair) -> Found:
    laws = pair.before.law, pair.after.law
    if laws[0] is None or laws[1] is None:
        raise NotPossible("the contacts follow no law that is known here in both states")
    if laws[0].name != laws[1].name:
        return 1.0, SAME_LAW
    return abs(laws[1].modulus / laws[0].modulus - 1.0), SAME_LAW


AUDITS = (
    IncrementAudit(
        "small_increment", _small,
        "the strain of the box between the states with a hundredth",
        "a wall that has moved, lengths in two units, states that do not belong together",
        "the states are far apart: second-order work is of a small increment",
    ),
    IncrementAudit(
        "order_of_steps", _order,
        "the numbers of the time steps of both states",
        "states in the wrong order, or two states of one step",
        "the state after is not later than the state before",
    ),
    IncrementAudit(
        "grains_moved", _moved,
        "the displacement of each grain that bears, less that of the box, with the mean radius",
        "grains in another order, states of other grains",
        "a grain that bears has moved by more than a radius: grains are in another order, or it is no small increment",
    ),
    IncrementAudit(
        "strain_of_grains", _strain,
        "the strain that the displacements of the grains show with that of the box",
        "walls or centres of another step, a wall that has moved, grains in another order",
        "the grains have not moved with the walls",
    ),
    IncrementAudit(
        "mean_displacement", _mean,
        "the mean displacement of the grains with that of the walls",
        "a wall that has moved, another origin of coordinates",
        "the grains have not moved with the walls",
    ),
    IncrementAudit(
        "contacts_persist", _persist,
        "the contacts before with those after: what most of the force goes through must be in both",
        "grains in another order, contacts left out in one state, states that do not belong together",
        "the contacts of the two states are different ones",
    ),
    IncrementAudit(
        "forces_carry_over",
        _carried_over,
        "the force of the median contact before with that of the same contacts after",
        "forces of one state in other units",
        "the forces of the contacts that stay are many times larger or smaller after than before",
    ),
    IncrementAudit(
        "forces_change",
        _forces_change,
        "the strain of the box with the change of the contact forces",
        "the contacts of one state in both",
        "the box has a strain, and no force has changed: the contacts are of one state",
    ),
    IncrementAudit(
        "same_law", _same_law,
        "the stiffness that forces and overlaps show before with that after",
        "forces or lengths of one state in other units",
        "the contacts are of another stiffness after than before",
    ),
)  # fmt: skip
