"""Making a packing: grains grow among each other to an isotropic pressure."""

from __future__ import annotations

from dataclasses import is_dataclass, replace

import numpy as np

from rendulic.dem.assembly import Assembly
from rendulic.dem.drive.quasi_static import STEPS_PER_LOOK, QuasiStatic, scaled_inertia, strain_rate_of
from rendulic.dem.drive.rest import bring_to_rest
from rendulic.dem.drive.servo import drive_for, hold
from rendulic.dem.kernels.insertion import insert_spheres
from rendulic.dem.laws import ContactLaw, LinearFrictional
from rendulic.dem.measure.equilibrium import unbalanced_force
from rendulic.foundation.checks import finite_array, positive_number, whole_number
from rendulic.foundation.errors import DidNotConverge, InvalidInput
from rendulic.foundation.progress import Progress, silent

__all__ = ["check_pressure", "pack"]

LOOSE_FRACTION = 0.25  # solid fraction of the random places from which growth starts
STEPS_PER_GROWTH = 10
SMALLEST_OVERLAP, LARGEST_OVERLAP = 1e-7, 0.02  # of a diameter, for the mean force p d^2 on the mean grain


def pack(
    n_grains: int | None = None,
    radius=(2e-3, 18e-3),
    pressure: float = 200e3,
    *,
    seed: int = 0,
    law: ContactLaw | None = None,
    density: float = 2600.0,
    growth_friction: float | None = None,
    porosity: float | None = None,
    speed: QuasiStatic | None = None,
    probe_damping: float = 0.05,
    progress: Progress = silent,
) -> Assembly:
    """Make a cubical packing at rest under an isotropic pressure (paper, section 4.1).

    1. Grains at random places of a cube, small enough not to touch.
    2. Their radii grow at a bounded rate, friction on, until the walls feel the pressure.
    3. The walls hold the pressure while the radii finish growing to the values drawn.
    4. With `porosity`, friction is lowered at constant pressure until the packing is that dense.
    5. Friction takes its final value; rest at constant stress.

    Parameters
    ----------
    n_grains : int
        Number of grains; may be omitted when `radius` is an array of all radii.
    radius : (smallest, largest) or array
        Bounds of a uniform distribution, or all radii, in m.
    pressure : float
        Isotropic pressure in Pa.
    seed : int
        Of radii and places; the same seed gives the same packing.
    growth_friction : float, optional
        Friction during growth; by default that of the law (a loose packing). Smaller gives denser.
    porosity : float, optional
        Target, at most what growth gives; the packing is densified to within 0.001.
    speed : QuasiStatic, optional
        Damping, rates and equilibrium criterion of the preparation.
    probe_damping : float
        Damping of the returned assembly.

    Raises
    ------
    InvalidInput
        For numbers that make no packing, or a pressure that would press the grains flat.
    DidNotConverge
        If the pressure or the porosity cannot be reached; the message says how far it came.
    """
    law = LinearFrictional() if law is None else law
    speed = speed or QuasiStatic()
    pressure = positive_number("pressure", pressure, "Pa")
    seed = whole_number("seed", seed, 0)
    radii = _draw_radii(n_grains, radius, seed)
    check_pressure(pressure, float(radii.mean()), law)
    if porosity is not None and not 0.2 < porosity < 0.6:
        raise InvalidInput(f"a target porosity must lie between 0.2 and 0.6, got {porosity!r}")
    growth_friction = law.friction if growth_friction is None else growth_friction
    growing = _with_friction(law, growth_friction)

    # a cube in which the pressure builds up just before the radii are final
    expected = 0.40 + 0.03 * min(growth_friction / 0.7, 1.0)
    solid = float((4.0 / 3.0 * np.pi * radii**3).sum())
    length = (solid / (1.0 - expected)) ** (1.0 / 3.0)
    start = (LOOSE_FRACTION * length**3 / solid) ** (1.0 / 3.0)
    position, placed = insert_spheres(radii * start, length, seed, 100_000)
    if placed < len(radii):
        raise DidNotConverge(
            f"only {placed} of {len(radii)} grains found a place: the largest radius ({radii[0]:.3g} m) is too large "
            f"for a cube of {length:.3g} m; use more grains or a narrower range of radii"
        )
    box = np.array([0.0, length] * 3)
    assembly = Assembly(position, radii * start, box, density=density, law=growing, damping=probe_damping)
    assembly.sort_grains()
    with scaled_inertia(assembly, speed):
        _grow(assembly, 1.0 / start, pressure, speed, progress)
        if porosity is not None:
            _densify(assembly, porosity, law, pressure, speed, progress)
        assembly.law = law
        assembly.sort_grains()
        assembly.renew_time_step()
        bring_to_rest(assembly, "stress", speed, (pressure,) * 3, progress)
    assembly.reset_strain()
    assembly.spent[:] = 0.0  # growing radii do work that no wall does: balances start here
    return assembly


