"""[[bursts]]: around and within the cones of a set, predicted against observed failure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from pydantic import Field

from rendulic.foundation.validation import Positive
from rendulic.loading import directions
from rendulic.probing.burst import bursts
from rendulic.probing.cone import Cone, cone_of
from rendulic.study.task import How, Parts, at_rest
from rendulic.study.tasks.cones import ConeSet
from rendulic.study.tasks.measurement import AnyStudy
from rendulic.study.tasks.of_cones import OfCones
from rendulic.study.values import Step, Steps

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["BurstSet", "around_and_within"]


class BurstSet(OfCones):
    """Bursts around and within the cones of a set: predicted against observed failure."""

    table: ClassVar[str] = "bursts"
    work: ClassVar[str] = "bursts"
    order: ClassVar[int] = 40

    rate: Positive | None = Field(
        None, description="strain per time step of pushes and their probes; 1e-8 if not given; for grains"
    )
    hold_steps: Steps | None = Field(
        None, description="steps after which an undecided motion is given up; 200 000 if not given; for grains"
    )
    step_deg: Step = Field(20.0, description="angle between the directions; more lie within the cones")
    cone_norm: Positive | None = Field(
        None, description="size of the probes whose cone is taken; the set's if not given"
    )

    def check(self, study: AnyStudy) -> None:
        cones = self.its_cones(study)
        if self.cone_norm is not None and self.cone_norm not in cones.sizes:
            raise ValueError(f"{self.what}: cone_norm = {self.cone_norm:g} is not among the sizes of {cones.what}")

    def like(self, cones: ConeSet) -> Self:
        return super().like(cones).model_copy(update={"cone_norm": self.cone_norm or cones.norm})

    def run(self, needs: Mapping[str, Parts], how: How) -> Parts:
        cone = cone_of(needs["cone"]["probes"].sel(norm=self.cone_norm))
        curves: dict[str, Any] = {}

        def keep(alpha: float, curve: xr.Dataset) -> None:
            curves[f"burst_{len(curves)}"] = curve.assign_attrs(alpha=alpha)

        table = bursts(
            at_rest(needs, self.damping or 0.0), around_and_within(cone, self.step_deg), float(self.norm or 0.0), rate=self.rate,
            hold_steps=self.hold_steps, cone=cone, workers=how.threads, progress=how.progress, on_burst=keep,
        )  # fmt: skip
        return {"bursts": table} | curves

    def read(self, parts: Sequence[Parts]) -> tuple[xr.Dataset, dict[float, xr.Dataset]]:
        """The table of a state's bursts, and the curve of each by its direction."""
        (one,) = parts
        table = one["bursts"]
        return table, {float(alpha): one[f"burst_{k}"] for k, alpha in enumerate(table.alpha.values)}

    def write(self, result: Any, path: Path) -> list[Path]:
        """The table, and the curve of each burst in a folder beside it."""
        from rendulic.io.tables import write_dataset

        table, curves = result
        files = [write_dataset(curve, path / f"alpha_{alpha:07.3f}.nc") for alpha, curve in curves.items()]
        return [write_dataset(table, path.with_name(f"{path.name}.nc")), *files]


def around_and_within(cone: Cone, step: float) -> directions.Directions:
    """Directions all around, and at a quarter, a half and three quarters of every sector of a cone."""
    within = [first + share * (last - first) for first, last in cone.sectors for share in (0.25, 0.5, 0.75)]
    return directions.axisymmetric(np.unique(np.concatenate((directions.rendulic(step).alpha, np.mod(within, 360.0)))))
