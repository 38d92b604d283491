"""One time step of several copies of an assembly together, the copy ("lane") as innermost array axis.

The same step as `kernels/step.py`, for strain rates imposed on the walls, with the same contact law and
the same operations in the same order: a lane ends at the numbers of the assembly alone, to the bit. All
lanes start from one state and share radii, masses and candidate pairs; a contact's numbers of all lanes
lie side by side, so that one instruction serves `WIDTH` of them. A contact's rows are moved to constant
places on the stack, worked on there, and moved back: there the compiler knows that nothing overlaps,
makes vectors of the loop over lanes, and keeps all rows in registers. Every lane's arithmetic is its own:
what the others do cannot change a bit of it.

`WIDTH`, the operations on rows and the `law_*` names are bound by `compiled.lane_kernels_for`.
"""

from __future__ import annotations

from math import expm1

import numpy as np

from rendulic.dem.kernels.arithmetic import fma
from rendulic.dem.kernels.contact_law import law_stiffness, law_wall_stiffness
from rendulic.dem.kernels.mechanics import damped, pair_force
from rendulic.foundation.compiling import kernel, unbound

# rows of a grain, each of WIDTH numbers; the first fifteen are its state, then where the list was built
POSITION, VELOCITY, SPIN, FORCE, TORQUE, ORIGIN, ROWS = 0, 3, 6, 9, 12, 15, 18
# rows on the stack: of a contact, the first grain (15), the second (15; its position from the first), history (4),
# distance squared; of a moving grain, its rows (18) and how far it moved, squared
SECOND, HELD, DISTANCE2, STACKED = 15, 30, 34, 35
AHEAD = 6  # contacts between fetching a second grain and its use

# lanes to a row, and the operations on rows of so many
WIDTH = unbound("take the kernel from `lane_kernels_for(law, width)`, which binds it to a number of lanes")
copy_row = add_row = subtract_row = square_row = add_square_row = fetch = stack_rows = WIDTH
scale_row = shift_row = raise_row = replace_positive = any_less = any_beyond = any_unequal = WIDTH


@kernel
def move_lanes(state, mass, inertia, dt, damping, reach):
    """Advance velocities and positions by `dt`, clear force and torque; see `step.move_grains`.

    Returns how many grains of any lane are no longer within `reach` of where the list was built.
    """
    scratch = stack_rows()
    reach2 = reach * reach
    beyond = 0
    for g in range(mass.shape[0]):
        impulse, angular_impulse = dt / mass[g], dt / inertia[g]
        own = g * ROWS * WIDTH
        for k in range(ROWS):
            copy_row(scratch, k * WIDTH, state, own + k * WIDTH)
        # one loop over lanes with the axes inside: that the compiler makes vectors of
        for lane in range(WIDTH):
            moved2 = 0.0
            for k in range(3):
                old, full = scratch[(VELOCITY + k) * WIDTH + lane], scratch[(FORCE + k) * WIDTH + lane]
                new = fma(impulse, damped(full, old, 0.5 * impulse, damping), old)
                x = fma(dt, new, scratch[(POSITION + k) * WIDTH + lane])
                scratch[(POSITION + k) * WIDTH + lane] = x
                scratch[(VELOCITY + k) * WIDTH + lane] = new
                moved2 += (x - scratch[(ORIGIN + k) * WIDTH + lane]) ** 2
                old, full = scratch[(SPIN + k) * WIDTH + lane], scratch[(TORQUE + k) * WIDTH + lane]
                kept = damped(full, old, 0.5 * angular_impulse, damping)
                scratch[(SPIN + k) * WIDTH + lane] = fma(angular_impulse, kept, old)
                scratch[(FORCE + k) * WIDTH + lane] = 0.0
                scratch[(TORQUE + k) * WIDTH + lane] = 0.0
            scratch[ROWS * WIDTH + lane] = moved2
        for k in range(ORIGIN):
            copy_row(state, own + k * WIDTH, scratch, k * WIDTH)
        if any_beyond(scratch, ROWS * WIDTH, reach2):
            beyond += 1
    return beyond


