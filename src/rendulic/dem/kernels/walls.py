"""The six walls: their forces on grains, and how they are moved."""

from __future__ import annotations

from math import expm1

import numpy as np

from rendulic.dem.kernels.contact_law import law_wall_stiffness
from rendulic.dem.kernels.layout import GRAIN, SERVO, SPENT
from rendulic.foundation.compiling import kernel


@kernel
def press_walls(grains, walls, wall_contacts, begin, end, parameters, stiffness):
    """How grains and frictionless walls press on each other in the wall contacts `begin` to `end`."""
    row = grains.row
    for at in range(begin, end):
        c = np.uint64(at)
        i, w = np.uint64(wall_contacts.grain[c]), np.uint64(wall_contacts.wall[c])
        side = 1.0 if w & np.uint64(1) == 0 else -1.0  # the wall pushes the grain along +axis or -axis
        r = row[i, GRAIN.radius]
        overlap = r - side * (row[i, np.uint64(GRAIN.position) + (w >> np.uint64(1))] - walls.position[w])
        k_n = law_wall_stiffness(r, parameters)
        closed = overlap > 0.0
        wall_contacts.force[c] = k_n * overlap if closed else 0.0
        stiffness[c] = k_n if closed else 0.0


@kernel
def push_from_wall(row, wall_contacts, c):
    """Add the force of a wall to the grain of wall contact `c`."""
    i, w = np.uint64(wall_contacts.grain[c]), np.uint64(wall_contacts.wall[c])
    pressing = wall_contacts.force[c]
    row[i, np.uint64(GRAIN.force) + (w >> np.uint64(1))] += pressing if w & np.uint64(1) == 0 else -pressing


@kernel
def sum_walls(walls, wall_contacts, stiffness):
    """Force and stiffness of each wall."""
    for w in range(6):
        walls.force[w] = 0.0
        walls.stiffness[w] = 0.0
    for c in range(stiffness.shape[0]):
        w = np.uint64(wall_contacts.wall[c])
        walls.force[w] += wall_contacts.force[c]
        walls.stiffness[w] += stiffness[c]


@kernel
def wall_forces(grains, walls, wall_contacts, parameters):
    """Add the forces of the frictionless walls to the grains; sum force and stiffness of each wall."""
    n = wall_contacts.grain.shape[0]
    stiffness = np.empty(n)
    press_walls(grains, walls, wall_contacts, 0, n, parameters, stiffness)
    for c in range(n):
        push_from_wall(grains.row, wall_contacts, np.uint64(c))
    sum_walls(walls, wall_contacts, stiffness)


@kernel
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


@kernel
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


@kernel
def move_walls(walls, drive, dt, reference, reach, spent, room):
    """Move the walls as driven, with the first half of their work; whether all stay within `reach`."""
    matrix, right, rates = room[SERVO.matrix : SERVO.right], room[SERVO.right], room[SERVO.rates]
    servo_rates(walls, drive, dt, matrix, right, rates)
    within = True
    for axis in range(3):
        low, high = 2 * axis, 2 * axis + 1
        length = walls.position[high] - walls.position[low]
        inward = -0.5 * length * expm1(-rates[axis] * dt)
        walls.position[low] += inward
        walls.position[high] -= inward
        spent[SPENT.boundary] += 0.5 * inward * (walls.force[low] + walls.force[high])
        room[SERVO.inward, axis] = inward
        if not (
            abs(walls.position[low] - reference[low]) <= reach and abs(walls.position[high] - reference[high]) <= reach
        ):
            within = False
    return within


@kernel
def add_wall_work(walls, spent, room):
    """The second half of the work of the walls, done by the forces at the new positions."""
    for axis in range(3):
        spent[SPENT.boundary] += 0.5 * room[SERVO.inward, axis] * (walls.force[2 * axis] + walls.force[2 * axis + 1])
