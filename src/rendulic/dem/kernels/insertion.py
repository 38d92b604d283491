"""Random places for spheres that do not overlap."""

from __future__ import annotations

import numpy as np

from rendulic.foundation.compiling import kernel


@kernel
def insert_spheres(radius, length, seed, max_tries):
    """Place spheres one by one at random in a cube `[0, length]^3`, none overlapping.

    `radius` must be sorted from large to small. Returns positions and the number placed (smaller
    than asked for when one sphere found no place in `max_tries` tries).
    """
    np.random.seed(seed)
    n = radius.shape[0]
    position = np.empty((n, 3))
    size = 2.0 * radius[0]
    side = max(int(length / size), 1)
    size = length / side
    head = np.full(side**3, -1, np.int64)
    following = np.full(n, -1, np.int64)
    at = np.empty(3)
    for i in range(n):
        placed = False
        for _ in range(max_tries):
            for k in range(3):
                at[k] = radius[i] + (length - 2.0 * radius[i]) * np.random.random()
            free = True
            a, b, c = int(at[0] / size), int(at[1] / size), int(at[2] / size)
            for u in range(max(a - 1, 0), min(a + 2, side)):
                for v in range(max(b - 1, 0), min(b + 2, side)):
                    for w in range(max(c - 1, 0), min(c + 2, side)):
                        j = head[(u * side + v) * side + w]
                        while j >= 0 and free:
                            reach = radius[i] + radius[j]
                            dx = at[0] - position[j, 0]
                            dy = at[1] - position[j, 1]
                            dz = at[2] - position[j, 2]
                            if dx * dx + dy * dy + dz * dz < reach * reach:
                                free = False
                            j = following[j]
            if free:
                placed = True
                break
        if not placed:
            return position, i
        for k in range(3):
            position[i, k] = at[k]
        cell = (min(a, side - 1) * side + min(b, side - 1)) * side + min(c, side - 1)
        following[i] = head[cell]
        head[cell] = i
    return position, n
