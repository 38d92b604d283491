"""[[probes]]: small increments from every state in many directions, each with a null probe."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pydantic import Field, model_validator

from rendulic.foundation.validation import Positive, Whole
from rendulic.loading import directions
from rendulic.probing.probe import probes_of
from rendulic.specimen.protocol import HasGrains
from rendulic.study.ids import StateId
from rendulic.study.task import How, Parts, at_rest
from rendulic.study.tasks.anatomy import AnatomyOfState
from rendulic.study.tasks.measurement import AnyPlan, AnyStudy, Selected
from rendulic.study.values import Damping, Norms, Step

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["BATCH", "ProbeBatch", "ProbeSet"]

BATCH = 7  # probes of one unit: with the null probe, a full vector of lanes


class ProbeSet(Selected):
    """Probes from every state in many directions, each with a null probe."""

    table: ClassVar[str] = "probes"
    work: ClassVar[str] = "all probes"
    order: ClassVar[int] = 10

    kind: Literal["strain", "stress"] = Field("strain", description="what is imposed")
    step_deg: Step | None = Field(None, description="angle between directions in the Rendulic plane; 10 if not given")
    sphere_directions: Whole | None = Field(
        None, ge=12, le=100_000, description="instead, so many over the whole sphere"
    )
    norms: Norms = Field(
        (5e-5,), description="increasing sizes of the increment: strain, or Pa for stress, where they must be given"
    )
    rate: Positive | None = Field(
        None, description="strain, or Pa, per time step; 1e-8, or 5e-6 of the mean stress, if not given; for grains"
    )
    settle: bool = Field(True, strict=True, description="whether they are read at rest; for grains")
    check_rate: bool = Field(False, strict=True, description="whether half the rate is tried, too; for grains")
    damping: Damping = Field(0.05, description="of Cundall; for grains")
    anatomy: bool = Field(
        False, strict=True, description="whether to tell where in the grains W2 comes from; for grains"
    )

    @model_validator(mode="after")
    def _one_set_of_directions(self) -> ProbeSet:
        if self.step_deg is not None and self.sphere_directions is not None:
            raise ValueError("give step_deg for the Rendulic plane or sphere_directions for the sphere, not both")
        if self.kind == "stress" and "norms" not in self.model_fields_set:
            raise ValueError("stress probes have no default size: give norms in Pa")
        return self

    def check(self, study: AnyStudy) -> None:
        super().check(study)
        if self.kind == "strain":
            for specimen in study.specimen:
                if not self.specimens or specimen.name in self.specimens:
                    specimen.check_probe(self.what, self.norms[-1])

    @property
    def is_in_the_plane(self) -> bool:
        """Whether the directions lie in the Rendulic plane."""
        return self.sphere_directions is None

    def directions(self) -> directions.Directions | directions.SphereDirections:
        """In the Rendulic plane or on the sphere."""
        if self.sphere_directions is not None:
            return directions.sphere(self.sphere_directions)
        return directions.rendulic(self.step_deg or 10.0)

    def count(self) -> int:
        return -(-len(self.directions()) // BATCH) + self.anatomy

    def add(self, plan: AnyPlan, state: StateId | None) -> None:
        assert state is not None
        count, own = len(self.directions()), self.inputs()
        if not plan.has_grains(state):
            own["anatomy"] = False
        units = []
        for first in range(0, count, BATCH):
            many = min(BATCH, count - first)
            batch = ProbeBatch.model_validate({"name": self.name, **own, "first": first, "count_": many})
            label = f"{self.what}, {first} to {first + many - 1}: {state}"
            units.append(batch.unit(label, state=plan.state(state)))
        plan.put(self, state, *units)
        if own["anatomy"]:
            largest = self.norms[-1]
            task = AnatomyOfState(norm=largest, rate=self.rate, settle=self.settle, damping=self.damping)
            needs = {f"probes_{k}": unit for k, unit in enumerate(units)}
            unit = task.unit(f"anatomy '{self.name}': {state}", state=plan.state(state), **needs)
            plan.put(self, state, unit, table=AnatomyOfState.work)

    def read(self, parts: Sequence[Parts]) -> xr.Dataset:
        return merged(self.directions(), self.kind, [one["probes"] for one in parts])


class ProbeBatch(ProbeSet):
    """Some of the directions of a set: one unit of work."""

    table: ClassVar[str] = ""
    work: ClassVar[str] = "probes"

    first: Whole = Field(ge=0)
    count_: Whole = Field(ge=1)

    def run(self, needs: Parts, how: How) -> Parts:
        every = self.directions()
        around = _part_of(every, slice(self.first, self.first + self.count_))
        specimen = at_rest(needs, self.damping)
        found = probes_of(
            specimen, around, list(self.norms), rate=self.rate, settle=self.settle, check_rate=self.check_rate, kind=self.kind,
            anatomy=self.anatomy and isinstance(specimen, HasGrains), workers=how.threads, progress=how.progress,
        )  # fmt: skip
        return {"probes": found}


def _part_of(every: directions.Directions | directions.SphereDirections, chosen: slice) -> Any:
    """Some of the directions; weights on a sphere are shares of these."""
    if isinstance(every, directions.Directions):
        return directions.Directions(every.alpha[chosen])
    weight = every.weight[chosen]
    return directions.SphereDirections(every.unit[chosen], weight / weight.sum())


def merged(
    every: directions.Directions | directions.SphereDirections, kind: str, batches: list[xr.Dataset]
) -> xr.Dataset:
    """Batches of probes as the one table that all directions together give."""
    import xarray as xr

    table = xr.concat(batches, every.dimension, data_vars="minimal", coords="minimal", compat="override")
    return table.assign_coords({name: coordinate for name, coordinate in every.coordinates(kind).items()})
