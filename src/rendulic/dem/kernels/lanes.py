"""One time step of several copies of an assembly together, the copy ("lane") as innermost array axis.

The same step as `kernels/step.py`, for strain rates imposed on the walls, with the same contact law.
All lanes start from one state and share radii, masses and candidate pairs; a contact's numbers of all
lanes lie side by side, so that one instruction serves `WIDTH` of them. A contact's rows are moved into
a small scratch at constant places, worked on there, and moved back: only so can the compiler know that
nothing overlaps. Every lane's arithmetic is its own: what the others do cannot change a bit of it.

`WIDTH`, the row moves and the `law_*` names are put in place before compiling, see
`compiled.lane_kernels_for`.
"""

from __future__ import annotations

from math import copysign, expm1, sqrt

import numpy as np

from rendulic.dem.kernels.rows import row_moves
from rendulic.dem.laws.linear_frictional import contact_force as law_contact_force
from rendulic.dem.laws.linear_frictional import mean_diameter_stiffness as law_stiffness
from rendulic.dem.laws.linear_frictional import wall_stiffness as law_wall_stiffness

WIDTH = 8
copy_row, add_row, subtract_row = (vars(row_moves(WIDTH))[name] for name in ("copy_row", "add_row", "subtract_row"))

# rows of a grain, each of WIDTH numbers; the first fifteen are its state, then where the list was built
POSITION, VELOCITY, SPIN, FORCE, TORQUE, ORIGIN, ROWS = 0, 3, 6, 9, 12, 15, 18
# rows of the scratch of a contact: two grains (9 each), history (4), force (3), torques (6), distance squared
SECOND, HELD, PAIR_FORCE, TORQUE_1, TORQUE_2, DISTANCE2, SCRATCH_ROWS = 9, 18, 22, 25, 28, 31, 32


def move_lanes(state, mass, inertia, dt, damping, reach, scratch):
    """Advance velocities and positions by `dt`, clear force and torque; see `step.move_grains`.

    Returns how many grains of all lanes are no longer within `reach` of where the list was built.
    """
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
                kept = full * (1.0 - damping * copysign(1.0, full * (old + 0.5 * impulse * full)))
                new = old + impulse * kept
                x = scratch[(POSITION + k) * WIDTH + lane] + dt * new
                scratch[(POSITION + k) * WIDTH + lane] = x
                scratch[(VELOCITY + k) * WIDTH + lane] = new
                moved2 += (x - scratch[(ORIGIN + k) * WIDTH + lane]) ** 2
                old, full = scratch[(SPIN + k) * WIDTH + lane], scratch[(TORQUE + k) * WIDTH + lane]
                kept = full * (1.0 - damping * copysign(1.0, full * (old + 0.5 * angular_impulse * full)))
                scratch[(SPIN + k) * WIDTH + lane] = old + angular_impulse * kept
                scratch[(FORCE + k) * WIDTH + lane] = 0.0
                scratch[(TORQUE + k) * WIDTH + lane] = 0.0
            scratch[ROWS * WIDTH + lane] = moved2
        for k in range(ORIGIN):
            copy_row(state, own + k * WIDTH, scratch, k * WIDTH)
        out = 0.0
        for lane in range(WIDTH):
            out += 0.0 if scratch[ROWS * WIDTH + lane] <= reach2 else 1.0  # also of what is not a number
        if out > 0.0:
            beyond += 1
    return beyond


