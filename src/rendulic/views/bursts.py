"""Bursts: failure that second-order work predicts, and failure that was observed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rendulic.foundation.errors import InvalidInput
from rendulic.probing.burst import VERDICTS, judged
from rendulic.probing.edges import NEAR_EDGE
from rendulic.views.burst_curves import burst_curves, equation_1
from rendulic.views.catalogue import StudyFigure
from rendulic.views.view import Mark, Table, View

if TYPE_CHECKING:
    import xarray as xr

    from rendulic.study.plan import Plan
    from rendulic.study.results import Results
    from rendulic.study.store.unit import Unit

__all__ = ["STUDY_FIGURES", "BurstsOfState", "PredictedObserved", "all_rows", "bursts_of_study", "predicted_observed"]

CAPTION = (
    "Bursts: each state is pushed in a direction and then left to itself under the load that it had. The height of a "
    "symbol is the normalised second-order work W2n of that direction, its shape what was observed. Failure is predicted "
    "where W2n is negative from the size of the push to ten times it; open symbols are against the prediction. Not "
    f"counted are directions closer than {NEAR_EDGE:g} degrees to an edge of a cone, and stable ones whose opposite is "
    "unstable: a burst moves either way along its line."
)
MODEL = (
    "models (a test of the code and no evidence: without inertia there is no motion to be watched, and the verdict "
    "repeats the sign of the tangent)"
)
LARGEST_RATIO = 1e6  # R is infinite at 90 and 270 degrees, but for rounding
HEADS = (
    "state", "W2 < 0, lasting", "of them fail", "W2 < 0 at first", "of them do not", "W2 > 0", "of them do not", "agree",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class BurstsOfState:
    """All directions of one state, each row of them as `rd.bursts` has it.

    Parameters
    ----------
    label : str
        Of its panel.
    table : xarray.Dataset
        From `rd.bursts`.
    agrees, counted : (n,) arrays of bool
        Whether each direction agrees with its prediction, and whether it is counted; see `rd.agreement`.
    state : str
        Which state it is, for figures that move together.
    """

    label: str
    table: xr.Dataset
    agrees: np.ndarray
    counted: np.ndarray
    state: str

    @property
    def is_watched(self) -> bool:
        """Whether the motion after the push was followed, as that of grains is."""
        return "kinetic_growth" in self.table

    @property
    def agreeing(self) -> tuple[int, int]:
        """How many directions agree, and how many are counted."""
        return int((self.agrees & self.counted).sum()), int(self.counted.sum())

    def judgement(self, k: int) -> str:
        """Of one direction, in a word or two."""
        if self.counted[k]:
            return "agrees" if self.agrees[k] else "disagrees"
        return f"not counted: {'edge' if self.table.to_edge.values[k] <= NEAR_EDGE else 'opposite is unstable'}"


@dataclass(frozen=True, kw_only=True, eq=False)
class PredictedObserved(View):
    """One panel for each state."""

    panels: tuple[BurstsOfState, ...]


def predicted_observed(
    tables: Mapping[str, xr.Dataset], title: str = "", states: Mapping[str, str] | None = None
) -> PredictedObserved:
    """Predicted and observed failure of every state and direction, in tables, too.

    Parameters
    ----------
    tables : mapping of label to xarray.Dataset
        From `rd.bursts`; the directions may differ.
    title : str
        Above.
    states : mapping of label to str, optional
        The state of each label, where the label does not name it.
    """
    panels = tuple(
        BurstsOfState(label, table, *judged(table), (states or {}).get(label, label)) for label, table in tables.items()
    )
    if not panels:
        raise InvalidInput("a figure of bursts needs the table of one state at least, got none")
    kinds = {
        kind: ones
        for kind, ones in (
            ("grains", [one for one in panels if one.is_watched]),
            (MODEL, [one for one in panels if not one.is_watched]),
        )
        if ones
    }
    parts = [make(kind, ones) for make in (_summary, _disagreements, _every) for kind, ones in kinds.items()]
    return PredictedObserved(
        title=title,
        caption=CAPTION,
        verdict=" ".join(_verdict(kind, ones) for kind, ones in kinds.items()),
        tables=tuple(part for part in parts if part.rows),
        data=all_rows(tables),
        panels=panels,
    )


def all_rows(tables: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """All tables of `rd.bursts` as one with a row for each burst, verdicts in words; NaN for what models do not tell."""
    import xarray as xr

    parts = []
    for label, table in tables.items():
        words = np.array(VERDICTS)[table.verdict.values]
        rows = table.drop_vars("norm", errors="ignore").assign(
            verdict=("alpha", words),
            state=("alpha", np.full(len(words), label)),
            norm=("alpha", np.full(len(words), table.attrs.get("norm", np.nan))),
        )
        parts.append(rows.reset_index("alpha").reset_coords("alpha").rename_dims(alpha="burst"))
    every = list(dict.fromkeys(name for part in parts for name in part.data_vars))
    filled = [
        part.assign({name: ("burst", np.full(part.sizes["burst"], np.nan)) for name in every if name not in part})
        for part in parts
    ]
    return xr.concat(filled, "burst", combine_attrs="drop", data_vars="all", coords="minimal", compat="override")


def _verdict(kind: str, ones: list[BurstsOfState]) -> str:
    good, count = np.sum([one.agreeing for one in ones], axis=0)
    words = "Grains" if kind == "grains" else "Models, a test of the code only"
    return f"{words}: {good} of {count} directions agree with the prediction."


def _counts(one: BurstsOfState) -> list[int]:
    """Directions and agreeing directions: of lasting negative work, of work negative at first only, of positive work."""
    lasting, negative = one.table.predicted.values, one.table.w2_normalised.values < 0.0
    return [
        int((one.counted & which & right).sum())
        for which in (lasting, negative & ~lasting, ~negative)
        for right in (np.ones(len(one.agrees), dtype=bool), one.agrees)
    ]


def _summary(kind: str, ones: list[BurstsOfState]) -> Table:
    """One row for each state, and one for all."""
    watched = all(one.is_watched for one in ones)
    rows: list[tuple[str, ...]] = []
    marks: list[Mark] = []
    counts = [_counts(one) for one in ones]
    for one, numbers in zip(ones, counts, strict=True):
        good, count = one.agreeing
        error = (_error(one.table),) if watched else ()
        rows.append((one.label, *map(str, numbers), f"{good} of {count}", *error))
        marks.append("" if not count else "good" if good == count else "doubtful" if good else "bad")
    total = np.sum(counts, axis=0)
    if len(ones) > 1:
        rows.append(("all", *map(str, total), f"{total[1::2].sum()} of {total[::2].sum()}", *([""] if watched else [])))
        marks.append("")
    heads = (*HEADS, "energy balance error") if watched else HEADS
    goes_to = [*(one.state for one in ones), *([""] if len(ones) > 1 else [])]
    return Table(f"How many directions agree: {kind}", heads, rows, goes_to=goes_to, marks=marks, marked=7)


def _error(table: xr.Dataset) -> str:
    return f"{float(table.balance_error.max()):.0e}" if "balance_error" in table else ""


def _disagreements(kind: str, panels: list[BurstsOfState]) -> Table:
    heads = (
        "state", "α [°]", "R", "W2n", "lasting W2n", "W2n of the opposite", "observed", "energy grew by",
        "ran, in pushes", "judged",
    )  # fmt: skip
    rows: list[tuple[str, ...]] = []
    marks: list[Mark] = []
    goes_to: list[str] = []
    for panel in panels:
        for k in np.flatnonzero(~panel.agrees):
            one = panel.table.isel(alpha=int(k))
            grew = f"{float(one.kinetic_growth):.0e}" if "kinetic_growth" in one else ""
            way = f"{float(one.travelled):.1f}" if "travelled" in one else ""
            rows.append((
                panel.label, *_numbers(one), f"{float(one.w2_normalised_opposite):+.2f}", VERDICTS[int(one.verdict)], grew,
                way, panel.judgement(int(k)),
            ))  # fmt: skip
            marks.append(_mark(panel, int(k)))
            goes_to.append(panel.state)
    caption = f"Against the prediction, counted or not: {kind}"
    return Table(caption, heads, rows, goes_to=goes_to, marks=marks, marked=9)


def _every(kind: str, panels: list[BurstsOfState]) -> Table:
    rows: list[tuple[str, ...]] = []
    marks: list[Mark] = []
    for panel in panels:
        for k in range(panel.table.sizes["alpha"]):
            one = panel.table.isel(alpha=k)
            predicted = "fails" if bool(one.predicted) else "settles"
            rows.append((panel.label, *_numbers(one), predicted, VERDICTS[int(one.verdict)], panel.judgement(k)))
            marks.append(_mark(panel, k))
    heads = ("state", "α [°]", "R", "W2n", "lasting W2n", "predicted", "observed", "judged")
    return Table(f"Every direction: {kind}", heads, rows, marks=marks, marked=7, filter_by="judged")


def _numbers(one: xr.Dataset) -> tuple[str, ...]:
    ratio = float(one.ratio) + 0.0
    return (
        f"{float(one.alpha):.4g}", f"{ratio:.2f}" if abs(ratio) < LARGEST_RATIO else "∞", f"{float(one.w2_normalised):+.2f}",
        f"{float(one.w2_normalised_lasting):+.2f}",
    )  # fmt: skip


def _mark(panel: BurstsOfState, k: int) -> Mark:
    return "" if not panel.counted[k] else "good" if panel.agrees[k] else "bad"


def bursts_of_study(results: Results) -> Mapping[str, View]:
    """All states, and the curves of the state of grains in which most bursts failed."""
    found: dict[str, tuple[xr.Dataset, Mapping[float, xr.Dataset]]] = {}
    states: dict[str, str] = {}
    for (name, state), parts in results.of("bursts").items():
        label = f"{state}, bursts '{name}'" if str(state) in found else str(state)
        found[label], states[label] = parts, str(state)
    if not found:
        return {}
    tables = {label: table for label, (table, _) in found.items()}
    view = predicted_observed(tables, "Bursts, predicted and observed", states)
    made: dict[str, View] = {"bursts": view}
    watched = [one for one in view.panels if one.is_watched]
    if watched:
        worst = max(watched, key=lambda one: int(one.table.observed.sum()))
        curves = {f"{alpha:.1f}": curve for alpha, curve in found[worst.label][1].items()}
        title = f"{worst.label}, pushed by {float(worst.table.attrs['norm']):g}"
        made["bursts_curves"] = burst_curves(curves, title)
        made["bursts_equation_1"] = equation_1(curves, f"Eq. 1, {title}")
    return made


def _families(results: Results) -> Mapping[str, View]:
    words = {"bursts": "all states", "bursts_curves": "curves", "bursts_equation_1": "Eq. 1"}
    return {words[stem]: view for stem, view in bursts_of_study(results).items()}


def _needs(plan: Plan) -> list[Unit]:
    return [unit for units in plan.of("bursts").values() for unit in units]


STUDY_FIGURES = (
    StudyFigure("bursts", "predicted against observed failure", "a [[bursts]] set", _needs, bursts_of_study, _families),
)
