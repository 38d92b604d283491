"""A packing of spheres between six rigid frictionless walls: its state, and steps in time."""

from __future__ import annotations

from math import isfinite

import numpy as np

from rendulic.dem.drive import burst, loading
from rendulic.dem.drive.lanes import probe_in_lanes
from rendulic.dem.drive.team import Prepared, in_ranks, prepared, threads_for
from rendulic.dem.kernels.arrays import (
    Contacts,
    Drive,
    Grains,
    ListRange,
    Packing,
    Stepping,
    WallContacts,
    Walls,
    aligned_rows,
    servo_room,
)
from rendulic.dem.kernels.compiled import kernels_for
from rendulic.dem.kernels.layout import CONTACT, SPENT
from rendulic.dem.laws import ContactLaw, LinearFrictional
from rendulic.dem.measure import equilibrium
from rendulic.dem.measure.energy import energies, kinetic_energy
from rendulic.dem.measure.time_step import critical_time_step
from rendulic.dem.state import saving
from rendulic.dem.state.grains import make_grains, morton_order, sphere_masses
from rendulic.dem.state.neighbours import find_contacts
from rendulic.dem.state.placement import refuse_deep_overlaps, refuse_outside
from rendulic.foundation.checks import finite_array, positive_number
from rendulic.foundation.errors import InvalidInput, UnstableTimeStep
from rendulic.specimen.snapshot import Snapshot
from rendulic.specimen.state import State
from rendulic.tensors.invariants import mean_stress, stress_ratio

__all__ = ["Assembly"]


