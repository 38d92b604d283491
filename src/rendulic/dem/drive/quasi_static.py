"""How fast an assembly may be loaded and still count as quasi-static."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

import numpy as np

from rendulic.dem.drive.stepping import advance
from rendulic.dem.kernels.arrays import Drive
from rendulic.dem.measure.equilibrium import KINETIC_TOLERANCE, TOLERANCE
from rendulic.dem.state.assembly_state import AssemblyState
from rendulic.foundation.errors import InvalidInput

__all__ = ["STEPS_PER_LOOK", "QuasiStatic", "advance_and_measure", "strain_rate_of"]

STEPS_PER_LOOK = 100  # between two looks at the unbalanced force


@dataclass(frozen=True)
class QuasiStatic:
    """How fast a path may be followed.

    Parameters
    ----------
    inertial_number : float
        Of the fastest loading; the strain rate follows as `I sqrt(p / rho) / d`, d the mean diameter.
    unbalanced_limit : float
        Loading slows down, by at most `slowest`, while the unbalanced force exceeds this.
    slowest : float
        Smallest fraction of the rate that adaptation may choose.
    damping : float
        Cundall's coefficient while loading.
    mass_scaling : float
        Grains smaller than this many mean radii move with the inertia of a grain of that radius (see
        `grains.sphere_masses`); 0 keeps the true masses. The true masses return at the end.
    tolerance, kinetic_tolerance : float
        Equilibrium criterion of a state at which a path stops.
    max_rest_steps : int
        Steps that a rest may take.
    """

    inertial_number: float = 2e-5
    unbalanced_limit: float = 5e-3
    slowest: float = 0.05
    damping: float = 0.3
    mass_scaling: float = 1.0
    tolerance: float = TOLERANCE
    kinetic_tolerance: float = KINETIC_TOLERANCE
    max_rest_steps: int = 400_000

    def __post_init__(self) -> None:
        for name in (
            "inertial_number",
            "unbalanced_limit",
            "slowest",
            "tolerance",
            "kinetic_tolerance",
            "max_rest_steps",
        ):
            value = getattr(self, name)
            if not (isfinite(value) and value > 0):
                raise InvalidInput(f"{name} must be a positive number, got {value!r}")
        if not (isfinite(self.mass_scaling) and self.mass_scaling >= 0.0):
            raise InvalidInput(f"mass_scaling must be zero or a positive number, got {self.mass_scaling!r}")
        if not 0.0 <= self.damping < 1.0:
            raise InvalidInput(f"damping must be in [0, 1), got {self.damping!r}")


def strain_rate_of(assembly: AssemblyState, inertial_number: float, pressure: float) -> float:
    """Strain rate in 1/s at which the inertial number `I = rate d sqrt(rho / p)` has this value."""
    diameter = 2.0 * float(assembly.grains.radius.mean())
    return inertial_number / diameter * float(np.sqrt(max(pressure, 1.0) / assembly.density))


def advance_and_measure(assembly: AssemblyState, n_steps: int, drive: Drive, damping: float) -> float:
    """Make steps, in place, and return the inertial number of the strain that the walls really made.

    It counts the fastest wall, servo-driven ones too, and the masses as they are scaled; infinite
    where walls move and nothing carries pressure.
    """
    before = np.diag(assembly.strain)
    advance(assembly, n_steps, drive, damping)
    rate = float(np.abs(np.diag(assembly.strain) - before).max()) / (n_steps * assembly.time_step)
    if assembly.pressure <= 0.0:
        return float("inf") if rate else 0.0
    radius = assembly.grains.radius
    density = float(assembly.grains.mass.sum() / (4.0 / 3.0 * np.pi * radius**3).sum())
    return rate * 2.0 * float(radius.mean()) * float(np.sqrt(density / assembly.pressure))
