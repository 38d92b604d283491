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
from rendulic.dem.kernels.arrays import FORCE, POSITION, RADIUS, SPIN, TORQUE, VELOCITY
from rendulic.dem.kernels.mechanics import damped, pair_force
from rendulic.dem.laws.linear_frictional import elastic_energy as law_elastic_energy
from rendulic.dem.laws.linear_frictional import mean_diameter_stiffness as law_stiffness
from rendulic.dem.laws.linear_frictional import wall_stiffness as law_wall_stiffness

FRICTION, DAMPING, BOUNDARY = 0, 1, 2  # places in the array of energies spent
SHEAR_RATIO = 0.42  # k_t / k_n up to which normal stiffness decides the time step


def move_grains(grains, dt, damping, reference, reach, spent):
    """Advance velocities and positions by `dt`; clear force and torque.

    Returns whether every grain is still within `reach` of its `reference` position: False, also
    for a position that is not a number, means the neighbour list must be rebuilt before forces.
    """
    row, mass, inertia = grains.row, grains.mass, grains.inertia
    reach2 = reach * reach
    lost = 0.0
    within = True
    for i in range(row.shape[0]):
        impulse, angular_impulse = dt / mass[i], dt / inertia[i]
        moved2 = 0.0
        for k in range(3):
            old, full = row[i, VELOCITY + k], row[i, FORCE + k]
            kept = damped(full, old, 0.5 * impulse, damping)
            new = fma(impulse, kept, old)
            lost += (full - kept) * (old + new)
            row[i, VELOCITY + k] = new
            x = fma(dt, new, row[i, POSITION + k])
            row[i, POSITION + k] = x
            moved2 += (x - reference[i, k]) ** 2
            row[i, FORCE + k] = 0.0
            old, full = row[i, SPIN + k], row[i, TORQUE + k]
            kept = damped(full, old, 0.5 * angular_impulse, damping)
            new = fma(angular_impulse, kept, old)
            lost += (full - kept) * (old + new)
            row[i, SPIN + k] = new
            row[i, TORQUE + k] = 0.0
        if not moved2 <= reach2:
            within = False
    spent[DAMPING] += 0.5 * lost * dt
    return within


def contact_forces(grains, contacts, dt, parameters, spent):
    """Add the grain-grain contact forces at the present positions; update the contacts' history."""
    row = grains.row
    first, second, held = contacts.first, contacts.second, contacts.force
    lost = 0.0
    for c in range(first.shape[0]):
        i, j = np.uint64(first[c]), np.uint64(second[c])  # unsigned: no test for negative indices
        nx = row[j, POSITION] - row[i, POSITION]
        ny = row[j, POSITION + 1] - row[i, POSITION + 1]
        nz = row[j, POSITION + 2] - row[i, POSITION + 2]
        r1, r2 = row[i, RADIUS], row[j, RADIUS]
        reach = r1 + r2
        distance2 = dot(nx, ny, nz, nx, ny, nz)
        if distance2 >= reach * reach:
            if held[c, 0] != 0.0:
                k_n, k_t = law_stiffness(r1, r2, parameters)
                tangential = sqrt(held[c, 1] ** 2 + held[c, 2] ** 2 + held[c, 3] ** 2)
                lost += law_elastic_energy(0.0, tangential, k_n, k_t)
                held[c, 0] = 0.0
                held[c, 1] = 0.0
                held[c, 2] = 0.0
                held[c, 3] = 0.0
            continue
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
            row[j, VELOCITY] - row[i, VELOCITY],
            row[j, VELOCITY + 1] - row[i, VELOCITY + 1],
            row[j, VELOCITY + 2] - row[i, VELOCITY + 2],
            row[i, SPIN],
            row[i, SPIN + 1],
            row[i, SPIN + 2],
            row[j, SPIN],
            row[j, SPIN + 1],
            row[j, SPIN + 2],
            held[c, 1],
            held[c, 2],
            held[c, 3],
            dt,
            parameters,
        )
        lost += slid
        held[c, 0] = fn
        held[c, 1] = tx
        held[c, 2] = ty
        held[c, 3] = tz
        row[i, FORCE] -= fx
        row[i, FORCE + 1] -= fy
        row[i, FORCE + 2] -= fz
        row[j, FORCE] += fx
        row[j, FORCE + 1] += fy
        row[j, FORCE + 2] += fz
        row[i, TORQUE] = fma(-a1, mx, row[i, TORQUE])
        row[i, TORQUE + 1] = fma(-a1, my, row[i, TORQUE + 1])
        row[i, TORQUE + 2] = fma(-a1, mz, row[i, TORQUE + 2])
        row[j, TORQUE] = fma(-a2, mx, row[j, TORQUE])
        row[j, TORQUE + 1] = fma(-a2, my, row[j, TORQUE + 1])
        row[j, TORQUE + 2] = fma(-a2, mz, row[j, TORQUE + 2])
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
    matrix, right, rates = scratch[:3], scratch[3], scratch[4]
    for step in range(n_steps):
        within = move_grains(grains, dt, damping, reference, reach, spent)
        servo_rates(walls, drive, dt, matrix, right, rates)
        for axis in range(3):
            low, high = 2 * axis, 2 * axis + 1
            length = walls.position[high] - walls.position[low]
            inward = -0.5 * length * expm1(-rates[axis] * dt)
            walls.position[low] += inward
            walls.position[high] -= inward
            spent[BOUNDARY] += 0.5 * inward * (walls.force[low] + walls.force[high])
            scratch[5, axis] = inward
            if not (
                abs(walls.position[low] - wall_reference[low]) <= reach
                and abs(walls.position[high] - wall_reference[high]) <= reach
            ):
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
