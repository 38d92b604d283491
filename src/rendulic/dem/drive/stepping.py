"""Steps in time, with lists of neighbours renewed on the way."""

from __future__ import annotations

import numpy as np

from rendulic.dem.drive.team import in_ranks, prepared_for, threads_for
from rendulic.dem.kernels.arrays import Drive, ListRange, Stepping, servo_room
from rendulic.dem.kernels.compiled import kernels_for
from rendulic.dem.state import margins
from rendulic.dem.state.assembly_state import AssemblyState
from rendulic.dem.state.neighbours import find_contacts
from rendulic.foundation.whole_change import heed_interrupts, is_interrupted, whole_change

__all__ = ["advance", "compute_forces", "list_neighbours", "rebuild", "tighten_list"]

AT_A_TIME = 500_000  # grains times steps between two looks for Ctrl-C: some tenths of a second


@whole_change
def advance(assembly: AssemblyState, n_steps: int, drive: Drive, damping: float | None = None) -> None:
    """Make `n_steps` steps of the present time step, in place; without `damping` the assembly's own.

    Ctrl-C stops it between two steps, where time and counts are those of the steps made.

    Raises
    ------
    UnstableTimeStep
        If the motion diverges.
    """
    kernels, threads = kernels_for(assembly.law), threads_for(len(assembly))
    damping = assembly.damping if damping is None else damping
    stepping, room = Stepping(assembly.time_step, damping, assembly.law.parameters), servo_room()
    left = not_counted = n_steps
    most = max(1, AT_A_TIME // len(assembly))
    while left > 0:
        reach = 0.5 * assembly.margin - assembly.growth_since_build
        valid = ListRange(assembly.list_origin, assembly.list_wall_origin, reach)
        moved = (assembly.packing, drive, stepping, valid, assembly.spent, room)
        if threads == 1:
            done, complete = kernels.advance(min(left, most), *moved)
        else:
            done, complete = in_ranks(kernels.advance_team, prepared_for(assembly, threads), min(left, most), *moved)
        assembly.steps_since_build += done
        left -= done
        if not complete:
            rebuild(assembly)
            kernels.finish_step(assembly.packing, stepping, assembly.spent, room)
            left -= 1
        if is_interrupted():
            _count(assembly, not_counted - left)
            not_counted = left
            heed_interrupts()
    _count(assembly, not_counted)


def _count(assembly: AssemblyState, n_steps: int) -> None:
    assembly.n_steps += n_steps
    assembly.time += n_steps * assembly.time_step


def compute_forces(assembly: AssemblyState, dt: float = 0.0) -> None:
    """Forces at the present positions, in place, without moving anything.

    `dt` advances the tangential forces by the motion of the last step, for states of engines
    that save forces one step older than positions.
    """
    assembly.grains.force[:] = 0.0
    assembly.grains.torque[:] = 0.0
    kernels, parameters = kernels_for(assembly.law), assembly.law.parameters
    kernels.contact_forces(assembly.grains, assembly.contacts, dt, parameters, np.zeros(3))
    kernels.wall_forces(assembly.grains, assembly.walls, assembly.wall_contacts, parameters)


def list_neighbours(assembly: AssemblyState) -> None:
    """Find the candidate pairs of the present positions, in place; closed contacts keep their history."""
    found = find_contacts(assembly.grains, assembly.walls, assembly.contacts, assembly.margin)
    assembly.contacts, assembly.wall_contacts = found
    assembly.list_origin = assembly.grains.position.copy()
    assembly.list_wall_origin = assembly.walls.position.copy()
    assembly.steps_since_build = 0
    assembly.growth_since_build = 0.0


def rebuild(assembly: AssemblyState) -> None:
    """Find the candidate pairs anew, in place, within a margin that follows how long the last list held."""
    held, radius = assembly.steps_since_build, assembly.grains.radius.mean()
    assembly.margin = margins.narrowed(margins.widened(assembly.margin, held, radius), held, radius)
    list_neighbours(assembly)
    assembly.n_rebuilds += 1


def tighten_list(assembly: AssemblyState) -> None:
    """Find the candidate pairs anew, in place, within a narrow margin for small motions; it widens if need be."""
    assembly.margin = margins.AT_REST * float(assembly.grains.radius.mean())
    list_neighbours(assembly)
    compute_forces(assembly)
