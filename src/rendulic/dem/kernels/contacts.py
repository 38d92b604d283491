"""Forces of the contacts between grains, eight contacts at a time."""

from __future__ import annotations

from math import sqrt

import numpy as np

from rendulic.dem.kernels.arithmetic import dot
from rendulic.dem.kernels.arrays import BLOCK, COLUMNS, FORCE, FRICTION, RADIUS, SPIN, VELOCITY
from rendulic.dem.kernels.contact_law import law_elastic_energy, law_stiffness
from rendulic.dem.kernels.mechanics import pair_force
from rendulic.dem.kernels.packs import PACK, pack_operations
from rendulic.dem.kernels.rows import row_operations
from rendulic.foundation.compiling import kernel

AHEAD = 8  # contacts between fetching a second grain and its use
# rows on the stack of a pack: first grain, second grain (10 each), history before (4) and now (4), what goes to
# the grains (8), what friction took, the force of pairs that opened
SECOND, HELD, NOW, PAIR, SLID, OPENED, STACKED = 10, 20, 24, 28, 36, 37, 38
_rows, _packs = row_operations(PACK, 2, STACKED), pack_operations()
stack_block = row_operations(PACK, 0, BLOCK).stack_rows
stack_rows, fetch, any_unequal = _rows.stack_rows, _rows.fetch, _rows.any_unequal
gather_8, gather_4, gather_2 = _packs.gather_8, _packs.gather_4, _packs.gather_2
scatter_8, scatter_4 = _packs.scatter_8, _packs.scatter_4
stack_places, indexed_places = _packs.stack_places, _packs.indexed_places
add_to_first, add_to_second = _packs.add_to_first, _packs.add_to_second


@kernel
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


@kernel
def energy_let_go(row, held, first, second, c, parameters):
    """Elastic energy of the tangential spring of a contact that opens."""
    k_n, k_t = law_stiffness(row[first[c], RADIUS], row[second[c], RADIUS], parameters)
    tangential = sqrt(held[c, 1] ** 2 + held[c, 2] ** 2 + held[c, 3] ** 2)
    return law_elastic_energy(0.0, tangential, k_n, k_t)


@kernel
def contact_forces(grains, contacts, dt, parameters, spent):
    """Add the grain-grain contact forces at the present positions; update the contacts' history."""
    n = contacts.first.shape[0]
    lost = np.empty((n + BLOCK - 1) // BLOCK)
    forces_on(grains, 0, grains.row.shape[0], contacts, 0, n, dt, parameters, lost)
    spent[FRICTION] += total(lost)


@kernel
def forces_on(grains, first_grain, last_grain, contacts, begin, end, dt, parameters, lost):
    """Add the forces of the contacts `begin` to `end` to those of their grains that lie in a range.

    `begin` is a multiple of `BLOCK`; `lost` receives what friction took, by blocks of contacts: an order of summation
    that no thread changes.
    """
    row, first, second = grains.row, contacts.first, contacts.second
    pair = stack_block().reshape((BLOCK, 8))
    for c in range(begin, end, BLOCK):
        stop = min(c + BLOCK, end)
        lost[c // BLOCK] = contact_pairs(grains, contacts, c, stop, dt, parameters, pair)
        for at in range(c, stop):
            i, j = np.int64(first[np.uint64(at)]), np.int64(second[np.uint64(at)])
            if first_grain <= i < last_grain:
                add_to_first(row, i * COLUMNS + FORCE - 2, pair, (at - c) * 8)
            if first_grain <= j < last_grain:
                add_to_second(row, j * COLUMNS + FORCE - 2, pair, (at - c) * 8)


@kernel
def total(lost):
    """The sum of all blocks, in their order."""
    everything = 0.0
    for block in range(lost.shape[0]):
        everything += lost[block]
    return everything
