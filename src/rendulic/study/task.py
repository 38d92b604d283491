"""What every kind of work has, and how it is found by its name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from pkgutil import iter_modules
from typing import Any, ClassVar

from rendulic.foundation.errors import one_of
from rendulic.foundation.progress import Progress, silent
from rendulic.foundation.validation import Section
from rendulic.specimen.protocol import Specimen
from rendulic.specimen.registry import specimen_of
from rendulic.study.store.unit import Unit

__all__ = ["How", "Parts", "Task", "at_rest", "kinds_of_work", "task_from"]

Parts = Mapping[str, Any]  # each a State or an xarray.Dataset
WHERE = ("rendulic.study.tasks", "rendulic.study.specimens")  # folders that are searched for kinds of work


@dataclass(frozen=True)
class How:
    """How a task runs; no result depends on it.

    Parameters
    ----------
    progress : Progress
        Called with how far it is.
    threads : int
        That probes may use.
    """

    progress: Progress = silent
    threads: int = 1


class Task(Section):
    """One kind of work: its fields are its inputs, and its result depends on nothing but these and on what it needs.

    A subclass with a name of its `work` is found by that name wherever it lies in `rendulic.study.tasks` or `rendulic.study.specimens`, or in
    a module that another package names as an entry point of the group `rendulic.tasks`.
    """

    work: ClassVar[str] = ""  # the kind of its units
    found: ClassVar[dict[str, type[Task]]] = {}

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        super().__pydantic_init_subclass__(**kwargs)
        if cls.__dict__.get("work"):
            Task.found[cls.work] = cls

    def inputs(self) -> dict[str, Any]:
        """All fields that the result depends on, as JSON can hold them."""
        return self.model_dump(mode="json")

    @classmethod
    def from_inputs(cls, inputs: Mapping[str, Any]) -> Task:
        """The task again, from its `inputs`."""
        return cls.model_validate(dict(inputs))

    def unit(self, label: str, **needs: Unit) -> Unit:
        """The work as a unit of a plan; `label` is for people."""
        return Unit(self.work, label, self.inputs(), needs)

    def run(self, needs: Mapping[str, Parts], how: How) -> Parts:
        """The result, from those of the units that it needs.

        Raises
        ------
        RendulicError
            If the mechanics does not get there; that is written down, and other work goes on.
        """
        raise TypeError(f"{type(self).__name__} has no method run")


def at_rest(needs: Mapping[str, Parts], damping: float) -> Specimen:
    """The state that a unit starts from; grains are damped so in the probes to come."""
    specimen = specimen_of(needs["state"]["state"])
    if hasattr(specimen, "damping"):
        specimen.damping = damping
    return specimen


@cache
def kinds_of_work() -> dict[str, type[Task]]:
    """All kinds of work, by name."""
    for package in map(import_module, WHERE):
        for module in iter_modules(package.__path__):
            import_module(f"{package.__name__}.{module.name}")
    for point in entry_points(group="rendulic.tasks"):
        point.load()
    return Task.found


def task_from(kind: str, inputs: Mapping[str, Any]) -> Task:
    """The task of a unit.

    Raises
    ------
    InvalidInput
        If there is no such kind of work here.
    """
    return kinds_of_work()[one_of(kind, kinds_of_work(), "kind of work")].from_inputs(inputs)
