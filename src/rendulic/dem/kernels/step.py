"""One time step of an assembly, compiled for its contact law.

Order of a step: leapfrog with the forces of the present positions, walls, then forces at the new
positions. A state between steps is therefore whole: positions, the forces at these positions, and
velocities half a step earlier.
"""

from __future__ import annotations

import numpy as np

from rendulic.dem.kernels.arithmetic import fma
from rendulic.dem.kernels.arrays import BLOCK
from rendulic.dem.kernels.contacts import contact_forces
from rendulic.dem.kernels.layout import GRAIN, HALF_GRAIN, MOVE_STACK, N_GRAIN, N_MOVE_STACK, SPENT
from rendulic.dem.kernels.mechanics import damped
from rendulic.dem.kernels.packs import PACK, pack_operations
from rendulic.dem.kernels.rows import row_operations
from rendulic.dem.kernels.walls import add_wall_work, move_walls, wall_forces
from rendulic.foundation.compiling import kernel

# of eight moving grains
ROW, ORIGIN, MASS, INERTIA = MOVE_STACK.row, MOVE_STACK.origin, MOVE_STACK.mass, MOVE_STACK.inertia
POSITION, VELOCITY, SPIN = ROW + GRAIN.position, ROW + GRAIN.velocity, ROW + GRAIN.spin
FORCE, TORQUE, MOVED2, TAKEN = ROW + GRAIN.force, ROW + GRAIN.torque, MOVE_STACK.moved2, MOVE_STACK.taken
_rows, _packs = row_operations(PACK, 0, N_MOVE_STACK), pack_operations()
stack_grains, any_beyond = _rows.stack_rows, _rows.any_beyond
gather_8, gather_2 = _packs.gather_8, _packs.gather_2
scatter_8, stack_places = _packs.scatter_8, _packs.stack_places


@kernel
def move_grains(grains, begin, end, dt, damping, reference, reach, lost):
    """Advance velocities and positions of the grains `begin` to `end` by `dt`; clear force and torque.

    What damping took goes to `lost` by blocks of grains: an order of summation that no thread changes.

    Returns whether every grain is still within `reach` of its `reference` position: False, also
    for a position that is not a number, means the neighbour list must be rebuilt before forces.
    """
    row, mass, inertia = grains.row, grains.mass, grains.inertia
    stack, own, origin = stack_grains(), stack_places(), stack_places()
    reach2 = reach * reach
    beyond = False
    for block in range(begin // BLOCK, (end + BLOCK - 1) // BLOCK):
        for lane in range(PACK):
            stack[TAKEN * PACK + lane] = 0.0
        last = min((block + 1) * BLOCK, end) - 1
        for i in range(block * BLOCK, last + 1, PACK):
            for k in range(PACK):
                at = min(i + k, last)  # the last one fills up the last pack: it is moved, and stored, again
                own[k], origin[k] = at * N_GRAIN, at * 3
                stack[MASS * PACK + k] = mass[np.uint64(at)]
                stack[INERTIA * PACK + k] = inertia[np.uint64(at)]
            gather_8(stack, ROW * PACK, row, own, 0)
            gather_8(stack, (ROW + HALF_GRAIN) * PACK, row, own, HALF_GRAIN)
            gather_2(stack, ORIGIN * PACK, reference, origin, 0)
            gather_2(stack, (ORIGIN + 1) * PACK, reference, origin, 1)
            for lane in range(PACK):
                of_force, of_torque = dt / stack[MASS * PACK + lane], dt / stack[INERTIA * PACK + lane]
                moved2, taken = 0.0, 0.0
                for k in range(3):
                    old, full = stack[(VELOCITY + k) * PACK + lane], stack[(FORCE + k) * PACK + lane]
                    kept = damped(full, old, 0.5 * of_force, damping)
                    new = fma(of_force, kept, old)
                    taken += (full - kept) * (old + new)
                    x = fma(dt, new, stack[(POSITION + k) * PACK + lane])
                    stack[(POSITION + k) * PACK + lane] = x
                    stack[(VELOCITY + k) * PACK + lane] = new
                    moved2 += (x - stack[(ORIGIN + k) * PACK + lane]) ** 2
                    old, full = stack[(SPIN + k) * PACK + lane], stack[(TORQUE + k) * PACK + lane]
                    kept = damped(full, old, 0.5 * of_torque, damping)
                    new = fma(of_torque, kept, old)
                    taken += (full - kept) * (old + new)
                    stack[(SPIN + k) * PACK + lane] = new
                    stack[(FORCE + k) * PACK + lane] = 0.0
                    stack[(TORQUE + k) * PACK + lane] = 0.0
                stack[MOVED2 * PACK + lane] = moved2
                stack[TAKEN * PACK + lane] += taken if i + lane <= last else 0.0
            beyond |= any_beyond(stack, MOVED2 * PACK, reach2)
            scatter_8(row, own, stack, ROW * PACK, 0)
            scatter_8(row, own, stack, (ROW + HALF_GRAIN) * PACK, HALF_GRAIN)
        total = 0.0
        for lane in range(PACK):
            total += stack[TAKEN * PACK + lane]
        lost[block] = 0.5 * total * dt
    return not beyond


@kernel
def advance(n_steps, packing, drive, stepping, valid, spent, room):
    """Make up to `n_steps` steps, in place.

    Parameters
    ----------
    packing : Packing
    drive : Drive
    stepping : Stepping
    valid : ListRange
        Where the neighbour list holds.
    spent : (3,) array
        Energies, see `layout.SPENT`.
    room : array
        See `arrays.servo_room`.

    Returns
    -------
    done : int
        Steps made.
    complete : bool
        False when the neighbour list must be rebuilt: grains and walls of the next step have moved
        but its forces are not computed yet (`finish_step` does that after the rebuild).
    """
    grains, walls, dt, damping = packing.grains, packing.walls, stepping.dt, stepping.damping
    n, lost = grains.row.shape[0], np.zeros((grains.row.shape[0] + BLOCK - 1) // BLOCK)
    for step in range(n_steps):
        within = move_grains(grains, 0, n, dt, damping, valid.origin, valid.reach, lost)
        for block in range(lost.shape[0]):
            spent[SPENT.damping] += lost[block]
        if not move_walls(walls, drive, dt, valid.wall_origin, valid.reach, spent, room):
            within = False
        if not within:
            return step, False
        finish_step(packing, stepping, spent, room)
    return n_steps, True


@kernel
def finish_step(packing, stepping, spent, room):
    """Forces at the present positions, and the second half of the boundary work of the step."""
    contact_forces(packing.grains, packing.contacts, stepping.dt, stepping.parameters, spent)
    wall_forces(packing.grains, packing.walls, packing.wall_contacts, stepping.parameters)
    add_wall_work(packing.walls, spent, room)
