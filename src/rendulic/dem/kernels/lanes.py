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
from rendulic.dem.kernels.layout import (
    CONTACT,
    LANE,
    LANE_CONTACT_STACK,
    LANE_MOVE_STACK,
    LANE_WALL_STACK,
    N_CONTACT,
    N_LANE,
)
from rendulic.dem.kernels.mechanics import damped, pair_force
from rendulic.foundation.compiling import kernel, unbound

AHEAD = 6  # contacts between fetching a second grain and its use
FIRST, SECOND, HELD, DISTANCE2 = (
    LANE_CONTACT_STACK.first, LANE_CONTACT_STACK.second, LANE_CONTACT_STACK.held, LANE_CONTACT_STACK.distance2
)  # fmt: skip
FORCE_N, FORCE_T = HELD + CONTACT.force_n, HELD + CONTACT.force_t
ROWS, MOVED2 = LANE_MOVE_STACK.rows, LANE_MOVE_STACK.moved2
PRESSING, STIFFNESS = LANE_WALL_STACK.pressing, LANE_WALL_STACK.stiffness

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
        own = g * N_LANE * WIDTH
        for k in range(N_LANE):
            copy_row(scratch, (ROWS + k) * WIDTH, state, own + k * WIDTH)
        # one loop over lanes with the axes inside: that the compiler makes vectors of
        for lane in range(WIDTH):
            moved2 = 0.0
            for k in range(3):
                x, v = (ROWS + LANE.position + k) * WIDTH + lane, (ROWS + LANE.velocity + k) * WIDTH + lane
                f, s = (ROWS + LANE.force + k) * WIDTH + lane, (ROWS + LANE.spin + k) * WIDTH + lane
                m = (ROWS + LANE.torque + k) * WIDTH + lane
                old, full = scratch[v], scratch[f]
                new = fma(impulse, damped(full, old, 0.5 * impulse, damping), old)
                to = fma(dt, new, scratch[x])
                scratch[x] = to
                scratch[v] = new
                moved2 += (to - scratch[(ROWS + LANE.origin + k) * WIDTH + lane]) ** 2
                old, full = scratch[s], scratch[m]
                kept = damped(full, old, 0.5 * angular_impulse, damping)
                scratch[s] = fma(angular_impulse, kept, old)
                scratch[f] = 0.0
                scratch[m] = 0.0
            scratch[MOVED2 * WIDTH + lane] = moved2
        for k in range(LANE.origin):
            copy_row(state, own + k * WIDTH, scratch, (ROWS + k) * WIDTH)
        if any_beyond(scratch, MOVED2 * WIDTH, reach2):
            beyond += 1
    return beyond