class Assembly:
    """Spheres between walls; a `Specimen` that steps in time.

    Parameters
    ----------
    position : (n, 3) array
        Centres in m.
    radius : (n,) array
        Radii in m.
    walls : (6,) array
        Wall coordinates in m, in the order 1-, 1+, 2-, 2+, 3-, 3+.
    density : float
        Of the grains' material, in kg/m3.
    law : ContactLaw, optional
        `LinearFrictional()` if not given.
    damping : float
        Cundall's non-viscous coefficient, 0 <= lambda < 1.
    time_step : float, optional
        In s, fixed until `set_time_step()` releases it. By default `time_step_fraction` of the critical
        one, renewed while loading.
    time_step_fraction : float
        Of `critical_time_step`, 0 < fraction < 0.58 (beyond, coupled rotation is unstable).
    velocity, angular_velocity : (n, 3) arrays, optional
        At rest if not given.

    Raises
    ------
    InvalidInput
        For wrong shapes or signs, an empty packing, grains outside the walls, pairs or walls that
        overlap a grain by more than half its radius, numbers that are not finite.
    UnstableTimeStep
        If `time_step` exceeds the critical one.

    Notes
    -----
    Axis 1 is the axial direction of the triaxial test. Strains are logarithmic, compression
    positive, counted from the walls at construction (`reset_strain` makes the present the origin).
    """

    _prepared: Prepared | None = None  # for several threads

    def __init__(
        self,
        position,
        radius,
        walls,
        *,
        density: float = 2600.0,
        law: ContactLaw | None = None,
        damping: float = 0.05,
        time_step: float | None = None,
        time_step_fraction: float = 0.5,
        velocity=None,
        angular_velocity=None,
    ) -> None:
        self.law: ContactLaw = LinearFrictional() if law is None else law
        self.density = positive_number("density", density, "kg/m3")
        self.grains: Grains = make_grains(position, radius, density, velocity, angular_velocity)
        wall_position = finite_array("walls", walls, (6,))
        if (wall_position[1::2] <= wall_position[0::2]).any():
            raise InvalidInput(f"each upper wall must lie above its lower wall, got {wall_position.tolist()}")
        self.walls = Walls(wall_position, np.zeros(6), np.zeros(6))
        refuse_outside(self.grains, self.walls)
        if not (isfinite(damping) and 0.0 <= damping < 1.0):
            raise InvalidInput(f"damping must be in [0, 1), got {damping!r}")
        self.damping = float(damping)
        if not 0.0 < time_step_fraction < 0.58:
            raise InvalidInput(f"time_step_fraction must be in (0, 0.58), got {time_step_fraction!r}")
        self.time_step_fraction = float(time_step_fraction)
        self.inertial_radius = 0.0
        self.time = 0.0
        self.n_steps = 0
        self.n_rebuilds = 0
        self.spent = np.zeros(3)
        self.strain_origin = self.lengths
        self.margin = 0.05 * float(self.grains.radius.mean())
        self.steps_since_build = 0
        self.growth_since_build = 0.0
        self._scratch = servo_room()
        self.contacts, self.wall_contacts = self._candidates(None)
        refuse_deep_overlaps(self.grains, self.contacts)
        self._compute_forces()
        self.time_step, self.has_fixed_time_step = 0.0, False
        self.set_time_step(time_step)

    # -- what it is ------------------------------------------------------------------------------

    def __len__(self) -> int:
        return len(self.grains.radius)

    def __repr__(self) -> str:
        return (
            f"<Assembly of {len(self)} grains, {self.n_contacts} contacts, porosity {self.porosity:.4f}, "
            f"p = {self.stress.trace() / 3e3:.1f} kPa>"
        )

    @property
    def lengths(self) -> np.ndarray:
        """(3,) distances between opposite walls in m."""
        return self.walls.position[1::2] - self.walls.position[0::2]

    @property
    def volume(self) -> float:
        """Volume between the walls in m3."""
        return float(np.prod(self.lengths))

    @property
    def porosity(self) -> float:
        """Share of the volume that is not grains (overlaps not deducted)."""
        return 1.0 - float((4.0 / 3.0 * np.pi * self.grains.radius**3).sum()) / self.volume

    @property
    def n_contacts(self) -> int:
        """Closed contacts, grain-grain and grain-wall."""
        return int((self.contacts.force_n > 0).sum() + (self.wall_contacts.force > 0).sum())

    @property
    def stress(self) -> np.ndarray:
        """(3, 3) Cauchy stress from the wall forces in Pa, compression positive."""
        lengths = self.lengths
        areas = self.volume / lengths
        return np.diag(0.5 * (self.walls.force[0::2] + self.walls.force[1::2]) / areas)

    @property
    def strain(self) -> np.ndarray:
        """(3, 3) logarithmic strain since the origin, contraction positive."""
        return np.diag(np.log(self.strain_origin / self.lengths))

    @property
    def pressure(self) -> float:
        """Mean stress in Pa."""
        return float(mean_stress(self.stress))

    @property
    def eta(self) -> float:
        """Stress ratio q/p; NaN where nothing carries stress."""
        return float(stress_ratio(self.stress))

    def reset_strain(self) -> None:
        """Make the present walls the origin of strain."""
        self.strain_origin = self.lengths

    def energies(self) -> dict[str, float]:
        """Kinetic, elastic, frictional, damping and boundary energy in J; see `dem.energy`."""
        return energies(self)

    def equilibrium(self) -> equilibrium.Equilibrium:
        """Unbalanced force and kinetic energy now, with the verdict."""
        return equilibrium.assess(self)

    def snapshot(self) -> Snapshot:
        """The present state for analysis: positions, walls, contacts and their forces (copies)."""
        grains = self.grains
        pair = np.flatnonzero(self.contacts.force_n > 0)
        first, second = self.contacts.first[pair], self.contacts.second[pair]
        normal = grains.position[second] - grains.position[first]
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        touching = np.flatnonzero(self.wall_contacts.force > 0)
        grain, wall = self.wall_contacts.grain[touching], self.wall_contacts.wall[touching]
        outward = np.zeros((len(touching), 3))
        outward[np.arange(len(touching)), wall // 2] = np.where(wall % 2 == 0, -1.0, 1.0)
        return Snapshot(
            position=grains.position.copy(),
            radius=grains.radius.copy(),
            wall_position=self.walls.position.copy(),
            first=np.concatenate((first, grain)).astype(np.int64),
            second=np.concatenate((second, len(self) + wall)).astype(np.int64),
            normal=np.concatenate((normal, outward)),
            force_n=np.concatenate((self.contacts.force_n[pair], self.wall_contacts.force[touching])),
            force_t=np.concatenate((self.contacts.force_t[pair], np.zeros((len(touching), 3)))),
            friction=self.law.friction,
        )

    # -- stepping --------------------------------------------------------------------------------

    def set_time_step(self, time_step: float | None = None) -> None:
        """Fix the time step in s; without an argument take the stated fraction of the critical one.

        Raises
        ------
        UnstableTimeStep
            If it is not positive, or above 0.58 of the critical one.
        """
        critical = critical_time_step(self)
        if time_step is None:
            self.time_step, self.has_fixed_time_step = self.time_step_fraction * critical, False
            return
        if not (isfinite(time_step) and 0.0 < time_step <= 0.58 * critical):
            raise UnstableTimeStep(
                f"time step must be positive and at most {0.58 * critical:.3g} s (0.58 of the critical one for the "
                f"present contacts), got {time_step!r}"
            )
        self.time_step, self.has_fixed_time_step = float(time_step), True

    def renew_time_step(self) -> None:
        """Take the time step that the present contacts allow, or check the one that was fixed."""
        self.set_time_step(self.time_step if self.has_fixed_time_step else None)

    def advance(self, n_steps: int, drive: Drive, damping: float | None = None) -> None:
        """Make `n_steps` steps of the present time step under `drive`, in place.

        Raises
        ------
        UnstableTimeStep
            If the motion diverges.
        """
        kernels, threads = kernels_for(self.law), threads_for(len(self))
        damping = self.damping if damping is None else damping
        stepping = Stepping(self.time_step, damping, self.law.parameters)
        left = n_steps
        while left > 0:
            reach = 0.5 * self.margin - self.growth_since_build
            valid = ListRange(self.list_origin, self.list_wall_origin, reach)
            moved = (self._packing(), drive, stepping, valid, self.spent, self._scratch)
            if threads == 1:
                done, complete = kernels.advance(left, *moved)
            else:
                done, complete = in_ranks(kernels.advance_team, self._ready_for(threads), left, *moved)
            self.steps_since_build += done
            left -= done
            if not complete:
                self._rebuild()
                kernels.finish_step(self._packing(), stepping, self.spent, self._scratch)
                left -= 1
        self.n_steps += n_steps
        self.time += n_steps * self.time_step

    def _packing(self) -> Packing:
        return Packing(self.grains, self.contacts, self.walls, self.wall_contacts)

    def _ready_for(self, threads: int) -> Prepared:
        if self._prepared is None or not self._prepared.is_for(self.contacts, threads):
            self._prepared = prepared(self, threads)
        return self._prepared

    def tighten_list(self) -> None:
        """Rebuild the neighbour list with a narrow margin, for small motions; it widens again if need be."""
        self.margin = 0.02 * float(self.grains.radius.mean())
        self.contacts, self.wall_contacts = self._candidates(self.contacts)
        self._compute_forces()

    def scale_masses(self, inertial_radius: float) -> None:
        """Give grains smaller than `inertial_radius` [m] more mass; 0 restores the true masses.

        See `grains.sphere_masses`. Velocities stay, and the change of kinetic energy is booked as
        damping. The time step stays as it is: call `set_time_step`.
        """
        if not (isfinite(inertial_radius) and inertial_radius >= 0.0):
            raise InvalidInput(f"inertial_radius must be zero or a positive length, got {inertial_radius!r}")
        before = sum(kinetic_energy(self))
        self.inertial_radius = float(inertial_radius)
        mass, inertia = sphere_masses(self.grains.radius.copy(), self.density, self.inertial_radius)
        self.grains.mass[:] = mass
        self.grains.inertia[:] = inertia
        self.spent[SPENT.damping] += before - sum(kinetic_energy(self))

    def scale_radii(self, factor: float) -> None:
        """Multiply all radii by `factor`, masses following; forces follow at the next step."""
        grains = self.grains
        largest = float(grains.radius.max())
        grains.radius[:] *= factor
        self.scale_masses(self.inertial_radius)
        self.growth_since_build += max(factor - 1.0, 0.0) * largest
        if self.growth_since_build >= 0.25 * self.margin:
            self._rebuild()
            self._compute_forces()

    def set_tangential_forces(self, first: np.ndarray, second: np.ndarray, force: np.ndarray, age: float = 0.0) -> None:
        """Give contacts `first < second` the tangential forces (n, 3) on `second` in N of another engine.

        `age` in s is how much older than the positions the forces are: they are advanced by the
        present velocities. Pairs that do not touch are left open; forces beyond the friction limit
        are scaled to it.
        """
        place = {
            pair: c
            for c, pair in enumerate(zip(self.contacts.first.tolist(), self.contacts.second.tolist(), strict=True))
        }
        for pair, value in zip(zip(first.tolist(), second.tolist(), strict=True), force, strict=True):
            c = place.get(pair)
            if c is not None and self.contacts.force_n[c] > 0:
                self.contacts.force_t[c] = value
        self._compute_forces(age)

    def stop_rattlers(self) -> None:
        """Stop the grains with fewer than two contacts, in place.

        Damping acts on forces, so a grain in free flight would never come to rest. The kinetic
        energy taken is booked as damping.
        """
        closed = self.contacts.force_n > 0
        touching = (
            self.contacts.first[closed], self.contacts.second[closed],
            self.wall_contacts.grain[self.wall_contacts.force > 0],
        )  # fmt: skip
        free = np.bincount(np.concatenate(touching), minlength=len(self)) < 2
        before = sum(kinetic_energy(self))
        self.grains.velocity[free] = 0.0
        self.grains.angular_velocity[free] = 0.0
        self.spent[SPENT.damping] += before - sum(kinetic_energy(self))

    def stop_spins(self) -> None:
        """Stop all rotation, in place; the kinetic energy taken is booked as damping.

        Grains that turn on each other like gears along a frictionless wall meet no resistance.
        """
        self.spent[SPENT.damping] += kinetic_energy(self)[1]
        self.grains.angular_velocity[:] = 0.0

    def sort_grains(self) -> None:
        """Renumber the grains along a space-filling curve; the mechanics does not change."""
        order = morton_order(self.grains.position, self.walls.position[0::2], self.walls.position[1::2])
        place = np.empty(len(self), np.int32)
        place[order] = np.arange(len(self))
        grains = self.grains
        self.grains = Grains(aligned_rows(grains.row[order]), grains.mass[order], grains.inertia[order])
        first, second = place[self.contacts.first], place[self.contacts.second]
        swapped = first > second
        force = self.contacts.force.copy()
        force[swapped, CONTACT.force_t :] *= -1.0
        first, second = np.where(swapped, second, first), np.where(swapped, first, second)
        by_pair = np.lexsort((second, first))
        self.contacts = Contacts(first[by_pair], second[by_pair], np.ascontiguousarray(force[by_pair]))
        self._rebuild()
        self._compute_forces()

    def _candidates(self, contacts: Contacts | None) -> tuple[Contacts, WallContacts]:
        found = find_contacts(self.grains, self.walls, contacts, self.margin)
        self.list_origin = self.grains.position.copy()
        self.list_wall_origin = self.walls.position.copy()
        self.steps_since_build = 0
        self.growth_since_build = 0.0
        return found

    def _rebuild(self) -> None:
        # rebuilding costs about 15 steps; a wide margin slows every step: aim at 150 to 1500 steps
        smallest, largest = 0.005 * self.grains.radius.mean(), 0.3 * self.grains.radius.mean()
        if self.steps_since_build < 150:
            self.margin = float(min(1.5 * self.margin, largest))
        elif self.steps_since_build > 1500:
            self.margin = float(max(0.75 * self.margin, smallest))
        self.contacts, self.wall_contacts = self._candidates(self.contacts)
        self.n_rebuilds += 1

    def _compute_forces(self, dt: float = 0.0) -> None:
        """Forces at the present positions without moving anything.

        `dt` advances the tangential forces by the motion of the last step, for states of engines
        that save forces one step older than positions.
        """
        self.grains.force[:] = 0.0
        self.grains.torque[:] = 0.0
        kernels = kernels_for(self.law)
        nothing = np.zeros(3)
        kernels.contact_forces(self.grains, self.contacts, dt, self.law.parameters, nothing)
        kernels.wall_forces(self.grains, self.walls, self.wall_contacts, self.law.parameters)

    # -- loading, saving -------------------------------------------------------------------------

    def load(self, path, **options):
        """Load along a `Path`; returns the curve as an `xarray.Dataset`. See `dem.loading.load`."""
        return loading.load(self, path, **options)

    def probe(self, increment, n_steps: int, **options) -> None:
        """Impose a principal strain or stress increment (3,), in place. See `dem.loading.probe`."""
        loading.probe(self, increment, n_steps, **options)

    def probe_together(self, increments, n_steps: int, **options) -> list:
        """Impose principal strain increments (m, 3) on copies that advance together. See `dem.lanes.probe_in_lanes`."""
        return probe_in_lanes(self, increments, n_steps, **options)

    def burst(self, direction, norm: float, n_steps: int, **options):
        """Disturb the assembly under a held load, in place; the curve with a verdict. See `dem.burst.burst`."""
        return burst.burst(self, direction, norm, n_steps, **options)

    def clone(self) -> Assembly:
        """An independent assembly in the same state."""
        return Assembly.from_state(self.save(), self.law)

    def save(self) -> State:
        """Copy the whole state, so that `restore` continues bitwise as this one would."""
        return saving.state_of(self)

    def restore(self, state: State) -> None:
        """Return to a saved state, in place, exactly.

        Raises
        ------
        InvalidInput
            If the state is of another kind of specimen, or of another contact law.
        CorruptFile
            If something is missing in it.
        """
        saving.restore(self, state)

    @classmethod
    def from_state(cls, state: State, law: ContactLaw | None = None) -> Assembly:
        """Make an assembly of a saved state; `law` is needed for a law that is not rendulic's own."""
        assembly = cls.__new__(cls)
        assembly.law = saving.law_of(state, law, exactly=law is not None)
        assembly.restore(state)
        return assembly
