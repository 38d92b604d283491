"""Inertia of small grains scaled up for quasi-static phases, and radii that grow."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from math import isfinite

from rendulic.dem.drive.stepping import compute_forces, rebuild
from rendulic.dem.drive.time_step import renew_time_step
from rendulic.dem.kernels.layout import SPENT
from rendulic.dem.measure.energy import kinetic_energy
from rendulic.dem.state.assembly_state import AssemblyState
from rendulic.dem.state.grains import sphere_masses
from rendulic.foundation.errors import InvalidInput

__all__ = ["scale_masses", "scale_radii", "scaled_inertia"]


def scale_masses(assembly: AssemblyState, inertial_radius: float) -> None:
    """Give grains smaller than `inertial_radius` [m] more mass, in place; 0 restores the true masses.

    See `grains.sphere_masses`. Velocities stay, and the change of kinetic energy is counted as
    damping. The time step stays as it is: call `set_time_step`.
    """
    if not (isfinite(inertial_radius) and inertial_radius >= 0.0):
        raise InvalidInput(f"inertial_radius must be zero or a positive length, got {inertial_radius!r}")
    before = sum(kinetic_energy(assembly))
    assembly.inertial_radius = float(inertial_radius)
    mass, inertia = sphere_masses(assembly.grains.radius.copy(), assembly.density, assembly.inertial_radius)
    assembly.grains.mass[:] = mass
    assembly.grains.inertia[:] = inertia
    assembly.spent[SPENT.damping] += before - sum(kinetic_energy(assembly))


def scale_radii(assembly: AssemblyState, factor: float) -> None:
    """Multiply all radii by `factor`, in place, masses following; forces follow at the next step."""
    grains = assembly.grains
    largest = float(grains.radius.max())
    grains.radius[:] *= factor
    scale_masses(assembly, assembly.inertial_radius)
    assembly.growth_since_build += max(factor - 1.0, 0.0) * largest
    if assembly.growth_since_build >= 0.25 * assembly.margin:
        rebuild(assembly)
        compute_forces(assembly)


@contextmanager
def scaled_inertia(assembly: AssemblyState, mass_scaling: float) -> Iterator[None]:
    """Work with grains below `mass_scaling` mean radii made heavier, and the time step of that; undone at the end.

    A time step fixed by the user stays.
    """
    previous = assembly.inertial_radius
    scale_masses(assembly, max(previous, mass_scaling * float(assembly.grains.radius.mean())))
    renew_time_step(assembly)
    try:
        yield
    finally:
        scale_masses(assembly, previous)
        renew_time_step(assembly)
