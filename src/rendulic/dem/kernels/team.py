"""One time step of one assembly on several threads: the step of `kernels/step.py`, to the bit.

Every thread runs the same kernel with a rank of its own, and adds forces to the grains of its rank only, in the
order in which one thread would. A contact between grains of two ranks is computed by both, each with a history of
its own, which the same arithmetic keeps the same; losses are summed by blocks. So no sum depends on
the number of threads.
"""

from __future__ import annotations

from rendulic.dem.kernels.arrays import CACHE_LINE
from rendulic.dem.kernels.barrier import wait_for_all
from rendulic.dem.kernels.contacts import forces_on, total
from rendulic.dem.kernels.layout import SPENT
from rendulic.dem.kernels.step import move_grains
from rendulic.dem.kernels.walls import add_wall_work, move_walls, press_walls, push_from_wall, sum_walls
from rendulic.foundation.compiling import kernel


@kernel
def finish_team(rank, n_ranks, arrivals, packing, stepping, spent, room, team, crossing):
    """`step.finish_step` of a rank; all its arrivals at the barrier so far go in and come out."""
    grains, contacts, walls, wall_contacts = packing.grains, packing.contacts, packing.walls, packing.wall_contacts
    dt, parameters = stepping.dt, stepping.parameters
    begin, end = team.grains[rank], team.grains[rank + 1]
    before, after = crossing[2 * rank], crossing[2 * rank + 1]
    forces_on(grains, begin, end, before, 0, before.first.shape[0], dt, parameters, team.again[rank])
    forces_on(grains, begin, end, contacts, team.contacts[rank], team.contacts[rank + 1], dt, parameters, team.friction)
    forces_on(grains, begin, end, after, 0, after.first.shape[0], dt, parameters, team.again[rank])
    for at in range(team.wall_start[rank], team.wall_start[rank + 1]):
        c = team.at_walls[at]
        press_walls(grains, walls, wall_contacts, c, c + 1, parameters, team.wall_stiffness)
        push_from_wall(grains.row, wall_contacts, c)
    arrivals += n_ranks
    wait_for_all(team.arrived, arrivals)
    if rank == 0:
        sum_walls(walls, wall_contacts, team.wall_stiffness)
        spent[SPENT.friction] += total(team.friction)
        add_wall_work(walls, spent, room)
    return arrivals


@kernel
def advance_team(rank, n_ranks, n_steps, packing, drive, stepping, valid, spent, room, team, crossing):
    """`step.advance` of a rank."""
    grains, walls, dt, damping = packing.grains, packing.walls, stepping.dt, stepping.damping
    begin, end = team.grains[rank], team.grains[rank + 1]
    arrivals = 0
    for step in range(n_steps):
        within = move_grains(grains, begin, end, dt, damping, valid.origin, valid.reach, team.damping)
        if rank == 0 and not move_walls(walls, drive, dt, valid.wall_origin, valid.reach, spent, room):
            within = False
        team.within[CACHE_LINE * rank] = within
        arrivals += n_ranks
        wait_for_all(team.arrived, arrivals)
        if rank == 0:
            for block in range(team.damping.shape[0]):
                spent[SPENT.damping] += team.damping[block]
        for other in range(n_ranks):
            if not team.within[CACHE_LINE * other]:
                return step, False
        arrivals = finish_team(rank, n_ranks, arrivals, packing, stepping, spent, room, team, crossing)
    return n_steps, True
