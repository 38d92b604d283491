"""What an assembly is at one moment: its arrays and numbers, listed once. Saving and copying follow from the list."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any, TypeVar

import numpy as np

from rendulic.dem.kernels.arrays import Contacts, Grains, Packing, WallContacts, Walls, aligned_rows
from rendulic.dem.laws import ContactLaw
from rendulic.tensors.invariants import mean_stress, stress_ratio

__all__ = ["DAMPING", "DENSITY", "LARGEST_FRACTION", "TIME_STEP_FRACTION", "AssemblyState", "copied", "copy_of"]

AnyAssembly = TypeVar("AnyAssembly", bound="AssemblyState")

# what an assembly has if nothing else is said
DENSITY = 2600.0  # of grains, kg/m3
DAMPING = 0.05  # Cundall's coefficient
TIME_STEP_FRACTION = 0.5  # of the critical time step

LARGEST_FRACTION = 0.58  # of the critical time step; beyond, coupled rotation is unstable


@dataclass(eq=False, repr=False, kw_only=True)
class AssemblyState:
    """Spheres between walls at one moment; `measure/` reads it, `drive/` changes it.

    A saved state holds every field but the law, in this order.

    Parameters
    ----------
    law : ContactLaw
        Saved by its name and numbers.
    grains : Grains
        Positions, radii, velocities, resultants.
    contacts, wall_contacts : Contacts, WallContacts
        Candidate pairs with their forces; open pairs have none.
    walls : Walls
        Positions, forces, stiffnesses.
    list_origin, list_wall_origin : (n, 3), (6,) arrays
        Where grains and walls were when the candidate pairs were found, in m.
    spent : (3,) array
        Energies that friction and damping took, and the work of the walls, in J; `layout.SPENT` has the places.
    strain_origin : (3,) array
        Distances between opposite walls at zero strain, in m.
    density : float
        Of the grains' material, in kg/m3.
    damping : float
        Cundall's coefficient.
    inertial_radius : float
        Smaller grains have more mass, see `grains.sphere_masses`; in m.
    time_step_fraction : float
        Of the critical time step, where the time step is not fixed.
    time_step : float
        In s.
    has_fixed_time_step : bool
        Whether the user has fixed it.
    time : float
        In s.
    n_steps, n_rebuilds : int
        Steps made, and lists of candidate pairs since the first.
    margin : float
        How far apart candidate pairs may be, in m.
    steps_since_build : int
        Since the candidate pairs were found.
    growth_since_build : float
        Of the largest radius since then, in m.
    """

    law: ContactLaw = field(metadata={"saved": False})
    grains: Grains
    contacts: Contacts
    walls: Walls
    wall_contacts: WallContacts
    list_origin: np.ndarray
    list_wall_origin: np.ndarray
    spent: np.ndarray
    strain_origin: np.ndarray
    density: float
    damping: float
    inertial_radius: float = 0.0
    time_step_fraction: float
    time_step: float = 0.0
    has_fixed_time_step: bool = False
    time: float = 0.0
    n_steps: int = 0
    n_rebuilds: int = 0
    margin: float
    steps_since_build: int = 0
    growth_since_build: float = 0.0

    def __len__(self) -> int:
        return len(self.grains.radius)

    def __repr__(self) -> str:
        return (
            f"<{type(self).__name__} of {len(self)} grains, {self.n_contacts} contacts, porosity {self.porosity:.4f}, "
            f"p = {self.stress.trace() / 3e3:.1f} kPa>"
        )

    @property
    def packing(self) -> Packing:
        """Grains, contacts and walls as the kernels take them, not copied."""
        return Packing(self.grains, self.contacts, self.walls, self.wall_contacts)

    @property
    def lengths(self) -> np.ndarray:
        """(3,) distances between opposite walls in m."""
        return self.walls.position[1::2] - self.walls.position[0::2]

    @property
    def volume(self) -> float:
        """Volume between the walls in m3."""
        return float(np.prod(self.lengths))

    @property
    def porosity(self) -> float:
        """Share of the volume that is not grains (overlaps not deducted)."""
        return 1.0 - float((4.0 / 3.0 * np.pi * self.grains.radius**3).sum()) / self.volume

    @property
    def n_contacts(self) -> int:
        """Closed contacts, grain-grain and grain-wall."""
        return int((self.contacts.force_n > 0).sum() + (self.wall_contacts.force > 0).sum())

    @property
    def stress(self) -> np.ndarray:
        """(3, 3) Cauchy stress from the wall forces in Pa, compression positive."""
        lengths = self.lengths
        areas = self.volume / lengths
        return np.diag(0.5 * (self.walls.force[0::2] + self.walls.force[1::2]) / areas)

    @property
    def strain(self) -> np.ndarray:
        """(3, 3) logarithmic strain since the origin, contraction positive."""
        return np.diag(np.log(self.strain_origin / self.lengths))

    @property
    def pressure(self) -> float:
        """Mean stress in Pa."""
        return float(mean_stress(self.stress))

    @property
    def eta(self) -> float:
        """Stress ratio q/p; NaN where nothing carries stress."""
        return float(stress_ratio(self.stress))


def copy_of(assembly: AnyAssembly, **changes: Any) -> AnyAssembly:
    """An independent assembly of the same class and state, but for `changes` of fields."""
    own = object.__new__(type(assembly))
    for name in (item.name for item in fields(AssemblyState)):
        setattr(own, name, changes[name] if name in changes else copied(getattr(assembly, name)))
    return own


def copied(value: Any) -> Any:
    """A copy of an array, or of a group of arrays; numbers and laws never change and are shared."""
    if isinstance(value, Grains):
        return Grains(aligned_rows(value.row), value.mass.copy(), value.inertia.copy())
    if isinstance(value, tuple):
        return type(value)(*(array.copy() for array in value))
    return value.copy() if isinstance(value, np.ndarray) else value
