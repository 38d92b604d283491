"""Forces of the contacts between grains, eight contacts at a time."""

from __future__ import annotations

from math import sqrt

import numpy as np

from rendulic.dem.kernels.arithmetic import dot
from rendulic.dem.kernels.arrays import BLOCK
from rendulic.dem.kernels.contact_law import law_elastic_energy, law_stiffness
from rendulic.dem.kernels.layout import (
    CONTACT,
    CONTACT_STACK,
    GRAIN,
    HALF_GRAIN,
    N_CONTACT,
    N_CONTACT_STACK,
    N_GRAIN,
    N_PAIR,
    PAIR,
    SPENT,
)
from rendulic.dem.kernels.mechanics import pair_force
from rendulic.dem.kernels.packs import PACK, pack_operations
from rendulic.dem.kernels.rows import row_operations
from rendulic.foundation.compiling import kernel

FETCHED = N_GRAIN // PACK  # rows of eight that a grain fills
AHEAD = 8  # contacts between fetching a second grain and its use
RESULTANT = GRAIN.force - PAIR.force  # where, in a grain's row, a contact's force and moment go on top of each other
FIRST, SECOND, HELD, NOW = CONTACT_STACK.first, CONTACT_STACK.second, CONTACT_STACK.held, CONTACT_STACK.now
EXERTED, SLID, OPENED = CONTACT_STACK.pair, CONTACT_STACK.slid, CONTACT_STACK.opened
_rows, _packs = row_operations(PACK, FETCHED, N_CONTACT_STACK), pack_operations()
stack_block = row_operations(N_PAIR, 0, BLOCK).stack_rows
stack_rows, fetch, any_unequal = _rows.stack_rows, _rows.fetch, _rows.any_unequal
gather_8, gather_4, gather_2 = _packs.gather_8, _packs.gather_4, _packs.gather_2
scatter_8, scatter_4 = _packs.scatter_8, _packs.scatter_4
stack_places, indexed_places = _packs.stack_places, _packs.indexed_places
add_to_first, add_to_second = _packs.add_to_first, _packs.add_to_second


@kernel
def contact_pairs(grains, contacts, begin, end, dt, parameters, pair):
    """What the contacts `begin` to `end` exert at the present positions, and their new history, by packs.

    `pair` (at least end - begin, N_PAIR) receives what `mechanics.pair_force` gives of each, see `layout.PAIR`;
    zeros for pairs that do not touch. Returns what friction took.
    """
    row, held = grains.row, contacts.force
    first, second = contacts.first, contacts.second
    stack, one, two, own, to = stack_rows(), stack_places(), stack_places(), stack_places(), stack_places()
    lost = 0.0
    for c in range(begin, end, PACK):
        if c + PACK <= end:
            indexed_places(one, first, c, N_GRAIN)
            indexed_places(two, second, c, N_GRAIN)
            for k in range(PACK):
                own[k], to[k] = (c + k) * N_CONTACT, (c + k - begin) * N_PAIR
        else:
            for k in range(PACK):
                at = min(c + k, end - 1)  # the last one fills up the last pack: it is computed, and stored, again
                one[k], two[k] = np.int64(first[np.uint64(at)]) * N_GRAIN, np.int64(second[np.uint64(at)]) * N_GRAIN
                own[k], to[k] = at * N_CONTACT, (at - begin) * N_PAIR
        if c + AHEAD + PACK <= first.shape[0]:
            for k in range(PACK):
                fetch(row, np.int64(second[np.uint64(c + AHEAD + k)]) * N_GRAIN)
        gather_8(stack, FIRST * PACK, row, one, 0)
        gather_2(stack, (FIRST + HALF_GRAIN) * PACK, row, one, HALF_GRAIN)
        gather_8(stack, SECOND * PACK, row, two, 0)
        gather_2(stack, (SECOND + HALF_GRAIN) * PACK, row, two, HALF_GRAIN)
        gather_4(stack, HELD * PACK, held, own, 0)
        for lane in range(PACK):
            # places of the columns of both grains and of the history, for this contact
            x1, x2 = (FIRST + GRAIN.position) * PACK + lane, (SECOND + GRAIN.position) * PACK + lane
            v1, v2 = (FIRST + GRAIN.velocity) * PACK + lane, (SECOND + GRAIN.velocity) * PACK + lane
            s1, s2 = (FIRST + GRAIN.spin) * PACK + lane, (SECOND + GRAIN.spin) * PACK + lane
            t = (HELD + CONTACT.force_t) * PACK + lane
            r1, r2 = stack[(FIRST + GRAIN.radius) * PACK + lane], stack[(SECOND + GRAIN.radius) * PACK + lane]
            apart = (
                stack[x2] - stack[x1], stack[x2 + PACK] - stack[x1 + PACK], stack[x2 + 2 * PACK] - stack[x1 + 2 * PACK]
            )  # fmt: skip
            distance2 = dot(apart, apart)
            reach = r1 + r2
            closed = distance2 < reach * reach
            k_n, k_t = law_stiffness(r1, r2, parameters)
            force_n, force_t, force, moment, a1, a2, slid = pair_force(
                apart,
                distance2,
                r1,
                r2,
                k_n,
                k_t,
                (
                    stack[v2] - stack[v1],
                    stack[v2 + PACK] - stack[v1 + PACK],
                    stack[v2 + 2 * PACK] - stack[v1 + 2 * PACK],
                ),
                (stack[s1], stack[s1 + PACK], stack[s1 + 2 * PACK]),
                (stack[s2], stack[s2 + PACK], stack[s2 + 2 * PACK]),
                (stack[t], stack[t + PACK], stack[t + 2 * PACK]),
                dt,
                parameters,
            )
            stack[(EXERTED + PAIR.arm_1) * PACK + lane] = a1 if closed else 0.0
            stack[(EXERTED + PAIR.arm_2) * PACK + lane] = a2 if closed else 0.0
            f, m = (EXERTED + PAIR.force) * PACK + lane, (EXERTED + PAIR.moment) * PACK + lane
            stack[f] = force[0] if closed else 0.0
            stack[f + PACK] = force[1] if closed else 0.0
            stack[f + 2 * PACK] = force[2] if closed else 0.0
            stack[m] = moment[0] if closed else 0.0
            stack[m + PACK] = moment[1] if closed else 0.0
            stack[m + 2 * PACK] = moment[2] if closed else 0.0
            t = (NOW + CONTACT.force_t) * PACK + lane
            stack[(NOW + CONTACT.force_n) * PACK + lane] = force_n if closed else 0.0
            stack[t] = force_t[0] if closed else 0.0
            stack[t + PACK] = force_t[1] if closed else 0.0
            stack[t + 2 * PACK] = force_t[2] if closed else 0.0
            stack[SLID * PACK + lane] = slid if closed else 0.0
            stack[OPENED * PACK + lane] = 0.0 if closed else stack[(HELD + CONTACT.force_n) * PACK + lane]
        if any_unequal(stack, OPENED * PACK, 0.0):
            for lane in range(min(PACK, end - c)):
                if stack[OPENED * PACK + lane] != 0.0:
                    lost += energy_let_go(row, held, first, second, c + lane, parameters)
        scatter_8(pair, to, stack, EXERTED * PACK, 0)
        scatter_4(held, own, stack, NOW * PACK, 0)
        if any_unequal(stack, SLID * PACK, 0.0):
            for lane in range(min(PACK, end - c)):
                lost += stack[SLID * PACK + lane]
    return lost


