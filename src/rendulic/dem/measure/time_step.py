"""The largest stable time step, from the contacts that the grains actually have."""

from __future__ import annotations

import numpy as np

from rendulic.dem.kernels.compiled import kernels_for
from rendulic.dem.state.assembly_state import AssemblyState

__all__ = ["critical_time_step"]


def critical_time_step(assembly: AssemblyState) -> float:
    """Smallest `2 sqrt(m / sum k)` over the grains, in s (theory, section 2).

    The sum runs over the closed contacts of a grain, walls included, and is at least the stiffness of
    one contact with the largest grain: a free grain may be hit before the next look.

    Notes
    -----
    k is `k_n`, or `k_t / 0.42` where that is more. The true limit lies lower, since both ends of a
    contact move and turn: two equal grains that shear against each other are stable below
    `1 / sqrt(7 k_t / k)` of this value, at the worst `LARGEST_FRACTION`, which bounds the fraction in use.
    """
    sums = np.empty(len(assembly))
    kernels_for(assembly.law).stiffness_sums(
        assembly.grains, assembly.contacts, assembly.wall_contacts, assembly.law.parameters, sums
    )
    return float(2.0 * np.sqrt((assembly.grains.mass / sums).min()))
