"""What a study has done, and what is missing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rendulic.views.catalogue import StudyFigure
from rendulic.views.view import Mark, Table, View

if TYPE_CHECKING:
    from rendulic.study.results import Results

__all__ = ["STUDY_FIGURES", "Done", "Missing", "done", "missing"]

MOST_NAMED = 40  # missing units that are named
MOST_KEYS = 6  # of a table in a table


class Done(View):
    """Specimens and sets of measurements that have finished units."""


class Missing(View):
    """Units that failed or were not done yet."""


def done(results: Results) -> Done:
    """The view of what has been done: only specimens and sets of which something is finished."""
    count, total = len(results.done & set(results.wanted)), len(results.wanted)
    verdict = f"{count} of {total} units of work are finished"
    if count < total:
        verdict += f", {len(results.failed)} failed, {len(results.missing)} are missing: see the end"
    tables = []
    for kind, heads, row in (
        ("grains", ("packings", "seeds", "grains", "radii [mm]", "pressure [kPa]", "friction of growth", "states at η"), _packing),
        ("chang_hicher", ("sands", "void ratios", "formulation", "pressure [kPa]", "test", "states at η"), _sand),
    ):  # fmt: skip
        rows = []
        for specimen in results.study.specimen:
            samples = [sample.value for sample in results.samples if sample.specimen == specimen.name]
            if specimen.kind == kind and samples:
                reached = sorted(
                    {state.eta for state in results.states if state.specimen == specimen.name and state.eta is not None}
                )
                rows.append(row(specimen, samples, ", ".join(f"{eta:g}" for eta in reached) or "none"))
        if rows:
            tables.append(
                Table("Specimens: grains" if kind == "grains" else "Specimens: sands of the model", heads, rows)
            )
    measured = []
    for measurement in results.study.measurements():
        found = [state for name, state in results.of(measurement.table) if name == measurement.name]
        if found:
            asked = sum(1 for _ in measurement.states(results.study))
            measured.append((measurement.what, f"{len(found)} of {asked}", _how(measurement)))
    if measured:
        tables.append(Table("Measurements", ("set", "states done", "how"), measured))
    return Done(title="What was done", verdict=f"{verdict}.", tables=tuple(tables))


def _packing(specimen: Any, seeds: list[float], eta: str) -> tuple[str, ...]:
    friction = specimen.growth_friction
    return (
        specimen.name, ", ".join(f"{seed:.0f}" for seed in seeds), str(specimen.n_grains),
        f"{1e3 * specimen.radius_min_m:g} to {1e3 * specimen.radius_max_m:g}", f"{specimen.pressure_pa / 1e3:g}",
        f"{specimen.contact.friction if friction is None else friction:g}", eta,
    )  # fmt: skip


def _sand(specimen: Any, void_ratios: list[float], eta: str) -> tuple[str, ...]:
    return (
        specimen.name, ", ".join(f"{void_ratio:g}" for void_ratio in void_ratios), specimen.formulation,
        f"{specimen.pressure_pa / 1e3:g}", specimen.path, eta,
    )  # fmt: skip


def _how(measurement: Any) -> str:
    """The values of a set that were given, in the words of the file."""
    given = measurement.model_dump(mode="json", exclude_unset=True, exclude=set(measurement.not_inputs))
    return ", ".join(f"{name} = {_short(value)}" for name, value in given.items())


def _short(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, list):
        return f"[{', '.join(map(_short, value))}]"
    if isinstance(value, dict):
        return ", ".join(value) if len(value) <= MOST_KEYS else f"{len(value)} values"
    return str(value)


def missing(results: Results) -> Missing | None:
    """The view of what failed or is missing; None if nothing is."""
    left = results.missing
    rows = [(unit.label, "failed", why) for unit, why in results.failed.items()]
    rows += [(unit.label, "missing", "not done yet") for unit in left[:MOST_NAMED]]
    if not rows:
        return None
    marks: list[Mark] = ["bad"] * len(results.failed)
    marks += ["doubtful"] * (len(rows) - len(marks))
    more = f"; {len(left) - MOST_NAMED} more units are missing" if len(left) > MOST_NAMED else ""
    table = Table("Units that are not finished", ("unit", "how", "why"), rows, marks=marks)
    verdict = f"{len(results.failed)} units failed, {len(left)} are missing{more}."
    return Missing(title="What is missing", verdict=verdict, tables=(table,))


def _missing(results: Results) -> dict[str, View]:
    view = missing(results)
    return {"missing": view} if view is not None else {}


STUDY_FIGURES = (
    StudyFigure("run", "what was done, as tables", "something to do", lambda plan: list(plan.units.values()),
                lambda results: {"run": done(results)}, in_report_only=True),
    StudyFigure("missing", "what is missing, as a table", "something to do", lambda plan: list(plan.units.values()), _missing,
                in_report_only=True),
)  # fmt: skip
