"""What a table of measurements in a study's file is."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, ClassVar, Protocol

from pydantic import Field

from rendulic.foundation.errors import InvalidInput, one_of
from rendulic.study.ids import StateId
from rendulic.study.specimens.section import SpecimenSection
from rendulic.study.store.unit import Unit
from rendulic.study.task import Parts, Task, kinds_of_work
from rendulic.study.values import Name, Names, Seeds, StressRatios, VoidRatios

__all__ = ["AnyPlan", "AnyStudy", "Measurement", "Selected", "known", "measurements"]


class AnyStudy(Protocol):
    """What a measurement may know of its study."""

    @property
    def specimen(self) -> Sequence[SpecimenSection]: ...

    def sets(self, table: str) -> Mapping[str, Any]:
        """The sets of a table by name."""


class AnyPlan(Protocol):
    """What a measurement may do to a plan."""

    @property
    def study(self) -> AnyStudy: ...

    def state(self, state: StateId) -> Unit:
        """The unit that makes a state."""

    def has_grains(self, state: StateId) -> bool:
        """Whether it is a state of grains."""

    def load_options(self, state: StateId) -> dict[str, Any]:
        """How its specimen follows paths, as JSON can hold it."""

    def put(self, measurement: Measurement, state: StateId | None, *units: Unit, table: str = "") -> None:
        """Add units of a measurement; under the name of another table, if one is given."""

    def of(self, table: str) -> Mapping[tuple[str, StateId | None], tuple[Unit, ...]]:
        """Units of a table by the name of their set and their state."""


def known(what: str, name: str, names: Iterable[str], word: str) -> str:
    """`name`, if it is one of `names`; else a `ValueError` that says in which set it is asked for, and the nearest."""
    try:
        return one_of(name, names, word)
    except InvalidInput as error:
        raise ValueError(f"{what}: {error}") from None


class Measurement(Task):
    """Work at states of the study's specimens, asked for by a table of the study's file."""

    table: ClassVar[str] = ""  # its name in TOML, as in [[cones]]
    order: ClassVar[int] = 50  # those that need results of others come after them
    of_grains: ClassVar[bool] = False  # whether only grains can be asked; states of sands are then left out
    not_inputs: ClassVar[frozenset[str]] = frozenset({"name"})  # fields that choose where, and change no result

    name: Name = Field(description="names the files of its results")

    def inputs(self) -> dict[str, Any]:
        return self.model_dump(mode="json", exclude=set(self.not_inputs))

    @classmethod
    def from_inputs(cls, inputs: Mapping[str, Any]) -> Task:
        return cls.model_validate({"name": "unit", **inputs})

    @property
    def what(self) -> str:
        """The set in words."""
        return f"{self.table} '{self.name}'"

    def states(self, study: AnyStudy) -> Iterator[StateId | None]:
        """The states that are meant, in the order of the study; None alone for what needs no state."""
        yield None

    def check(self, study: AnyStudy) -> None:
        """Raise `ValueError` if it does not fit the rest of the study."""

    def count(self) -> int:
        """How many units it has at each state, at most."""
        return 1

    def add(self, plan: AnyPlan, state: StateId | None) -> None:
        """Put its units at one state into the plan: one unit that needs the state, if a subclass does not say otherwise."""
        if state is None:
            plan.put(self, None, self.unit(self.what))
        else:
            plan.put(self, state, self.unit(f"{self.what}: {state}", state=plan.state(state)))

    def read(self, parts: Sequence[Parts]) -> Any:
        """The result of the set at one state, from those of its units: its first part, if a subclass says no other."""
        return next(iter(parts[0].values()))

    def write(self, result: Any, path: Path) -> list[Path]:
        """Write a result for people into `path`, which has no suffix yet; return the files."""
        from rendulic.io.tables import write_dataset

        return [write_dataset(result, path.with_name(f"{path.name}.nc"))]


class Selected(Measurement):
    """A measurement at some of the states; at all of them, if nothing is said."""

    not_inputs = frozenset({"name", "specimens", "seeds", "void_ratios", "eta"})

    specimens: Names = Field((), description="names of specimens; all if not given")
    seeds: Seeds = Field((), description="seeds of grains; all if not given")
    void_ratios: VoidRatios = Field((), description="initial void ratios of sands; all if not given")
    eta: StressRatios = Field((), description="stress ratios of the states; all if not given")

    def states(self, study: AnyStudy) -> Iterator[StateId | None]:
        for specimen in study.specimen:
            if (self.specimens and specimen.name not in self.specimens) or (self.of_grains and not specimen.has_grains):
                continue
            for sample in specimen.samples():
                chosen = self.seeds if sample.by == "seed" else self.void_ratios
                if not chosen or sample.value in chosen:
                    yield from self.of_sample(StateId(*sample, eta) for eta in (None, *specimen.eta))

    def of_sample(self, states: Iterator[StateId]) -> Iterator[StateId]:
        """Those of a sample's states that are meant; the first is the sample as made."""
        return (state for state in states if state.eta is not None and (not self.eta or state.eta in self.eta))

    def check(self, study: AnyStudy) -> None:
        for name in self.specimens:
            known(self.what, name, [specimen.name for specimen in study.specimen], "specimen")
        meant = [one for one in study.specimen if not self.specimens or one.name in self.specimens]
        samples = [sample for one in meant for sample in one.samples()]
        for asked, there, word in (
            (self.seeds, {sample.value for sample in samples if sample.by == "seed"}, "seed"),
            (self.void_ratios, {sample.value for sample in samples if sample.by == "e"}, "void ratio"),
            (self.eta, {eta for one in meant for eta in one.eta}, "eta"),
        ):
            if unknown := [value for value in asked if value not in there]:
                among = ", ".join(f"{value:g}" for value in sorted(there)) or "none"
                raise ValueError(
                    f"{self.what}: no specimen that is meant has {word} = {unknown[0]:g}; there are {among}"
                )
        if not any(True for _ in self.states(study)):
            raise ValueError(
                f"{self.what}: it has no state to start from: these specimens, seeds, void ratios and stress ratios have none "
                "together; give a [[specimen]] with eta = [...], or choose others"
            )


@cache
def measurements() -> dict[str, type[Measurement]]:
    """All tables of measurements that a study's file can have."""
    found = [task for task in kinds_of_work().values() if issubclass(task, Measurement) and task.__dict__.get("table")]
    return {task.table: task for task in sorted(found, key=lambda task: (task.order, task.table))}
