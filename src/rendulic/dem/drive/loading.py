"""Loading an assembly along a path, quasi-statically or saying that it is not."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import ceil
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from rendulic.dem.drive.masses import scaled_inertia
from rendulic.dem.drive.quasi_static import STEPS_PER_LOOK, QuasiStatic, advance_and_measure
from rendulic.dem.drive.rest import bring_to_rest
from rendulic.dem.drive.servo import drive_for, hold
from rendulic.dem.drive.settling import Watch, looks, settled_copy
from rendulic.dem.drive.stepping import advance
from rendulic.dem.drive.time_step import renew_time_step
from rendulic.dem.measure.equilibrium import unbalanced_force
from rendulic.dem.measure.inertial_number import strain_rate_of
from rendulic.dem.state.assembly_state import AssemblyState, copy_of
from rendulic.foundation.checks import finite_array, increasing_fractions, positive_number, whole_number
from rendulic.foundation.errors import one_of
from rendulic.foundation.progress import Progress
from rendulic.loading.paths import Path
from rendulic.specimen.curve import CurveRecorder
from rendulic.specimen.way import Way

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["load", "probe", "probe_alone"]

AnyAssembly = TypeVar("AnyAssembly", bound=AssemblyState)
Reading = TypeVar("Reading")

ETA_TOLERANCE = 0.005  # of a stress ratio at rest
LEAST_PEAK = 0.05  # change of q, in mean stresses, below which there is no peak to speak of
LOOKS_BELOW_PEAK = 5  # looks for which a loss of q must last


def load(
    assembly: AnyAssembly,
    path: Path,
    speed: QuasiStatic | None,
    progress: Progress,
    on_record: Callable[[AnyAssembly], None] | None,
) -> xr.Dataset:
    """Follow a path, in place; options, result and errors are those of `Assembly.load`.

    1. The rate starts at the one of `speed.inertial_number`.
    2. Every hundred steps it is halved while the unbalanced force exceeds the limit, and recovers
       by a tenth otherwise.
    3. A stress ratio counts as reached only if it stands when the test is paused there (controlled
       strains fixed, controlled stresses kept) until at rest. A loose packing is carried above its
       curve on spikes: what is left of them relaxes in the pause, and loading goes on from rest.
       While approaching the target, loading is four times slower.
    """
    speed = speed or QuasiStatic()
    recorder = CurveRecorder(path.name)
    if not path.is_driven:
        rest = bring_to_rest(assembly, path, speed, progress=progress)
        recorder.add(
            assembly,
            inertial_number=rest.largest_inertial_number,
            unbalanced_force=rest.equilibrium.unbalanced_force,
        )
        return recorder.dataset(stopped_by="target")

    with scaled_inertia(assembly, speed.mass_scaling):
        stopped_by = _drive_along(assembly, path, speed, recorder, progress, on_record)
    return recorder.dataset(stopped_by=stopped_by)


def _drive_along(
    assembly: AnyAssembly,
    path: Path,
    speed: QuasiStatic,
    recorder: CurveRecorder,
    progress: Progress,
    on_record: Callable[[AnyAssembly], None] | None,
) -> str:
    """Follow a driven path to its end and return what stopped it."""
    until, target = path.until, path.until.eta
    relative = np.where(path.control.is_stress, 0.0, path.strain_rate)
    driven = np.abs(np.linalg.inv(np.asarray(path.control.strain_basis)) @ relative)
    fastest, axis = driven.max(), 0 if driven[0] > 0.0 else int(driven.argmax())
    full_rate = strain_rate_of(assembly, speed.inertial_number, assembly.pressure)
    drive = drive_for(assembly, path.control, path.stress, np.zeros(3), 10 * full_rate)
    start, eta_start, q_start = float(assembly.strain[axis, axis]), assembly.eta, assembly.eta * assembly.pressure
    every = max(1, round(until.strain / 4000 / (full_rate * assembly.time_step * STEPS_PER_LOOK)))
    recorder.add(assembly, inertial_number=0.0, unbalanced_force=unbalanced_force(assembly))
    travelled = 0.0
    factor, looks, fastest_flow, largest_change, below = speed.slowest, 0, 0.0, 0.0, 0

    def missing() -> float:
        """How much of the stress ratio aimed at is still missing."""
        assert target is not None
        return (target - assembly.eta) * (1.0 if target >= eta_start else -1.0)

    def pause() -> bool:
        """Pause the test; whether the stress ratio aimed at stands. What is left of a spike relaxes."""
        bring_to_rest(assembly, path, speed, tuple(drive.target), progress)
        return missing() <= ETA_TOLERANCE

    if target is not None and missing() <= ETA_TOLERANCE and pause():
        return "eta"
    while True:
        near = target is not None and missing() < 0.03 * max(abs(target), 0.3)
        rate = full_rate * factor * (0.25 if near else 1.0) / fastest
        drive.rate[:] = relative * rate
        steps_left = ceil((until.strain - travelled) / (rate * driven[axis] * assembly.time_step))
        n_steps = min(STEPS_PER_LOOK, max(steps_left, 1))
        flow = advance_and_measure(assembly, n_steps, drive, speed.damping)
        looks, fastest_flow = looks + 1, max(fastest_flow, flow)
        unbalanced = unbalanced_force(assembly)
        factor = max(0.5 * factor, speed.slowest) if unbalanced > speed.unbalanced_limit else min(1.1 * factor, 1.0)
        if looks % 5 == 0:
            renew_time_step(assembly)
        if looks % every == 0:
            recorder.add(assembly, inertial_number=fastest_flow, unbalanced_force=unbalanced)
            fastest_flow = 0.0
            if on_record is not None:
                on_record(assembly)
        eta, pressure = assembly.eta, assembly.pressure
        travelled = abs(float(assembly.strain[axis, axis]) - start)
        share = travelled / until.strain
        if target is not None and target != eta_start:
            share = max(share, (eta - eta_start) / (target - eta_start))
        progress(
            min(share, 1.0), 1.0, f"{path.name}: strain {travelled:.4f}, eta {eta:.3f}, unbalanced {unbalanced:.0e}"
        )
        # a peak is a change of q that matters, and whose loss lasts
        change = abs(eta * pressure - q_start)
        largest_change = max(largest_change, change)
        fallen = largest_change > LEAST_PEAK * pressure and change < (1.0 - until.peak_drop) * largest_change
        below = below + 1 if fallen else 0
        if target is not None and missing() <= 0.0:
            if pause():
                stopped_by = "eta"
                break
            factor = speed.slowest
        elif travelled >= until.strain:
            stopped_by = "strain"
            break
        elif until.peak and below >= LOOKS_BELOW_PEAK:
            stopped_by = "peak"
            break
    recorder.add(assembly, inertial_number=fastest_flow, unbalanced_force=unbalanced_force(assembly))
    return stopped_by


def probe(
    assembly: AssemblyState,
    increment,
    n_steps: int,
    kind: str,
    marks: tuple[float, ...],
    on_mark: Callable[[float], None] | None,
    rate_cap: float,
    on_look: Callable[[], None] | None = None,
) -> None:
    """Impose a principal increment (3,) at constant rate, in place; options are those of `Assembly.probe`.

    Strains are imposed by exact kinematics, stresses by the servo. The time step is the present one, fixed, and the damping
    the assembly's own. `on_look` is called every hundred steps, and before each mark.
    """
    one_of(kind, ("strain", "stress"), "kind of probe")
    increment = finite_array("increment", increment, (3,))
    n_steps = whole_number("n_steps", n_steps, 1)
    positive_number("rate_cap", rate_cap, "1/s")
    marks = increasing_fractions("marks", marks)
    rate = increment / (n_steps * assembly.time_step)
    strained = kind == "strain"
    drive = drive_for(assembly, hold(kind), (None,) * 3, rate if strained else np.zeros(3), rate_cap)
    if not strained:
        drive.target_rate[:] = rate
    done = 0
    for mark in marks:
        upto = round(mark * n_steps)
        for n_more in looks(upto - done) if on_look else (upto - done,):
            advance(assembly, n_more, drive)
            if on_look is not None:
                on_look()
        done = upto
        if on_mark is not None:
            on_mark(mark)


def probe_alone(
    assembly: AnyAssembly,
    increment,
    n_steps: int,
    kind: str,
    marks: Sequence[float],
    settling_steps: int,
    read: Callable[[AnyAssembly, Way], Reading],
    rate_cap: float,
) -> list[Reading]:
    """Impose a principal increment (3,) on a copy, and read it at each mark, with walls held until it is at rest."""
    one = copy_of(assembly)
    watch = Watch(assembly)
    readings: list[Reading] = []

    def on_mark(share: float) -> None:
        settled, held = settled_copy(one, settling_steps)
        readings.append(read(settled, watch.way(settled, held, round(share * n_steps))))

    probe(
        one, increment, n_steps, kind, tuple(marks), on_mark, rate_cap,
        on_look=lambda: watch.look(one),
    )  # fmt: skip
    return readings
