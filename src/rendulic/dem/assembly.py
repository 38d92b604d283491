"""A packing of spheres between six rigid frictionless walls. The face of the folder: nothing below imports it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Self, TypeVar

from rendulic.dem.drive import burst, lanes, loading
from rendulic.dem.drive.quasi_static import QuasiStatic
from rendulic.dem.drive.stepping import compute_forces
from rendulic.dem.laws import ContactLaw
from rendulic.dem.measure.energy import energies
from rendulic.dem.measure.equilibrium import Equilibrium, assess
from rendulic.dem.measure.snapshot import snapshot_of
from rendulic.dem.state import saving
from rendulic.dem.state.assembly_state import DAMPING, DENSITY, TIME_STEP_FRACTION, copy_of
from rendulic.dem.state.making import made_of
from rendulic.dem.stepped import SteppedState
from rendulic.foundation.progress import Progress, silent
from rendulic.foundation.whole_change import whole_change
from rendulic.loading.paths import Path
from rendulic.specimen.snapshot import Snapshot
from rendulic.specimen.state import State
from rendulic.specimen.way import Way
from rendulic.specimen.window import Window

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Assembly"]

Reading = TypeVar("Reading")
RATE_CAP = 0.1  # of the servo of stress probes, 1/s


class Assembly(SteppedState):
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
        Of the critical time step, 0 < fraction < 0.58 (beyond, coupled rotation is unstable).
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
    `AssemblyState` lists all that an assembly holds.
    """

    def __init__(
        self,
        position,
        radius,
        walls,
        *,
        density: float = DENSITY,
        law: ContactLaw | None = None,
        damping: float = DAMPING,
        time_step: float | None = None,
        time_step_fraction: float = TIME_STEP_FRACTION,
        velocity=None,
        angular_velocity=None,
    ) -> None:
        made = made_of(position, radius, walls, density, law, damping, time_step_fraction, velocity, angular_velocity)
        super().__init__(**vars(made))
        compute_forces(self)
        self.set_time_step(time_step)

    def energies(self) -> dict[str, float]:
        """Kinetic, elastic, frictional, damping and boundary energy in J; see `measure.energy`."""
        return energies(self)

    def equilibrium(self) -> Equilibrium:
        """Unbalanced force and kinetic energy now, with the verdict."""
        return assess(self)

    def snapshot(self) -> Snapshot:
        """The present state for analysis: positions, walls, contacts and their forces (copies)."""
        return snapshot_of(self)

    @whole_change
    def load(
        self,
        path: Path,
        *,
        speed: QuasiStatic | None = None,
        progress: Progress = silent,
        on_record: Callable[[Self], None] | None = None,
    ) -> xr.Dataset:
        """Follow a path, adapting the rate to the unbalanced force, in place; `drive.loading` says how.

        Parameters
        ----------
        path : Path
            E.g. `rd.paths.drained_triaxial(until_eta=0.48)`. A stress ratio counts as reached if it stands at rest.
        speed : QuasiStatic, optional
            Rates, damping and equilibrium criterion; `QuasiStatic()` if not given.
        progress, on_record : callable, optional
            Called now and then; the second one with the assembly, at every record.

        Returns
        -------
        xarray.Dataset
            The curve (see `rendulic.specimen.curve`), with the verdict in `attrs`: `stopped_by`
            ("strain", "eta", "peak", "target"), `is_quasi_static`, `largest_inertial_number`.

        Raises
        ------
        NotEquilibrated
            If a path without a driven strain does not come to rest at its stresses, or a paused test does
            not come to rest at the stress ratio aimed at.
        UnstableTimeStep
            If the motion diverges.
        """
        return loading.load(self, path, speed, progress, on_record)

    @whole_change
    def probe(
        self,
        increment,
        n_steps: int,
        *,
        kind: str = "strain",
        marks: tuple[float, ...] = (1.0,),
        on_mark: Callable[[float], None] | None = None,
        rate_cap: float = RATE_CAP,
    ) -> None:
        """Impose a principal increment (3,) at constant rate over `n_steps` steps of the present size, in place.

        Parameters
        ----------
        increment : (3,) array
            Strains, or stresses in Pa.
        kind : {"strain", "stress"}
            What is imposed.
        marks : tuple of float
            Increasing fractions of the increment at which `on_mark(fraction)` is called; ends with 1.
        rate_cap : float
            Largest strain rate of the servo in 1/s. Where the state cannot carry the stress, the walls
            run at it, and the stress reached is the result, not the one asked for.
        """
        loading.probe(self, increment, n_steps, kind, marks, on_mark, rate_cap)

    def probe_together(
        self,
        increments,
        n_steps: int,
        *,
        kind: str,
        marks: Sequence[float],
        settling_steps: int,
        read: Callable[[Self, Way], Reading],
        workers: int,
        on_done: Callable[[int], None],
    ) -> list[list[Reading]]:
        """Impose principal increments (m, 3), each on a copy, side by side on `workers` threads.

        What `read` returned at each of the increasing `marks` (fractions), by increment, then mark: of a copy whose walls
        were held for at most `settling_steps` steps until it was at rest, with the `Way` there. What is probed goes on from the
        mark itself. `on_done` is called with the number of increments finished since the last call. The number of `workers` changes
        no result.
        """
        if kind == "strain":
            return lanes.probe_in_lanes(self, increments, n_steps, marks, settling_steps, read, workers, on_done)

        def follow(increment) -> list[Reading]:
            readings = loading.probe_alone(self, increment, n_steps, kind, marks, settling_steps, read, RATE_CAP)
            on_done(1)
            return readings

        with ThreadPoolExecutor(max_workers=workers) as pool:
            return list(pool.map(follow, increments))

    @whole_change
    def burst(
        self,
        direction,
        norm: float,
        n_steps: int,
        *,
        hold_steps: int = burst.HOLD_STEPS,
        disturbance: str = "push",
        kick: float = 5e-3,
        strain_limit: float = 0.02,
        n_records: int = 100,
        seed: int = 0,
        on_window: Callable[[Window], None] | None = None,
    ) -> xr.Dataset:
        """Disturb the assembly under a held load and follow what it does, in place; `drive.burst` says how.

        Parameters
        ----------
        direction : (3,) array
            Unit vector of principal strains.
        norm : float
            Size of the push, a strain.
        n_steps : int
            Of the push, and of the way back. A kick takes none.
        hold_steps : int
            Steps after which an undecided motion is given up.
        disturbance : {"push", "kick"}
            What is done to it: a push along the direction, taken back, or random velocities.
        kick : float
            Kinetic energy of a kick over the stored elastic energy.
        strain_limit : float
            Strain along `direction` beyond which a motion that does not decay is a failure.
        n_records : int
            Records of the hold, if it lasts for `hold_steps`; more where the strain grows.
        seed : int
            Of the velocities of a kick.
        on_window : callable, optional
            Called with a `Window` at every record.

        Returns
        -------
        xarray.Dataset
            Dimension `record`: the curve, with `phase`, strain along the direction, load, energies since rest
            (J), error of their balance. In `attrs`:

            - `verdict`. "settles": at rest again, under its load, near by. "arrested": at rest after an avalanche, beyond the
              push by more than the push itself and a tenth of the elastic strain. "fails": beyond the limit of strain, with a
              kinetic energy that does not surely decay. "undecided": none of these within `hold_steps`. "too fast": the
              push was, by the unbalanced force that it made, and what followed proves nothing.
            - `motion`: the verdict of the motion alone, also after a push that was too fast.
            - `travelled`: largest strain along the direction, with its sign, over `norm`; `beyond`: the strain by which the
              specimen left the range of the push, over `elastic_strain`, which is `2 E / (p V)` at rest, E the `stored_energy` in J.
            - `kinetic_share`: largest kinetic energy after the push over the stored energy; `growth_of_late`: its growth in 1/s
              over the last half of the motion (negative: decay) with the half width of its 95 % interval, `growth_of_late_error`.
            - `unbalanced_typical`: median on the way of the push, before grains broke loose, if they did; `w2_of_push`, in J/m3; `steps_held`; `balance_error`.

        Raises
        ------
        InvalidInput
            For values out of range, or an assembly without stress.
        UnstableTimeStep
            If the motion diverges.
        """
        what = burst.Disturbance(norm, n_steps, disturbance, kick, seed, hold_steps, strain_limit, n_records)
        return burst.burst(self, direction, what, on_window)

    def clone(self) -> Self:
        """An independent assembly in the same state."""
        return copy_of(self)

    def save(self) -> State:
        """Copy the whole state, so that `restore` continues bitwise as this one would."""
        return saving.state_of(self)

    @whole_change
    def restore(self, state: State) -> None:
        """Return to a saved state, in place, exactly.

        Raises
        ------
        InvalidInput
            If the state is of another kind of specimen, or of another contact law.
        CorruptFile
            If something is missing or impossible in it: the field and the row are named.
        """
        saving.restore(self, state)

    @classmethod
    def from_state(cls, state: State, law: ContactLaw | None = None) -> Self:
        """Make an assembly of a saved state; `law` is needed for a law that is not rendulic's own."""
        assembly = cls.__new__(cls)
        assembly.law = saving.law_of(state, law, exactly=law is not None)
        assembly.restore(state)
        return assembly
