"""Loading an assembly along a path, quasi-statically or saying that it is not."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from rendulic.checks import finite_array, positive_number, whole_number
from rendulic.curve import CurveRecorder
from rendulic.dem.equilibrium import unbalanced_force
from rendulic.dem.quasi_static import (
    STEPS_PER_LOOK,
    QuasiStatic,
    inertial_number_of,
    scaled_inertia,
    strain_rate_of,
)
from rendulic.dem.rest import bring_to_rest
from rendulic.dem.servo import drive_for, hold
from rendulic.errors import InvalidInput, one_of
from rendulic.loading.paths import Path
from rendulic.progress import Progress, silent

if TYPE_CHECKING:
    from rendulic.dem.assembly import Assembly

__all__ = ["load", "probe"]

ETA_TOLERANCE = 0.005  # of a stress ratio at rest


def load(
    assembly: Assembly,
    path: Path,
    *,
    speed: QuasiStatic | None = None,
    progress: Progress = silent,
    on_record: Callable[[Assembly], None] | None = None,
):
    """Follow a path, adapting the rate to the unbalanced force, in place.

    1. The rate starts at the one of `speed.inertial_number`.
    2. Every hundred steps it is halved while the unbalanced force exceeds the limit, and recovers
       by a tenth otherwise.
    3. A stress ratio counts as reached only if it stands when the test is paused there (controlled
       strains fixed, controlled stresses kept) until at rest. A loose packing is carried above its
       curve on spikes: what is left of them relaxes in the pause, and loading goes on from rest.
       While approaching the target, loading is four times slower.

    Returns
    -------
    xarray.Dataset
        The curve (see `rendulic.curve`), with the verdict in `attrs`: `stopped_by`
        ("strain", "eta", "peak", "target"), `is_quasi_static`, `largest_inertial_number`.

    Raises
    ------
    NotEquilibrated
        If a path without a driven strain does not come to rest at its stresses.
    UnstableTimeStep
        If the motion diverges.
    """
    speed = speed or QuasiStatic()
    recorder = CurveRecorder(path.name)
    if not path.is_driven:
        rest = bring_to_rest(assembly, "stress", speed, path.stress, progress)
        recorder.add(assembly, inertial_number=0.0, unbalanced_force=rest.equilibrium.unbalanced_force)
        return recorder.dataset(stopped_by="target")

    with scaled_inertia(assembly, speed):
        stopped_by = _drive_along(assembly, path, speed, recorder, progress, on_record)
    return recorder.dataset(stopped_by=stopped_by)


def _drive_along(
    assembly: Assembly,
    path: Path,
    speed: QuasiStatic,
    recorder: CurveRecorder,
    progress: Progress,
    on_record: Callable[[Assembly], None] | None,
) -> str:
    """Follow a driven path to its end and return what stopped it."""
    basis_inverse = np.linalg.inv(np.asarray(path.control.strain_basis))
    relative = np.where(path.control.is_stress, 0.0, path.strain_rate)
    fastest = np.abs(basis_inverse @ relative).max()
    start = np.diag(assembly.strain)
    pressure = float(np.trace(assembly.stress)) / 3.0
    full_rate = strain_rate_of(assembly, speed.inertial_number, pressure)
    drive = drive_for(assembly, path.control, path.stress, np.zeros(3), 10 * full_rate)
    factor, q_largest, looks = speed.slowest, -np.inf, 0
    eta_start = assembly.eta
    target = path.until.eta
    rising = target is None or target >= eta_start
    recorder.add(assembly, inertial_number=0.0, unbalanced_force=unbalanced_force(assembly))
    every = max(1, round(path.until.strain / 4000 / (full_rate * assembly.time_step * STEPS_PER_LOOK)))
    stopped_by = ""
    while not stopped_by:
        near = target is not None and abs(target - assembly.eta) < 0.03 * max(abs(target), 0.3)
        rate = full_rate * factor * (0.25 if near else 1.0)
        drive.rate[:] = relative * rate / fastest
        assembly.advance(STEPS_PER_LOOK, drive, speed.damping)
        looks += 1
        unbalanced = unbalanced_force(assembly)
        factor = max(0.5 * factor, speed.slowest) if unbalanced > speed.unbalanced_limit else min(1.1 * factor, 1.0)
        if looks % 5 == 0:
            assembly.set_time_step()
        stress = np.diag(assembly.stress)
        pressure, eta = float(stress.mean()), assembly.eta
        q = eta * pressure
        q_largest = max(q_largest, q)
        travelled = float(np.abs(np.diag(assembly.strain) - start).max())
        if looks % every == 0:
            recorder.add(
                assembly,
                inertial_number=inertial_number_of(assembly, rate, pressure),
                unbalanced_force=unbalanced,
            )
            if on_record is not None:
                on_record(assembly)
        share = travelled / path.until.strain
        if target is not None and target != eta_start:
            share = max(share, (eta - eta_start) / (target - eta_start))
        progress(
            min(share, 1.0),
            1.0,
            f"{path.name}: strain {travelled:.4f}, eta {eta:.3f}, unbalanced {unbalanced:.0e}",
        )
        if target is not None and (eta >= target if rising else eta <= target):
            # pause the test; what is left of a spike relaxes, and loading goes on from rest
            bring_to_rest(assembly, path, speed, progress=progress, strict=False)
            missing = target - assembly.eta if rising else assembly.eta - target
            if missing <= ETA_TOLERANCE:
                stopped_by = "eta"
            factor = speed.slowest
        elif travelled >= path.until.strain:
            stopped_by = "strain"
        elif path.until.peak and q < (1.0 - path.until.peak_drop) * q_largest:
            stopped_by = "peak"
    recorder.add(assembly, inertial_number=0.0, unbalanced_force=unbalanced_force(assembly))
    return stopped_by


def probe(
    assembly: Assembly,
    increment,
    n_steps: int,
    kind: str = "strain",
    marks: tuple[float, ...] = (1.0,),
    on_mark: Callable[[float], None] | None = None,
    rate_cap: float = 0.1,
) -> None:
    """Impose a principal increment (3,) at constant rate over `n_steps` steps, in place.

    Parameters
    ----------
    increment : (3,) array
        Strains, or stresses in Pa.
    kind : {"strain", "stress"}
        Strains are imposed by exact kinematics; stresses by the servo.
    marks : tuple of float
        Increasing fractions of the increment at which `on_mark(fraction)` is called; ends with 1.
    rate_cap : float
        Largest strain rate of the servo in 1/s. Where the state cannot carry the stress, the walls
        run at it, and the stress reached is the result, not the one asked for.

    Notes
    -----
    The time step is the present one, fixed, and the damping the assembly's own.
    """
    one_of(kind, ("strain", "stress"), "kind of probe")
    increment = finite_array("increment", increment, (3,))
    n_steps = whole_number("n_steps", n_steps, 1)
    positive_number("rate_cap", rate_cap, "1/s")
    if not marks or marks[-1] != 1.0 or marks[0] <= 0.0 or list(marks) != sorted(set(marks)):
        raise InvalidInput(f"marks must be increasing fractions of the increment that end with 1, got {marks!r}")
    rate = increment / (n_steps * assembly.time_step)
    strained = kind == "strain"
    drive = drive_for(assembly, hold(kind), (None,) * 3, rate if strained else np.zeros(3), rate_cap)
    if not strained:
        drive.target_rate[:] = rate
    done = 0
    for mark in marks:
        upto = round(mark * n_steps)
        assembly.advance(upto - done, drive)
        done = upto
        if on_mark is not None:
            on_mark(mark)
