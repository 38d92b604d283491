"""Disturbing an assembly at rest under a held load, and watching whether its kinetic energy bursts.

Section 4 of the theory: failure is shown, not only predicted.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from rendulic.dem.drive.servo import drive_for
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
from rendulic.specimen.curve import CurveRecorder
from rendulic.specimen.window import Window

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["burst"]

FASTEST = 0.05  # inertial number of the fastest motion that the servo follows
PHASES = ("rest", "disturbed", "held")
GROWS = 100.0  # kinetic energy of a failing specimen over that of the disturbance
SLIPS = 10.0  # strain of an avalanche over the disturbance
CALM, FLOWS = 1e-4, 1e-2  # unbalanced force of a specimen that has settled, and of one that still flows


def burst(
    assembly: AssemblyState,
    direction,
    norm: float,
    n_steps: int,
    hold_steps: int | None,
    disturbance: str,
    kick: float,
    strain_limit: float,
    n_records: int,
    seed: int,
    on_window: Callable[[Window], None] | None,
) -> xr.Dataset:
    """Disturb the assembly under a held load and follow what it does, in place; options are those of `Assembly.burst`.

    1. The strains move along `direction` u only, `d_eps = u e`; the conjugate stress `s = sigma : u` is
       the load. In the Rendulic plane that is the path `d_eps_1 + 2 R d_eps_3 = 0`.
    2. A push moves e to `norm` in `n_steps` steps and takes s back to what it was in as many. Where the
       second-order work `ds e` of the push was negative, the load exceeds what the specimen carries by then.
       A kick gives all grains random velocities instead.
    3. The load is held, and the specimen left to itself.
    """
    u = finite_array("direction of a burst", direction, (3,))
    if abs(np.linalg.norm(u) - 1.0) > 1e-9:
        raise InvalidInput(f"the direction of a burst must be a unit vector, got {u.tolist()}")
    norm = positive_number("norm", norm)
    n_steps = whole_number("n_steps", n_steps, 1)
    hold_steps = 30 * n_steps if hold_steps is None else whole_number("hold_steps", hold_steps, 1)
    one_of(disturbance, ("push", "kick"), "disturbance")
    positive_number("kick", kick)
    positive_number("strain_limit", strain_limit)
    if assembly.pressure <= 0.0:
        raise InvalidInput("a burst needs a specimen that carries stress: load it first")
    basis = np.linalg.svd(u[None, :])[2]
    basis[0] = u
    watch = _Watch(assembly, u, norm, disturbance, on_window)
    cap = strain_rate_of(assembly, FASTEST, assembly.pressure)
    held = drive_for(assembly, Control.of_strains(basis, ("stress", "strain", "strain")), (None,) * 3, np.zeros(3), cap)
    every = max(1, n_steps // 10)
    if disturbance == "push":
        rate = norm / (n_steps * assembly.time_step)
        watch.reference_energy = _affine_energy(assembly, rate * u)
        driven = Control.of_strains(basis, ("strain",) * 3)
        watch.follow(n_steps, every, drive_for(assembly, driven, (None,) * 3, [rate, 0.0, 0.0], cap))
        load = float(held.target[0])
        held.target[0] = u @ np.diag(assembly.stress)
        held.target_rate[0] = (load - held.target[0]) / (n_steps * assembly.time_step)
        watch.follow(n_steps, every, held)
        held.target[0], held.target_rate[0] = load, 0.0
    else:
        watch.reference_energy = watch.injected = _kick(assembly, kick, seed)
        watch.follow(n_steps, every, held)
    return watch.hold(held, hold_steps, max(1, 10 * n_steps // n_records), strain_limit)


class _Watch:
    """Follows an assembly through the phases of a burst and records it."""

    def __init__(self, assembly: AssemblyState, u, norm: float, disturbance: str, on_window) -> None:
        self.assembly, self.u, self.norm, self.on_window = assembly, u, norm, on_window
        self.disturbance = disturbance
        self.recorder = CurveRecorder(f"burst after a {disturbance}")
        self.strain, self.spent = np.diag(assembly.strain), energies(assembly)
        self.begin = assembly.time
        self.reference_energy = self.injected = 0.0
        self.load = float(u @ np.diag(assembly.stress))
        self.record(0)

    @property
    def moved(self) -> float:
        """Strain along the direction since rest."""
        return float(self.u @ (np.diag(self.assembly.strain) - self.strain))

    def record(self, phase: int) -> dict[str, float]:
        """Add the present state to the curve; its energies since rest."""
        now = energies(self.assembly)
        change = {name: now[name] - self.spent[name] for name in now}
        missing = (
            change["boundary"] + self.injected - sum(value for name, value in change.items() if name != "boundary")
        )
        self.recorder.add(
            self.assembly, phase=float(phase), strain_along=self.moved, load=float(self.u @ np.diag(self.assembly.stress)),
            unbalanced_force=unbalanced_force(self.assembly), kinetic_energy=now["kinetic"],
            boundary_work=change["boundary"], elastic_energy=change["elastic"], friction_work=change["friction"],
            damping_work=change["damping"], energy_error=missing,
        )  # fmt: skip
        return change

    def step(self, drive: Drive) -> None:
        """One step, and the window on it."""
        if self.on_window is None:
            advance(self.assembly, 1, drive)
            return
        assembly = self.assembly
        before, taken = snapshot_of(assembly), damping_forces(assembly)
        kinetic = whole_step_kinetic_energy(assembly)
        advance(assembly, 1, drive)
        after = snapshot_of(assembly)
        damped = 0.5 * float(((after.position - before.position) * (taken + damping_forces(assembly))).sum())
        self.on_window(Window(before, after, whole_step_kinetic_energy(assembly) - kinetic + damped))

    def follow(self, n_steps: int, every: int, drive: Drive) -> None:
        """The disturbance."""
        left = n_steps
        while left > 0:
            count = min(every, left)
            if count > 1:
                advance(self.assembly, count - 1, drive)
            self.step(drive)
            left -= count
            self.record(1)

    def hold(self, drive: Drive, n_steps: int, every: int, strain_limit: float) -> xr.Dataset:
        """The held load, until at rest, or beyond the limit of strain, or to the end; the curve with the verdict."""
        assembly = self.assembly
        peak, furthest, calm, done = 0.0, 0.0, 0, 0
        while done < n_steps and calm < 3 and abs(furthest) < strain_limit:
            renew_time_step(assembly)
            advance(assembly, every, drive)
            self.step(drive)
            done += every + 1
            self.record(2)
            peak = max(peak, sum(kinetic_energy(assembly)))
            furthest = max(furthest, self.moved, key=abs)
            off = abs(float(self.u @ np.diag(assembly.stress)) - self.load)
            at_rest = unbalanced_force(assembly) <= CALM and off <= 1e-3 * assembly.pressure
            calm = calm + 1 if at_rest else 0
        growth, travelled, settled = peak / self.reference_energy, furthest / self.norm, calm >= 3
        flows = abs(furthest) >= strain_limit or unbalanced_force(assembly) > FLOWS
        if growth > GROWS and flows:
            verdict = "fails"
        elif abs(travelled) > SLIPS:
            verdict = "arrested"
        else:
            verdict = "settles" if settled else "undecided"
        curve = self.recorder.dataset(
            verdict=verdict, kinetic_growth=growth, travelled=travelled, settled=int(settled), norm=self.norm,
            direction=self.u.tolist(), disturbance=self.disturbance, reference_energy=self.reference_energy, steps_held=done,
        )  # fmt: skip
        curve["time"] = curve.time - self.begin
        curve["phase"].attrs["meaning"] = ", ".join(f"{k} {name}" for k, name in enumerate(PHASES))
        # of the energy that went in by the walls or by the kick, or came out of the contacts
        terms = [
            abs(curve[name]).max() for name in ("boundary_work", "friction_work", "damping_work", "elastic_energy")
        ]
        curve.attrs["balance_error"] = float(abs(curve.energy_error[-1])) / max(float(term) for term in terms)
        return curve


def _affine_energy(assembly: AssemblyState, rates: np.ndarray) -> float:
    """Kinetic energy in J of a motion with these principal strain rates about the middle of the box."""
    middle = assembly.walls.position.reshape(3, 2).mean(axis=1)
    velocity = rates * (assembly.grains.position - middle)
    return 0.5 * float(assembly.grains.mass @ (velocity**2).sum(axis=1))


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
