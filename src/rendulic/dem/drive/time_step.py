"""Choosing the time step, by the user or by the contacts."""

from __future__ import annotations

from math import isfinite

from rendulic.dem.measure.time_step import critical_time_step
from rendulic.dem.state.assembly_state import LARGEST_FRACTION, AssemblyState
from rendulic.foundation.errors import UnstableTimeStep

__all__ = ["renew_time_step", "set_time_step"]


def set_time_step(assembly: AssemblyState, time_step: float | None = None) -> None:
    """Fix the time step in s; without one take the assembly's fraction of the critical one.

    Raises
    ------
    UnstableTimeStep
        If it is not positive, or above `LARGEST_FRACTION` of the critical one.
    """
    critical = critical_time_step(assembly)
    if time_step is None:
        assembly.time_step, assembly.has_fixed_time_step = assembly.time_step_fraction * critical, False
        return
    if not (isfinite(time_step) and 0.0 < time_step <= LARGEST_FRACTION * critical):
        raise UnstableTimeStep(
            f"time step must be positive and at most {LARGEST_FRACTION * critical:.3g} s ({LARGEST_FRACTION} of the "
            f"critical one for the present contacts), got {time_step!r}"
        )
    assembly.time_step, assembly.has_fixed_time_step = float(time_step), True


def renew_time_step(assembly: AssemblyState) -> None:
    """Take the time step that the present contacts allow, or check the one that was fixed."""
    set_time_step(assembly, assembly.time_step if assembly.has_fixed_time_step else None)
