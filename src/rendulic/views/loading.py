"""Loading curves with the states on them (Figs. 1 and 2 of the paper), and the table of these states."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from rendulic.probing.bootstrap import students_t
from rendulic.specimen.protocol import Specimen
from rendulic.tensors.invariants import deviatoric_stress, mean_stress, stress_ratio
from rendulic.views.catalogue import StudyFigure
from rendulic.views.ensembles import CHANCE
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
OF_MANY = (
    " A full line is the mean of packings that differ in their seeds, with its 95 % interval (Student's t, strain by strain), as far as "
    "all of them go; faint lines are single packings."
)
MOST_STRAINS = 400  # of a mean
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
    """One sample: arrays over the records, q in Pa, strains as numbers, contraction positive.

    Or the mean of many packings, with the bounds of the means of q and of eps_v in `bands`; `is_faint` for each of these.
    """

    label: str
    eps_1: np.ndarray
    q: np.ndarray
    eps_v: np.ndarray
    marks: tuple[StateMark, ...] = ()
    bands: tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]] | None = None
    is_faint: bool = False


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
    return _view(made, quantity, title, tables)


def _view(
    made: tuple[LoadingCurve, ...], quantity: Literal["q", "eps_v"], title: str, tables: tuple[Table, ...]
) -> LoadingCurves:
    full = [one for one in made if not one.is_faint]
    verdict = "; ".join(f"{one.label}: {_told(one, quantity)}" if one.label else _told(one, quantity) for one in full)
    return LoadingCurves(
        title=title,
        caption=CAPTION + (OF_MANY if len(full) < len(made) else ""),
        verdict=f"{verdict}.",
        tables=tables,
        curves=made,
        quantity=quantity,
    )


def _told(one: LoadingCurve, quantity: str) -> str:
    """The largest q, or how the volume changes in all."""
    if quantity == "q":
        k = int(np.argmax(np.abs(one.q)))
        width = "" if one.bands is None else f" ± {0.5e-3 * (one.bands[0][1][k] - one.bands[0][0][k]):.1f}"
        return f"largest q {1e-3 * one.q[k]:.1f}{width} kPa at {100 * one.eps_1[k]:.2f} % axial strain"
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


def mean_of_curves(
    curves: Mapping[str, xr.Dataset], label: str, marks: Iterable[StateMark] = (), confidence: float = 0.95
) -> tuple[LoadingCurve, ...]:
    """Curves of packings that differ in their seeds: each, faint, and their mean with its interval at equal axial strain.

    The mean goes as far as the shortest curve. Parts in which the axial strain goes back are left out of the mean.
    """
    each = [
        LoadingCurve(name, one.eps_1.values, one.q.values, one.eps_v.values, is_faint=True)
        for name, one in curves.items()
    ]
    end = min(float(one.eps_1.max()) for one in each)
    at = np.linspace(max(float(one.eps_1[0]) for one in each), end, MOST_STRAINS)
    means, bands = [], []
    for name in ("q", "eps_v"):
        values = []
        for one in each:
            ahead = np.concatenate(([True], one.eps_1[1:] > np.maximum.accumulate(one.eps_1)[:-1]))
            values.append(np.interp(at, one.eps_1[ahead], getattr(one, name)[ahead]))
        mean = np.mean(values, axis=0)
        half = students_t(len(each) - 1, confidence) * np.std(values, axis=0, ddof=1) / np.sqrt(len(each))
        means.append(mean)
        bands.append((mean - half, mean + half))
    return *each, LoadingCurve(label, at, means[0], means[1], tuple(marks), (bands[0], bands[1]))


def _mean_marks(marks: Mapping[str, Iterable[StateMark]], etas: Iterable[float], specimen: str) -> list[StateMark]:
    """The mean place of the states at each stress ratio."""
    every = [mark for own in marks.values() for mark in own]
    found = []
    for asked in etas:
        here = [mark for mark in every if mark.state.endswith(f"eta = {asked:g}")]
        if here:
            eta, eps_1, q, eps_v = (
                float(np.mean([getattr(mark, name) for mark in here])) for name in ("eta", "eps_1", "q", "eps_v")
            )
            found.append(StateMark(eta, eps_1, q, eps_v, f"{specimen}, eta = {asked:g}"))
    return found


def _curves_of(
    results: Results, samples: Iterable[SampleId], to_the_end: bool = False
) -> dict[str, tuple[str, tuple[LoadingCurve, ...], list[StateId]]]:
    """Of each specimen the mean of its packings, of what is alone its curve, with the states; by the names of files."""
    found: dict[str, tuple[str, tuple[LoadingCurve, ...], list[StateId]]] = {}
    there = {one: curve for one in samples if (curve := results.whole_curve(one)) is not None}
    if to_the_end:
        there = {one: curve for one, curve in there.items() if one in results.plan.ends}
    for specimen in dict.fromkeys(one.specimen for one in there):
        own = [one for one in there if one.specimen == specimen]
        states = {one: [state for state in results.states if state.sample == one] for one in own}
        marks = {str(one): [_mark(state, results.state(state)) for state in states[one]] for one in own}
        every = [state for one in own for state in states[one]]
        if len(own) > 1 and results.plan.specimen(specimen).has_grains:
            label = f"{specimen}, mean of {len(own)} packings"
            etas = sorted({state.eta for state in every if state.eta is not None})
            curves = mean_of_curves({str(one): there[one] for one in own}, label, _mean_marks(marks, etas, specimen))
            found[specimen] = results.about(own[0]), curves, every
            continue
        for one in own:
            has_grains = results.plan.specimen(specimen).has_grains
            about = results.about(one) + (f"; {CHANCE}" if has_grains else "")
            curve = there[one]
            single = LoadingCurve(
                str(one), curve.eps_1.values, curve.q.values, curve.eps_v.values, tuple(marks[str(one)])
            )  # fmt: skip
            found[one.folder] = about, (single,), states[one]
    return found


def _one_by_one(results: Results, quantity: Literal["q", "eps_v"]) -> dict[str, View]:
    """A view for each ensemble, and for each sample alone, that goes on to the end."""
    name = "fig1" if quantity == "q" else "fig2"
    found = _curves_of(results, results.plan.ends, to_the_end=True)
    views: dict[str, View] = {}
    for own, (about, curves, states) in found.items():
        tables = (_table_of(results, states),) if states and quantity == "q" else ()
        views[name if len(found) == 1 else f"{name}_{own}"] = _view(curves, quantity, about, tables)
    return views


def _table_of(results: Results, states: Iterable[StateId]) -> Table:
    return states_table({str(state): results.state(state) for state in states})


def _together(results: Results) -> dict[str, View]:
    """All samples that have a curve, grains and sands apart; packings of one specimen with their mean."""
    views: dict[str, View] = {}
    for has_grains, title in ((True, "grains"), (False, "sands of the model")):
        samples = [one for one in results.samples if results.plan.specimen(one.specimen).has_grains is has_grains]
        found = _curves_of(results, samples)
        if found:
            curves = tuple(one for _, own, _ in found.values() for one in own)
            states = [state for _, _, own in found.values() for state in own]
            views[title] = _view(curves, "q", title, (_table_of(results, states),) if states else ())
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
