"""The arrays of an assembly, grouped as the kernels take them. All float64 unless said otherwise."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rendulic.dem.kernels.layout import CONTACT, GRAIN, N_SERVO

__all__ = [
    "Contacts", "Drive", "Grains", "LaneArrays", "ListRange", "Packing", "Stepping", "Team", "WallContacts", "Walls",
    "aligned", "aligned_rows", "servo_room",
]  # fmt: skip

CACHE_LINE = 64  # bytes
BLOCK = 128  # grains or contacts whose losses are summed together, whatever the number of threads


class Grains(NamedTuple):
    """One row per grain; SI units.

    All that a contact reads and writes of a grain lies in one row of 128 bytes, two cache lines; `layout.GRAIN`
    has its columns. The properties are views of it. Velocities belong to the last half step; force and torque are the resultants
    of the contact forces at the present position, undamped.
    """

    row: np.ndarray  # (n, N_GRAIN), aligned to cache lines
    mass: np.ndarray  # (n,)
    inertia: np.ndarray  # (n,)

    @property
    def position(self) -> np.ndarray:
        """(n, 3) view, m."""
        return self.row[:, GRAIN.position : GRAIN.position + 3]

    @property
    def radius(self) -> np.ndarray:
        """(n,) view, m."""
        return self.row[:, GRAIN.radius]

    @property
    def velocity(self) -> np.ndarray:
        """(n, 3) view, m/s."""
        return self.row[:, GRAIN.velocity : GRAIN.velocity + 3]

    @property
    def angular_velocity(self) -> np.ndarray:
        """(n, 3) view, rad/s."""
        return self.row[:, GRAIN.spin : GRAIN.spin + 3]

    @property
    def force(self) -> np.ndarray:
        """(n, 3) view, N."""
        return self.row[:, GRAIN.force : GRAIN.force + 3]

    @property
    def torque(self) -> np.ndarray:
        """(n, 3) view, N m."""
        return self.row[:, GRAIN.torque : GRAIN.torque + 3]


def aligned(count: int) -> np.ndarray:
    """So many numbers, with anything in them, that start on a cache line."""
    numbers = CACHE_LINE // 8
    buffer = np.empty(count + numbers)
    offset = -buffer.ctypes.data // 8 % numbers
    return buffer[offset : offset + count]


def aligned_rows(values: np.ndarray) -> np.ndarray:
    """A copy of (n, N_GRAIN) `values` that starts on a cache line."""
    rows = aligned(values.size).reshape(values.shape)
    rows[:] = values
    return rows


def servo_room() -> np.ndarray:
    """Room for `walls.move_walls`, which `finish_step` reads; see `layout.SERVO`."""
    return np.zeros((N_SERVO, 3))


class Contacts(NamedTuple):
    """Candidate pairs `first < second`, sorted; open pairs carry zero force.

    `force` holds the normal force and the tangential force on `second`, see `layout.CONTACT`. The
    properties are views of it.
    """

    first: np.ndarray  # (n,) int32
    second: np.ndarray  # (n,) int32
    force: np.ndarray  # (n, N_CONTACT)

    @property
    def force_n(self) -> np.ndarray:
        """(n,) view, N; above zero where the pair touches."""
        return self.force[:, CONTACT.force_n]

    @property
    def force_t(self) -> np.ndarray:
        """(n, 3) view, N."""
        return self.force[:, CONTACT.force_t :]


class WallContacts(NamedTuple):
    """Candidate grain-wall pairs with their normal force (zero when open)."""

    grain: np.ndarray  # (n,) int32
    wall: np.ndarray  # (n,) int32
    force: np.ndarray  # (n,)


class Walls(NamedTuple):
    """Six walls in the order 1-, 1+, 2-, 2+, 3-, 3+."""

    position: np.ndarray  # (6,) coordinate along the wall's own axis
    force: np.ndarray  # (6,) pressing force of the grains, positive
    stiffness: np.ndarray  # (6,) summed normal stiffness of the closed contacts


class Drive(NamedTuple):
    """Loading of the box in its principal axes, in the generalised components of a `Control`.

    Strain increments are `inverse @ e`, stresses obey `s = conjugate @ sigma`.
    """

    inverse: np.ndarray  # (3, 3)
    conjugate: np.ndarray  # (3, 3)
    is_stress: np.ndarray  # (3,) bool
    rate: np.ndarray  # (3,) strain rate of the strain-controlled components, 1/s
    target: np.ndarray  # (3,) stress of the stress-controlled components at the end of the step, Pa
    target_rate: np.ndarray  # (3,) its change, Pa/s
    rate_cap: np.ndarray  # (1,) largest strain rate the servo may use, 1/s


class Packing(NamedTuple):
    """Grains between walls, and what touches what."""

    grains: Grains
    contacts: Contacts
    walls: Walls
    wall_contacts: WallContacts


class Stepping(NamedTuple):
    """The numbers that all steps share."""

    dt: float
    damping: float
    parameters: tuple[float, ...]  # of the contact law


class ListRange(NamedTuple):
    """Where grains and walls were when the candidate pairs were found, and how far they may be from there."""

    origin: np.ndarray  # (n, 3)
    wall_origin: np.ndarray  # (6,)
    reach: float


class LaneArrays(NamedTuple):
    """Several copies of an assembly, the copy as innermost axis; radii, masses and candidate pairs are common."""

    state: np.ndarray  # (n * N_LANE * lanes,), rows of `layout.LANE` for each grain, aligned to cache lines
    radius: np.ndarray  # (n,)
    mass: np.ndarray  # (n,)
    inertia: np.ndarray  # (n,)
    first: np.ndarray  # (c,) int32
    second: np.ndarray  # (c,) int32
    held: np.ndarray  # (c * N_CONTACT * lanes,), rows of `layout.CONTACT` for each pair
    grain: np.ndarray  # (w,) int32
    wall: np.ndarray  # (w,) int32
    wall_held: np.ndarray  # (w, lanes)
    wall_position: np.ndarray  # (6, lanes)
    wall_origin: np.ndarray  # (6, lanes), where the walls were when the candidate pairs were found
    wall_force: np.ndarray  # (6, lanes)
    wall_stiffness: np.ndarray  # (6, lanes)


class Team(NamedTuple):
    """What the threads of `kernels/team.py` share beside the assembly's own arrays."""

    grains: np.ndarray  # (ranks + 1,) int64, where the grains of a rank begin
    contacts: np.ndarray  # (ranks + 1,) int64, where the contacts of a rank begin
    again: np.ndarray  # (ranks, blocks), losses in contacts that are also another rank's: counted there
    at_walls: np.ndarray  # int32, wall contacts of the rank's grains, and
    wall_start: np.ndarray  # (ranks + 1,) int64, where they begin
    wall_stiffness: np.ndarray  # (wall contacts,)
    friction: np.ndarray  # (blocks of contacts,) what friction took in this step
    damping: np.ndarray  # (blocks of grains,) what damping took in this step
    within: np.ndarray  # (CACHE_LINE ranks,) bool, whether a rank's grains are where the list holds; a cache line each
    arrived: np.ndarray  # (1,) int64, arrivals at the barrier
