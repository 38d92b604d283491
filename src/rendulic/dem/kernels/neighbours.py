"""Candidate pairs by a hierarchy of grids: grains of like size share a grid, so size ratio is free."""

from __future__ import annotations

import numpy as np

from rendulic.dem.kernels.layout import CONTACT
from rendulic.foundation.compiling import kernel


@kernel
def cell_of(position, low, size, n_cells):
    """Index of the cell of a coordinate, kept inside the grid."""
    return min(max(int((position - low) / size), 0), n_cells - 1)


@kernel
def build_grids(position, level, sizes, low, high):
    """Sort grains into one grid per size level (counting sort).

    Returns cells per axis (levels, 3), where each level's cells start in `start`, the cell starts
    and the grains in cell order.
    """
    n, n_levels = position.shape[0], sizes.shape[0]
    shape = np.empty((n_levels, 3), np.int64)
    base = np.empty(n_levels + 1, np.int64)
    base[0] = 0
    for g in range(n_levels):
        total = 1
        for k in range(3):
            shape[g, k] = max(int((high[k] - low[k]) / sizes[g]), 1)
            total *= shape[g, k]
        base[g + 1] = base[g] + total
    start = np.zeros(base[n_levels] + 1, np.int64)
    cell = np.empty(n, np.int64)
    for i in range(n):
        g = level[i]
        a = cell_of(position[i, 0], low[0], sizes[g], shape[g, 0])
        b = cell_of(position[i, 1], low[1], sizes[g], shape[g, 1])
        c = cell_of(position[i, 2], low[2], sizes[g], shape[g, 2])
        cell[i] = base[g] + (a * shape[g, 1] + b) * shape[g, 2] + c
        start[cell[i] + 1] += 1
    for q in range(start.shape[0] - 1):
        start[q + 1] += start[q]
    fill = start.copy()
    order = np.empty(n, np.int64)
    for i in range(n):
        order[fill[cell[i]]] = i
        fill[cell[i]] += 1
    return shape, base, start, order


@kernel
def candidate_pairs(position, radius, margin, level, sizes, low, high):
    """All pairs closer than `r1 + r2 + margin`, as `first < second`, sorted by both.

    `sizes[level[i]]` must be at least the largest diameter of that level plus `margin`, and grow
    with the level: each grain then looks only at its own and at coarser grids, one cell around.
    """
    n = position.shape[0]
    shape, base, start, order = build_grids(position, level, sizes, low, high)
    found_1 = np.empty(8 * n + 64, np.int32)
    found_2 = np.empty(8 * n + 64, np.int32)
    n_found = 0
    for i in range(n):
        for g in range(level[i], sizes.shape[0]):
            at = np.empty(3, np.int64)
            for k in range(3):
                at[k] = cell_of(position[i, k], low[k], sizes[g], shape[g, k])
            for a in range(max(at[0] - 1, 0), min(at[0] + 2, shape[g, 0])):
                for b in range(max(at[1] - 1, 0), min(at[1] + 2, shape[g, 1])):
                    row = base[g] + (a * shape[g, 1] + b) * shape[g, 2]
                    c_low, c_high = max(at[2] - 1, 0), min(at[2] + 2, shape[g, 2])
                    for q in range(start[row + c_low], start[row + c_high]):
                        j = order[q]
                        if g == level[i] and j <= i:
                            continue
                        reach = radius[i] + radius[j] + margin
                        dx = position[j, 0] - position[i, 0]
                        dy = position[j, 1] - position[i, 1]
                        dz = position[j, 2] - position[i, 2]
                        if dx * dx + dy * dy + dz * dz < reach * reach:
                            if n_found == found_1.shape[0]:
                                found_1 = np.concatenate((found_1, np.empty_like(found_1)))
                                found_2 = np.concatenate((found_2, np.empty_like(found_2)))
                            found_1[n_found] = min(i, j)
                            found_2[n_found] = max(i, j)
                            n_found += 1
    return sorted_pairs(found_1[:n_found], found_2[:n_found], n)


@kernel
def sorted_pairs(first, second, n):
    """Sort pairs by first, then second index: counting sort, then insertion within rows."""
    row = np.zeros(n + 1, np.int64)
    for c in range(first.shape[0]):
        row[first[c] + 1] += 1
    for i in range(n):
        row[i + 1] += row[i]
    fill = row.copy()
    out_1 = np.empty_like(first)
    out_2 = np.empty_like(second)
    for c in range(first.shape[0]):
        i, j = first[c], second[c]
        q = fill[i]
        fill[i] += 1
        while q > row[i] and out_2[q - 1] > j:
            out_2[q] = out_2[q - 1]
            q -= 1
        out_2[q] = j
    for i in range(n):
        for q in range(row[i], row[i + 1]):
            out_1[q] = i
    return out_1, out_2


@kernel
def carry_history(old_first, old_second, old_force, first, second):
    """Forces of the pairs that both lists share (both sorted); zero for the others.

    Also returns the number of closed contacts that found no place in the new list, which is zero
    unless a list has failed.
    """
    force = np.zeros((first.shape[0], old_force.shape[1]))
    c, lost = 0, 0
    for q in range(old_first.shape[0]):
        if old_force[q, CONTACT.force_n] == 0.0:
            continue
        while c < first.shape[0] and (
            first[c] < old_first[q] or (first[c] == old_first[q] and second[c] < old_second[q])
        ):
            c += 1
        if c < first.shape[0] and first[c] == old_first[q] and second[c] == old_second[q]:
            for k in range(old_force.shape[1]):
                force[c, k] = old_force[q, k]
        else:
            lost += 1
    return force, lost


@kernel
def wall_candidates(position, radius, walls, margin):
    """Grains closer than `radius + margin` to a wall: grain and wall index, by wall then grain."""
    n = position.shape[0]
    grain = np.empty(6 * n, np.int32)
    wall = np.empty(6 * n, np.int32)
    found = 0
    for w in range(6):
        side = 1.0 if w % 2 == 0 else -1.0
        for i in range(n):
            if side * (position[i, w // 2] - walls[w]) < radius[i] + margin:
                grain[found] = i
                wall[found] = w
                found += 1
    return grain[:found].copy(), wall[:found].copy()
