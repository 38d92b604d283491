"""Is the assembly at rest? A criterion, a number for it, and an honest verdict."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rendulic.dem.measure.energy import elastic_energy, kinetic_energy
from rendulic.dem.state.assembly_state import AssemblyState
from rendulic.specimen.unbalanced import unbalanced_ratio

__all__ = ["KINETIC_TOLERANCE", "TOLERANCE", "Equilibrium", "assess", "unbalanced_force"]


# loose packings at 1e-4 may still be on their way to collapse; at 1e-6 the null probe drifts by pascals
TOLERANCE, KINETIC_TOLERANCE = 1e-6, 1e-8


@dataclass(frozen=True)
class Equilibrium:
    """How far from rest a state is.

    Parameters
    ----------
    unbalanced_force : float
        Mean resultant on a grain over mean contact force.
    kinetic_ratio : float
        Kinetic energy of translation over elastic energy. Spins are left out: along frictionless walls
        grains can turn on each other like gears for ever, and load nothing.
    tolerance, kinetic_tolerance : float
        What each must not exceed.
    """

    unbalanced_force: float
    kinetic_ratio: float
    tolerance: float = TOLERANCE
    kinetic_tolerance: float = KINETIC_TOLERANCE

    @property
    def reached(self) -> bool:
        """Whether both numbers are within their tolerances."""
        return self.unbalanced_force <= self.tolerance and self.kinetic_ratio <= self.kinetic_tolerance

    def __str__(self) -> str:
        verdict = "at rest" if self.reached else "NOT at rest"
        return (
            f"{verdict}: unbalanced force {self.unbalanced_force:.1e} (limit {self.tolerance:.0e}), "
            f"kinetic/elastic energy {self.kinetic_ratio:.1e} (limit {self.kinetic_tolerance:.0e})"
        )


def unbalanced_force(assembly: AssemblyState) -> float:
    """Mean |resultant on a grain| over mean |contact force|; infinite without contacts."""
    contacts = assembly.contacts
    closed = contacts.force[contacts.force_n > 0]
    walls = assembly.wall_contacts.force
    total = np.sqrt((closed**2).sum(axis=1)).sum() + walls.sum()
    return unbalanced_ratio(assembly.grains.force, total, len(closed) + int((walls > 0).sum()))


def assess(
    assembly: AssemblyState, tolerance: float = TOLERANCE, kinetic_tolerance: float = KINETIC_TOLERANCE
) -> Equilibrium:
    """Return the `Equilibrium` of the present state."""
    stored = elastic_energy(assembly)
    ratio = kinetic_energy(assembly)[0] / stored if stored > 0.0 else float("inf")
    return Equilibrium(unbalanced_force(assembly), ratio, tolerance, kinetic_tolerance)