def _draw_radii(n_grains: int | None, radius, seed: int) -> np.ndarray:
    """Radii from large to small."""
    values = finite_array("radius", radius, (None,))
    if (values <= 0.0).any():
        raise InvalidInput(f"radii must be positive, got {values.min():.3g} m")
    if n_grains is None:
        if len(values) < 20:
            raise InvalidInput(f"give n_grains, or at least 20 radii; got {len(values)} radii")
        return np.sort(values)[::-1].copy()
    n_grains = whole_number("n_grains", n_grains, 20)
    if len(values) != 2 or values[0] > values[1]:
        raise InvalidInput(f"radius must be (smallest, largest) when n_grains is given, got {values.tolist()}")
    drawn = np.random.default_rng(seed).uniform(values[0], values[1], int(n_grains))
    return np.sort(drawn)[::-1].copy()


def check_pressure(pressure: float, mean: float, law: ContactLaw) -> None:
    """Raise `InvalidInput` for a pressure in Pa that would press grains of this mean radius in m flat, or press nothing.

    Contacts are points in this mechanics.
    """
    stiffness, _ = law.stiffness(mean, mean, law.parameters)
    scale = stiffness / (2.0 * mean)
    if not SMALLEST_OVERLAP * scale <= pressure <= LARGEST_OVERLAP * scale:
        raise InvalidInput(
            f"a pressure of {pressure:.4g} Pa is unreachable with these contacts: mean overlaps must stay between "
            f"{SMALLEST_OVERLAP:g} and {LARGEST_OVERLAP:g} of a diameter, that is {SMALLEST_OVERLAP * scale:.4g} to "
            f"{LARGEST_OVERLAP * scale:.4g} Pa; change the pressure or the stiffness"
        )


def _with_friction(law: ContactLaw, friction: float) -> ContactLaw:
    if friction == law.friction:
        return law
    if not is_dataclass(law):
        raise InvalidInput(
            f"{type(law).__name__} is not a dataclass, so its friction cannot be changed while packing: leave "
            "growth_friction and porosity out, or make it one"
        )
    return replace(law, friction=friction)


def _grow(assembly: Assembly, final: float, pressure: float, speed: QuasiStatic, progress: Progress) -> None:
    """Grow all radii by the factor `final`, walls fixed up to the pressure, then holding it."""
    control = hold("strain")
    walls_fixed = drive_for(assembly, control, (None,) * 3, np.zeros(3), 0.0)
    factor, held = 1.0, False
    drive = walls_fixed
    # radii grow as the loading strains: by the inertial number at the pressure aimed at
    gentle = strain_rate_of(assembly, 5 * speed.inertial_number, pressure)
    rate = 100.0 * gentle
    assembly.renew_time_step()
    while factor < final:
        for _ in range(STEPS_PER_LOOK // STEPS_PER_GROWTH):
            growth = min(np.exp(rate * assembly.time_step * STEPS_PER_GROWTH), final / factor)
            factor *= growth
            assembly.scale_radii(growth)
            assembly.advance(STEPS_PER_GROWTH, drive, speed.damping)
        assembly.renew_time_step()
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
            assembly.advance(STEPS_PER_LOOK, drive, speed.damping)
            carried = float(np.trace(assembly.stress)) / 3.0
            progress(min(carried, pressure), pressure, f"compression: p {carried / 1e3:.1f} kPa")
            if carried >= 0.99 * pressure:
                return
            assembly.renew_time_step()
        raise DidNotConverge(
            f"the packing carries {carried:.4g} Pa of the {pressure:.4g} Pa asked for after all allowed steps: "
            "allow faster preparation (larger inertial_number)"
        )


def _densify(
    assembly: Assembly,
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
        assembly.law = _with_friction(assembly.law, 0.9 * assembly.law.friction)
        if assembly.law.friction < 1e-3 * max(law.friction, 1e-3):
            raise DidNotConverge(
                f"without friction the packing has porosity {assembly.porosity:.4f} at {pressure:.4g} Pa; "
                f"{porosity:g} is denser than spheres of these sizes pack"
            )
        drive = drive_for(assembly, hold("stress"), (pressure,) * 3, np.zeros(3), cap)
        for look in range(400):
            if look % 10 == 0:
                assembly.renew_time_step()
            assembly.advance(STEPS_PER_LOOK, drive, speed.damping)
            if assembly.porosity <= porosity or unbalanced_force(assembly) < speed.unbalanced_limit:
                break
        progress(start - assembly.porosity, start - porosity, f"densify: porosity {assembly.porosity:.4f}")
