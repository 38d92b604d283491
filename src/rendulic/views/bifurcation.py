"""Maps of cones: unstable directions against the stress ratio, and the ratio at which they first appear."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rendulic.foundation.errors import InvalidInput
from rendulic.probing.bifurcation import map_of
from rendulic.study.ids import StateId
from rendulic.views.amplitude import sectors_in, unknown_in
from rendulic.views.catalogue import StudyFigure
from rendulic.views.cones import size_of_probes
from rendulic.views.sectors import Track, direction_range
from rendulic.views.view import Mark, Table, View

if TYPE_CHECKING:
    import xarray as xr

    from rendulic.study.plan import Plan
    from rendulic.study.results import Results
    from rendulic.study.store.unit import Unit

__all__ = ["STUDY_FIGURES", "BifurcationMap", "MapPanel", "Sample", "Shares", "bifurcation_map", "map_of_study"]

CAPTION = (
    "Unstable directions of the strain increment (above) and smallest normalised second-order work W2n (below) against "
    "the stress ratio, each sample of a specimen in a colour of its own. Bars go from edge to edge of an unstable "
    "sector; thin bars at the edges are their uncertainty, an edge without could be made by the error alone. Grey and dotted: "
    "directions whose sign is unknown; the sign of an open dot is not sure. Dashed: where W2 first vanishes, between the last ratio "
    "up to which the sample is surely stable and the first at which it is surely unstable (shaded). Where a line is broken, a state "
    "is missing."
)
SHARES = " At the bottom, the share of the samples that are surely unstable (red), unknown (grey, hatched) and surely stable."
MOST_SAMPLES = 3  # that are named one by one in a sentence


@dataclass(frozen=True, eq=False)
class Sample:
    """One sample of a specimen.

    Parameters
    ----------
    track : Track
        Along the stress ratio.
    first : (float, float, float) or None
        Where W2 first vanishes, and the ratios on both sides of it; None if it was not found.
    words : str
        The same in words, or from which side it is known.
    """

    track: Track
    first: tuple[float, float, float] | None
    words: str


@dataclass(frozen=True, eq=False)
class Shares:
    """How many of the samples of a specimen are surely unstable, and how many unknown, at each stress ratio.

    Parameters
    ----------
    at : (n,) array
        Stress ratios.
    count, unstable, unknown : (n,) arrays of int
        Samples that have such a state, and those of them that are surely unstable, and neither that nor surely stable.
    """

    at: np.ndarray
    count: np.ndarray
    unstable: np.ndarray
    unknown: np.ndarray


@dataclass(frozen=True, eq=False)
class MapPanel:
    """One specimen with its samples.

    Parameters
    ----------
    median : str
        Where W2 first vanishes in the median of the samples, in words.
    """

    label: str
    samples: tuple[Sample, ...]
    shares: Shares
    median: str

    @property
    def verdict(self) -> str:
        """What is known of each sample, or of all if there are many, in one clause."""
        if len(self.samples) == 1:
            return self.samples[0].words
        if len(self.samples) <= MOST_SAMPLES:
            return "; ".join(f"{one.track.label}: {one.words}" for one in self.samples)
        found = sum(one.first is not None for one in self.samples)
        return f"median of {len(self.samples)} samples: {self.median} ({found} of them found)"


@dataclass(frozen=True, kw_only=True, eq=False)
class BifurcationMap(View):
    """Specimens side by side; directions in sight from `low` to `high` degrees."""

    panels: tuple[MapPanel, ...]
    low: float
    high: float

    @property
    def has_shares(self) -> bool:
        """Whether a specimen has several samples, so that shares of them are worth a look."""
        return any(len(panel.samples) > 1 for panel in self.panels)


def bifurcation_map(maps: Mapping[str, xr.Dataset], title: str = "") -> BifurcationMap:
    """Cone edges of each sample against its stress ratio.

    Parameters
    ----------
    maps : mapping of label to xarray.Dataset
        From `rd.bifurcation_map`, one for each specimen; its samples are along the dimension `specimen`.
    title : str
        Above.

    Raises
    ------
    InvalidInput
        If there is no map, or a table is none.
    """
    for label, table in maps.items():
        if "eta" not in table.dims or "first_eta" not in table:
            raise InvalidInput(f"a figure of bifurcation maps needs tables of rd.bifurcation_map, {label!r} is none")
    if not maps:
        raise InvalidInput("a figure of bifurcation maps needs the table of one specimen at least, got none")
    panels = tuple(_panel(label, table) for label, table in maps.items())
    low, high = direction_range(sector for panel in panels for one in panel.samples for sector in one.track.every)
    view = BifurcationMap(
        title=title,
        caption=CAPTION,
        verdict=" ".join(f"{panel.label or 'This specimen'}: {panel.verdict}." for panel in panels),
        tables=(_table(panels),),
        panels=panels,
        low=low,
        high=high,
    )
    if not view.has_shares:
        return view
    return replace(view, caption=CAPTION + SHARES, tables=(*view.tables, _table_of_shares(panels)))


def _panel(label: str, table: xr.Dataset) -> MapPanel:
    samples = tuple(_sample(table.isel(specimen=k)) for k in range(table.sizes["specimen"]))
    verdicts = np.array([one.track.verdicts for one in samples])
    shares = Shares(
        table.eta.values,
        (verdicts != "").sum(axis=0),
        (verdicts == "unstable").sum(axis=0),
        (verdicts == "unknown").sum(axis=0),
    )
    low, high = float(table.first_eta_median_from), float(table.first_eta_median_to)
    return MapPanel(label, samples, shares, _between(low, high))


def _between(low: float, high: float) -> str:
    """Where W2 first vanishes, from bounds that are NaN where there are none."""
    if np.isfinite(low) and np.isfinite(high):
        return f"W2 = 0 first between eta = {low:g} and {high:g}"
    if np.isfinite(high):
        return f"W2 = 0 first at or below eta = {high:g}"
    return f"W2 = 0 not by eta = {low:g}" if np.isfinite(low) else "where W2 = 0 first is not known"


def _sample(one: xr.Dataset) -> Sample:
    eta = one.eta.values
    states = [one.isel(eta=k) for k in range(len(eta))]
    track = Track(
        _name(one.specimen.item()),
        eta,
        tuple(map(sectors_in, states)),
        tuple(map(unknown_in, states)),
        one.smallest_w2n.values,
        one.is_significant.values,
        one.smallest_error.values,
    )
    first, low, high = (float(one[name]) for name in ("first_eta", "first_eta_from", "first_eta_to"))
    if np.isfinite(first):
        return Sample(track, (first, low, high), f"W2 = 0 first at eta = {first:.3g} ({low:.3g} to {high:.3g})")
    reason = str(one.first_eta_reason.item())
    return Sample(
        track,
        None,
        f"W2 = 0 first {reason}" if np.isfinite(high) else f"W2 = 0 {reason}" if np.isfinite(low) else reason,
    )


def _name(label: str | float) -> str:
    return label if isinstance(label, str) else f"specimen {label}"


def _table(panels: tuple[MapPanel, ...]) -> Table:
    rows: list[tuple[str, ...]] = []
    marks: list[Mark] = []
    for panel in panels:
        for one in panel.samples:
            verdicts = one.track.verdicts
            name = ", ".join(part for part in (panel.label, one.track.label) if part)
            counts = (sum(map(bool, verdicts)), verdicts.count("unstable"), verdicts.count("unknown"))
            rows.append((name, *map(str, counts), one.words))
            marks.append("bad" if counts[1] else "doubtful" if counts[2] else "")
    heads = ("sample", "states", "unstable", "unknown", "where W2 first vanishes")
    return Table("First unstable stress ratio", heads, rows, marks=marks, marked=2)


def _table_of_shares(panels: tuple[MapPanel, ...]) -> Table:
    rows: list[tuple[str, ...]] = []
    marks: list[Mark] = []
    for panel in panels:
        for eta, *counts in zip(*vars(panel.shares).values(), strict=True):
            count, unstable, unknown = map(int, counts)
            if count:
                cells = (f"{unstable} of {count}", f"{unknown} of {count}", f"{count - unstable - unknown} of {count}")
                rows.append((panel.label, f"{eta:g}", *cells))
                marks.append("bad" if unstable else "doubtful" if unknown else "")
    heads = ("specimen", "stress ratio", "surely unstable", "unknown", "surely stable")
    return Table("Samples by stress ratio", heads, rows, marks=marks, marked=2)


def map_of_study(results: Results) -> Mapping[str, View]:
    """The map of all specimens that have a cone, its numbers in one dataset."""
    asked = list(
        dict.fromkeys(state for _, state in results.plan.of("cones") if state is not None and state.eta is not None)
    )
    there = {state.sample for state in results.cones}
    states = [state for state in asked if state.sample in there]
    if not states:
        return {}
    names = list(dict.fromkeys(state.specimen for state in states))
    own = {name: [state for state in states if state.specimen == name] for name in names}
    maps = {name: _map(results, of_name) for name, of_name in own.items()}
    view = bifurcation_map(maps, f"Cones against the stress ratio, {size_of_probes(results)}")
    return {"map": replace(view, data=_together(results, own))}


def _map(results: Results, states: Sequence[StateId], etas: Iterable[float | None] = ()) -> xr.Dataset:
    """The map of some states, at their stress ratios and others; None where there is no cone."""
    samples = list(dict.fromkeys(state.sample for state in states))
    labels = [sample.own if len({one.specimen for one in samples}) == 1 else str(sample) for sample in samples]
    at = sorted({state.eta for state in states if state.eta is not None} | {eta for eta in etas if eta is not None})
    rows = {eta: [results.cones.get(StateId(*sample, eta)) for sample in samples] for eta in at}
    return map_of(rows, labels)


def _together(results: Results, own: Mapping[str, Sequence[StateId]]) -> xr.Dataset:
    """All samples in one table, and what the samples of each specimen have in common along the dimension `name`."""
    import xarray as xr

    states = [state for of_name in own.values() for state in of_name]
    table = _map(results, states)
    common = [name for name, variable in table.data_vars.items() if "specimen" not in variable.dims]
    spread = [_map(results, of_name, table.eta.values.tolist())[common] for of_name in own.values()]
    names = xr.DataArray(list(own), dims="name", name="name")
    return xr.merge([table.drop_vars([*common, "statistic"]), xr.concat(spread, names)], combine_attrs="override")


def _needs(plan: Plan) -> list[Unit]:
    return [
        unit
        for (_, state), units in plan.of("cones").items()
        if state is not None and state.eta is not None
        for unit in units
    ]


STUDY_FIGURES = (
    StudyFigure("map", "unstable directions against the stress ratio", "a [[cones]] set", _needs, map_of_study),
)
