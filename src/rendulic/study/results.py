"""Finished results of a study, read from its store where they are asked for; what is not finished is left out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any

from rendulic.probing.cone import Cone, cone_of
from rendulic.specimen.protocol import Specimen
from rendulic.specimen.registry import specimen_of
from rendulic.study.ids import SampleId, StateId
from rendulic.study.plan import Plan
from rendulic.study.store.store import Store
from rendulic.study.store.unit import Unit
from rendulic.study.tasks.measurement import measurements

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Results"]


class Results:
    """What the units of a plan have given so far.

    Parameters
    ----------
    plan : Plan
        Of the study.
    store : Store
        Of its folder.
    wanted : dict of hash to Unit, optional
        Units that were asked for; all of the plan if not given.
    """

    def __init__(self, plan: Plan, store: Store, wanted: Mapping[str, Unit] | None = None) -> None:
        self.plan, self.store, self.study = plan, store, plan.study
        self.wanted = dict(plan.units if wanted is None else wanted)
        self.done = store.keys() & set(plan.units)
        self._of: dict[str, Mapping[tuple[str, StateId | None], Any]] = {}

    @cached_property
    def failed(self) -> dict[Unit, str]:
        """Units that failed, and why."""
        notes = self.store.failures()
        return {
            self.wanted[key]: note["error"]
            for key, note in notes.items()
            if key in self.wanted and key not in self.done
        }

    @cached_property
    def missing(self) -> list[Unit]:
        """Units that were asked for, and are neither finished nor failed."""
        return [unit for key, unit in self.wanted.items() if key not in self.done and unit not in self.failed]

    def is_done(self, *units: Unit) -> bool:
        """Whether all these units are finished."""
        return all(unit.key in self.done for unit in units)

    def part(self, unit: Unit, name: str) -> Any:
        """One part of a unit's result."""
        return self.store.read(unit.key)[name]

    @cached_property
    def samples(self) -> list[SampleId]:
        """Samples that are finished."""
        return [sample for sample, unit in self.plan.samples.items() if self.is_done(unit)]

    @cached_property
    def states(self) -> list[StateId]:
        """States at a stress ratio that are finished."""
        return [state for state, unit in self.plan.states.items() if self.is_done(unit)]

    def sample(self, sample: SampleId) -> Specimen:
        """A sample as made."""
        return specimen_of(self.part(self.plan.samples[sample], "state"))

    def state(self, state: StateId) -> Specimen:
        """A sample in one of its states."""
        return specimen_of(self.part(self.plan.state(state), "state"))

    def about(self, sample: SampleId) -> str:
        """A sample in a few words."""
        return self.plan.specimen(sample.specimen).about(sample)

    def curve(self, state: StateId) -> xr.Dataset:
        """The curve that led to a state from the one before."""
        return self.part(self.plan.states[state], "curve")

    def end(self, sample: SampleId) -> xr.Dataset | None:
        """The curve after the last state."""
        unit = self.plan.ends.get(sample)
        return self.part(unit, "curve") if unit is not None and self.is_done(unit) else None

    def whole_curve(self, sample: SampleId) -> xr.Dataset | None:
        """The curve of a sample through all its states, as far as it goes."""
        import xarray as xr

        parts = [self.curve(state) for state in self.states if state.sample == sample]
        if (end := self.end(sample)) is not None:
            parts.append(end)
        if not parts:
            return None
        of_records = [
            part.drop_dims([dim for dim in part.dims if dim not in ("record", "component")]) for part in parts
        ]
        whole = xr.concat(
            of_records, "record", combine_attrs="drop", data_vars="minimal", coords="minimal", compat="override"
        )
        largest = [part.attrs["largest_inertial_number"] for part in parts if "largest_inertial_number" in part.attrs]
        return whole.assign_attrs(largest_inertial_number=max(largest)) if largest else whole

    def sets(self, table: str) -> dict[str, Any]:
        """The sets of a table by name."""
        return self.study.sets(table)

    def of(self, table: str) -> Mapping[tuple[str, StateId | None], Any]:
        """Finished results of a table of measurements by the name of their set and their state; read when asked for.

        What each is stands in `read` of the table's class; for "anatomy" it is the dataset with every contact.
        """
        if table not in self._of:
            units = {where: units for where, units in self.plan.of(table).items() if self.is_done(*units)}
            self._of[table] = _Read(units, lambda where: self._read(table, where[0], units[where]))
        return self._of[table]

    def _read(self, table: str, name: str, units: tuple[Unit, ...]) -> Any:
        parts = [self.store.read(unit.key) for unit in units]
        return self.sets(table)[name].read(parts) if table in measurements() else next(iter(parts[0].values()))

    def cone(self, name: str, state: StateId) -> Cone:
        """The cone of a set at a state, at the set's norm."""
        chosen = self.sets("cones")[name]
        return cone_of(self.of("cones")[name, state].sel(norm=chosen.norm))

    @cached_property
    def cones(self) -> dict[StateId, Cone]:
        """Cones of all states; of the first set that has the state."""
        found: dict[StateId, Cone] = {}
        for name, state in self.of("cones"):
            if state is not None and state not in found:
                found[state] = self.cone(name, state)
        # in the order of states, whatever that of the sets
        return {state: found[state] for state in self.plan.states if state in found}


class _Read(Mapping):
    """A mapping whose values are read when they are first asked for."""

    def __init__(self, keys: Iterable[Any], read: Callable[[Any], Any]) -> None:
        self._keys, self._how = dict.fromkeys(keys), read
        self._made: dict[Any, Any] = {}

    def __getitem__(self, key: Any) -> Any:
        if key not in self._made:
            if key not in self._keys:
                raise KeyError(key)
            self._made[key] = self._how(key)
        return self._made[key]

    def __iter__(self) -> Iterator[Any]:
        return iter(self._keys)

    def __len__(self) -> int:
        return len(self._keys)
