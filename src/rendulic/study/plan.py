"""The units of work that a study consists of, and what each of them needs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from rendulic.foundation.errors import InvalidInput
from rendulic.study.language.config import BurstSet, ConeSet, Packing, ProbeSet, Study
from rendulic.study.sands import MODEL_BURSTS, SANDS
from rendulic.study.store.unit import Unit

__all__ = ["BATCH", "MOST_UNITS", "Place", "Plan", "plan_of"]

BATCH = 7  # probes of one unit: with the null probe, a full vector of lanes
MOST_UNITS = 1_000_000


class Place(NamedTuple):
    """A state at rest of one packing."""

    packing: str
    seed: int
    eta: float

    def __str__(self) -> str:
        return f"{self.packing}, seed {self.seed}, eta = {self.eta:g}"


@dataclass(frozen=True)
class Plan:
    """All units of a study, and where in the study each belongs.

    Parameters
    ----------
    study : Study
        What they are of.
    units : dict of hash to Unit
        Each after those that it needs.
    packings, ends : dict of (name, seed) to Unit
        Packings under isotropic pressure, and their curves after the last state.
    states : dict of Place to Unit
        States at rest with the curves that led there.
    probes : dict of (set, Place) to list of Unit
        Batches of directions, in order.
    cones, bursts : dict of (set, Place) to Unit
        Of the sets of that name.
    dissections : dict of Place to Unit
        Every contact in the most unstable direction.
    tests : dict of str to Unit
        Element tests by name.
    extra : dict of str to Unit
        What single figures need besides.
    """

    study: Study
    units: dict[str, Unit] = field(default_factory=dict)
    packings: dict[tuple[str, int], Unit] = field(default_factory=dict)
    ends: dict[tuple[str, int], Unit] = field(default_factory=dict)
    states: dict[Place, Unit] = field(default_factory=dict)
    probes: dict[tuple[str, Place], list[Unit]] = field(default_factory=dict)
    cones: dict[tuple[str, Place], Unit] = field(default_factory=dict)
    bursts: dict[tuple[str, Place], Unit] = field(default_factory=dict)
    dissections: dict[Place, Unit] = field(default_factory=dict)
    tests: dict[str, Unit] = field(default_factory=dict)
    extra: dict[str, Unit] = field(default_factory=dict)

    def add(self, kind: str, label: str, inputs: dict[str, Any], **needs: Unit) -> Unit:
        """A unit of the plan; the one that is there already if it is the same work."""
        unit = Unit(kind, label, inputs, needs)
        return self.units.setdefault(unit.key, unit)

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
    for packing in study.packing:
        for seed in packing.seeds:
            _add_packing(plan, packing, seed)
    for probes in study.probes:
        for place in _places(study, probes):
            plan.probes[probes.name, place] = _batches(plan, probes, place)
    # those that answer others come after them
    for cones in sorted(study.cones, key=lambda cones: cones.answering is not None):
        for place in _places(study, cones):
            plan.cones[cones.name, place] = _cone(plan, cones, place)
    for bursts in study.bursts:
        _add_bursts(plan, bursts)
    settings = {"material": study.material.model_dump(), "model": study.model.model_dump()}
    for test in study.test:
        inputs = settings | {"test": test.model_dump(mode="json", exclude_unset=True)}
        plan.tests[test.name] = plan.add("element_test", f"element test {test.name}", inputs)
    _add_for_figures(plan)
    return plan


def _places(study: Study, chosen: ProbeSet | ConeSet) -> list[Place]:
    return [Place(packing.name, *picked) for packing in study.packing for picked in chosen.picks(packing)]


def _check_size(study: Study) -> None:
    count = len(study.test) + sum(len(packing.seeds) * (len(packing.eta) + 2) for packing in study.packing)
    for chosen in (*study.probes, *study.cones):
        each = -(-len(chosen.directions()) // BATCH) if isinstance(chosen, ProbeSet) else 2
        count += each * sum(chosen.count(packing) for packing in study.packing)
    if count > MOST_UNITS:
        raise InvalidInput(f"the study asks for {count} units of work, and {MOST_UNITS} are allowed: split it")


def _add_packing(plan: Plan, packing: Packing, seed: int) -> None:
    study = plan.study
    recipe = packing.recipe(study.shared)
    name = f"{packing.name}, seed {seed}"
    grains = {"contact": study.contact.model_dump(), "loading": study.loading.model_dump()}
    before = plan.add("packing", f"packing {name}", {"recipe": recipe.model_dump(), "seed": seed} | grains)
    plan.packings[packing.name, seed] = before
    loading = {
        "loading": grains["loading"], "lateral_stress_pa": recipe.pressure_pa, "axial_strain": packing.axial_strain
    }  # fmt: skip
    for eta in packing.eta:
        place = Place(packing.name, seed, eta)
        before = plan.add("state", f"state {place}", loading | {"eta": eta}, before=before)
        plan.states[place] = before
    if packing.to_the_end:
        plan.ends[packing.name, seed] = plan.add("end", f"shear to the end {name}", loading, before=before)


def _batches(plan: Plan, probes: ProbeSet, place: Place) -> list[Unit]:
    how = probes.model_dump(include={"kind", "step_deg", "sphere_directions", "norms", "n_steps", "damping", "anatomy"})
    count = len(probes.directions())
    return [
        plan.add(
            "probes",
            f"probes {probes.name} {first} to {min(first + BATCH, count) - 1}: {place}",
            how | {"norms": list(probes.norms), "first": first, "count": min(BATCH, count - first)},
            state=plan.states[place],
        )
        for first in range(0, count, BATCH)
    ]


def _cone(plan: Plan, cones: ConeSet, place: Place) -> Unit:
    how = cones.model_dump(include={"n_steps", "damping", "step_deg"})
    state = plan.states[place]
    if cones.answering is None:
        bracket = {"norms": list(cones.sizes), "tolerance_deg": cones.tolerance_deg}
        return plan.add("cone", f"cone {cones.name}: {place}", how | bracket, state=state)
    answered = plan.cones[cones.answering, place]
    return plan.add(
        "stress_probes", f"stress probes {cones.name}: {place}", how | {"norm": cones.norm}, state=state, cone=answered
    )


def _add_bursts(plan: Plan, bursts: BurstSet) -> None:
    cones = next(cones for cones in plan.study.cones if cones.name == bursts.cones)
    how = {"norm": cones.norm, "damping": cones.damping, "n_steps": bursts.n_steps, "step_deg": bursts.step_deg}
    for place in _places(plan.study, cones):
        needs = {"state": plan.states[place], "cone": plan.cones[cones.name, place]}
        plan.bursts[bursts.name, place] = plan.add("bursts", f"bursts {bursts.name}: {place}", how, **needs)


def _add_for_figures(plan: Plan) -> None:
    study, draw = plan.study, plan.study.figures.draw
    if "anatomy" in draw:
        probes = next(each for each in study.probes if each.anatomy)
        how = {"norm": probes.norms[-1], "n_steps": probes.steps_to(probes.norms[-1]), "damping": probes.damping}
        for (name, place), batches in plan.probes.items():
            if name == probes.name:
                parts = {f"probes_{k}": unit for k, unit in enumerate(batches)}
                plan.dissections[place] = plan.add(
                    "dissection", f"anatomy of {place}", how, state=plan.states[place], **parts
                )  # fmt: skip
    sand = {"pressure_pa": study.shared.pressure_pa} if study.specimen else {}
    if "map" in draw:
        for name in SANDS:
            plan.extra[f"map {name}"] = plan.add("sand_map", f"map of sand {name}", sand | {"sand": name})
    if "bursts" in draw:
        step = {"step_deg": study.bursts[0].step_deg}
        for name, eta in MODEL_BURSTS:
            inputs = sand | step | {"sand": name, "eta": eta}
            plan.extra[f"bursts {name} {eta:g}"] = plan.add("sand_bursts", f"bursts of sand {name}, {eta:g}", inputs)
