"""Loading an assembly along a path, quasi-statically or saying that it is not."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from rendulic.curve import CurveRecorder
from rendulic.dem.equilibrium import Equilibrium, assess, unbalanced_force
from rendulic.dem.grains import finite_array
from rendulic.dem.kernels.arrays import Drive
from rendulic.errors import InvalidInput, NotEquilibrated, one_of
from rendulic.loading.control import Control
from rendulic.loading.paths import Path
from rendulic.progress import Progress, silent

if TYPE_CHECKING:
    from rendulic.dem.assembly import Assembly

__all__ = ["QuasiStatic", "Rest", "bring_to_rest", "drive_for", "load", "probe"]

STEPS_PER_LOOK = 100
ETA_TOLERANCE = 0.005  # of a stress ratio at rest


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
    tolerance: float = 1e-6
    kinetic_tolerance: float = 1e-8
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
    """

    held: str
    n_steps: int
    crept: np.ndarray
    relaxed: np.ndarray
    equilibrium: Equilibrium


def strain_rate_of(assembly: Assembly, inertial_number: float, pressure: float) -> float:
    """Strain rate in 1/s at which the inertial number `I = rate d sqrt(rho / p)` has this value."""
    diameter = 2.0 * float(assembly.grains.radius.mean())
    return inertial_number / diameter * float(np.sqrt(max(pressure, 1.0) / assembly.density))


def inertial_number_of(assembly: Assembly, rate: float, pressure: float) -> float:
    """Inertial number of a strain rate; infinite where nothing carries pressure."""
    if pressure <= 0.0:
        return float("inf") if rate else 0.0
    return abs(rate) * 2.0 * float(assembly.grains.radius.mean()) * float(np.sqrt(assembly.density / pressure))


def drive_for(assembly: Assembly, control: Control, stress, rate, cap: float) -> Drive:
    """A drive that holds `stress` (None: the present value) where stress is controlled.

    `rate` (3,) are the strain rates of the strain-controlled components in 1/s; `cap` bounds the
    strain rate of the servo.
    """
    basis = np.asarray(control.strain_basis, dtype=float)
    conjugate = control.stress_basis
    present = conjugate @ np.diag(assembly.stress)
    target = np.array([now if want is None else want for want, now in zip(stress, present, strict=True)], dtype=float)
    return Drive(
        inverse=np.linalg.inv(basis),
        conjugate=conjugate,
        is_stress=control.is_stress,
        rate=np.where(control.is_stress, 0.0, np.asarray(rate, dtype=float)),
        target=target,
        target_rate=np.zeros(3),
        rate_cap=np.array([cap]),
    )


def hold(what: str) -> Control:
    """The control of all three strains or all three stresses."""
    one_of(what, ("strain", "stress"), "quantity to hold")
    return Control(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), (what,) * 3)


@contextmanager
def scaled_inertia(assembly: Assembly, speed: QuasiStatic) -> Iterator[None]:
    """Work with the masses that `speed.mass_scaling` allows and their time step; undone at the end."""
    previous = assembly.inertial_radius
    assembly.scale_masses(max(previous, speed.mass_scaling * float(assembly.grains.radius.mean())))
    assembly.set_time_step()
    try:
        yield
    finally:
        assembly.scale_masses(previous)
        assembly.set_time_step()


def bring_to_rest(
    assembly: Assembly,
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

    Raises
    ------
    NotEquilibrated
        If `speed.max_rest_steps` did not suffice and `strict`.
    """
    speed = speed or QuasiStatic()
    if isinstance(held, Path):
        control, stress, name = held.control, held.stress, f"{held.name}, paused"
    else:
        control, name = hold(held), f"constant {held}"
    before, stress_before = np.diag(assembly.strain), np.diag(assembly.stress)
    pressure = float(stress_before.mean())
    cap = strain_rate_of(assembly, 10 * speed.inertial_number, pressure)
    drive = drive_for(assembly, control, stress, np.zeros(3), cap)
    done = 0
    verdict = assess(assembly, speed.tolerance, speed.kinetic_tolerance)

    def on_target() -> bool:
        error = np.abs(control.stress_basis @ np.diag(assembly.stress) - drive.target)[control.is_stress]
        return bool((error <= 1e-4 * np.abs(drive.target).max()).all())

    calm = 0
    with scaled_inertia(assembly, speed):
        while calm < 3 and done < speed.max_rest_steps:
            assembly.advance(STEPS_PER_LOOK, drive, speed.damping)
            assembly.calm_free_motion()
            done += STEPS_PER_LOOK
            verdict = assess(assembly, speed.tolerance, speed.kinetic_tolerance)
            calm = calm + 1 if verdict.reached and on_target() else 0
            progress(
                done,
                speed.max_rest_steps,
                f"rest, {name}: unbalanced {verdict.unbalanced_force:.1e}, kinetic {verdict.kinetic_ratio:.1e}",
            )
    if calm < 3 and strict:
        raise NotEquilibrated(
            f"no equilibrium ({name}) after {done} steps ({verdict}): allow more steps "
            "(max_rest_steps) or a larger tolerance, or start from a calmer state"
        )
    return Rest(name, done, np.diag(assembly.strain) - before, np.diag(assembly.stress) - stress_before, verdict)


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
        if looks % 20 == 0:
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
