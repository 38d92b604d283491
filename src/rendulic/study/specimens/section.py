"""What every kind of specimen in a study's file has."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import Field

from rendulic.foundation.validation import Positive, Section
from rendulic.study.ids import SampleId
from rendulic.study.task import Task
from rendulic.study.values import Name, StressRatios

__all__ = ["SpecimenSection"]


class SpecimenSection(Section):
    """A [[specimen]]: samples of one recipe, each loaded through its states."""

    has_grains: ClassVar[bool] = False

    name: Name = Field(description="names the folders of its results")
    eta: StressRatios = Field((), description="stress ratios q/p of the states, increasing")
    axial_strain: Positive = Field(0.1, le=1, description="largest axial strain; loading ends there")
    to_the_end: bool = Field(
        False, strict=True, description="whether loading goes on to axial_strain after the last state"
    )

    def samples(self) -> list[SampleId]:
        """All samples, in order."""
        raise TypeError(f"{type(self).__name__} has no method samples")

    def about(self, sample: SampleId) -> str:
        """The sample in a few words."""
        raise TypeError(f"{type(self).__name__} has no method about")

    def make(self, sample: SampleId) -> Task:
        """Work that makes the sample: its result has the part `state`."""
        raise TypeError(f"{type(self).__name__} has no method make")

    def reach(self, eta: float | None) -> Task:
        """Work that loads a sample from its state before (`before`) to a stress ratio, or to the end if it is None.

        Its result has the parts `state` (not needed at the end) and `curve`.
        """
        raise TypeError(f"{type(self).__name__} has no method reach")

    def load_options(self) -> dict[str, Any]:
        """How its samples follow other paths, as JSON can hold it; see `follow`."""
        return {}

    def check_probe(self, what: str, norm: float) -> None:
        """Raise `ValueError` if a strain probe of this size is a loading rather than a probe."""

    def check(self) -> None:
        """Raise `ValueError` or `InvalidInput` if a sample cannot be as it is described."""
