"""[[cones]]: edges of the unstable sectors of every state, by bisection."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from pydantic import Field, model_validator

from rendulic.foundation.validation import Positive
from rendulic.loading import directions
from rendulic.probing.cone import probe_to_edges
from rendulic.study.task import How, Parts, at_rest
from rendulic.study.tasks.measurement import AnyStudy, Selected
from rendulic.study.values import Damping, Norms, Step

__all__ = ["ConeSet"]


class ConeSet(Selected):
    """Edges of the unstable sectors of every state, by bisection."""

    table: ClassVar[str] = "cones"
    work: ClassVar[str] = "cone"
    order: ClassVar[int] = 20

    norm: Positive = Field(1e-4, description="size of the strain probes whose cone is drawn")
    norms: Norms | None = Field(None, description="all sizes to compare cones at; `norm` if not given")
    rate: Positive | None = Field(None, description="strain per time step; 1e-8 if not given; for grains")
    settle: bool = Field(True, strict=True, description="whether they are read at rest; for grains")
    check_rate: bool = Field(False, strict=True, description="whether half the rate is tried, too; for grains")
    damping: Damping = Field(0.05, description="of Cundall; for grains")
    step_deg: Step = Field(10.0, le=60, description="angle between the directions that cones are first sought in")
    tolerance_deg: Positive = Field(0.5, le=30, description="to which the edges are bracketed")

    @model_validator(mode="after")
    def _norm_is_among_norms(self) -> ConeSet:
        if self.norms is not None and self.norm not in self.norms:
            raise ValueError(f"norm = {self.norm:g} must be one of the norms {', '.join(f'{n:g}' for n in self.norms)}")
        return self

    @property
    def sizes(self) -> tuple[float, ...]:
        """All norms."""
        return self.norms or (self.norm,)

    def check(self, study: AnyStudy) -> None:
        super().check(study)
        for specimen in study.specimen:
            if not self.specimens or specimen.name in self.specimens:
                specimen.check_probe(self.what, self.sizes[-1])

    def run(self, needs: Mapping[str, Parts], how: How) -> Parts:
        return {
            "probes": probe_to_edges(
                at_rest(needs, self.damping), directions.rendulic(self.step_deg), list(self.sizes), rate=self.rate,
                settle=self.settle, check_rate=self.check_rate, tolerance=self.tolerance_deg, refine_smallest=True, workers=how.threads, progress=how.progress,
            )
        }  # fmt: skip
