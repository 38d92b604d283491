"""Finished results of a study, read from its store where they are asked for."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from rendulic.dem.assembly import Assembly
from rendulic.probing.cone import Cone, cone_of
from rendulic.probing.consistency import stress_on_strain
from rendulic.study.language.config import ConeSet, ProbeSet
from rendulic.study.plan import Place, Plan
from rendulic.study.store.store import Store
from rendulic.study.store.unit import Unit
from rendulic.study.work import merged

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Results"]


class Results:
    """What the units of a plan have given.

    Parameters
    ----------
    plan : Plan
        Its units must be finished where they are asked for, else `InvalidInput` is raised.
    store : Store
        Of its folder.
    """

    def __init__(self, plan: Plan, store: Store) -> None:
        self.plan, self.store, self.study = plan, store, plan.study

    def part(self, unit: Unit, name: str) -> Any:
        """One part of a unit's result."""
        return self.store.read(unit.key)[name]

    def specimen(self, packing: str, seed: int) -> Assembly:
        """A packing under isotropic pressure."""
        return Assembly.from_state(self.part(self.plan.packings[packing, seed], "state"))

    def state(self, place: Place) -> Assembly:
        """A state at rest."""
        return Assembly.from_state(self.part(self.plan.states[place], "state"))

    def curve(self, place: Place) -> xr.Dataset:
        """The curve that led to a state from the one before."""
        return self.part(self.plan.states[place], "curve")

    def end(self, packing: str, seed: int) -> xr.Dataset:
        """The curve after the last state."""
        return self.part(self.plan.ends[packing, seed], "curve")

    def probes(self, chosen: ProbeSet, place: Place) -> xr.Dataset:
        """Probes in all directions as one table."""
        batches = [self.part(unit, "probes") for unit in self.plan.probes[chosen.name, place]]
        return merged(chosen.directions(), chosen.kind, batches)

    def sweep(self, chosen: ConeSet, place: Place) -> xr.Dataset:
        """Probes that bracket the edges of a cone, at all norms; of a set that answers another, stress probes."""
        return self.part(self.plan.cones[chosen.name, place], "probes")

    def cone(self, chosen: ConeSet, place: Place) -> Cone:
        """At the norm of the set."""
        return cone_of(self.sweep(chosen, place).sel(norm=chosen.norm))

    def bursts(self, name: str, place: Place) -> tuple[xr.Dataset, dict[float, xr.Dataset]]:
        """The table of a state's bursts, and the curve of each by its direction."""
        parts = self.store.read(self.plan.bursts[name, place].key)
        table = parts["bursts"]
        return table, {float(alpha): parts[f"burst_{k}"] for k, alpha in enumerate(table.alpha.values)}

    def test(self, name: str) -> xr.Dataset:
        """The curve of an element test."""
        return self.part(self.plan.tests[name], "curve")

    @cached_property
    def cones(self) -> dict[Place, Cone]:
        """Cones of strain probes; of the first set that has the state."""
        found: dict[Place, Cone] = {}
        for chosen in self.study.cones:
            for name, place in self.plan.cones:
                if name == chosen.name and chosen.answering is None and place not in found:
                    found[place] = self.cone(chosen, place)
        # in the order of states, whatever that of the sets
        return {place: found[place] for place in self.plan.states if place in found}

    @cached_property
    def stress_on_strain(self) -> dict[Place, xr.Dataset]:
        """Stress probes laid on the strain probes of the cones that they answer, where these have several sizes."""
        of_name = {chosen.name: chosen for chosen in self.study.cones}
        return {
            place: stress_on_strain(self.sweep(of_name[chosen.answering], place), self.sweep(chosen, place))
            for chosen in self.study.cones
            if chosen.answering is not None and len(of_name[chosen.answering].sizes) > 1
            for name, place in self.plan.cones
            if name == chosen.name
        }

    @cached_property
    def all_bursts(self) -> dict[Place, xr.Dataset]:
        """Tables of bursts; of the first set that has the state."""
        found: dict[Place, xr.Dataset] = {}
        for name, place in self.plan.bursts:
            if place not in found:
                found[place] = self.bursts(name, place)[0]
        return {place: found[place] for place in self.plan.states if place in found}

    def anatomies(self, chosen: ProbeSet) -> dict[Place, xr.Dataset]:
        """Probes with anatomy at their largest norm."""
        return {
            place: self.probes(chosen, place).isel(norm=-1) for name, place in self.plan.probes if name == chosen.name
        }

    def most_negative(self, places: Iterable[Place]) -> Place:
        """The state with the smallest W2n of the probes with anatomy at their largest norm."""
        chosen = next(each for each in self.study.probes if each.anatomy)
        return min(places, key=lambda place: float(self.probes(chosen, place).isel(norm=-1).w2_normalised.min()))

    def most_unstable(self) -> Place:
        """The state in which most bursts failed."""
        return max(self.all_bursts, key=lambda place: float(np.sum(self.all_bursts[place].observed.values)))
