"""Motions that no resistance would ever stop."""

from __future__ import annotations

import numpy as np

from rendulic.dem.kernels.layout import SPENT
from rendulic.dem.measure.energy import kinetic_energy
from rendulic.dem.state.assembly_state import AssemblyState

__all__ = ["stop_rattlers", "stop_spins"]


def stop_rattlers(assembly: AssemblyState) -> None:
    """Stop the grains with fewer than two contacts, in place.

    Damping acts on forces, so a grain in free flight would never come to rest. The kinetic
    energy taken is counted as damping.
    """
    contacts, at_walls = assembly.contacts, assembly.wall_contacts
    closed = contacts.force_n > 0
    touching = (contacts.first[closed], contacts.second[closed], at_walls.grain[at_walls.force > 0])
    free = np.bincount(np.concatenate(touching), minlength=len(assembly)) < 2
    before = sum(kinetic_energy(assembly))
    assembly.grains.velocity[free] = 0.0
    assembly.grains.angular_velocity[free] = 0.0
    assembly.spent[SPENT.damping] += before - sum(kinetic_energy(assembly))


def stop_spins(assembly: AssemblyState) -> None:
    """Stop all rotation, in place; the kinetic energy taken is counted as damping.

    Grains that turn on each other like gears along a frictionless wall meet no resistance.
    """
    assembly.spent[SPENT.damping] += kinetic_energy(assembly)[1]
    assembly.grains.angular_velocity[:] = 0.0
