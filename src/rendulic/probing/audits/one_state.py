"""Audits of one state: what its list of contacts says, against what its grains, its box and its engine say.

Each function takes a `Reading` and returns residual and limit, or raises `NotPossible`. `AUDITS` has them in the order
in which they are told. A limit is one of these: rounding of numbers with nine digits; the share by which a state may
be out of balance; a thousandth of a mean overlap, below which a contact does not matter.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rendulic.micro.normal_law import NormalLaw, normal_law
from rendulic.micro.overlapping import TooManyPairs, overlaps, unlisted_overlaps
from rendulic.micro.stress import love_weber_stress
from rendulic.probing.audits.audit import NotPossible
from rendulic.specimen.recorded import Recorded
from rendulic.specimen.snapshot import Snapshot

__all__ = ["AUDITS", "Reading", "StateAudit"]

TURNED = 1e-3  # of the mean contact force: engines turn tangential forces with the contact to the first order only
ROUNDING = 1e-6  # relative, of numbers that are written with nine digits or more
UNBALANCED = 1e-2  # the usual demand on quasi-static states
ONE_GRAIN = 0.1  # of the mean contact force: ten times what the mean over the grains may be
NEGLIGIBLE = 1e-3  # of the mean overlap
ONE_LAW = 1e-2  # of the mean contact force, by a law that is known from the contacts only
DIRECTION = 1e-5  # of a unit vector: coordinates with eight digits
OTHER_VOLUME = 1e-2  # engines measure the volume of a box, and branches to walls, in their own ways
MORE_PULL_THAN_PUSH = 0.5
REACH = 1.5  # centres apart, in sums of radii
SOFT = 0.1  # overlap in radii
LARGEST_GRAIN = 1.0  # m
OUTWARD = np.tile([-1.0, 1.0], 3)


@dataclass
class Reading:
    """One state and what several audits need of it.

    Parameters
    ----------
    snapshot : Snapshot
        The state.
    are_spheres : bool
        Whether its grains are spheres of the radii given.
    """

    snapshot: Snapshot
    are_spheres: bool

    @property
    def recorded(self) -> Recorded:
        """What the engine says."""
        return self.snapshot.recorded or Recorded()

    @cached_property
    def resultant(self) -> np.ndarray:
        """(n + 6, 3) from the contacts, in N."""
        return self.snapshot.resultant

    @cached_property
    def mean_force(self) -> float:
        """Mean contact force in N."""
        size = np.linalg.norm(self.snapshot.force, axis=1)
        if not size.any():
            raise NotPossible("no contact carries a force")
        return float(size.mean())

    @cached_property
    def pressing(self) -> np.ndarray:
        """(6,) force of the contacts on each wall in N, positive outward."""
        return OUTWARD * self.resultant[self.snapshot.n_grains :][np.arange(6), np.arange(6) // 2]

    @cached_property
    def wall_stress(self) -> np.ndarray:
        """(3,) principal stress of the walls and across periodic faces in Pa, compression positive."""
        return np.diag(self.snapshot.wall_stress)

    @cached_property
    def has_walls(self) -> np.ndarray:
        """(3,) bool: axes that are not periodic."""
        return ~self.snapshot.across.any(axis=0) & np.full(
            3, self.snapshot.is_wall.any() or not self.snapshot.is_periodic
        )

    @cached_property
    def overlap(self) -> np.ndarray:
        """(n_contacts,) by which spheres and walls overlap by their positions and radii, in m."""
        self.need_spheres()
        return overlaps(self.snapshot)

    @cached_property
    def mean_overlap(self) -> float:
        """Mean overlap of the contacts that overlap, in m."""
        closed = self.overlap[self.overlap > 0.0]
        if not len(closed):
            raise NotPossible("no contact overlaps")
        return float(closed.mean())

    @cached_property
    def slack(self) -> np.ndarray:
        """(n + 6,) m by which each body may have moved between the instants of its force and of its position."""
        n, of_grains = self.snapshot.n_grains, self.recorded.slack
        if of_grains is None:
            return np.zeros(n + 6)
        touching = [of_grains[self.snapshot.first[self.snapshot.second == n + face]] for face in range(6)]
        return np.concatenate((of_grains, [np.median(each) if len(each) else 0.0 for each in touching]))

    @cached_property
    def contact_slack(self) -> np.ndarray:
        """(n_contacts,) the same for both bodies of a contact."""
        return self.slack[self.snapshot.first] + self.slack[self.snapshot.second]

    @cached_property
    def law(self) -> NormalLaw | None:
        """The normal law that the contacts follow by their forces and overlaps; None if none that is known."""
        return normal_law(self.snapshot, self.overlap)

    def need_spheres(self) -> None:
        """Raise `NotPossible` if the grains are no spheres."""
        if not self.are_spheres:
            raise NotPossible("the grains are not spheres, or not known to be")


Found = tuple[float, float]


@dataclass(frozen=True)
class StateAudit:
    """An audit of one state; the texts are those of `Audit`."""

    name: str
    ask: Callable[[Reading], Found]
    compares: str
    catches: str
    failure: str


def _largest(values: np.ndarray) -> float:
    """The largest of some numbers, at least zero; NaN if one is."""
    return float(np.max(values, initial=0.0))


def _equilibrium(state: Reading) -> Found:
    return state.snapshot.unbalanced_force, UNBALANCED


def _balance_of_grains(state: Reading) -> Found:
    found, engine = state.resultant[: state.snapshot.n_grains], state.recorded.grain_force
    expected, limit = (0.0, ONE_GRAIN) if engine is None or len(engine) != len(found) else (engine, ROUNDING)
    return _largest(np.linalg.norm(found - expected, axis=1)) / state.mean_force, limit


def _balance_of_moments(state: Reading) -> Found:
    state.need_spheres()
    snapshot, n = state.snapshot, state.snapshot.n_grains
    radius = np.concatenate((snapshot.radius, np.zeros(6)))
    turning = np.cross(snapshot.normal, snapshot.force_t)
    total = np.zeros((n + 6, 3))
    for body in (snapshot.first, snapshot.second):
        np.add.at(total, body, -(radius[body] - 0.5 * state.overlap)[:, None] * turning)
    engine = state.recorded.grain_moment
    expected, limit = (0.0, ONE_GRAIN) if engine is None or len(engine) != n else (engine, ROUNDING)
    size = np.linalg.norm(total[:n] - expected, axis=1) / snapshot.radius
    return _largest(size) / state.mean_force, limit


def _missing(state: Reading) -> Found:
    state.need_spheres()
    try:
        first, second, overlap = unlisted_overlaps(state.snapshot, state.has_walls)
    except TooManyPairs:
        raise NotPossible("nearly all grains overlap: the radii do not belong to the positions") from None
    return _largest(overlap - state.slack[first] - state.slack[second]) / state.mean_overlap, NEGLIGIBLE


def _touching(state: Reading) -> Found:
    pressing = state.snapshot.force_n > 0.0
    return _largest((-state.overlap - state.contact_slack)[pressing]) / state.mean_overlap, NEGLIGIBLE


def _pairs_once(state: Reading) -> Found:
    snapshot = state.snapshot
    low, high = np.minimum(snapshot.first, snapshot.second), np.maximum(snapshot.first, snapshot.second)
    across = np.where((snapshot.first > snapshot.second)[:, None], -snapshot.across, snapshot.across)
    again = len(low) - len(np.unique(np.column_stack((low, high, across)), axis=0))
    if not again and not state.are_spheres:
        raise NotPossible("grains that are not spheres may touch at several points, which were added up")
    return float(again + state.recorded.n_merged), 0.0


def _normals(state: Reading) -> Found:
    snapshot, wall = state.snapshot, state.snapshot.is_wall
    outward = np.zeros((int(wall.sum()), 3))
    face = snapshot.second[wall] - snapshot.n_grains
    outward[np.arange(len(face)), face // 2] = OUTWARD[face]
    worst = _largest(np.linalg.norm(snapshot.normal[wall] - outward, axis=1))
    if state.are_spheres:
        branch = snapshot.branch[~wall]
        apart = np.linalg.norm(branch, axis=1)
        off = np.linalg.norm(snapshot.normal[~wall] - branch / np.where(apart > 0.0, apart, 1.0)[:, None], axis=1)
        worst = max(worst, _largest(off - state.contact_slack[~wall] / np.where(apart > 0.0, apart, 1.0)))
    if worst <= DIRECTION:
        if "normal" in state.recorded.derived:
            raise NotPossible("the file has no normals: those of the centres were taken")
        state.need_spheres()
    return worst, DIRECTION


def _tangential(state: Reading) -> Found:
    along = np.abs((state.snapshot.force_t * state.snapshot.normal).sum(axis=1))
    found = _largest(along) / state.mean_force
    if found <= TURNED and "force_t" in state.recorded.derived:
        raise NotPossible("the file has whole forces: their parts along and across the normal were taken")
    return found, TURNED


def _coulomb(state: Reading) -> Found:
    snapshot, between = state.snapshot, ~state.snapshot.is_wall
    if snapshot.friction is None:
        raise NotPossible("the coefficient of friction is not known: give it")
    if not state.are_spheres:
        raise NotPossible("forces of grains that are not spheres may be sums over several points")
    size = np.linalg.norm(snapshot.force_t[between], axis=1)
    return _largest(size - snapshot.friction * np.abs(snapshot.force_n[between])) / state.mean_force, ROUNDING


def _law(state: Reading) -> Found:
    snapshot, springs = state.snapshot, state.recorded.springs
    overlap, wall = state.overlap, state.snapshot.is_wall
    if springs is not None:
        one, other = snapshot.radius[snapshot.first], snapshot.radius[np.where(wall, 0, snapshot.second)]
        k_n = np.where(wall, springs.on_wall(one), springs.between(one, other))
        expected, stiffness, limit = k_n * np.maximum(overlap, 0.0), k_n, ROUNDING
    elif state.law is not None:
        expected, limit = state.law.force_n, ONE_LAW
        stiffness = 1.5 * expected / np.where(overlap > 0.0, overlap, np.inf)
    else:
        raise NotPossible("the law is not known, and the contacts follow none that is known here: linear or Hertz")
    beyond = np.abs(snapshot.force_n - expected) - stiffness * state.contact_slack
    known = ~np.isnan(beyond)
    if not known.any():
        raise NotPossible("there is no contact whose stiffness is known")
    return _largest(beyond[known]) / state.mean_force, limit


def _signs(state: Reading) -> Found:
    force = state.snapshot.force_n
    total = float(np.abs(force).sum())
    if total == 0.0:
        raise NotPossible("no contact carries a normal force")
    return float(np.abs(force[force < 0.0]).sum()) / total, MORE_PULL_THAN_PUSH


def _love_weber(state: Reading) -> Found:
    love_weber = np.diag(love_weber_stress(state.snapshot))
    scale = max(np.abs(love_weber).max(), np.abs(state.wall_stress).max())
    if scale == 0.0:
        raise NotPossible("no contact carries a force")
    return _largest(np.abs(love_weber - state.wall_stress)) / scale, UNBALANCED


def _opposite_walls(state: Reading) -> Found:
    if not state.has_walls.any():
        raise NotPossible("there are no walls")
    low, high = state.pressing[0::2][state.has_walls], state.pressing[1::2][state.has_walls]
    scale = max(np.abs(low).max(), np.abs(high).max())
    if scale == 0.0:
        raise NotPossible("no grain presses a wall")
    return _largest(np.abs(high - low)) / scale, UNBALANCED


def _engine_walls(state: Reading) -> Found:
    recorded = state.recorded.wall_force
    if recorded is None:
        raise NotPossible("the data have no forces of the engine's own on the walls")
    scale = float(np.abs(recorded).max()) or state.mean_force
    return _largest(np.abs(state.pressing - recorded)) / scale, ROUNDING


def _engine_stress(state: Reading) -> Found:
    recorded = state.recorded.stress
    if recorded is None:
        raise NotPossible("the data have no stress of the engine's own")
    snapshot = state.snapshot
    of = ~snapshot.is_wall if state.recorded.stress_of_pairs else np.full(len(snapshot.first), True)
    love_weber = snapshot.force[of].T @ snapshot.branch[of] / snapshot.volume
    known = ~np.isnan(recorded)
    scale = _largest(np.abs(np.concatenate((recorded[known], love_weber[known]))))
    if scale == 0.0:
        raise NotPossible("there is no stress, by the contacts and by the engine")
    return _largest(np.abs(love_weber - recorded)[known]) / scale, OTHER_VOLUME


def _reach(state: Reading) -> Found:
    snapshot, between = state.snapshot, ~state.snapshot.is_wall
    if not between.any():
        raise NotPossible("there is no contact between grains")
    apart = np.linalg.norm(snapshot.branch[between], axis=1)
    return float(np.median(apart / (snapshot.radius[snapshot.first] + snapshot.radius[
        np.where(between, snapshot.second, 0)])[between])), REACH  # fmt: skip


def _soft(state: Reading) -> Found:
    closed = state.overlap > 0.0
    if not closed.any():
        raise NotPossible("no contact overlaps")
    return float(np.median((state.overlap / state.snapshot.radius[state.snapshot.first])[closed])), SOFT


def _box(state: Reading) -> Found:
    """How far the farthest centre is out of the box, in its own radii; or the grains' volume that is too much."""
    snapshot = state.snapshot
    low, high = snapshot.wall_position[0::2], snapshot.wall_position[1::2]
    out = np.maximum(low - snapshot.position, snapshot.position - high) / snapshot.radius[:, None]
    filled = float((4.0 / 3.0 * np.pi * snapshot.radius**3).sum()) / snapshot.volume
    return max(_largest(out[:, state.has_walls]), filled - 1.0, 0.0), 0.0


