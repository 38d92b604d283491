"""Disturbing an assembly at rest under a held load, and watching whether it finds an equilibrium again.

Section 4 of the theory: failure is shown, not only predicted.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import TYPE_CHECKING

import numpy as np

from rendulic.dem.drive.held_motion import HeldMotion
from rendulic.dem.drive.quasi_static import STEPS_PER_LOOK
from rendulic.dem.drive.servo import drive_for
from rendulic.dem.drive.settling import SETTLED, SETTLING_DAMPING, looks, stands_still
from rendulic.dem.drive.stepping import advance
from rendulic.dem.drive.time_step import renew_time_step
from rendulic.dem.kernels.arrays import Drive
from rendulic.dem.measure.energy import damping_forces, energies, kinetic_energy, whole_step_kinetic_energy
from rendulic.dem.measure.equilibrium import unbalanced_force
from rendulic.dem.measure.inertial_number import strain_rate_of
from rendulic.dem.measure.snapshot import snapshot_of
from rendulic.dem.state.assembly_state import AssemblyState
from rendulic.foundation.checks import finite_array, positive_number, whole_number
from rendulic.foundation.errors import InvalidInput, one_of
from rendulic.loading.control import Control
from rendulic.loading.rate import SETTLING_STEPS
from rendulic.specimen.curve import CurveRecorder
from rendulic.specimen.window import Window

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Disturbance", "burst", "typical_of"]

FASTEST = 0.05  # inertial number of the fastest motion that the servo follows
PHASES = ("rest", "disturbed", "held")
REST, DISTURBED, HELD = range(3)
TOO_FAST = 1e-3  # largest median of the unbalanced force on the way of a push that is slow enough
COLLAPSE = 0.05  # unbalanced force of grains that have broken loose, whatever the rate
MOVES = 1e-2  # unbalanced force of a specimen that must be looked at more often
HOLD_STEPS = 200_000  # for which the load is held at most
RECORDS_OF_PUSH = 20


@dataclass(frozen=True)
class Disturbance:
    """What is done to a specimen, and how it is watched; see `Assembly.burst`."""

    norm: float
    n_steps: int
    kind: str
    kick: float
    seed: int
    hold_steps: int
    strain_limit: float
    n_records: int

    def __post_init__(self) -> None:
        positive_number("norm", self.norm)
        whole_number("n_steps", self.n_steps, 1)
        one_of(self.kind, ("push", "kick"), "disturbance")
        positive_number("kick", self.kick)
        whole_number("hold_steps", self.hold_steps, 1)
        positive_number("strain_limit", self.strain_limit)
        whole_number("n_records", self.n_records, 2)


def burst(
    assembly: AssemblyState, direction, what: Disturbance, on_window: Callable[[Window], None] | None = None
) -> xr.Dataset:
    """Disturb the assembly under a held load and follow what it does, in place; options are those of `Assembly.burst`.

    1. The strains move along `direction` u only, `d_eps = u e`; the conjugate stress `s = sigma : u` is
       the load. In the Rendulic plane that is the path `d_eps_1 + 2 R d_eps_3 = 0`.
    2. A push moves e to `norm` in `n_steps` steps, as a probe does, waits with the walls held until the grains are at rest, and takes s
       back to what it was in `n_steps` steps. Where the second-order work `ds e` of the push was negative, the load exceeds
       what the specimen carries by then. A kick gives all grains random velocities instead.
    3. The load is held, and the specimen left to itself, until `HeldMotion` has its verdict.
    """
    u = finite_array("direction of a burst", direction, (3,))
    if abs(np.linalg.norm(u) - 1.0) > 1e-9:
        raise InvalidInput(f"the direction of a burst must be a unit vector, got {u.tolist()}")
    if assembly.pressure <= 0.0 or energies(assembly)["elastic"] <= 0.0:
        raise InvalidInput("a burst needs a specimen that carries stress: load it first")
    watch = _Watch(assembly, u, what, on_window)
    if what.kind == "push":
        watch.push()
        watch.take_back()
    else:
        watch.kick()
    watch.hold()
    return watch.curve()


class _Watch:
    """Takes an assembly through the phases of a burst, looks at it at the same steps however it is recorded, and records it."""

    def __init__(self, assembly: AssemblyState, u: np.ndarray, what: Disturbance, on_window) -> None:
        self.assembly, self.u, self.what, self.on_window = assembly, u, what, on_window
        self.recorder = CurveRecorder(f"burst after a {what.kind}")
        self.strain, self.spent, self.begin = np.diag(assembly.strain), energies(assembly), assembly.time
        self.stored, self.pressure = self.spent["elastic"], assembly.pressure
        self.elastic_strain = 2.0 * self.stored / (self.pressure * assembly.volume)
        self.motion = HeldMotion(what.norm, self.elastic_strain, what.strain_limit)
        self.cap = strain_rate_of(assembly, FASTEST, self.pressure)
        self.basis = np.linalg.svd(u[None, :])[2]
        self.basis[0] = u
        self.held = self.drive("stress")
        self.load = float(self.held.target[0])
        self.on_way: list[float] = []  # unbalanced forces seen during the push
        self.injected = self.largest_kinetic = 0.0
        self.w2_of_push = np.nan
        self.steps_held = self.looks = 0
        self.record(REST)

    def drive(self, first: str, rate: float = 0.0) -> Drive:
        """The strain along u, or its conjugate stress, controlled; the others fixed."""
        control = Control.of_strains(self.basis, (first, "strain", "strain"))
        return drive_for(self.assembly, control, (None,) * 3, [rate, 0.0, 0.0], self.cap)

    @property
    def moved(self) -> float:
        """Strain along the direction since rest."""
        return float(self.u @ (np.diag(self.assembly.strain) - self.strain))

    @property
    def stress_along(self) -> float:
        """The stress conjugate to the direction, Pa."""
        return float(self.u @ np.diag(self.assembly.stress))

    def push(self) -> None:
        """The strain to its size, and the walls held until the grains are at rest."""
        n_steps = self.what.n_steps
        forward = self.drive("strain", self.what.norm / (n_steps * self.assembly.time_step))
        every = max(1, n_steps // (RECORDS_OF_PUSH * STEPS_PER_LOOK)) * STEPS_PER_LOOK
        for steps, done in _upto(n_steps):
            self.move(steps, forward, DISTURBED if done % every == 0 or done == n_steps else None)
            self.on_way.append(unbalanced_force(self.assembly))
        self.settle()
        self.w2_of_push = (self.stress_along - self.load) * self.moved

    def settle(self) -> None:
        """The walls held until the grains are at rest, as after a probe."""
        own, self.assembly.damping = self.assembly.damping, SETTLING_DAMPING
        still, steps, due = self.drive("strain"), 0, 0.0
        while not stands_still(self.assembly) and steps < SETTLING_STEPS:
            steps += STEPS_PER_LOOK
            self.move(STEPS_PER_LOOK, still, DISTURBED if steps >= due else None)
            due = due if steps < due else 1.3 * steps
        self.move(1, still, DISTURBED)
        self.assembly.damping = own

    def take_back(self) -> None:
        """The load to what it was; a specimen that runs away is followed no further than to its verdict."""
        n_steps = self.what.n_steps
        back = self.drive("stress")
        back.target_rate[0] = (self.load - back.target[0]) / (n_steps * self.assembly.time_step)
        every = max(1, n_steps // (RECORDS_OF_PUSH * STEPS_PER_LOOK)) * STEPS_PER_LOOK
        for steps, done in _upto(n_steps):
            self.move(steps, back, DISTURBED if done % every == 0 or done == n_steps else None)
            self.look()
            if self.motion.verdict == "fails":
                break

    def kick(self) -> None:
        """Random velocities of all grains."""
        self.injected = _kick(self.assembly, self.what.kick, self.what.seed)
        self.move(1, self.held, DISTURBED)

    def hold(self) -> None:
        """The held load, until the motion has its verdict, or to the limit of steps."""
        grows = max((self.what.hold_steps / STEPS_PER_LOOK) ** (1.0 / self.what.n_records), 1.0)
        due, strain = 0.0, self.moved
        while self.motion.verdict == "undecided" and self.steps_held < self.what.hold_steps:
            restless = unbalanced_force(self.assembly) > MOVES
            steps = STEPS_PER_LOOK // 5 if restless else STEPS_PER_LOOK
            if self.looks % 5 == 0:
                renew_time_step(self.assembly)
            self.steps_held += steps
            is_due = self.steps_held >= due or abs(self.moved - strain) > 0.02 * self.what.strain_limit
            self.move(steps, self.held, HELD if is_due else None)
            if is_due:
                due, strain = grows * self.steps_held, self.moved
            self.look(at_rest=self.is_calm() and abs(self.stress_along - self.load) <= 1e-3 * self.pressure)
        self.move(1, self.held, HELD)

    def is_calm(self) -> bool:
        """Whether the grains are at rest. Rattlers are stopped only near rest, so that no motion is braked by being looked at."""
        return unbalanced_force(self.assembly) <= 10.0 * SETTLED and stands_still(self.assembly)

    def look(self, at_rest: bool = False) -> None:
        """Let the motion be seen."""
        kinetic = sum(kinetic_energy(self.assembly))
        self.looks += 1
        self.largest_kinetic = max(self.largest_kinetic, kinetic)
        self.motion.see(self.assembly.time, self.moved, kinetic, at_rest=at_rest)

    def move(self, n_steps: int, drive: Drive, phase: int | None = None) -> None:
        """Steps; with a phase the last one is recorded, with the window on it."""
        assembly = self.assembly
        if phase is None or self.on_window is None:
            advance(assembly, n_steps, drive)
        else:
            if n_steps > 1:
                advance(assembly, n_steps - 1, drive)
            before, taken = snapshot_of(assembly), damping_forces(assembly)
            kinetic = whole_step_kinetic_energy(assembly)
            advance(assembly, 1, drive)
            after = snapshot_of(assembly)
            damped = 0.5 * float(((after.position - before.position) * (taken + damping_forces(assembly))).sum())
            self.on_window(Window(before, after, whole_step_kinetic_energy(assembly) - kinetic + damped))
        if phase is not None:
            self.record(phase)

    def record(self, phase: int) -> None:
        """Add the present state to the curve, with its energies since rest."""
        now = energies(self.assembly)
        change = {name: now[name] - self.spent[name] for name in now}
        missing = (
            change["boundary"] + self.injected - sum(value for name, value in change.items() if name != "boundary")
        )
        self.recorder.add(
            self.assembly, phase=float(phase), strain_along=self.moved, load=self.stress_along,
            unbalanced_force=unbalanced_force(self.assembly), kinetic_energy=now["kinetic"],
            boundary_work=change["boundary"], elastic_energy=change["elastic"], friction_work=change["friction"],
            damping_work=change["damping"], energy_error=missing,
        )  # fmt: skip

    def curve(self) -> xr.Dataset:
        """What was recorded, with the verdict."""
        motion, what = self.motion, self.what
        typical, late = typical_of(self.on_way), motion.trend_of_late
        is_too_fast = typical > TOO_FAST
        curve = self.recorder.dataset(
            verdict="too fast" if is_too_fast else motion.verdict, motion=motion.verdict, travelled=motion.furthest / what.norm,
            beyond=motion.beyond / self.elastic_strain, kinetic_share=self.largest_kinetic / self.stored,
            growth_of_late=late.growth, growth_of_late_error=late.error, unbalanced_typical=typical, w2_of_push=self.w2_of_push,
            norm=what.norm, direction=self.u.tolist(), disturbance=what.kind, stored_energy=self.stored,
            elastic_strain=self.elastic_strain, steps_held=self.steps_held, hold_steps=what.hold_steps,
        )  # fmt: skip
        curve["time"] = curve.time - self.begin
        curve["phase"].attrs["meaning"] = ", ".join(f"{k} {name}" for k, name in enumerate(PHASES))
        # of the energy that went in by the walls or by the kick, or came out of the contacts
        terms = [
            abs(curve[name]).max() for name in ("boundary_work", "friction_work", "damping_work", "elastic_energy")
        ]
        curve.attrs["balance_error"] = float(abs(curve.energy_error[-1])) / max(float(term) for term in terms)
        return curve


def typical_of(on_way: Sequence[float]) -> float:
    """Median of the unbalanced forces seen during a push, before grains broke loose, as they may do at any rate; NaN if none was seen.

    >>> typical_of([2e-4, 3e-4, 2e-4, 0.3, 0.6, 0.6, 0.6])
    0.0002
    """
    if not len(on_way):
        return np.nan
    loose = np.flatnonzero(np.asarray(on_way) > COLLAPSE)
    before = on_way[: loose[0]] if len(loose) else on_way
    return float(np.median(before if len(before) else on_way))


def _upto(n_steps: int) -> Iterator[tuple[int, int]]:
    """Steps up to each look, and those made by then."""
    steps = list(looks(n_steps))
    return zip(steps, accumulate(steps), strict=True)


def _kick(assembly: AssemblyState, share: float, seed: int) -> float:
    """Give all grains random velocities, in place; the kinetic energy in J, `share` of what is stored."""
    rng = np.random.default_rng(seed)
    mass = assembly.grains.mass
    velocity = rng.standard_normal((len(assembly), 3))
    velocity -= mass @ velocity / mass.sum()
    size = 0.5 * float(mass @ (velocity**2).sum(axis=1))
    energy = share * energies(assembly)["elastic"]
    assembly.grains.velocity[:] = velocity * np.sqrt(energy / size)
    return energy