@kernel
def contact_lanes(state, radius, first, second, held, dt, parameters):
    """Add the grain-grain contact forces of all lanes; see `contacts.contact_forces`."""
    scratch = stack_rows()
    ahead = first.shape[0] - AHEAD
    for c in range(first.shape[0]):
        if c < ahead:
            fetch(state, np.int64(second[c + AHEAD]) * (N_LANE * WIDTH))
        i, j = np.uint64(first[c]), np.uint64(second[c])  # unsigned: no test for negative indices
        one, two = np.int64(i) * (N_LANE * WIDTH), np.int64(j) * (N_LANE * WIDTH)
        history = c * (N_CONTACT * WIDTH)
        r1, r2 = radius[i], radius[j]
        reach = r1 + r2
        reach2 = reach * reach
        apart = (SECOND + LANE.position) * WIDTH
        for k in range(3):
            copy_row(scratch, apart + k * WIDTH, state, two + (LANE.position + k) * WIDTH)
            subtract_row(scratch, apart + k * WIDTH, state, one + (LANE.position + k) * WIDTH)
        square_row(scratch, DISTANCE2 * WIDTH, scratch, apart + 2 * WIDTH)
        add_square_row(scratch, DISTANCE2 * WIDTH, scratch, apart + WIDTH)
        add_square_row(scratch, DISTANCE2 * WIDTH, scratch, apart)
        copy_row(scratch, FORCE_N * WIDTH, held, history + CONTACT.force_n * WIDTH)
        if not (any_less(scratch, DISTANCE2 * WIDTH, reach2) or any_unequal(scratch, FORCE_N * WIDTH, 0.0)):
            continue
        for k in range(LANE.velocity, LANE.origin):
            copy_row(scratch, (FIRST + k) * WIDTH, state, one + k * WIDTH)
            copy_row(scratch, (SECOND + k) * WIDTH, state, two + k * WIDTH)
        for k in range(CONTACT.force_t, N_CONTACT):
            copy_row(scratch, (HELD + k) * WIDTH, held, history + k * WIDTH)
        k_n, k_t = law_stiffness(r1, r2, parameters)
        for lane in range(WIDTH):
            x = (SECOND + LANE.position) * WIDTH + lane
            v1, v2 = (FIRST + LANE.velocity) * WIDTH + lane, (SECOND + LANE.velocity) * WIDTH + lane
            s1, s2 = (FIRST + LANE.spin) * WIDTH + lane, (SECOND + LANE.spin) * WIDTH + lane
            t = FORCE_T * WIDTH + lane
            distance2 = scratch[DISTANCE2 * WIDTH + lane]
            force_n, force_t, force, moment, a1, a2, _dissipated = pair_force(
                (scratch[x], scratch[x + WIDTH], scratch[x + 2 * WIDTH]),
                distance2,
                r1,
                r2,
                k_n,
                k_t,
                (
                    scratch[v2] - scratch[v1],
                    scratch[v2 + WIDTH] - scratch[v1 + WIDTH],
                    scratch[v2 + 2 * WIDTH] - scratch[v1 + 2 * WIDTH],
                ),
                (scratch[s1], scratch[s1 + WIDTH], scratch[s1 + 2 * WIDTH]),
                (scratch[s2], scratch[s2 + WIDTH], scratch[s2 + 2 * WIDTH]),
                (scratch[t], scratch[t + WIDTH], scratch[t + 2 * WIDTH]),
                dt,
                parameters,
            )
            closed = distance2 < reach2
            scratch[FORCE_N * WIDTH + lane] = force_n if closed else 0.0
            scratch[t] = force_t[0] if closed else 0.0
            scratch[t + WIDTH] = force_t[1] if closed else 0.0
            scratch[t + 2 * WIDTH] = force_t[2] if closed else 0.0
            fx, fy, fz = force
            mx, my, mz = moment
            fx, fy, fz = fx if closed else 0.0, fy if closed else 0.0, fz if closed else 0.0
            mx, my, mz = mx if closed else 0.0, my if closed else 0.0, mz if closed else 0.0
            on, to = (FIRST + LANE.force) * WIDTH + lane, (SECOND + LANE.force) * WIDTH + lane
            scratch[on] -= fx
            scratch[on + WIDTH] -= fy
            scratch[on + 2 * WIDTH] -= fz
            scratch[to] += fx
            scratch[to + WIDTH] += fy
            scratch[to + 2 * WIDTH] += fz
            on, to = (FIRST + LANE.torque) * WIDTH + lane, (SECOND + LANE.torque) * WIDTH + lane
            scratch[on] = fma(-a1, mx, scratch[on])
            scratch[on + WIDTH] = fma(-a1, my, scratch[on + WIDTH])
            scratch[on + 2 * WIDTH] = fma(-a1, mz, scratch[on + 2 * WIDTH])
            scratch[to] = fma(-a2, mx, scratch[to])
            scratch[to + WIDTH] = fma(-a2, my, scratch[to + WIDTH])
            scratch[to + 2 * WIDTH] = fma(-a2, mz, scratch[to + 2 * WIDTH])
        for k in range(N_CONTACT):
            copy_row(held, history + k * WIDTH, scratch, (HELD + k) * WIDTH)
        for k in range(LANE.force, LANE.origin):
            copy_row(state, one + k * WIDTH, scratch, (FIRST + k) * WIDTH)
            copy_row(state, two + k * WIDTH, scratch, (SECOND + k) * WIDTH)


@kernel
def wall_lanes(state, radius, grain, wall, wall_held, wall_position, wall_force, wall_stiffness, parameters):
    """Add the forces of the walls of all lanes; see `walls.wall_forces`."""
    scratch = stack_rows()
    pressing, stiffness = PRESSING * WIDTH, STIFFNESS * WIDTH
    wall_force[:] = 0.0
    wall_stiffness[:] = 0.0
    for c in range(grain.shape[0]):
        g, w = np.uint64(grain[c]), np.int64(wall[c])
        axis = np.int64(g) * N_LANE + w // 2  # rows of the grain, from that of the wall's axis on
        side = 1.0 if w % 2 == 0 else -1.0
        r = radius[g]
        k_n = law_wall_stiffness(r, parameters)
        copy_row(scratch, pressing, state, (axis + LANE.position) * WIDTH)
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
        add_row(state, (axis + LANE.force) * WIDTH, scratch, pressing)


@kernel
def advance_lanes(n_steps, lanes, rates, stepping, reach):
    """Make up to `n_steps` steps of all lanes, in place.

    Parameters
    ----------
    lanes : LaneArrays
    rates : (3, WIDTH) array
        Principal strain rates.
    stepping : Stepping
    reach : float
        How far grains and walls may be from where the candidate pairs were found.

    Returns
    -------
    done : int
        Steps made.
    complete : bool
        False when the candidate pairs must be found anew: grains and walls of the next step have
        moved, its forces are missing (`finish_lanes`).
    """
    wall_position, wall_origin = lanes.wall_position, lanes.wall_origin
    dt, damping = stepping.dt, stepping.damping
    for made in range(n_steps):
        beyond = move_lanes(lanes.state, lanes.mass, lanes.inertia, dt, damping, reach)
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
        finish_lanes(lanes, dt, stepping.parameters)
    return n_steps, True


@kernel
def finish_lanes(lanes, dt, parameters):
    """Forces at the present positions."""
    contact_lanes(lanes.state, lanes.radius, lanes.first, lanes.second, lanes.held, dt, parameters)
    wall_lanes(lanes.state, lanes.radius, lanes.grain, lanes.wall, lanes.wall_held, lanes.wall_position,
               lanes.wall_force, lanes.wall_stiffness, parameters)  # fmt: skip
