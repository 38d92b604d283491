"""Where the energy is and where it went; the balance of boundary work."""

from __future__ import annotations

import numpy as np

from rendulic.dem.kernels.compiled import kernels_for
from rendulic.dem.kernels.layout import SPENT
from rendulic.dem.state.assembly_state import AssemblyState

__all__ = ["damping_forces", "elastic_energy", "energies", "kinetic_energy", "whole_step_kinetic_energy"]


def kinetic_energy(assembly: AssemblyState) -> tuple[float, float]:
    """Kinetic energy of translation and of rotation in J, of the last half step."""
    grains = assembly.grains
    return (
        0.5 * float(grains.mass @ (grains.velocity**2).sum(axis=1)),
        0.5 * float(grains.inertia @ (grains.angular_velocity**2).sum(axis=1)),
    )


def damping_forces(assembly: AssemblyState) -> np.ndarray:
    """(n, 3) part of the forces on the grains that damping takes away in the next step, in N."""
    grains = assembly.grains
    half = 0.5 * assembly.time_step / grains.mass[:, None]
    return assembly.damping * np.abs(grains.force) * np.sign(grains.velocity + half * grains.force)


def whole_step_kinetic_energy(assembly: AssemblyState) -> float:
    """Kinetic energy of translation in J at the time of the positions, `m v . v' / 2`.

    `v` and `v'` are the velocities half a step before and after. Defined so, its change over a step is the work
    of the mean of the forces at both ends, to rounding.
    """
    grains = assembly.grains
    kept = grains.force - damping_forces(assembly)
    after = grains.velocity + assembly.time_step / grains.mass[:, None] * kept
    return 0.5 * float(grains.mass @ (grains.velocity * after).sum(axis=1))


def elastic_energy(assembly: AssemblyState) -> float:
    """Energy stored in the contacts, walls included, in J."""
    return kernels_for(assembly.law).stored_energy(
        assembly.grains, assembly.contacts, assembly.wall_contacts, assembly.law.parameters
    )


def energies(assembly: AssemblyState) -> dict[str, float]:
    """Energies in J.

    Returns
    -------
    dict
        `kinetic` and `elastic` are of the present state; `friction`, `damping` and `boundary`
        (work of the walls on the grains) are counted since the assembly was made or packed. Between two
        states `boundary = kinetic + elastic + friction + damping` in differences; what is missing
        is the error of the integration, which shrinks with the time step.
    """
    return {
        "kinetic": sum(kinetic_energy(assembly)),
        "elastic": elastic_energy(assembly),
        "friction": float(assembly.spent[SPENT.friction]),
        "damping": float(assembly.spent[SPENT.damping]),
        "boundary": float(assembly.spent[SPENT.boundary]),
    }
