"""One time step of one assembly on several threads: the step of `kernels/step.py`, to the bit.

Every thread runs the same kernel with a rank of its own. Contacts are computed in one pass, each into a row
of its own, and summed per grain in a second, in the order in which the loop over contacts would have added
them; losses are summed by blocks. So no sum depends on the number of threads.
"""

from __future__ import annotations

import numpy as np

from rendulic.dem.kernels.arrays import BLOCK, BOUNDARY, COLUMNS, DAMPING, FORCE, FRICTION
from rendulic.dem.kernels.barrier import wait_for_all
from rendulic.dem.kernels.contacts import add_to_first, add_to_second, contact_pairs
from rendulic.dem.kernels.step import move_grains
from rendulic.dem.kernels.walls import move_walls, press_walls, push_from_wall, sum_walls


def sum_forces(rank, grains, contacts, wall_contacts, team):
    """Add what contacts and walls exert on the rank's grains, in the order of contacts, then of wall contacts."""
    row, pair = grains.row, team.pair
    first, second = contacts.first, contacts.second
    end = team.grains[rank + 1]
    for at in range(team.crossing_start[rank], team.crossing_start[rank + 1]):
        c = np.int64(team.crossing[at])
        add_to_second(row, np.int64(second[np.uint64(c)]) * COLUMNS + FORCE - 2, pair, c * 8)
    for c in range(team.own[rank], team.own[rank + 1]):
        i, j = np.int64(first[np.uint64(c)]), np.int64(second[np.uint64(c)])
        add_to_first(row, i * COLUMNS + FORCE - 2, pair, c * 8)
        if j < end:
            add_to_second(row, j * COLUMNS + FORCE - 2, pair, c * 8)
    for at in range(team.wall_start[rank], team.wall_start[rank + 1]):
        push_from_wall(row, wall_contacts, np.uint64(team.at_walls[at]))


def finish_team(
    rank, n_ranks, arrivals, grains, contacts, walls, wall_contacts, dt, parameters, spent, scratch, team
):  # fmt: skip
    """`step.finish_step` of a rank; all its arrivals at the barrier so far go in and come out."""
    begin, end = team.computed[rank], team.computed[rank + 1]
    for c in range(begin, end, BLOCK):
        upto = min(c + BLOCK, end)
        team.friction[c // BLOCK] = contact_pairs(grains, contacts, c, upto, dt, parameters, team.pair[c:upto])
    n_walls = wall_contacts.grain.shape[0]
    press_walls(
        grains, walls, wall_contacts, n_walls * rank // n_ranks, n_walls * (rank + 1) // n_ranks, parameters,
        team.wall_stiffness,
    )  # fmt: skip
    arrivals += n_ranks
    wait_for_all(team.arrived, arrivals)
    sum_forces(rank, grains, contacts, wall_contacts, team)
    if rank == 0:
        sum_walls(walls, wall_contacts, team.wall_stiffness)
        lost = 0.0
        for block in range(team.friction.shape[0]):
            lost += team.friction[block]
        spent[FRICTION] += lost
        for axis in range(3):
            spent[BOUNDARY] += 0.5 * scratch[5, axis] * (walls.force[2 * axis] + walls.force[2 * axis + 1])
    return arrivals


def advance_team(
    rank,
    n_ranks,
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
    team,
):
    """`step.advance` of a rank."""
    begin, end = team.grains[rank], team.grains[rank + 1]
    arrivals = 0
    for step in range(n_steps):
        within = move_grains(grains, begin, end, dt, damping, reference, reach, team.damping)
        if rank == 0 and not move_walls(walls, drive, dt, wall_reference, reach, spent, scratch):
            within = False
        team.within[8 * rank] = within
        arrivals += n_ranks
        wait_for_all(team.arrived, arrivals)
        if rank == 0:
            for block in range(team.damping.shape[0]):
                spent[DAMPING] += team.damping[block]
        for other in range(n_ranks):
            if not team.within[8 * other]:
                return step, False
        arrivals = finish_team(
            rank, n_ranks, arrivals, grains, contacts, walls, wall_contacts, dt, parameters, spent, scratch, team
        )
    return n_steps, True
