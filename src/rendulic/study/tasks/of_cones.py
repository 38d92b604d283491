"""What is measured at the states of a set of cones, from these cones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Self

from pydantic import Field

from rendulic.foundation.validation import Positive
from rendulic.study.ids import StateId
from rendulic.study.task import Task
from rendulic.study.tasks.cones import ConeSet
from rendulic.study.tasks.measurement import AnyPlan, AnyStudy, Measurement, known
from rendulic.study.values import Damping, Name

__all__ = ["OfCones"]


class OfCones(Measurement):
    """A measurement that starts from the states and cones of a set of cones."""

    not_inputs = frozenset({"name", "cones"})

    cones: Name = Field(description="the set of cones; its states are taken")
    norm: Positive | None = Field(None, description="size of the strain probes or pushes; the set's if not given")
    damping: Damping | None = Field(None, description="of Cundall; for grains; the set's if not given")

    @classmethod
    def from_inputs(cls, inputs: Mapping[str, Any]) -> Task:
        return super().from_inputs({"cones": "unit", **inputs})

    def its_cones(self, study: AnyStudy) -> ConeSet:
        """The set of cones."""
        sets: Any = study.sets(ConeSet.table)
        return sets[known(self.what, self.cones, sets, "set of cones")]

    def check(self, study: AnyStudy) -> None:
        self.its_cones(study)

    def states(self, study: AnyStudy) -> Iterator[StateId | None]:
        return self.its_cones(study).states(study)

    def add(self, plan: AnyPlan, state: StateId | None) -> None:
        assert state is not None
        cones = self.its_cones(plan.study)
        (cone,) = plan.of(ConeSet.table)[self.cones, state]
        unit = self.like(cones).unit(f"{self.what}: {state}", state=plan.state(state), cone=cone)
        plan.put(self, state, unit)

    def like(self, cones: ConeSet) -> Self:
        """The same with the set's norm and damping, where it has none of its own."""
        damping = cones.damping if self.damping is None else self.damping
        return self.model_copy(update={"norm": self.norm or cones.norm, "damping": damping})
