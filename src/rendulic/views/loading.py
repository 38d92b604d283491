"""Loading curves with the states on them (Figs. 1 and 2 of the paper), and the table of these states."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from rendulic.specimen.protocol import Specimen
from rendulic.tensors.invariants import deviatoric_stress, mean_stress, stress_ratio
from rendulic.views.catalogue import StudyFigure
from rendulic.views.view import Table, View

if TYPE_CHECKING:
    import xarray as xr

    from rendulic.study.ids import SampleId, StateId
    from rendulic.study.plan import Plan
    from rendulic.study.results import Results
    from rendulic.study.store.unit import Unit

__all__ = ["STUDY_FIGURES", "LoadingCurve", "LoadingCurves", "StateMark", "loading_curves", "states_table"]

CAPTION = (
    "Deviatoric stress q and change of volume against axial strain; compression is positive, and a volume change below zero is "
    "a contraction. Circles are states that were probed."
)
STATE_HEADS = ("state", "η", "q [kPa]", "p [kPa]", "ε₁ [%]", "ε_v [%]", "void ratio", "contacts", "unbalanced force")


@dataclass(frozen=True)
class StateMark:
    """A state on a curve: stresses in Pa, strains as numbers."""

    eta: float
    eps_1: float
    q: float
    eps_v: float
    state: str = ""


@dataclass(frozen=True, eq=False)
class LoadingCurve:
    """One sample: arrays over the records, q in Pa, strains as numbers, contraction positive."""

    label: str
    eps_1: np.ndarray
    q: np.ndarray
    eps_v: np.ndarray
    marks: tuple[StateMark, ...] = ()


@dataclass(frozen=True, kw_only=True, eq=False)
class LoadingCurves(View):
    """Samples together; `quantity` is the one that a single panel shows."""

    curves: tuple[LoadingCurve, ...]
    quantity: Literal["q", "eps_v"] = "q"


def loading_curves(
    curves: Mapping[str, xr.Dataset],
    marks: Mapping[str, Iterable[StateMark]] | None = None,
    quantity: Literal["q", "eps_v"] = "q",
    title: str = "",
    tables: tuple[Table, ...] = (),
) -> LoadingCurves:
    """The view of curves from `load`, by label, with the states on each."""
    made = tuple(
        LoadingCurve(label, curve.eps_1.values, curve.q.values, curve.eps_v.values, tuple((marks or {}).get(label, ())))
        for label, curve in curves.items()
    )
    verdict = "; ".join(f"{one.label}: {_told(one, quantity)}" if one.label else _told(one, quantity) for one in made)
    return LoadingCurves(
        title=title,
        caption=CAPTION,
        verdict=f"{verdict}.",
        tables=tables,
        curves=made,
        quantity=quantity,
    )


def _told(one: LoadingCurve, quantity: str) -> str:
    """The largest q, or how the volume changes in all."""
    if quantity == "q":
        k = int(np.argmax(np.abs(one.q)))
        return f"largest q {1e-3 * one.q[k]:.1f} kPa at {100 * one.eps_1[k]:.2f} % axial strain"
    word = "contracts" if one.eps_v[-1] >= 0.0 else "dilates"
    return f"it {word} by {100 * abs(one.eps_v[-1]):.2f} % until {100 * one.eps_1[-1]:.2f} % axial strain"


def _mark(state: StateId, specimen: Specimen) -> StateMark:
    stress, strain = specimen.stress, specimen.strain
    return StateMark(
        float(stress_ratio(stress)),
        float(strain[0, 0]),
        float(deviatoric_stress(stress)),
        float(np.trace(strain)),
        str(state),
    )


def states_table(specimens: Mapping[str, Specimen]) -> Table:
    """One row per state: what it is; contacts and unbalanced force where there are grains."""
    rows = []
    for label, specimen in specimens.items():
        stress, strain, own = specimen.stress, specimen.strain, _of_grains(specimen)
        rows.append((
            label, f"{float(stress_ratio(stress)):.3f}", f"{1e-3 * float(deviatoric_stress(stress)):.1f}",
            f"{1e-3 * float(mean_stress(stress)):.1f}", f"{100 * strain[0, 0]:.3f}", f"{100 * np.trace(strain):.3f}", *own,
        ))  # fmt: skip
    return Table("States", STATE_HEADS, rows, goes_to=list(specimens))


def _of_grains(specimen: Any) -> tuple[str, str, str]:
    """Void ratio, contacts and unbalanced force, as far as the specimen has them."""
    if hasattr(specimen, "porosity"):
        void_ratio = specimen.porosity / (1.0 - specimen.porosity)
        return f"{void_ratio:.4f}", str(specimen.n_contacts), f"{specimen.equilibrium().unbalanced_force:.1e}"
    return (f"{specimen.void_ratio:.4f}" if hasattr(specimen, "void_ratio") else "", "", "")


# -- of a study ----------------------------------------------------------------------------------


def _to_the_end(plan: Plan) -> list[Unit]:
    return [unit for sample, end in plan.ends.items() for unit in (*_states_of(plan, sample), end)]


def _states_of(plan: Plan, sample: SampleId) -> list[Unit]:
    return [unit for state, unit in plan.states.items() if state.sample == sample]


def _one_by_one(results: Results, quantity: Literal["q", "eps_v"]) -> dict[str, View]:
    """A view for each sample that goes on to the end."""
    name = "fig1" if quantity == "q" else "fig2"
    samples = [sample for sample in results.plan.ends if results.whole_curve(sample) is not None]
    views: dict[str, View] = {}
    for sample in samples:
        curve = results.whole_curve(sample)
        assert curve is not None
        states = [state for state in results.states if state.sample == sample]
        specimens = {state: results.state(state) for state in states}
        marks = {str(sample): [_mark(state, specimen) for state, specimen in specimens.items()]}
        tables = (
            (states_table({str(state): one for state, one in specimens.items()}),) if states and quantity == "q" else ()
        )
        stem = name if len(samples) == 1 else f"{name}_{sample.folder}"
        views[stem] = loading_curves({str(sample): curve}, marks, quantity, results.about(sample), tables)
    return views


def _together(results: Results) -> dict[str, View]:
    """All samples that have a curve, grains and sands apart."""
    views: dict[str, View] = {}
    for has_grains, title in ((True, "grains"), (False, "sands of the model")):
        samples = [one for one in results.samples if results.plan.specimen(one.specimen).has_grains is has_grains]
        curves = {str(one): curve for one in samples if (curve := results.whole_curve(one)) is not None}
        if curves:
            specimens = {state: results.state(state) for state in results.states if str(state.sample) in curves}
            marks: dict[str, list[StateMark]] = {}
            for state, specimen in specimens.items():
                marks.setdefault(str(state.sample), []).append(_mark(state, specimen))
            table = states_table({str(state): one for state, one in specimens.items()})
            views[title] = loading_curves(curves, marks, "q", title, (table,) if specimens else ())
    return views


ENDS = "a [[specimen]] that goes to_the_end"
STUDY_FIGURES = (
    StudyFigure(
        "fig1", "q against axial strain", ENDS, _to_the_end, lambda results: _one_by_one(results, "q"), _together
    ),
    StudyFigure(
        "fig2", "volume change against axial strain", ENDS, _to_the_end, lambda results: _one_by_one(results, "eps_v")
    ),
)
