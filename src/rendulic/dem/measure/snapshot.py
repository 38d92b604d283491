"""The present state for analysis."""

from __future__ import annotations

import numpy as np

from rendulic.dem.laws import ContactLaw, LinearFrictional
from rendulic.dem.state.assembly_state import AssemblyState
from rendulic.specimen.recorded import Recorded, Springs
from rendulic.specimen.snapshot import Snapshot

__all__ = ["snapshot_of"]


def snapshot_of(assembly: AssemblyState) -> Snapshot:
    """Positions, walls, closed contacts and their forces, all copied."""
    grains, contacts, at_walls = assembly.grains, assembly.contacts, assembly.wall_contacts
    pair = np.flatnonzero(contacts.force_n > 0)
    first, second = contacts.first[pair], contacts.second[pair]
    normal = grains.position[second] - grains.position[first]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    touching = np.flatnonzero(at_walls.force > 0)
    grain, wall = at_walls.grain[touching], at_walls.wall[touching]
    outward = np.zeros((len(touching), 3))
    outward[np.arange(len(touching)), wall // 2] = np.where(wall % 2 == 0, -1.0, 1.0)
    return Snapshot(
        position=grains.position.copy(),
        radius=grains.radius.copy(),
        wall_position=assembly.walls.position.copy(),
        first=np.concatenate((first, grain)).astype(np.int64),
        second=np.concatenate((second, len(assembly) + wall)).astype(np.int64),
        normal=np.concatenate((normal, outward)),
        force_n=np.concatenate((contacts.force_n[pair], at_walls.force[touching])),
        force_t=np.concatenate((contacts.force_t[pair], np.zeros((len(touching), 3)))),
        friction=assembly.law.friction,
        recorded=Recorded(
            wall_force=assembly.walls.force.copy(),
            grain_force=grains.force.copy(),
            grain_moment=grains.torque.copy(),
            springs=_springs(assembly.law),
            are_spheres=True,
            step=assembly.n_steps,
        ),
    )


def _springs(law: ContactLaw) -> Springs | None:
    """The normal springs of a linear law; None of any other."""
    if not isinstance(law, LinearFrictional):
        return None
    return Springs(law.modulus, law.stiffness_rule, law.modulus)