@kernel
def contact_lanes(state, radius, first, second, held, dt, parameters):
    """Add the grain-grain contact forces of all lanes; see `step.contact_forces`."""
    scratch = stack_rows()
    ahead = first.shape[0] - AHEAD
    for c in range(first.shape[0]):
        if c < ahead:
            fetch(state, np.int64(second[c + AHEAD]) * (ROWS * WIDTH))
        i, j = np.uint64(first[c]), np.uint64(second[c])  # unsigned: no test for negative indices
        one, two = np.int64(i) * (ROWS * WIDTH), np.int64(j) * (ROWS * WIDTH)
        history = c * (4 * WIDTH)
        r1, r2 = radius[i], radius[j]
        reach = r1 + r2
        reach2 = reach * reach
        for k in range(3):
            copy_row(scratch, (SECOND + k) * WIDTH, state, two + k * WIDTH)
            subtract_row(scratch, (SECOND + k) * WIDTH, state, one + k * WIDTH)
        square_row(scratch, DISTANCE2 * WIDTH, scratch, (SECOND + 2) * WIDTH)
        add_square_row(scratch, DISTANCE2 * WIDTH, scratch, (SECOND + 1) * WIDTH)
        add_square_row(scratch, DISTANCE2 * WIDTH, scratch, SECOND * WIDTH)
        copy_row(scratch, HELD * WIDTH, held, history)
        if not (any_less(scratch, DISTANCE2 * WIDTH, reach2) or any_unequal(scratch, HELD * WIDTH, 0.0)):
            continue
        for k in range(VELOCITY, ORIGIN):
            copy_row(scratch, k * WIDTH, state, one + k * WIDTH)
            copy_row(scratch, (SECOND + k) * WIDTH, state, two + k * WIDTH)
        for k in range(1, 4):
            copy_row(scratch, (HELD + k) * WIDTH, held, history + k * WIDTH)
        k_n, k_t = law_stiffness(r1, r2, parameters)
        for lane in range(WIDTH):
            distance2 = scratch[DISTANCE2 * WIDTH + lane]
            fn, tx, ty, tz, fx, fy, fz, mx, my, mz, a1, a2, _dissipated = pair_force(
                scratch[SECOND * WIDTH + lane],
                scratch[(SECOND + 1) * WIDTH + lane],
                scratch[(SECOND + 2) * WIDTH + lane],
                distance2,
                r1,
                r2,
                k_n,
                k_t,
                scratch[(SECOND + VELOCITY) * WIDTH + lane] - scratch[VELOCITY * WIDTH + lane],
                scratch[(SECOND + VELOCITY + 1) * WIDTH + lane] - scratch[(VELOCITY + 1) * WIDTH + lane],
                scratch[(SECOND + VELOCITY + 2) * WIDTH + lane] - scratch[(VELOCITY + 2) * WIDTH + lane],
                scratch[SPIN * WIDTH + lane],
                scratch[(SPIN + 1) * WIDTH + lane],
                scratch[(SPIN + 2) * WIDTH + lane],
                scratch[(SECOND + SPIN) * WIDTH + lane],
                scratch[(SECOND + SPIN + 1) * WIDTH + lane],
                scratch[(SECOND + SPIN + 2) * WIDTH + lane],
                scratch[(HELD + 1) * WIDTH + lane],
                scratch[(HELD + 2) * WIDTH + lane],
                scratch[(HELD + 3) * WIDTH + lane],
                dt,
                parameters,
            )
            closed = distance2 < reach2
            scratch[HELD * WIDTH + lane] = fn if closed else 0.0
            scratch[(HELD + 1) * WIDTH + lane] = tx if closed else 0.0
            scratch[(HELD + 2) * WIDTH + lane] = ty if closed else 0.0
            scratch[(HELD + 3) * WIDTH + lane] = tz if closed else 0.0
            fx, fy, fz = fx if closed else 0.0, fy if closed else 0.0, fz if closed else 0.0
            mx, my, mz = mx if closed else 0.0, my if closed else 0.0, mz if closed else 0.0
            scratch[FORCE * WIDTH + lane] -= fx
            scratch[(FORCE + 1) * WIDTH + lane] -= fy
            scratch[(FORCE + 2) * WIDTH + lane] -= fz
            scratch[(SECOND + FORCE) * WIDTH + lane] += fx
            scratch[(SECOND + FORCE + 1) * WIDTH + lane] += fy
            scratch[(SECOND + FORCE + 2) * WIDTH + lane] += fz
            at, to = TORQUE * WIDTH + lane, (SECOND + TORQUE) * WIDTH + lane
            scratch[at] = fma(-a1, mx, scratch[at])
            scratch[at + WIDTH] = fma(-a1, my, scratch[at + WIDTH])
            scratch[at + 2 * WIDTH] = fma(-a1, mz, scratch[at + 2 * WIDTH])
            scratch[to] = fma(-a2, mx, scratch[to])
            scratch[to + WIDTH] = fma(-a2, my, scratch[to + WIDTH])
            scratch[to + 2 * WIDTH] = fma(-a2, mz, scratch[to + 2 * WIDTH])
        for k in range(4):
            copy_row(held, history + k * WIDTH, scratch, (HELD + k) * WIDTH)
        for k in range(FORCE, ORIGIN):
            copy_row(state, one + k * WIDTH, scratch, k * WIDTH)
            copy_row(state, two + k * WIDTH, scratch, (SECOND + k) * WIDTH)


