"""How fast a strain rate is for the grains: the inertial number `I = rate d sqrt(rho / p)`, d the mean diameter."""

from __future__ import annotations

import numpy as np

from rendulic.dem.state.assembly_state import AssemblyState

__all__ = ["inertial_number", "strain_rate_of"]


def strain_rate_of(assembly: AssemblyState, inertial_number: float, pressure: float) -> float:
    """Strain rate in 1/s at which the inertial number has this value, at this pressure in Pa and with the true masses."""
    diameter = 2.0 * float(assembly.grains.radius.mean())
    return inertial_number / diameter * float(np.sqrt(max(pressure, 1.0) / assembly.density))


def inertial_number(assembly: AssemblyState, strain_before: np.ndarray, duration: float) -> float:
    """Inertial number of the way from principal strains (3,) to the present ones in `duration` seconds.

    It counts the fastest wall, servo-driven ones too, and the masses as they are scaled; infinite
    where walls move and nothing carries pressure.
    """
    rate = float(np.abs(np.diag(assembly.strain) - strain_before).max()) / duration
    if assembly.pressure <= 0.0:
        return float("inf") if rate else 0.0
    radius = assembly.grains.radius
    density = float(assembly.grains.mass.sum() / (4.0 / 3.0 * np.pi * radius**3).sum())
    return rate * 2.0 * float(radius.mean()) * float(np.sqrt(density / assembly.pressure))
