"""Bursts: failure that second-order work predicts, and failure that was observed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rendulic.foundation.errors import InvalidInput
from rendulic.probing.agreement import Agreement, agreement, interval_of, judged
from rendulic.probing.burst import VERDICTS
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
    f"counted are directions closer than {NEAR_EDGE:g} degrees to an edge of a cone or with a sign within its error, stable ones whose "
    "opposite is unstable (a burst moves either way along its line), and bursts that prove nothing: undecided ones, and those pushed "
    "too fast."
)
MODEL = (
    "models (a test of the code and no evidence: without inertia there is no motion to be watched, and the verdict "
    "repeats the sign of the tangent)"
)
LARGEST_RATIO = 1e6  # R is infinite at 90 and 270 degrees, but for rounding
HEADS = (
    "state", "W2 < 0, lasting", "of them fail", "W2 < 0 at first", "of them do not", "W2 > 0", "of them do not", "undecided",
    "too fast", "agree",
)  # fmt: skip
AGREE = HEADS.index("agree")
PROVE_NOTHING = (VERDICTS.index("undecided"), VERDICTS.index("too fast"))


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
        Whether each direction agrees with its prediction, and whether it is counted; see `probing.agreement.judged`.
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
        return "kinetic_share" in self.table

    @property
    def is_against(self) -> np.ndarray:
        """(n,) bool: directions that did not do what was predicted, counted or not; a burst that proves nothing is none of them."""
        return ~self.agrees & ~np.isin(self.table.verdict.values, PROVE_NOTHING)

    def prediction(self, k: int) -> str:
        """Of one direction, in a word."""
        if not self.table.is_sure.values[k]:
            return "unsure"
        return "fails" if self.table.predicted.values[k] else "settles"

    def judgement(self, k: int) -> str:
        """Of one direction, in a word or two."""
        if self.counted[k]:
            return "agrees" if self.agrees[k] else "disagrees"
        if int(self.table.verdict.values[k]) in PROVE_NOTHING:
            return f"not counted: {VERDICTS[int(self.table.verdict.values[k])]}{self._of_pushes(k)}"
        if not self.table.is_sure.values[k]:
            return "not counted: sign within its error"
        return f"not counted: {'edge' if self.table.to_edge.values[k] <= NEAR_EDGE else 'opposite is unstable'}"

    def _of_pushes(self, k: int) -> str:
        """How many of several pushes failed, if some did and others did not."""
        if "pushes" not in self.table:
            return ""
        many, failed = int(self.table.pushes.values[k]), int(self.table.pushes_failed.values[k])
        return f", {failed} of {many} pushes fail" if 0 < failed < many else ""


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
    parts = [make(kind, ones) for make in (_summary, _worth, _disagreements, _every) for kind, ones in kinds.items()]
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
    all_of = agreement([one.table for one in ones])
    if kind != "grains":
        return f"Models, a test of the code only: {all_of.agreeing} of {all_of.counted} directions agree with the prediction."
    worth = f" ({_percent(*all_of.interval)}; {all_of.expected:.0%} would by chance)" if all_of.counted else ""
    rest = f"{all_of.undecided} undecided and {all_of.too_fast} pushed too fast are not counted"
    return f"Grains: {all_of.agreeing} of {all_of.counted} directions agree with the prediction{worth}; {rest}."


def _percent(low: float, high: float) -> str:
    return f"95 % interval {100.0 * low:.0f} to {100.0 * high:.0f} %"


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
    for one in ones:
        found = agreement(one.table)
        error = (_error(one.table),) if watched else ()
        rows.append((one.label, *_cells(_counts(one), found), *error))
        alike = found.agreeing == found.counted
        marks.append("" if not found.counted else "good" if alike else "doubtful" if found.agreeing else "bad")
    if len(ones) > 1:
        total = np.sum([_counts(one) for one in ones], axis=0).tolist()
        rows.append(("all", *_cells(total, agreement([one.table for one in ones])), *([""] if watched else [])))
        marks.append("")
    heads = (*HEADS, "energy balance error") if watched else HEADS
    goes_to = [*(one.state for one in ones), *([""] if len(ones) > 1 else [])]
    return Table(f"How many directions agree: {kind}", heads, rows, goes_to=goes_to, marks=marks, marked=AGREE)


def _cells(counts: list[int], found: Agreement) -> tuple[str, ...]:
    return *map(str, counts), str(found.undecided), str(found.too_fast), f"{found.agreeing} of {found.counted}"


def _worth(kind: str, ones: list[BurstsOfState]) -> Table:
    """What the share of agreeing directions is worth; of models nothing, as their verdicts repeat the prediction."""
    found = agreement([one.table for one in ones])
    rows: list[tuple[str, ...]] = []
    if kind == "grains" and found.counted:
        kappa = "no kappa: all alike" if np.isnan(found.kappa) else f"Cohen's kappa {found.kappa:.2f}"
        control = interval_of(found.surely_stable_stays, found.surely_stable)
        rows = [
            ("agree", f"{found.agreeing} of {found.counted}", _percent(*found.interval)),
            ("would agree by chance, at the same numbers of failures", f"{found.expected:.0%}", kappa),
            (
                "predicted failures that fail", f"{found.fails_as_predicted} of {found.fails_as_predicted + found.stays_unpredicted}",
                f"Fisher's exact test: p = {found.p_value:.1g}",
            ),
            (
                "control: W2 surely positive, does not fail", f"{found.surely_stable_stays} of {found.surely_stable}",
                _percent(*control) if found.surely_stable else "",
            ),
        ]  # fmt: skip
    caption = f"What that is worth: {kind}, directions taken as independent, which those of one state are not"
    return Table(caption, ("question", "answer", "how sure"), rows)


def _error(table: xr.Dataset) -> str:
    return f"{float(table.balance_error.max()):.0e}" if "balance_error" in table else ""


def _disagreements(kind: str, panels: list[BurstsOfState]) -> Table:
    heads = (
        "state", "α [°]", "R", "W2n", "lasting W2n", "W2n of the opposite", "observed", "kinetic / stored energy",
        "ran, in pushes", "judged",
    )  # fmt: skip
    rows: list[tuple[str, ...]] = []
    marks: list[Mark] = []
    goes_to: list[str] = []
    for panel in panels:
        for k in np.flatnonzero(panel.is_against):
            one = panel.table.isel(alpha=int(k))
            grew = f"{float(one.kinetic_share):.0e}" if "kinetic_share" in one else ""
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
            rows.append(
                (panel.label, *_numbers(one), panel.prediction(k), VERDICTS[int(one.verdict)], panel.judgement(k))
            )
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
