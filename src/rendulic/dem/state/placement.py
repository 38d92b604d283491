"""Where walls and grains may stand when an assembly is made."""

from __future__ import annotations

import numpy as np

from rendulic.dem.kernels.arrays import Contacts, Grains, Walls
from rendulic.foundation.checks import finite_array
from rendulic.foundation.errors import InvalidInput

__all__ = ["make_walls", "refuse_deep_overlaps", "refuse_outside"]


def make_walls(position) -> Walls:
    """Six walls at these coordinates in m, without forces.

    Raises
    ------
    InvalidInput
        Unless there are six, each upper one above its lower one.
    """
    position = finite_array("walls", position, (6,))
    if (position[1::2] <= position[0::2]).any():
        raise InvalidInput(f"each upper wall must lie above its lower wall, got {position.tolist()}")
    return Walls(position, np.zeros(6), np.zeros(6))


def refuse_outside(grains: Grains, walls: Walls) -> None:
    """Grains deeper than half their radius in a wall.

    Raises
    ------
    InvalidInput
        With the worst one.
    """
    position = grains.position
    inside = np.minimum((position - walls.position[0::2]).min(axis=1), (walls.position[1::2] - position).min(axis=1))
    deep = inside < 0.5 * grains.radius
    if deep.any():
        worst = int((inside / grains.radius).argmin())
        raise InvalidInput(
            f"{int(deep.sum())} grains lie outside the walls or deeper than half their radius in one; the worst is "
            f"grain {worst}, centre at {position[worst].tolist()}: check positions, radii and walls"
        )


def refuse_deep_overlaps(grains: Grains, pairs: Contacts) -> None:
    """Pairs that overlap by more than half the smaller radius.

    Raises
    ------
    InvalidInput
        With the worst one.
    """
    if not len(pairs.first):
        return
    gap = np.linalg.norm(grains.position[pairs.second] - grains.position[pairs.first], axis=1)
    r1, r2 = grains.radius[pairs.first], grains.radius[pairs.second]
    depth = (r1 + r2 - gap) / np.minimum(r1, r2)
    worst = int(depth.argmax())
    if depth[worst] > 0.5:
        raise InvalidInput(
            f"{int((depth > 0.5).sum())} pairs overlap by more than half the smaller radius, the worst are grains "
            f"{int(pairs.first[worst])} and {int(pairs.second[worst])} ({depth[worst]:.2f} radii): "
            "check positions and radii"
        )
