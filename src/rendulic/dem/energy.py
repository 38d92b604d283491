"""Where the energy is and where it went; the balance of boundary work."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rendulic.dem.kernels.arrays import BOUNDARY, DAMPING, FRICTION
from rendulic.dem.kernels.compiled import kernels_for

if TYPE_CHECKING:
    from rendulic.dem.assembly import Assembly

__all__ = ["elastic_energy", "energies", "kinetic_energy"]


def kinetic_energy(assembly: Assembly) -> tuple[float, float]:
    """Kinetic energy of translation and of rotation in J, of the last half step."""
    grains = assembly.grains
    return (
        0.5 * float(grains.mass @ (grains.velocity**2).sum(axis=1)),
        0.5 * float(grains.inertia @ (grains.angular_velocity**2).sum(axis=1)),
    )


def elastic_energy(assembly: Assembly) -> float:
    """Energy stored in the contacts, walls included, in J."""
    return kernels_for(assembly.law).stored_energy(
        assembly.grains, assembly.contacts, assembly.wall_contacts, assembly.law.parameters
    )


def energies(assembly: Assembly) -> dict[str, float]:
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
        "friction": float(assembly.spent[FRICTION]),
        "damping": float(assembly.spent[DAMPING]),
        "boundary": float(assembly.spent[BOUNDARY]),
    }