@kernel
def wall_lanes(state, radius, grain, wall, wall_held, wall_position, wall_force, wall_stiffness, parameters):
    """Add the forces of the walls of all lanes; see `step.wall_forces`."""
    scratch = stack_rows()
    pressing, stiffness = 0, WIDTH
    wall_force[:] = 0.0
    wall_stiffness[:] = 0.0
    for c in range(grain.shape[0]):
        g, w = np.uint64(grain[c]), np.int64(wall[c])
        at = (np.int64(g) * ROWS + w // 2) * WIDTH
        side = 1.0 if w % 2 == 0 else -1.0
        r = radius[g]
        k_n = law_wall_stiffness(r, parameters)
        copy_row(scratch, pressing, state, at)
        subtract_row(scratch, pressing, wall_position, w * WIDTH)
        scale_row(scratch, pressing, -side)
        shift_row(scratch, pressing, r)  # the overlap
        scale_row(scratch, pressing, k_n)
        raise_row(scratch, pressing, 0.0)
        copy_row(wall_held, c * WIDTH, scratch, pressing)
        add_row(wall_force, w * WIDTH, scratch, pressing)
        copy_row(scratch, stiffness, scratch, pressing)
        replace_positive(scratch, stiffness, k_n)
        add_row(wall_stiffness, w * WIDTH, scratch, stiffness)
        scale_row(scratch, pressing, side)
        add_row(state, at + FORCE * WIDTH, scratch, pressing)


@kernel
def advance_lanes(
    n_steps,
    state,
    radius,
    mass,
    inertia,
    first,
    second,
    held,
    grain,
    wall,
    wall_held,
    wall_position,
    wall_origin,
    wall_force,
    wall_stiffness,
    rates,
    dt,
    damping,
    parameters,
    reach,
):
    """Make up to `n_steps` steps of all lanes, in place; `rates` (3, WIDTH) are principal strain rates.

    Returns
    -------
    done : int
        Steps made.
    complete : bool
        False when the candidate pairs must be found anew: grains and walls of the next step have
        moved, its forces are missing (`finish_lanes`).
    """
    for made in range(n_steps):
        beyond = move_lanes(state, mass, inertia, dt, damping, reach)
        for axis in range(3):
            low, high = 2 * axis, 2 * axis + 1
            for lane in range(WIDTH):
                length = wall_position[high, lane] - wall_position[low, lane]
                inward = -0.5 * length * expm1(-rates[axis, lane] * dt)
                wall_position[low, lane] += inward
                wall_position[high, lane] -= inward
                if not (
                    abs(wall_position[low, lane] - wall_origin[low, lane]) <= reach
                    and abs(wall_position[high, lane] - wall_origin[high, lane]) <= reach
                ):
                    beyond += 1
        if beyond > 0:
            return made, False
        finish_lanes(state, radius, first, second, held, grain, wall, wall_held, wall_position, wall_force,
                     wall_stiffness, dt, parameters)  # fmt: skip
    return n_steps, True


@kernel
def finish_lanes(state, radius, first, second, held, grain, wall, wall_held, wall_position, wall_force, wall_stiffness,
                 dt, parameters):  # fmt: skip
    """Forces at the present positions."""
    contact_lanes(state, radius, first, second, held, dt, parameters)
    wall_lanes(state, radius, grain, wall, wall_held, wall_position, wall_force, wall_stiffness, parameters)
