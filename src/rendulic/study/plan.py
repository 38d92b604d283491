"""The units of work that a study consists of, and what each of them needs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from rendulic.foundation.errors import InvalidInput
from rendulic.study.ids import SampleId, StateId
from rendulic.study.language.study import Study
from rendulic.study.store.unit import Unit
from rendulic.study.tasks.measurement import Measurement

__all__ = ["MOST_UNITS", "Plan", "plan_of"]

MOST_UNITS = 1_000_000
Where = tuple[str, StateId | None]  # name of a set, and the state


@dataclass(frozen=True)
class Plan:
    """All units of a study, and where in the study each belongs.

    Parameters
    ----------
    study : Study
        What they are of.
    units : dict of hash to Unit
        Each after those that it needs.
    samples : dict of SampleId to Unit
        Samples as made.
    states : dict of StateId to Unit
        States with the curves that led there.
    ends : dict of SampleId to Unit
        Curves after the last state.
    work : dict of table to dict of (set, StateId) to tuple of Unit
        What is measured; see `of`.
    """

    study: Study
    units: dict[str, Unit] = field(default_factory=dict)
    samples: dict[SampleId, Unit] = field(default_factory=dict)
    states: dict[StateId, Unit] = field(default_factory=dict)
    ends: dict[SampleId, Unit] = field(default_factory=dict)
    work: dict[str, dict[Where, tuple[Unit, ...]]] = field(default_factory=dict)

    def add(self, unit: Unit) -> Unit:
        """A unit of the plan; the one that is there already if it is the same work."""
        return self.units.setdefault(unit.key, unit)

    def put(self, measurement: Measurement, state: StateId | None, *units: Unit, table: str = "") -> None:
        """Add units of a measurement; under the name of another table, if one is given."""
        own = self.work.setdefault(table or measurement.table, {})
        own[measurement.name, state] = tuple(map(self.add, units))

    def state(self, state: StateId) -> Unit:
        """The unit that makes a state."""
        return self.samples[state.sample] if state.eta is None else self.states[state]

    def of(self, table: str) -> Mapping[Where, tuple[Unit, ...]]:
        """Units of a table by the name of their set and their state, in the order of the study."""
        return self.work.get(table, {})

    def specimen(self, name: str) -> Any:
        """The section of a specimen."""
        return next(each for each in self.study.specimen if each.name == name)

    def has_grains(self, state: StateId) -> bool:
        """Whether it is a state of grains."""
        return self.specimen(state.specimen).has_grains

    def load_options(self, state: StateId) -> dict[str, Any]:
        """How its specimen follows paths."""
        return self.specimen(state.specimen).load_options()

    def needed_for(self, targets: Iterable[Unit]) -> dict[str, Unit]:
        """These units and all that they need, in the order of the plan."""
        wanted: set[str] = set()
        waiting = list(targets)
        while waiting:
            unit = waiting.pop()
            if unit.key not in wanted:
                wanted.add(unit.key)
                waiting.extend(unit.needs.values())
        return {key: unit for key, unit in self.units.items() if key in wanted}


def plan_of(study: Study) -> Plan:
    """Everything that a study asks for.

    Raises
    ------
    InvalidInput
        If that is more than a million units.
    """
    _check_size(study)
    plan = Plan(study)
    for specimen in study.specimen:
        for sample in specimen.samples():
            task = specimen.make(sample)
            before = plan.add(task.unit(f"{task.work} {sample}"))
            plan.samples[sample] = before
            for eta in specimen.eta:
                state = StateId(*sample, eta)
                before = plan.add(specimen.reach(eta).unit(f"state {state}", before=before))
                plan.states[state] = before
            if specimen.to_the_end:
                plan.ends[sample] = plan.add(specimen.reach(None).unit(f"loading to the end, {sample}", before=before))
    for measurement in study.measurements():
        for place in measurement.states(study):
            measurement.add(plan, place)
    return plan


def _check_size(study: Study) -> None:
    count = sum(len(each.samples()) * (len(each.eta) + 2) for each in study.specimen)
    for measurement in study.measurements():
        for _ in measurement.states(study):
            count += measurement.count()
            if count > MOST_UNITS:
                break
    if count > MOST_UNITS:
        raise InvalidInput(f"the study asks for {count} units of work or more, and {MOST_UNITS} are allowed: split it")