def _filled(state: Reading) -> Found:
    snapshot = state.snapshot
    return snapshot.volume / float((4.0 / 3.0 * np.pi * snapshot.radius**3).sum()), 10.0


def _metres(state: Reading) -> Found:
    return float(np.median(state.snapshot.radius)), LARGEST_GRAIN


def _finite(state: Reading) -> Found:
    snapshot = state.snapshot
    arrays = (
        snapshot.position,
        snapshot.radius,
        snapshot.wall_position,
        snapshot.normal,
        snapshot.force_n,
        snapshot.force_t,
    )
    return float(sum(int((~np.isfinite(array)).sum()) for array in arrays)), 0.0


AUDITS = (
    StateAudit(
        "finite", _finite,
        "every number with infinity",
        "numbers that are missing or have overflown",
        "there are numbers that are not finite",
    ),
    StateAudit(
        "equilibrium", _equilibrium,
        "the mean resultant of the contact forces on a grain with the mean contact force",
        "contacts left out, forces that do not belong together, states in motion",
        "far from equilibrium, or contacts are missing: the grains are out of balance",
    ),
    StateAudit(
        "missing_contacts", _missing,
        "pairs that overlap by their centres and radii with the list of contacts",
        "contacts left out, centres or walls of another state",
        "contacts are missing: grains or walls overlap that are not listed as a contact",
    ),
    StateAudit(
        "balance_of_grains", _balance_of_grains,
        "the contact forces on each grain with the resultant that the engine says, or with none where it says nothing",
        "a contact left out, doubled or altered",
        "a grain's contacts do not add up: they are incomplete or wrong, or it moves",
    ),
    StateAudit(
        "balance_of_moments", _balance_of_moments,
        "the moments of tangential forces on each sphere with the moment that the engine says, or with none",
        "tangential forces of other contacts or of another sign, moments that the data leave out (rolling resistance)",
        "a grain's moments do not add up: its tangential forces are wrong, or it spins up",
    ),
    StateAudit(
        "engine_walls", _engine_walls,
        "the sum of contact forces on each wall with the force that the engine says",
        "contacts with walls left out, forces in other units or of another step",
        "the contacts on a wall do not add up to the force that the engine has there",
    ),
    StateAudit(
        "engine_stress", _engine_stress,
        "the stress from forces and branches (Love-Weber) with the stress that the engine says",
        "forces or lengths in other units or of another sign, many contacts left out",
        "the stress of the contacts is not that of the engine",
    ),
    StateAudit(
        "love_weber", _love_weber,
        "the stress from forces and branches of all contacts (Love-Weber) with that of the forces on the boundary",
        "contacts left out, walls or centres of another state",
        "the stress within is not that on the boundary: contacts are missing or not in balance",
    ),
    StateAudit(
        "opposite_walls", _opposite_walls,
        "the forces on opposite walls with each other",
        "contacts with a wall left out",
        "opposite walls do not carry the same force",
    ),
    StateAudit(
        "normals", _normals,
        "the normals with the lines of centres, and with the walls'",
        "normals reversed, grains in another order, centres of another step",
        "normals are not along the lines of centres",
    ),
    StateAudit(
        "tangential_forces", _tangential,
        "tangential forces with normals: they are at right angles",
        "forces and normals of two steps",
        "tangential forces have a part along the normal",
    ),
    StateAudit(
        "touching", _touching,
        "distances of centres with radii, for contacts that press",
        "centres or walls of another state, contacts of other grains",
        "grains press each other that do not touch",
    ),
    StateAudit(
        "reach", _reach,
        "distances of the centres of grains in contact with their radii, for any shape",
        "grains in another order, lengths in two units",
        "grains in contact are far from each other",
    ),
    StateAudit(
        "law", _law,
        "normal forces with the overlaps of centres and radii, by the springs of the engine or the law that the contacts show",
        "forces altered, in other units or of another sign; centres, radii or walls of another state",
        "normal forces do not follow from the overlaps",
    ),
    StateAudit(
        "coulomb", _coulomb,
        "tangential forces between grains with friction times normal forces",
        "forces altered, a wrong coefficient of friction",
        "tangential forces are beyond Coulomb's limit",
    ),
    StateAudit(
        "signs", _signs,
        "the forces that pull with all normal forces",
        "forces of the opposite sign: on the first body, or tension positive",
        "most normal forces pull: the sign of the forces is the opposite",
    ),
    StateAudit(
        "pairs_once", _pairs_once,
        "the number of pairs in contact with the number of rows",
        "duplicates",
        "pairs of grains are listed more than once",
    ),
    StateAudit(
        "overlap_in_radii", _soft,
        "overlaps with radii",
        "lengths in two units",
        "grains overlap by a large part of their radii",
    ),
    StateAudit(
        "grains_in_box", _box,
        "centres and volume of the grains with the box",
        "walls of another state, lengths in two units",
        "grains are outside of the box, or larger than it",
    ),
    StateAudit(
        "volume", _filled,
        "the volume of the box with that of the grains",
        "lengths in two units",
        "the box is far larger than its grains",
    ),
    StateAudit(
        "metres", _metres,
        "the median radius with a metre",
        "lengths in millimetres or micrometres",
        "grains are larger than a metre: lengths are not in m",
    ),
)  # fmt: skip
