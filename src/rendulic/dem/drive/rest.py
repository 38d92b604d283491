"""Bringing an assembly to rest, and what that took."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rendulic.dem.drive.masses import scaled_inertia
from rendulic.dem.drive.quasi_static import STEPS_PER_LOOK, QuasiStatic, advance_and_measure
from rendulic.dem.drive.servo import drive_for, hold
from rendulic.dem.drive.stepping import tighten_list
from rendulic.dem.drive.stopping import stop_rattlers, stop_spins
from rendulic.dem.drive.time_step import renew_time_step
from rendulic.dem.measure.equilibrium import Equilibrium, assess
from rendulic.dem.measure.inertial_number import strain_rate_of
from rendulic.dem.state.assembly_state import AssemblyState
from rendulic.foundation.errors import NotEquilibrated
from rendulic.foundation.progress import Progress, silent
from rendulic.foundation.whole_change import whole_change
from rendulic.loading.paths import Path

__all__ = ["Rest", "bring_to_rest"]


@dataclass(frozen=True)
class Rest:
    """What bringing a state to rest took.

    Parameters
    ----------
    held : str
        What was held.
    n_steps : int
        Steps it took.
    crept : (3,) array
        Principal strains by which the walls moved.
    relaxed : (3,) array
        Change of the principal stresses in Pa.
    equilibrium : Equilibrium
        The verdict at the end.
    largest_inertial_number : float
        Of the walls' motion on the way.
    """

    held: str
    n_steps: int
    crept: np.ndarray
    relaxed: np.ndarray
    equilibrium: Equilibrium
    largest_inertial_number: float


@whole_change
def bring_to_rest(
    assembly: AssemblyState,
    held: str | Path = "strain",
    speed: QuasiStatic | None = None,
    stress=(None, None, None),
    progress: Progress = silent,
    strict: bool = True,
) -> Rest:
    """Hold strains, stresses or a path until the assembly is in equilibrium, in place.

    Parameters
    ----------
    held : {"strain", "stress"} or Path
        Walls fixed; stresses kept by the servo; or a path paused: its strain-controlled components
        fixed, its stress-controlled ones kept. A loose packing held at constant volume may lose
        all its stress, where a paused drained test only relaxes.
    stress : (3,) of float or None
        Values in Pa of the components held in stress; None takes the present ones, or the path's.
    strict : bool
        Raise if rest is not reached; otherwise return the verdict.

    Returns
    -------
    Rest
        What it took, and the verdict.

    Raises
    ------
    NotEquilibrated
        If `speed.max_rest_steps` did not suffice and `strict`.
    """
    speed = speed or QuasiStatic()
    if isinstance(held, Path):
        control, name = held.control, f"{held.name}, paused"
        stress = tuple(own if given is None else given for own, given in zip(held.stress, stress, strict=True))
    else:
        control, name = hold(held), f"constant {held}"
    before, stress_before = np.diag(assembly.strain), np.diag(assembly.stress)
    cap = strain_rate_of(assembly, 10 * speed.inertial_number, assembly.pressure)
    drive = drive_for(assembly, control, stress, np.zeros(3), cap)
    done = 0
    verdict = assess(assembly, speed.tolerance, speed.kinetic_tolerance)

    def on_target() -> bool:
        error = np.abs(control.stress_basis @ np.diag(assembly.stress) - drive.target)[control.is_stress]
        return bool((error <= 1e-4 * np.abs(drive.target).max()).all())

    calm, fastest = 0, 0.0
    with scaled_inertia(assembly, speed.mass_scaling):
        while calm < 3 and done < speed.max_rest_steps:
            fastest = max(fastest, advance_and_measure(assembly, STEPS_PER_LOOK, drive, speed.damping))
            stop_rattlers(assembly)
            done += STEPS_PER_LOOK
            if done % (10 * STEPS_PER_LOOK) == 0:
                renew_time_step(assembly)
            verdict = assess(assembly, speed.tolerance, speed.kinetic_tolerance)
            calm = calm + 1 if verdict.reached and on_target() else 0
            if calm == 1:
                stop_spins(assembly)
            progress(
                done,
                speed.max_rest_steps,
                f"rest, {name}: unbalanced {verdict.unbalanced_force:.1e}, kinetic {verdict.kinetic_ratio:.1e}",
            )
    tighten_list(assembly)
    if calm < 3 and strict:
        raise NotEquilibrated(
            f"no equilibrium ({name}) after {done} steps ({verdict}): allow more steps "
            "(max_rest_steps) or a larger tolerance, or start from a calmer state"
        )
    crept, relaxed = np.diag(assembly.strain) - before, np.diag(assembly.stress) - stress_before
    return Rest(name, done, crept, relaxed, verdict, fastest)
