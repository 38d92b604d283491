"""Grains that grow among each other to an isotropic pressure."""

from __future__ import annotations

from dataclasses import is_dataclass, replace

import numpy as np

from rendulic.dem.drive.masses import scale_radii, scaled_inertia
from rendulic.dem.drive.numbering import sort_grains
from rendulic.dem.drive.quasi_static import STEPS_PER_LOOK, QuasiStatic
from rendulic.dem.drive.rest import bring_to_rest
from rendulic.dem.drive.servo import drive_for, hold
from rendulic.dem.drive.stepping import advance
from rendulic.dem.drive.time_step import renew_time_step
from rendulic.dem.laws import ContactLaw
from rendulic.dem.measure.equilibrium import unbalanced_force
from rendulic.dem.measure.inertial_number import strain_rate_of
from rendulic.dem.state.assembly_state import AssemblyState
from rendulic.foundation.errors import DidNotConverge, InvalidInput
from rendulic.foundation.progress import Progress

__all__ = ["grow_to_rest", "with_friction"]

STEPS_PER_GROWTH = 10


def grow_to_rest(
    assembly: AssemblyState,
    final: float,
    law: ContactLaw,
    pressure: float,
    porosity: float | None,
    speed: QuasiStatic,
    progress: Progress,
) -> None:
    """Steps 2 to 5 of `packing.pack`, in place: radii grow by the factor `final`, `law` is that of the packing at rest."""
    sort_grains(assembly)
    with scaled_inertia(assembly, speed.mass_scaling):
        _grow(assembly, final, pressure, speed, progress)
        if porosity is not None:
            _densify(assembly, porosity, law, pressure, speed, progress)
        assembly.law = law
        sort_grains(assembly)
        renew_time_step(assembly)
        bring_to_rest(assembly, "stress", speed, (pressure,) * 3, progress)
    assembly.strain_origin = assembly.lengths
    assembly.spent[:] = 0.0  # growing radii do work that no wall does: balances start here


def with_friction(law: ContactLaw, friction: float) -> ContactLaw:
    """The same law with another coefficient of friction."""
    if friction == law.friction:
        return law
    if not is_dataclass(law):
        raise InvalidInput(
            f"{type(law).__name__} is not a dataclass, so its friction cannot be changed while packing: leave "
            "growth_friction and porosity out, or make it one"
        )
    return replace(law, friction=friction)


def _grow(assembly: AssemblyState, final: float, pressure: float, speed: QuasiStatic, progress: Progress) -> None:
    """Grow all radii by the factor `final`, walls fixed up to the pressure, then holding it."""
    control = hold("strain")
    walls_fixed = drive_for(assembly, control, (None,) * 3, np.zeros(3), 0.0)
    factor, held = 1.0, False
    drive = walls_fixed
    # radii grow as the loading strains: by the inertial number at the pressure aimed at
    gentle = strain_rate_of(assembly, 5 * speed.inertial_number, pressure)
    rate = 100.0 * gentle
    renew_time_step(assembly)
    while factor < final:
        for _ in range(STEPS_PER_LOOK // STEPS_PER_GROWTH):
            growth = min(np.exp(rate * assembly.time_step * STEPS_PER_GROWTH), final / factor)
            factor *= growth
            scale_radii(assembly, growth)
            advance(assembly, STEPS_PER_GROWTH, drive, speed.damping)
        renew_time_step(assembly)
        carried = float(np.trace(assembly.stress)) / 3.0
        if not held and carried >= pressure:
            held = True
            drive = drive_for(assembly, hold("stress"), (pressure,) * 3, np.zeros(3), 10 * gentle)
        touching = assembly.n_contacts
        crowded = touching > 0.3 * len(assembly) and carried > 1e-3 * pressure
        rate = gentle if crowded else min(100.0 * gentle, rate * 1.05)
        if crowded and unbalanced_force(assembly) > 50 * speed.unbalanced_limit:
            rate = 0.2 * gentle
        progress(factor - 1.0, final - 1.0, f"growth: p {carried / 1e3:.1f} kPa, {touching} contacts")
    stress = np.diag(assembly.stress)
    if stress.mean() < 0.5 * pressure:
        # the cube was too large: close the walls at a gentle rate until the pressure is there
        drive = drive_for(assembly, hold("stress"), (pressure,) * 3, np.zeros(3), gentle)
        for _ in range(4000):
            advance(assembly, STEPS_PER_LOOK, drive, speed.damping)
            carried = float(np.trace(assembly.stress)) / 3.0
            progress(min(carried, pressure), pressure, f"compression: p {carried / 1e3:.1f} kPa")
            if carried >= 0.99 * pressure:
                return
            renew_time_step(assembly)
        raise DidNotConverge(
            f"the packing carries {carried:.4g} Pa of the {pressure:.4g} Pa asked for after all allowed steps: "
            "allow faster preparation (larger inertial_number)"
        )


def _densify(
    assembly: AssemblyState,
    porosity: float,
    law: ContactLaw,
    pressure: float,
    speed: QuasiStatic,
    progress: Progress,
) -> None:
    """Lower friction at constant pressure until the porosity is reached."""
    bring_to_rest(assembly, "stress", speed, (pressure,) * 3, progress, strict=False)
    start = assembly.porosity
    if start < porosity - 1e-3:
        raise DidNotConverge(
            f"growth with friction {assembly.law.friction:g} gives porosity {start:.4f}, denser than the {porosity:g} "
            "asked for: use more friction during growth"
        )
    cap = strain_rate_of(assembly, 10 * speed.inertial_number, pressure)
    while assembly.porosity > porosity + 1e-3:
        assembly.law = with_friction(assembly.law, 0.9 * assembly.law.friction)
        if assembly.law.friction < 1e-3 * max(law.friction, 1e-3):
            raise DidNotConverge(
                f"without friction the packing has porosity {assembly.porosity:.4f} at {pressure:.4g} Pa; "
                f"{porosity:g} is denser than spheres of these sizes pack"
            )
        drive = drive_for(assembly, hold("stress"), (pressure,) * 3, np.zeros(3), cap)
        for look in range(400):
            if look % 10 == 0:
                renew_time_step(assembly)
            advance(assembly, STEPS_PER_LOOK, drive, speed.damping)
            if assembly.porosity <= porosity or unbalanced_force(assembly) < speed.unbalanced_limit:
                break
        progress(start - assembly.porosity, start - porosity, f"densify: porosity {assembly.porosity:.4f}")