@kernel
def energy_let_go(row, held, first, second, c, parameters):
    """Elastic energy of the tangential spring of a contact that opens."""
    k_n, k_t = law_stiffness(row[first[c], GRAIN.radius], row[second[c], GRAIN.radius], parameters)
    return law_elastic_energy(0.0, tangential_force(held, c), k_n, k_t)


@kernel
def tangential_force(held, c):
    """Size of the tangential force of a contact."""
    t = CONTACT.force_t
    return sqrt(held[c, t] ** 2 + held[c, t + 1] ** 2 + held[c, t + 2] ** 2)


@kernel
def contact_forces(grains, contacts, dt, parameters, spent):
    """Add the grain-grain contact forces at the present positions; update the contacts' history."""
    n = contacts.first.shape[0]
    lost = np.empty((n + BLOCK - 1) // BLOCK)
    forces_on(grains, 0, grains.row.shape[0], contacts, 0, n, dt, parameters, lost)
    spent[SPENT.friction] += total(lost)


@kernel
def forces_on(grains, first_grain, last_grain, contacts, begin, end, dt, parameters, lost):
    """Add the forces of the contacts `begin` to `end` to those of their grains that lie in a range.

    `begin` is a multiple of `BLOCK`; `lost` receives what friction took, by blocks of contacts: an order of summation
    that no thread changes.
    """
    row, first, second = grains.row, contacts.first, contacts.second
    pair = stack_block().reshape((BLOCK, N_PAIR))
    for c in range(begin, end, BLOCK):
        stop = min(c + BLOCK, end)
        lost[c // BLOCK] = contact_pairs(grains, contacts, c, stop, dt, parameters, pair)
        for at in range(c, stop):
            i, j = np.int64(first[np.uint64(at)]), np.int64(second[np.uint64(at)])
            if first_grain <= i < last_grain:
                add_to_first(row, i * N_GRAIN + RESULTANT, pair, (at - c) * N_PAIR)
            if first_grain <= j < last_grain:
                add_to_second(row, j * N_GRAIN + RESULTANT, pair, (at - c) * N_PAIR)


@kernel
def total(lost):
    """The sum of all blocks, in their order."""
    everything = 0.0
    for block in range(lost.shape[0]):
        everything += lost[block]
    return everything
