"""One time step of an assembly, compiled for its contact law.

Order of a step: leapfrog with the forces of the present positions, walls, then forces at the new
positions. A state between steps is therefore whole: positions, the forces at these positions, and
velocities half a step earlier.

The `law_*` names, here and in `mechanics`, are those of the default law; `compiled.kernels_for` puts another
law's functions in their place before compiling.
"""

from __future__ import annotations

from math import expm1, sqrt

import numpy as np

from rendulic.dem.kernels.arithmetic import dot, fma
from rendulic.dem.kernels.arrays import COLUMNS, FORCE, POSITION, RADIUS, SPIN, TORQUE, VELOCITY
from rendulic.dem.kernels.mechanics import damped, pair_force
from rendulic.dem.kernels.packs import PACK, pack_operations
from rendulic.dem.kernels.rows import row_operations
from rendulic.dem.laws.linear_frictional import elastic_energy as law_elastic_energy
from rendulic.dem.laws.linear_frictional import mean_diameter_stiffness as law_stiffness
from rendulic.dem.laws.linear_frictional import wall_stiffness as law_wall_stiffness

FRICTION, DAMPING, BOUNDARY = 0, 1, 2  # places in the array of energies spent
BLOCK = 256  # grains or contacts whose losses are summed together
AHEAD = 8  # contacts between fetching a second grain and its use
SHEAR_RATIO = 0.42  # k_t / k_n up to which normal stiffness decides the time step

# rows on the stack of a pack: first grain, second grain (10 each), history before (4) and now (4), what goes to
# the grains (8), what friction took, the force of pairs that opened
SECOND, HELD, NOW, PAIR, SLID, OPENED, STACKED = 10, 20, 24, 28, 36, 37, 38
# and of a pack of moving grains: the whole row (16), where the list was built (3), mass and inertia, how far
# it moved, squared, and what damping took
ORIGIN, MASS, MOVED2, TAKEN = 16, 20, 22, 23
_rows, _packs = row_operations(PACK, 2, STACKED), pack_operations()
stack_block = row_operations(PACK, 0, BLOCK).stack_rows
stack_rows, fetch, any_unequal, any_beyond = _rows.stack_rows, _rows.fetch, _rows.any_unequal, _rows.any_beyond
gather_8, gather_4, gather_2 = _packs.gather_8, _packs.gather_4, _packs.gather_2
scatter_8, scatter_4 = _packs.scatter_8, _packs.scatter_4
stack_places, indexed_places = _packs.stack_places, _packs.indexed_places
add_to_first, add_to_second = _packs.add_to_first, _packs.add_to_second


