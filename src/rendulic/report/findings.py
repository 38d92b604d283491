"""What of a study is there to be reported."""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import cache, cached_property
from typing import TYPE_CHECKING

from rendulic.dem.assembly import Assembly
from rendulic.probing.cone import Cone
from rendulic.study.execution.campaign import recorded_plan
from rendulic.study.language.config import ConeSet, ProbeSet
from rendulic.study.plan import Place
from rendulic.study.results import Results
from rendulic.study.store.unit import Unit

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Findings", "Panel", "panel_label"]

Panel = tuple[str, int]  # packing and seed


def panel_label(panel: Panel) -> str:
    """A packing and its seed in words."""
    return f"{panel[0]}, seed {panel[1]}"


class Findings:
    """Finished results of a study in its folder; what is not finished is left out.

    Parameters
    ----------
    folder : path
        Of a study that was run, or is running.

    Raises
    ------
    InvalidInput
        If the folder holds no study that this version reads.
    """

    def __init__(self, folder: str | os.PathLike) -> None:
        self.plan, self.wanted, self.store = recorded_plan(folder)
        self.study = self.plan.study
        self.results = Results(self.plan, self.store)
        self.done = self.store.keys() & set(self.plan.units)
        self.failed = {
            key: note for key, note in self.store.failures().items() if key in self.wanted and key not in self.done
        }

    @property
    def missing(self) -> list[Unit]:
        """Units that were asked for, and are neither finished nor failed."""
        return [unit for key, unit in self.wanted.items() if key not in self.done and key not in self.failed]

    def has(self, *units: Unit) -> bool:
        """Whether all these units are finished."""
        return all(unit.key in self.done for unit in units)

    @cached_property
    def places(self) -> list[Place]:
        """States at rest that there are."""
        return [place for place, unit in self.plan.states.items() if self.has(unit)]

    @cached_property
    def panels(self) -> list[Panel]:
        """Packings that have a curve."""
        ends = [panel for panel, unit in self.plan.ends.items() if self.has(unit)]
        return list(dict.fromkeys([*((place.packing, place.seed) for place in self.places), *ends]))

    @cached_property
    def states(self) -> dict[Place, Assembly]:
        """Every state at rest."""
        return {place: self.results.state(place) for place in self.places}

    @cached_property
    def curves(self) -> dict[Panel, xr.Dataset]:
        """The whole curve of each packing, as far as it goes."""
        import xarray as xr

        found = {}
        for panel in self.panels:
            parts = [self.results.curve(place) for place in self.places if place[:2] == panel]
            if panel in self.plan.ends and self.has(self.plan.ends[panel]):
                parts.append(self.results.end(*panel))
            largest = max(part.attrs["largest_inertial_number"] for part in parts)
            whole = xr.concat(parts, "record", combine_attrs="drop")
            found[panel] = whole.assign_attrs(largest_inertial_number=largest)
        return found

    @cache  # noqa: B019 a report reads its findings once, and both go together
    def probes(self, chosen: ProbeSet) -> dict[Place, xr.Dataset]:
        """Probes of a set, of the states where all its directions are finished."""
        places = [
            place for (name, place), units in self.plan.probes.items() if name == chosen.name and self.has(*units)
        ]
        return {place: self.results.probes(chosen, place) for place in places}

    def circles(self) -> Iterator[tuple[ProbeSet, dict[Place, xr.Dataset]]]:
        """Sets of probes in the Rendulic plane that have a state."""
        for chosen in self.study.probes:
            if chosen.sphere_directions is None and self.probes(chosen):
                yield chosen, self.probes(chosen)

    @cached_property
    def cones(self) -> dict[tuple[str, Place], Cone]:
        """Cones of strain probes by the name of their set and their state."""
        sets: dict[str, ConeSet] = {chosen.name: chosen for chosen in self.study.cones}
        return {
            (name, place): self.results.cone(sets[name], place)
            for (name, place), unit in self.plan.cones.items()
            if self.has(unit) and sets[name].answering is None
        }

    @cached_property
    def bursts(self) -> dict[tuple[str, Place], xr.Dataset]:
        """Tables of bursts by the name of their set and their state."""
        return {
            (name, place): self.results.bursts(name, place)[0]
            for (name, place), unit in self.plan.bursts.items()
            if self.has(unit)
        }

    @cached_property
    def tests(self) -> dict[str, xr.Dataset]:
        """Curves of element tests."""
        return {name: self.results.test(name) for name, unit in self.plan.tests.items() if self.has(unit)}

    @cached_property
    def dissection(self) -> xr.Dataset | None:
        """The anatomy of the most unstable direction of the most unstable state, with every contact, if it was asked for."""
        done = {place: unit for place, unit in self.plan.dissections.items() if self.has(unit, *unit.needs.values())}
        if not done:
            return None
        worst = self.results.most_negative(done)
        return self.results.part(done[worst], "anatomy").assign_attrs(place=str(worst))

    def grains(self, panel: Panel) -> int:
        """How many grains a packing has."""
        packing = next(packing for packing in self.study.packing if packing.name == panel[0])
        return packing.recipe(self.study.shared).n_grains
