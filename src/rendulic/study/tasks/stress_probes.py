"""[[stress_probes]]: stress probes from the states of a set of cones, to compare with its strain probes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from pydantic import Field

from rendulic.foundation.validation import Positive
from rendulic.loading import directions
from rendulic.probing.probe import probes_of
from rendulic.study.task import How, Parts, at_rest
from rendulic.study.tasks.measurement import AnyStudy
from rendulic.study.tasks.of_cones import OfCones
from rendulic.study.values import Step

__all__ = ["StressProbeSet"]

SOFTER = 0.2  # share of the directions of strain that stress probes should not go beyond


class StressProbeSet(OfCones):
    """Stress probes as large as the stresses that answer the strain probes of a set of cones in their softer directions."""

    table: ClassVar[str] = "stress_probes"
    work: ClassVar[str] = "stress probes"
    order: ClassVar[int] = 30

    norm: Positive | None = Field(
        None, description="size of the strain probes that they compare with; the set's if not given"
    )
    rate: Positive | None = Field(
        None, description="Pa per time step; 5e-6 of the mean stress if not given; for grains"
    )
    step_deg: Step = Field(10.0, le=60, description="angle between the directions of stress")

    def check(self, study: AnyStudy) -> None:
        cones = self.its_cones(study)
        if self.norm is not None and self.norm not in cones.sizes:
            raise ValueError(f"{self.what}: norm = {self.norm:g} is not among the sizes of {cones.what}")

    def run(self, needs: Mapping[str, Parts], how: How) -> Parts:
        answers = np.linalg.norm(needs["cone"]["probes"].d_sigma.sel(norm=self.norm).values, axis=-1)
        return {
            "probes": probes_of(
                at_rest(needs, self.damping or 0.0), directions.rendulic(self.step_deg),
                float(np.quantile(answers, SOFTER)), rate=self.rate, kind="stress", workers=how.threads,
                progress=how.progress,
            )
        }  # fmt: skip
