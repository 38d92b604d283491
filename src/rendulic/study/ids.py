"""Names of samples and states in a study."""

from __future__ import annotations

from typing import Literal, NamedTuple

__all__ = ["By", "SampleId", "StateId"]

By = Literal[
    "seed", "e"
]  # what tells the samples of one specimen apart: the seed of a packing, the void ratio of a sand


class SampleId(NamedTuple):
    """One packing or sand: a specimen of the study, with a seed or a void ratio.

    >>> str(SampleId("loose", "seed", 1)), SampleId("hostun", "e", 0.9).folder
    ('loose, seed 1', 'hostun_e_0.9')
    """

    specimen: str
    by: By
    value: float

    def __str__(self) -> str:
        return f"{self.specimen}, {self.own}"

    @property
    def own(self) -> str:
        """What tells it from other samples of the specimen."""
        return f"seed {self.value:.0f}" if self.by == "seed" else f"e = {self.value:g}"

    @property
    def folder(self) -> str:
        """Name of the folder of its results."""
        return f"{self.specimen}_{self.own.replace(' = ', '_').replace(' ', '_')}"


class StateId(NamedTuple):
    """A sample at a stress ratio, or as it was made (`eta` is None).

    >>> str(StateId("loose", "seed", 1, 0.3))
    'loose, seed 1, eta = 0.3'
    """

    specimen: str
    by: By
    value: float
    eta: float | None

    def __str__(self) -> str:
        return f"{self.sample}, as made" if self.eta is None else f"{self.sample}, eta = {self.eta:g}"

    @property
    def sample(self) -> SampleId:
        """Whose state it is."""
        return SampleId(self.specimen, self.by, self.value)
