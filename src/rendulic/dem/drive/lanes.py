"""Several probes of one assembly advancing together, one per lane."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from copy import copy
from typing import Generic, TypeVar

import numpy as np

from rendulic.dem.drive.quasi_static import STEPS_PER_LOOK
from rendulic.dem.drive.settling import SETTLING_DAMPING, Watch, looks, stands_still
from rendulic.dem.kernels.arrays import (
    Contacts,
    Grains,
    LaneArrays,
    Stepping,
    WallContacts,
    Walls,
    aligned,
    aligned_rows,
)
from rendulic.dem.kernels.compiled import lane_kernels_for
from rendulic.dem.kernels.layout import CONTACT, GRAIN, LANE, LANE_ROWS, N_CONTACT, N_GRAIN, N_LANE
from rendulic.dem.state.assembly_state import AssemblyState, copy_of
from rendulic.dem.state.margins import widened
from rendulic.dem.state.neighbours import find_contacts
from rendulic.specimen.way import Way

__all__ = ["Lanes", "batches", "probe_in_lanes"]

# columns of `Grains.row` in the order of the rows of a lane
IN_LANES = [getattr(GRAIN, name) + k for name in LANE_ROWS if name != "origin" for k in range(LANE_ROWS[name])]
WIDTHS = (4, 8)  # half a vector of 512 bits, and a whole one
Reading = TypeVar("Reading")
AnyAssembly = TypeVar("AnyAssembly", bound=AssemblyState)


def width_for(count: int) -> int:
    """Lanes of the narrowest kernel that holds `count` probes."""
    return next(width for width in WIDTHS if width >= count)


def batches(count: int, workers: int = 1) -> list[range]:
    """Which lanes advance together: an even share for each worker, in full vectors and a remainder.

    >>> batches(19, workers=2)
    [range(0, 8), range(8, 9), range(9, 17), range(17, 19)]
    """
    shares = [range(count * w // workers, count * (w + 1) // workers) for w in range(workers)]
    widest = max(WIDTHS)
    return [share[at : at + widest] for share in shares for at in range(0, len(share), widest)]


class Lanes(Generic[AnyAssembly]):
    """Up to eight copies of an assembly with strain rates of their own.

    Parameters
    ----------
    assembly : AssemblyState
        The common state, left as it is. Lanes keep its time step, damping and contact law; energies are
        not recorded.
    rates : (m, 3) array
        Principal strain rates in 1/s of each lane, m <= 8.
    width : {4, 8}, optional
        Lanes that the kernels are compiled for, at least m; those beyond m idle with rate zero. By default
        the narrowest that holds all.

    Notes
    -----
    Candidate pairs are those of any lane, found anew when a grain of any lane has used up its margin.
    Pairs that do not touch add nothing, and operations and their order are those of `stepping.advance`: a
    lane ends at the same bits as the assembly alone, whatever runs beside it.
    """

    def __init__(self, assembly: AnyAssembly, rates: np.ndarray, width: int | None = None) -> None:
        width = width or width_for(len(rates))
        grains, n = assembly.grains, len(assembly)
        self.base, self.width, self.n_used = assembly, width, len(rates)
        self.rates = np.zeros((3, width))
        self.rates[:, : len(rates)] = rates.T
        state = aligned(n * N_LANE * width)
        own = state.reshape(n, N_LANE, width)
        own[:, : LANE.origin] = grains.row[:, IN_LANES, None]
        own[:, LANE.origin :] = assembly.list_origin[:, :, None]
        contacts, touching, walls = assembly.contacts, assembly.wall_contacts, assembly.walls
        held = aligned(contacts.force.size * width)
        held.reshape(-1, N_CONTACT, width)[:] = contacts.force[:, :, None]

        def in_lanes(values: np.ndarray) -> np.ndarray:
            return np.repeat(values[:, None], width, axis=1)

        self.arrays = LaneArrays(
            state, grains.radius.copy(), grains.mass, grains.inertia,
            contacts.first.copy(), contacts.second.copy(), held,
            touching.grain.copy(), touching.wall.copy(), in_lanes(touching.force),
            in_lanes(walls.position), in_lanes(assembly.list_wall_origin), in_lanes(walls.force), in_lanes(walls.stiffness),
        )  # fmt: skip
        self.n_steps = self.n_rebuilds = self.steps_since_build = 0
        self.margin, self.damping = assembly.margin, assembly.damping

    def advance(self, n_steps: int) -> None:
        """Make `n_steps` steps, in place.

        Raises
        ------
        UnstableTimeStep
            If the motion of a lane diverges.
        """
        base, kernels = self.base, lane_kernels_for(self.base.law, self.width)
        stepping = Stepping(base.time_step, self.damping, base.law.parameters)
        left = n_steps
        while left > 0:
            done, complete = kernels.advance_lanes(left, self.arrays, self.rates, stepping, 0.5 * self.margin)
            left -= done
            self.steps_since_build += done
            if not complete:
                self._rebuild()
                kernels.finish_lanes(self.arrays, stepping.dt, stepping.parameters)
                left -= 1
        self.n_steps += n_steps

    def assembly(self, lane: int) -> AnyAssembly:
        """The specimen of a lane as it is now, independent and complete but for energies spent."""
        base, arrays = self.base, self.arrays
        state = arrays.state.reshape(len(base), N_LANE, self.width)[:, :, lane]
        rows = np.empty((len(base), N_GRAIN))
        rows[:, GRAIN.radius] = arrays.radius
        rows[:, IN_LANES] = state[:, : LANE.origin]
        held = np.ascontiguousarray(arrays.held.reshape(-1, N_CONTACT, self.width)[:, :, lane])
        of_walls = (arrays.wall_position, arrays.wall_force, arrays.wall_stiffness)
        return copy_of(
            base,
            grains=Grains(aligned_rows(rows), base.grains.mass.copy(), base.grains.inertia.copy()),
            contacts=Contacts(arrays.first.copy(), arrays.second.copy(), held),
            walls=Walls(*(np.ascontiguousarray(values[:, lane]) for values in of_walls)),
            wall_contacts=WallContacts(arrays.grain.copy(), arrays.wall.copy(), arrays.wall_held[:, lane].copy()),
            list_origin=np.ascontiguousarray(state[:, LANE.origin :]),
            list_wall_origin=np.ascontiguousarray(arrays.wall_origin[:, lane]),
            margin=self.margin, steps_since_build=self.steps_since_build, growth_since_build=0.0,
            n_steps=base.n_steps + self.n_steps, time=base.time + self.n_steps * base.time_step,
        )  # fmt: skip

    def only(self, chosen: Sequence[int], hold: bool = False) -> Lanes[AnyAssembly]:
        """An independent copy of some lanes, in the narrowest kernel that holds them; `hold` is to settle them."""
        width = width_for(len(chosen))
        copied = [*chosen, *[chosen[0]] * (width - len(chosen))]
        other, arrays = copy(self), self.arrays
        n, n_contacts, n_walls = len(arrays.radius), len(arrays.first), len(arrays.wall)

        def of(values: np.ndarray, *shape: int) -> np.ndarray:
            taken = aligned(int(np.prod(shape)) * width)
            taken.reshape(*shape, width)[:] = values.reshape(*shape, self.width)[..., copied]
            return taken

        other.arrays = arrays._replace(
            state=of(arrays.state, n, N_LANE), held=of(arrays.held, n_contacts, N_CONTACT),
            wall_held=of(arrays.wall_held, n_walls).reshape(n_walls, width),
            **{
                name: getattr(arrays, name)[:, copied].copy()
                for name in ("wall_position", "wall_origin", "wall_force", "wall_stiffness")
            },
        )  # fmt: skip
        other.width, other.n_used = width, len(chosen)
        other.rates = np.zeros((3, width)) if hold else self.rates[:, copied].copy()
        other.damping = SETTLING_DAMPING if hold else self.damping
        return other

    def stop_rattlers(self, lane: int, stopped: AnyAssembly) -> None:
        """Give a lane the velocities of its specimen, some of whose grains were stopped."""
        own = self.arrays.state.reshape(len(self.base), N_LANE, self.width)
        for name, values in (("velocity", stopped.grains.velocity), ("spin", stopped.grains.angular_velocity)):
            start = getattr(LANE, name)
            own[:, start : start + 3, lane] = values

    def _rebuild(self) -> None:
        """Candidate pairs of the present positions of all lanes, with the history of closed contacts."""
        arrays, width = self.arrays, self.width
        self.margin = widened(self.margin, self.steps_since_build, float(arrays.radius.mean()))
        n = len(arrays.radius)
        old_held = arrays.held.reshape(-1, N_CONTACT, width)
        old = arrays.first.astype(np.int64) * n + arrays.second
        pairs, touching = [old[(old_held[:, CONTACT.force_n] != 0.0).any(axis=1)]], []
        for lane in range(self.n_used):
            one = self.assembly(lane)
            found, at_walls = find_contacts(one.grains, one.walls, None, self.margin)
            pairs.append(found.first.astype(np.int64) * n + found.second)
            touching.append(at_walls.wall.astype(np.int64) * n + at_walls.grain)
        keys, wall_keys = np.unique(np.concatenate(pairs)), np.unique(np.concatenate(touching))
        held = aligned(len(keys) * N_CONTACT * width)
        held[:] = 0.0
        kept, place = np.isin(old, keys), np.searchsorted(keys, old)
        held.reshape(-1, N_CONTACT, width)[place[kept]] = old_held[kept]
        own = arrays.state.reshape(n, N_LANE, width)
        own[:, LANE.origin :] = own[:, LANE.position : LANE.position + 3]
        self.arrays = arrays._replace(
            first=(keys // n).astype(np.int32), second=(keys % n).astype(np.int32), held=held,
            grain=(wall_keys % n).astype(np.int32), wall=(wall_keys // n).astype(np.int32),
            wall_held=np.zeros((len(wall_keys), width)), wall_origin=arrays.wall_position.copy(),
        )  # fmt: skip
        self.steps_since_build = 0
        self.n_rebuilds += 1


def probe_in_lanes(
    assembly: AnyAssembly,
    increments: np.ndarray,
    n_steps: int,
    marks: Sequence[float],
    settling_steps: int,
    read: Callable[[AnyAssembly, Way], Reading],
    workers: int,
    on_done: Callable[[int], None],
) -> list[list[Reading]]:
    """Impose principal strain increments (m, 3), each in `n_steps` equal parts on a copy of the assembly.

    Options and result are those of `Assembly.probe_together`. Batches of lanes run on `workers` threads, and `on_done` gets
    the size of each. No lane depends on those beside it, so that workers do not change a bit of a result.
    """
    rates = np.asarray(increments, dtype=float) / (n_steps * assembly.time_step)

    def follow(batch: range) -> list[list[Reading]]:
        lanes = Lanes(assembly, rates[batch.start : batch.stop])
        readings: list[list[Reading]] = [[] for _ in range(lanes.n_used)]
        watches = [Watch(assembly) for _ in readings]
        done = 0
        for mark in marks:
            upto = round(mark * n_steps)
            for n_more in looks(upto - done):
                lanes.advance(n_more)
                for lane, watch in enumerate(watches):
                    watch.look(lanes.assembly(lane))
            done = upto
            for lane, (one, held) in enumerate(_settled(lanes, settling_steps)):
                readings[lane].append(read(one, watches[lane].way(one, held, done)))
        on_done(lanes.n_used)
        return readings

    with ThreadPoolExecutor(max_workers=workers) as pool:
        return [reading for batch in pool.map(follow, batches(len(rates), workers)) for reading in batch]


def _settled(lanes: Lanes[AnyAssembly], max_steps: int) -> list[tuple[AnyAssembly, int]]:
    """The specimens of all lanes with walls held until each is at rest, and the steps of that; the lanes stay as they are."""
    if max_steps == 0:
        return [(lanes.assembly(lane), 0) for lane in range(lanes.n_used)]
    found: dict[int, tuple[AnyAssembly, int]] = {}
    left, held, done = list(range(lanes.n_used)), lanes.only(range(lanes.n_used), hold=True), 0
    while left:
        moving = []
        for place, lane in enumerate(left):
            one = held.assembly(place)
            if stands_still(one) or done >= max_steps:
                found[lane] = one, done
            else:
                held.stop_rattlers(place, one)
                moving.append(place)
        if len(moving) < len(left):
            left = [left[place] for place in moving]
            held = held.only(moving) if moving else held
        if left:
            held.advance(STEPS_PER_LOOK)
            done += STEPS_PER_LOOK
    return [found[lane] for lane in range(lanes.n_used)]
