"""The largest stable time step, from the contacts that the grains actually have."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from rendulic.dem.assembly import Assembly

__all__ = ["critical_time_step"]


def critical_time_step(assembly: Assembly) -> float:
    """Smallest `2 sqrt(m / sum k_n)` over the grains, in s (theory, section 2).

    The sum runs over the closed contacts of a grain, walls included, and is at least the stiffness of
    one contact with the largest grain: a free grain may be hit before the next look.

    Notes
    -----
    The true limit lies lower, since both ends of a contact move and turn: two equal grains that
    shear against each other are stable below 0.58 of this value, which bounds the fraction in use.
    """
    grains, pairs, walls = assembly.grains, assembly.contacts, assembly.wall_contacts
    parameters = assembly.law.parameters
    stiffness = np.zeros(len(grains.radius))
    closed = pairs.force[:, 0] > 0
    first, second = pairs.first[closed], pairs.second[closed]
    k_n, _ = assembly.law.stiffness(grains.radius[first], grains.radius[second], parameters)
    np.add.at(stiffness, first, k_n)
    np.add.at(stiffness, second, k_n)
    touching = walls.force > 0
    grain = walls.grain[touching]
    np.add.at(stiffness, grain, assembly.law.wall_stiffness(grains.radius[grain], parameters))
    # a grain that is free now may be hit any time: one contact with the largest grain is the least
    hit, _ = assembly.law.stiffness(grains.radius, grains.radius.max(), parameters)
    stiffness = np.maximum(stiffness, hit)
    return float(2.0 * np.sqrt((grains.mass / stiffness).min()))