def contact_lanes(state, radius, first, second, held, dt, parameters, scratch):
    """Add the grain-grain contact forces of all lanes; see `step.contact_forces`."""
    for c in range(first.shape[0]):
        one, two = np.int64(first[c]) * (ROWS * WIDTH), np.int64(second[c]) * (ROWS * WIDTH)
        history = c * (4 * WIDTH)
        r1, r2 = radius[first[c]], radius[second[c]]
        reach = r1 + r2
        reach2 = reach * reach
        for k in range(3):
            copy_row(scratch, k * WIDTH, state, one + k * WIDTH)
            copy_row(scratch, (SECOND + k) * WIDTH, state, two + k * WIDTH)
        copy_row(scratch, HELD * WIDTH, held, history)
        touching = 0.0
        for lane in range(WIDTH):
            nx = scratch[9 * WIDTH + lane] - scratch[lane]
            ny = scratch[10 * WIDTH + lane] - scratch[WIDTH + lane]
            nz = scratch[11 * WIDTH + lane] - scratch[2 * WIDTH + lane]
            distance2 = nx * nx + ny * ny + nz * nz
            scratch[DISTANCE2 * WIDTH + lane] = distance2
            touching += 1.0 if (distance2 < reach2 or scratch[HELD * WIDTH + lane] != 0.0) else 0.0
        if touching == 0.0:
            continue
        for k in range(3, 9):
            copy_row(scratch, k * WIDTH, state, one + k * WIDTH)
            copy_row(scratch, (SECOND + k) * WIDTH, state, two + k * WIDTH)
        for k in range(1, 4):
            copy_row(scratch, (HELD + k) * WIDTH, held, history + k * WIDTH)
        k_n, k_t = law_stiffness(r1, r2, parameters)
        for lane in range(WIDTH):
            nx = scratch[9 * WIDTH + lane] - scratch[lane]
            ny = scratch[10 * WIDTH + lane] - scratch[WIDTH + lane]
            nz = scratch[11 * WIDTH + lane] - scratch[2 * WIDTH + lane]
            distance2 = scratch[DISTANCE2 * WIDTH + lane]
            distance = sqrt(distance2)
            overlap = reach - distance
            scale = 1.0 / distance
            nx *= scale
            ny *= scale
            nz *= scale
            a1, a2 = r1 - 0.5 * overlap, r2 - 0.5 * overlap
            sx, sy, sz = scratch[6 * WIDTH + lane], scratch[7 * WIDTH + lane], scratch[8 * WIDTH + lane]
            ux, uy, uz = scratch[15 * WIDTH + lane], scratch[16 * WIDTH + lane], scratch[17 * WIDTH + lane]
            wx, wy, wz = a1 * sx + a2 * ux, a1 * sy + a2 * uy, a1 * sz + a2 * uz
            vx = scratch[12 * WIDTH + lane] - scratch[3 * WIDTH + lane] - (wy * nz - wz * ny)
            vy = scratch[13 * WIDTH + lane] - scratch[4 * WIDTH + lane] - (wz * nx - wx * nz)
            vz = scratch[14 * WIDTH + lane] - scratch[5 * WIDTH + lane] - (wx * ny - wy * nx)
            vn = vx * nx + vy * ny + vz * nz
            fx, fy, fz = scratch[19 * WIDTH + lane], scratch[20 * WIDTH + lane], scratch[21 * WIDTH + lane]
            fn = fx * nx + fy * ny + fz * nz
            fx -= fn * nx
            fy -= fn * ny
            fz -= fn * nz
            turn = 0.5 * dt * ((sx + ux) * nx + (sy + uy) * ny + (sz + uz) * nz)
            tx = fx + turn * (ny * fz - nz * fy)
            ty = fy + turn * (nz * fx - nx * fz)
            tz = fz + turn * (nx * fy - ny * fx)
            fn, tx, ty, tz, _lost = law_contact_force(
                overlap, k_n, k_t, tx, ty, tz, dt * (vx - vn * nx), dt * (vy - vn * ny), dt * (vz - vn * nz), parameters
            )
            closed = distance2 < reach2
            fn = fn if closed else 0.0
            tx = tx if closed else 0.0
            ty = ty if closed else 0.0
            tz = tz if closed else 0.0
            scratch[18 * WIDTH + lane] = fn
            scratch[19 * WIDTH + lane] = tx
            scratch[20 * WIDTH + lane] = ty
            scratch[21 * WIDTH + lane] = tz
            scratch[22 * WIDTH + lane] = fn * nx + tx
            scratch[23 * WIDTH + lane] = fn * ny + ty
            scratch[24 * WIDTH + lane] = fn * nz + tz
            mx = ny * tz - nz * ty
            my = nz * tx - nx * tz
            mz = nx * ty - ny * tx
            scratch[25 * WIDTH + lane] = a1 * mx
            scratch[26 * WIDTH + lane] = a1 * my
            scratch[27 * WIDTH + lane] = a1 * mz
            scratch[28 * WIDTH + lane] = a2 * mx
            scratch[29 * WIDTH + lane] = a2 * my
            scratch[30 * WIDTH + lane] = a2 * mz
        for k in range(4):
            copy_row(held, history + k * WIDTH, scratch, (HELD + k) * WIDTH)
        for k in range(3):
            subtract_row(state, one + (FORCE + k) * WIDTH, scratch, (PAIR_FORCE + k) * WIDTH)
            add_row(state, two + (FORCE + k) * WIDTH, scratch, (PAIR_FORCE + k) * WIDTH)
            subtract_row(state, one + (TORQUE + k) * WIDTH, scratch, (TORQUE_1 + k) * WIDTH)
            subtract_row(state, two + (TORQUE + k) * WIDTH, scratch, (TORQUE_2 + k) * WIDTH)


def wall_lanes(state, radius, grain, wall, wall_held, wall_position, wall_force, wall_stiffness, parameters):
    """Add the forces of the walls of all lanes; see `step.wall_forces`."""
    for w in range(6):
        for lane in range(WIDTH):
            wall_force[w, lane] = 0.0
            wall_stiffness[w, lane] = 0.0
    for c in range(grain.shape[0]):
        g, w = np.int64(grain[c]), np.int64(wall[c])
        axis = w // 2
        side = 1.0 if w % 2 == 0 else -1.0
        at = (g * ROWS + axis) * WIDTH
        k_n = law_wall_stiffness(radius[g], parameters)
        for lane in range(WIDTH):
            overlap = radius[g] - side * (state[at + lane] - wall_position[w, lane])
            closed = overlap > 0.0
            pressing = k_n * overlap if closed else 0.0
            wall_held[c, lane] = pressing
            state[at + FORCE * WIDTH + lane] += side * pressing
            wall_force[w, lane] += pressing
            wall_stiffness[w, lane] += k_n if closed else 0.0


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
    scratch,
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
        beyond = move_lanes(state, mass, inertia, dt, damping, reach, scratch)
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
                     wall_stiffness, dt, parameters, scratch)  # fmt: skip
    return n_steps, True


def finish_lanes(state, radius, first, second, held, grain, wall, wall_held, wall_position, wall_force, wall_stiffness,
                 dt, parameters, scratch):  # fmt: skip
    """Forces at the present positions."""
    contact_lanes(state, radius, first, second, held, dt, parameters, scratch)
    wall_lanes(state, radius, grain, wall, wall_held, wall_position, wall_force, wall_stiffness, parameters)