def move_grains(grains, begin, end, dt, damping, reference, reach, lost):
    """Advance velocities and positions of the grains `begin` to `end` by `dt`; clear force and torque.

    What damping took goes to `lost` by blocks of grains: an order of summation that no thread changes.

    Returns whether every grain is still within `reach` of its `reference` position: False, also
    for a position that is not a number, means the neighbour list must be rebuilt before forces.
    """
    row, mass, inertia = grains.row, grains.mass, grains.inertia
    stack, own, origin = stack_rows(), stack_places(), stack_places()
    reach2 = reach * reach
    beyond = False
    for block in range(begin // BLOCK, (end + BLOCK - 1) // BLOCK):
        for lane in range(PACK):
            stack[TAKEN * PACK + lane] = 0.0
        last = min((block + 1) * BLOCK, end) - 1
        for i in range(block * BLOCK, last + 1, PACK):
            for k in range(PACK):
                at = min(i + k, last)  # the last one fills up the last pack: it is moved, and stored, again
                own[k], origin[k] = at * COLUMNS, at * 3
                stack[MASS * PACK + k] = mass[np.uint64(at)]
                stack[(MASS + 1) * PACK + k] = inertia[np.uint64(at)]
            gather_8(stack, 0, row, own, 0)
            gather_8(stack, 8 * PACK, row, own, 8)
            gather_2(stack, ORIGIN * PACK, reference, origin, 0)
            gather_2(stack, (ORIGIN + 1) * PACK, reference, origin, 1)
            for lane in range(PACK):
                of_force, of_torque = dt / stack[MASS * PACK + lane], dt / stack[(MASS + 1) * PACK + lane]
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
            scatter_8(row, own, stack, 0, 0)
            scatter_8(row, own, stack, 8 * PACK, 8)
        total = 0.0
        for lane in range(PACK):
            total += stack[TAKEN * PACK + lane]
        lost[block] = 0.5 * total * dt
    return not beyond


def contact_pairs(grains, contacts, begin, end, dt, parameters, pair):
    """What the contacts `begin` to `end` exert at the present positions, and their new history, by packs.

    `pair` (at least end - begin, 8) receives of each the two arms, the force on the second grain and the moment
    of `mechanics.pair_force`; zeros for pairs that do not touch. Returns what friction took.
    """
    row, held = grains.row, contacts.force
    first, second = contacts.first, contacts.second
    stack, one, two, own, to = stack_rows(), stack_places(), stack_places(), stack_places(), stack_places()
    lost = 0.0
    for c in range(begin, end, PACK):
        if c + PACK <= end:
            indexed_places(one, first, c, COLUMNS)
            indexed_places(two, second, c, COLUMNS)
            for k in range(PACK):
                own[k], to[k] = (c + k) * 4, (c + k - begin) * 8
        else:
            for k in range(PACK):
                at = min(c + k, end - 1)  # the last one fills up the last pack: it is computed, and stored, again
                one[k], two[k] = np.int64(first[np.uint64(at)]) * COLUMNS, np.int64(second[np.uint64(at)]) * COLUMNS
                own[k], to[k] = at * 4, (at - begin) * 8
        if c + AHEAD + PACK <= first.shape[0]:
            for k in range(PACK):
                fetch(row, np.int64(second[np.uint64(c + AHEAD + k)]) * COLUMNS)
        gather_8(stack, 0, row, one, 0)
        gather_2(stack, 8 * PACK, row, one, 8)
        gather_8(stack, SECOND * PACK, row, two, 0)
        gather_2(stack, (SECOND + 8) * PACK, row, two, 8)
        gather_4(stack, HELD * PACK, held, own, 0)
        for lane in range(PACK):
            r1, r2 = stack[RADIUS * PACK + lane], stack[(SECOND + RADIUS) * PACK + lane]
            nx = stack[SECOND * PACK + lane] - stack[lane]
            ny = stack[(SECOND + 1) * PACK + lane] - stack[PACK + lane]
            nz = stack[(SECOND + 2) * PACK + lane] - stack[2 * PACK + lane]
            distance2 = dot(nx, ny, nz, nx, ny, nz)
            reach = r1 + r2
            closed = distance2 < reach * reach
            k_n, k_t = law_stiffness(r1, r2, parameters)
            fn, tx, ty, tz, fx, fy, fz, mx, my, mz, a1, a2, slid = pair_force(
                nx,
                ny,
                nz,
                distance2,
                r1,
                r2,
                k_n,
                k_t,
                stack[(SECOND + VELOCITY) * PACK + lane] - stack[VELOCITY * PACK + lane],
                stack[(SECOND + VELOCITY + 1) * PACK + lane] - stack[(VELOCITY + 1) * PACK + lane],
                stack[(SECOND + VELOCITY + 2) * PACK + lane] - stack[(VELOCITY + 2) * PACK + lane],
                stack[SPIN * PACK + lane],
                stack[(SPIN + 1) * PACK + lane],
                stack[(SPIN + 2) * PACK + lane],
                stack[(SECOND + SPIN) * PACK + lane],
                stack[(SECOND + SPIN + 1) * PACK + lane],
                stack[(SECOND + SPIN + 2) * PACK + lane],
                stack[(HELD + 1) * PACK + lane],
                stack[(HELD + 2) * PACK + lane],
                stack[(HELD + 3) * PACK + lane],
                dt,
                parameters,
            )
            stack[PAIR * PACK + lane] = a1 if closed else 0.0
            stack[(PAIR + 1) * PACK + lane] = a2 if closed else 0.0
            stack[(PAIR + 2) * PACK + lane] = fx if closed else 0.0
            stack[(PAIR + 3) * PACK + lane] = fy if closed else 0.0
            stack[(PAIR + 4) * PACK + lane] = fz if closed else 0.0
            stack[(PAIR + 5) * PACK + lane] = mx if closed else 0.0
            stack[(PAIR + 6) * PACK + lane] = my if closed else 0.0
            stack[(PAIR + 7) * PACK + lane] = mz if closed else 0.0
            stack[NOW * PACK + lane] = fn if closed else 0.0
            stack[(NOW + 1) * PACK + lane] = tx if closed else 0.0
            stack[(NOW + 2) * PACK + lane] = ty if closed else 0.0
            stack[(NOW + 3) * PACK + lane] = tz if closed else 0.0
            stack[SLID * PACK + lane] = slid if closed else 0.0
            stack[OPENED * PACK + lane] = 0.0 if closed else stack[HELD * PACK + lane]
        if any_unequal(stack, OPENED * PACK, 0.0):
            for lane in range(min(PACK, end - c)):
                if stack[OPENED * PACK + lane] != 0.0:
                    lost += energy_let_go(row, held, first, second, c + lane, parameters)
        scatter_8(pair, to, stack, PAIR * PACK, 0)
        scatter_4(held, own, stack, NOW * PACK, 0)
        if any_unequal(stack, SLID * PACK, 0.0):
            for lane in range(min(PACK, end - c)):
                lost += stack[SLID * PACK + lane]
    return lost


def energy_let_go(row, held, first, second, c, parameters):
    """Elastic energy of the tangential spring of a contact that opens."""
    k_n, k_t = law_stiffness(row[first[c], RADIUS], row[second[c], RADIUS], parameters)
    tangential = sqrt(held[c, 1] ** 2 + held[c, 2] ** 2 + held[c, 3] ** 2)
    return law_elastic_energy(0.0, tangential, k_n, k_t)


def contact_forces(grains, contacts, dt, parameters, spent):
    """Add the grain-grain contact forces at the present positions; update the contacts' history."""
    row = grains.row
    first, second = contacts.first, contacts.second
    pair = stack_block().reshape((BLOCK, 8))
    lost = 0.0
    for begin in range(0, first.shape[0], BLOCK):
        end = min(begin + BLOCK, first.shape[0])
        lost += contact_pairs(grains, contacts, begin, end, dt, parameters, pair)
        for c in range(begin, end):
            i, j = np.int64(first[np.uint64(c)]), np.int64(second[np.uint64(c)])
            add_to_first(row, i * COLUMNS + 8, pair, (c - begin) * 8)
            add_to_second(row, j * COLUMNS + 8, pair, (c - begin) * 8)
    spent[FRICTION] += lost


def wall_forces(grains, walls, wall_contacts, parameters):
    """Add the forces of the frictionless walls; sum force and stiffness of each wall."""
    row = grains.row
    for w in range(6):
        walls.force[w] = 0.0
        walls.stiffness[w] = 0.0
    for c in range(wall_contacts.grain.shape[0]):
        i, w = np.uint64(wall_contacts.grain[c]), wall_contacts.wall[c]
        axis = w // 2
        side = 1.0 if w % 2 == 0 else -1.0  # the wall pushes the grain along +axis or -axis
        overlap = row[i, RADIUS] - side * (row[i, POSITION + axis] - walls.position[w])
        if overlap <= 0.0:
            wall_contacts.force[c] = 0.0
            continue
        k_n = law_wall_stiffness(row[i, RADIUS], parameters)
        pressing = k_n * overlap
        wall_contacts.force[c] = pressing
        row[i, FORCE + axis] += side * pressing
        walls.force[w] += pressing
        walls.stiffness[w] += k_n


def solve_3x3(a, b, x):
    """Solve `a x = b` by Cramer's rule, in place; return False where `a` is singular."""
    c0 = a[1, 1] * a[2, 2] - a[1, 2] * a[2, 1]
    c1 = a[1, 2] * a[2, 0] - a[1, 0] * a[2, 2]
    c2 = a[1, 0] * a[2, 1] - a[1, 1] * a[2, 0]
    det = a[0, 0] * c0 + a[0, 1] * c1 + a[0, 2] * c2
    if det == 0.0:
        return False
    x[0] = (
        b[0] * c0 + b[1] * (a[0, 2] * a[2, 1] - a[0, 1] * a[2, 2]) + b[2] * (a[0, 1] * a[1, 2] - a[0, 2] * a[1, 1])
    ) / det
    x[1] = (
        b[0] * c1 + b[1] * (a[0, 0] * a[2, 2] - a[0, 2] * a[2, 0]) + b[2] * (a[0, 2] * a[1, 0] - a[0, 0] * a[1, 2])
    ) / det
    x[2] = (
        b[0] * c2 + b[1] * (a[0, 1] * a[2, 0] - a[0, 0] * a[2, 1]) + b[2] * (a[0, 0] * a[1, 1] - a[0, 1] * a[1, 0])
    ) / det
    return True


def servo_rates(walls, drive, dt, matrix, right, rates):
    """Generalised strain rates that bring the controlled stresses to their targets, without gains.

    Each strain-controlled component keeps its rate. The others follow from the stress error and
    the instantaneous stiffness of the contacts on the walls, `d sigma_i = D_i d eps_i`, and are
    capped. `rates` (3,) receives the principal strain rates.
    """
    cap = drive.rate_cap[0]
    for k in range(3):
        drive.target[k] += dt * drive.target_rate[k]
        right[k] = drive.rate[k]
        for m in range(3):
            matrix[k, m] = 1.0 if k == m else 0.0
    any_stress = False
    for k in range(3):
        if not drive.is_stress[k]:
            continue
        any_stress = True
        error = drive.target[k]
        for m in range(3):
            matrix[k, m] = 0.0
        for axis in range(3):
            other, third = (axis + 1) % 3, (axis + 2) % 3
            length = walls.position[2 * axis + 1] - walls.position[2 * axis]
            area = (walls.position[2 * other + 1] - walls.position[2 * other]) * (
                walls.position[2 * third + 1] - walls.position[2 * third]
            )
            stress = 0.5 * (walls.force[2 * axis] + walls.force[2 * axis + 1]) / area
            stiffness = 0.25 * length * (walls.stiffness[2 * axis] + walls.stiffness[2 * axis + 1]) / area
            if stiffness == 0.0:
                stiffness = 1.0  # nothing touches: close at the capped rate
            error -= drive.conjugate[k, axis] * stress
            for m in range(3):
                matrix[k, m] += drive.conjugate[k, axis] * stiffness * drive.inverse[axis, m]
        right[k] = error / dt
    if any_stress:
        if not solve_3x3(matrix, right, rates):
            for k in range(3):
                rates[k] = 0.0
        for k in range(3):
            if drive.is_stress[k]:
                right[k] = min(max(rates[k], -cap), cap)
    for axis in range(3):
        rates[axis] = (
            drive.inverse[axis, 0] * right[0] + drive.inverse[axis, 1] * right[1] + drive.inverse[axis, 2] * right[2]
        )


def move_walls(walls, drive, dt, reference, reach, spent, scratch):
    """Move the walls as driven, with the first half of their work; whether all stay within `reach`."""
    matrix, right, rates = scratch[:3], scratch[3], scratch[4]
    servo_rates(walls, drive, dt, matrix, right, rates)
    within = True
    for axis in range(3):
        low, high = 2 * axis, 2 * axis + 1
        length = walls.position[high] - walls.position[low]
        inward = -0.5 * length * expm1(-rates[axis] * dt)
        walls.position[low] += inward
        walls.position[high] -= inward
        spent[BOUNDARY] += 0.5 * inward * (walls.force[low] + walls.force[high])
        scratch[5, axis] = inward
        if not (
            abs(walls.position[low] - reference[low]) <= reach and abs(walls.position[high] - reference[high]) <= reach
        ):
            within = False
    return within


def advance(
    n_steps,
    grains,
    contacts,
    walls,
    wall_contacts,
    drive,
    dt,
    damping,
    parameters,
    reference,
    wall_reference,
    reach,
    spent,
    scratch,
):
    """Make up to `n_steps` steps, in place.

    Returns
    -------
    done : int
        Steps made.
    complete : bool
        False when the neighbour list must be rebuilt: grains and walls of the next step have moved
        but its forces are not computed yet (`finish_step` does that after the rebuild).
    """
    n, lost = grains.row.shape[0], np.zeros((grains.row.shape[0] + BLOCK - 1) // BLOCK)
    for step in range(n_steps):
        within = move_grains(grains, 0, n, dt, damping, reference, reach, lost)
        for block in range(lost.shape[0]):
            spent[DAMPING] += lost[block]
        if not move_walls(walls, drive, dt, wall_reference, reach, spent, scratch):
            within = False
        if not within:
            return step, False
        finish_step(grains, contacts, walls, wall_contacts, dt, parameters, spent, scratch)
    return n_steps, True


def finish_step(grains, contacts, walls, wall_contacts, dt, parameters, spent, scratch):
    """Forces at the present positions, and the second half of the boundary work of the step."""
    contact_forces(grains, contacts, dt, parameters, spent)
    wall_forces(grains, walls, wall_contacts, parameters)
    for axis in range(3):
        spent[BOUNDARY] += 0.5 * scratch[5, axis] * (walls.force[2 * axis] + walls.force[2 * axis + 1])


def stiffness_sums(grains, contacts, wall_contacts, parameters, sums):
    """Sum the stiffnesses of each grain's closed contacts, walls included, into `sums` (n,).

    A contact counts with `k_n`, or with `k_t / 0.42` if that is more: the stability of two grains that
    shear against each other depends on `k_t`. A sum is at least one contact with the largest grain.
    """
    row = grains.row
    largest = 0.0
    for i in range(row.shape[0]):
        sums[i] = 0.0
        largest = max(largest, row[i, RADIUS])
    for c in range(contacts.first.shape[0]):
        if contacts.force[c, 0] > 0.0:
            i, j = contacts.first[c], contacts.second[c]
            k_n, k_t = law_stiffness(row[i, RADIUS], row[j, RADIUS], parameters)
            stiffest = max(k_n, k_t / SHEAR_RATIO)
            sums[i] += stiffest
            sums[j] += stiffest
    for c in range(wall_contacts.grain.shape[0]):
        if wall_contacts.force[c] > 0.0:
            i = wall_contacts.grain[c]
            sums[i] += law_wall_stiffness(row[i, RADIUS], parameters)
    for i in range(row.shape[0]):
        k_n, k_t = law_stiffness(row[i, RADIUS], largest, parameters)
        sums[i] = max(sums[i], k_n, k_t / SHEAR_RATIO)


def stored_energy(grains, contacts, wall_contacts, parameters):
    """Elastic energy of all closed contacts, walls included."""
    row = grains.row
    total = 0.0
    for c in range(contacts.first.shape[0]):
        if contacts.force[c, 0] > 0.0:
            k_n, k_t = law_stiffness(row[contacts.first[c], RADIUS], row[contacts.second[c], RADIUS], parameters)
            tangential = sqrt(contacts.force[c, 1] ** 2 + contacts.force[c, 2] ** 2 + contacts.force[c, 3] ** 2)
            total += law_elastic_energy(contacts.force[c, 0], tangential, k_n, k_t)
    for c in range(wall_contacts.grain.shape[0]):
        if wall_contacts.force[c] > 0.0:
            k_n = law_wall_stiffness(row[wall_contacts.grain[c], RADIUS], parameters)
            total += law_elastic_energy(wall_contacts.force[c], 0.0, k_n, k_n)
    return total
