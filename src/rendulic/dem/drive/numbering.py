"""Grains renumbered, so that neighbours in space are near in memory."""

from __future__ import annotations

import numpy as np

from rendulic.dem.drive.stepping import compute_forces, rebuild
from rendulic.dem.kernels.arrays import Contacts, Grains, aligned_rows
from rendulic.dem.kernels.layout import CONTACT
from rendulic.dem.state.assembly_state import AssemblyState
from rendulic.dem.state.grains import morton_order

__all__ = ["sort_grains"]


def sort_grains(assembly: AssemblyState) -> None:
    """Renumber the grains along a space-filling curve, in place; the mechanics does not change."""
    grains, contacts, walls = assembly.grains, assembly.contacts, assembly.walls
    order = morton_order(grains.position, walls.position[0::2], walls.position[1::2])
    place = np.empty(len(assembly), np.int32)
    place[order] = np.arange(len(assembly))
    assembly.grains = Grains(aligned_rows(grains.row[order]), grains.mass[order], grains.inertia[order])
    first, second = place[contacts.first], place[contacts.second]
    swapped = first > second
    force = contacts.force.copy()
    force[swapped, CONTACT.force_t :] *= -1.0
    first, second = np.where(swapped, second, first), np.where(swapped, first, second)
    by_pair = np.lexsort((second, first))
    assembly.contacts = Contacts(first[by_pair], second[by_pair], np.ascontiguousarray(force[by_pair]))
    rebuild(assembly)
    compute_forces(assembly)
