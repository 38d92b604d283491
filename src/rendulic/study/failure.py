"""The states of several packings and what their failure is read from; each finished result is a file."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rendulic.dem.assembly import Assembly
from rendulic.io.tables import write_dataset
from rendulic.loading import directions
from rendulic.loading.directions import Directions
from rendulic.probing.anatomy import anatomy
from rendulic.probing.burst import bursts
from rendulic.probing.cone import Cone, cone_of, probe_to_edges
from rendulic.probing.consistency import stress_on_strain
from rendulic.probing.probe import probe
from rendulic.progress import Progress
from rendulic.study.config import GrainStudy
from rendulic.study.stages import at_rest, claim, file_of, kept, specimen_of, state_at
from rendulic.tensors.rendulic_plane import increment_along
from rendulic.whole_file import writable_folder

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["FailureResults", "PackedState", "PackingStates", "around_and_within"]


@dataclass(frozen=True, eq=False)
class PackingStates:
    """One packing of the study in a folder of its own, with its states at rest."""

    density: str
    study: GrainStudy
    folder: Path
    is_fresh: dict[float, bool]  # whether a state was made now: what follows from it is then made again, too

    @property
    def seed(self) -> int:
        return self.study.specimen.seed

    @property
    def name(self) -> str:
        return f"{self.density}, seed {self.seed}"


@dataclass(frozen=True)
class PackedState:
    """One state of one packing."""

    packing: PackingStates
    eta: float

    @property
    def name(self) -> str:
        return f"{self.packing.name}, eta = {self.eta:g}"

    @property
    def is_fresh(self) -> bool:
        return self.packing.is_fresh[self.eta]

    def at_rest(self) -> Assembly:
        return at_rest(self.packing.study, self.packing.folder, self.eta)

    def burst_file(self, alpha: float) -> Path:
        folder = self.packing.folder / f"bursts_eta_{self.eta:.3f}"
        return writable_folder(folder) / f"alpha_{alpha:07.3f}.nc"


def _packings(study: GrainStudy, folder: Path) -> Iterator[tuple[str, GrainStudy, Path]]:
    """Density, study and folder of every packing."""
    failure = study.failure
    dense = {"growth_friction": failure.dense_growth_friction}
    for density, etas, recipe in (("loose", failure.loose_eta, {}), ("dense", failure.dense_eta, dense)):
        for seed in range(study.specimen.seed, study.specimen.seed + failure.n_seeds):
            specimen = study.specimen.model_copy(update={"seed": seed, **recipe})
            loading = study.loading.model_copy(update={"eta": etas, "axial_strain": failure.axial_strain})
            own = study.model_copy(update={"specimen": specimen, "loading": loading})
            yield density, own, folder / f"{density}_seed_{seed}"


class FailureResults:
    """What the figures need, computed when the first of them asks, and kept in files."""

    def __init__(self, study: GrainStudy, folder: Path, workers: int | None, stage: Callable[[str], Progress]) -> None:
        self.study, self.folder, self.workers, self.stage = study, folder, workers, stage

    @cached_property
    def packings(self) -> list[PackingStates]:
        """All packings, loose and dense, with their states."""
        return [self.first_packing, *(self._prepared(*each) for each in list(_packings(self.study, self.folder))[1:])]

    @cached_property
    def first_packing(self) -> PackingStates:
        """The loose one of the study's seed, which needs none of the others."""
        return self._prepared(*next(_packings(self.study, self.folder)))

    def _prepared(self, density: str, own: GrainStudy, folder: Path) -> PackingStates:
        name = f"{density} packing, seed {own.specimen.seed}"
        claim(folder, own)
        sample, fresh = specimen_of(own, folder, self.stage(name))
        is_fresh = {}
        for eta in own.loading.eta:
            _, fresh = state_at(own, folder, sample, eta, fresh, self.stage(f"{name}: shear to eta = {eta:g}"))
            is_fresh[eta] = fresh
        return PackingStates(density, own, folder, is_fresh)

    @cached_property
    def states(self) -> list[PackedState]:
        """All states of all packings."""
        return [PackedState(packing, eta) for packing in self.packings for eta in packing.study.loading.eta]

    @property
    def first(self) -> list[PackedState]:
        """States of the first packing."""
        return [PackedState(self.first_packing, eta) for eta in self.study.failure.loose_eta]

    def kept(self, state: PackedState, what: str, make: Callable[[Assembly, Progress], xr.Dataset]) -> xr.Dataset:
        """A result of a state from its file, or made from the state at rest."""
        path = file_of(state.packing.folder, what, state.eta, "nc")
        progress = self.stage(f"{what}: {state.name}")
        return kept(path, state.is_fresh, lambda: make(state.at_rest(), progress))

    @cached_property
    def sweeps(self) -> dict[PackedState, xr.Dataset]:
        """Probes that bracket the edges of every state; at all norms if the packing has the study's seed."""
        return {state: self._swept(state) for state in self.states}

    def _swept(self, state: PackedState) -> xr.Dataset:
        return self.kept(state, "cone", partial(self._sweep, state))

    def _sweep(self, state: PackedState, sample: Assembly, progress: Progress) -> xr.Dataset:
        failure = self.study.failure
        norms: tuple[float, ...] = (failure.norm,)
        if state.packing.seed == self.first_packing.seed:
            norms = tuple(sorted({*failure.norms, failure.norm}))
        return probe_to_edges(
            sample, directions.rendulic(failure.step_deg), norms, self._steps_to(norms[0]),
            tolerance=failure.tolerance_deg, refine_smallest=True, workers=self.workers, progress=progress,
        )  # fmt: skip

    @cached_property
    def cones(self) -> dict[PackedState, Cone]:
        """At the norm of the study."""
        return {state: cone_of(data.sel(norm=self.study.failure.norm)) for state, data in self.sweeps.items()}

    @cached_property
    def stress_probes(self) -> dict[PackedState, xr.Dataset]:
        """Stress probes of the states that were probed by strains of all sizes, laid on these."""
        return {
            state: stress_on_strain(self.sweeps[state], self.kept(state, "stress", partial(self._stress_probes, state)))
            for state in self.states
            if state.packing.seed == self.first_packing.seed
        }

    def _stress_probes(self, state: PackedState, sample: Assembly, progress: Progress) -> xr.Dataset:
        """Stress probes as large as the stresses that answer strain probes in their softer directions."""
        failure = self.study.failure
        answers = np.linalg.norm(self.cones[state].probes.d_sigma.values, axis=-1)
        return probe(
            sample, directions.rendulic(failure.step_deg), float(np.quantile(answers, 0.2)), self.steps, kind="stress",
            workers=self.workers, progress=progress,
        )  # fmt: skip

    @cached_property
    def most_unstable(self) -> PackedState:
        """The state of the first packing with the smallest W2n: the one to look at."""
        norm = self.study.failure.norm
        return min(self.first, key=lambda state: cone_of(self._swept(state).sel(norm=norm)).smallest_w2n)

    @property
    def steps(self) -> int:
        """Steps of a probe of the study's norm."""
        return self._steps_to(self.study.failure.norm)

    def _steps_to(self, norm: float) -> int:
        probes = self.study.probes
        return max(round(probes.n_steps * norm / probes.norms[0]), 1)

    @cached_property
    def sphere(self) -> xr.Dataset:
        """Probes of the first packing's most unstable state over the whole sphere of increments."""
        on_sphere, norm = directions.sphere(self.study.failure.sphere_directions), self.study.failure.norm
        return self.kept(
            self.most_unstable,
            "sphere",
            lambda sample, progress: probe(
                sample, on_sphere, norm, self.steps, workers=self.workers, progress=progress
            ),
        )

    @cached_property
    def anatomies(self) -> dict[PackedState, xr.Dataset]:
        """Probes of the first packing's states with their anatomy."""
        around, norm = directions.rendulic(self.study.failure.step_deg), self.study.failure.norm
        return {
            state: self.kept(
                state,
                "anatomy",
                lambda sample, progress: probe(
                    sample, around, norm, self.steps, anatomy=True, workers=self.workers, progress=progress
                ),
            )
            for state in self.first
        }

    def dissected(self, state: PackedState) -> tuple[float, xr.Dataset]:
        """The anatomy of a state's most unstable direction of those probed, with every contact."""
        data = self.anatomies[state]
        alpha = float(data.alpha[int(np.nanargmin(data.w2_normalised.values))])
        before = state.at_rest()
        after = before.clone()
        after.probe(increment_along(alpha, self.study.failure.norm), self.steps)
        return alpha, anatomy(before.snapshot(), after.snapshot())

    @cached_property
    def bursts(self) -> dict[PackedState, xr.Dataset]:
        """Predicted and observed failure of every state, the curve of every burst in a file of its own."""
        return {state: self.kept(state, "bursts", partial(self._bursts, state)) for state in self.states}

    def _bursts(self, state: PackedState, sample: Assembly, progress: Progress) -> xr.Dataset:
        cone = self.cones[state]

        def keep(alpha: float, curve: xr.Dataset) -> None:
            write_dataset(curve, state.burst_file(alpha))

        return bursts(
            sample, around_and_within(cone, self.study.failure.burst_step_deg), self.study.failure.norm, self.steps,
            cone=cone, workers=self.workers, progress=progress, on_burst=keep,
        )  # fmt: skip


def around_and_within(cone: Cone, step: float) -> Directions:
    """Directions all around, and at a quarter, a half and three quarters of every sector of a cone."""
    within = [first + share * (last - first) for first, last in cone.sectors for share in (0.25, 0.5, 0.75)]
    return directions.axisymmetric(np.unique(np.concatenate((directions.rendulic(step).alpha, np.mod(within, 360.0)))))
