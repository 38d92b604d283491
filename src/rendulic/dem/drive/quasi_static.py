"""How fast an assembly may be loaded and still count as quasi-static."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

import numpy as np

from rendulic.dem.drive.stepping import advance
from rendulic.dem.kernels.arrays import Drive
from rendulic.dem.measure.equilibrium import KINETIC_TOLERANCE, TOLERANCE
from rendulic.dem.measure.inertial_number import inertial_number
from rendulic.dem.state.assembly_state import AssemblyState
from rendulic.foundation.errors import InvalidInput

__all__ = ["STEPS_PER_LOOK", "QuasiStatic", "advance_and_measure"]

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


def advance_and_measure(assembly: AssemblyState, n_steps: int, drive: Drive, damping: float) -> float:
    """Make steps, in place, and return the inertial number of the strain that the walls really made."""
    before = np.diag(assembly.strain)
    advance(assembly, n_steps, drive, damping)
    return inertial_number(assembly, before, n_steps * assembly.time_step)
