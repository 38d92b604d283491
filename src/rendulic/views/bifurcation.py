"""Maps of cones: unstable directions against the stress ratio, and the ratio at which they first appear."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rendulic.foundation.errors import InvalidInput
from rendulic.probing.bifurcation import map_of
from rendulic.study.ids import StateId
from rendulic.views.amplitude import sectors_in
from rendulic.views.catalogue import StudyFigure
from rendulic.views.cones import size_of_probes
from rendulic.views.sectors import Track, direction_range
from rendulic.views.view import Mark, Table, View

if TYPE_CHECKING:
    import xarray as xr

    from rendulic.study.plan import Plan
    from rendulic.study.results import Results
    from rendulic.study.store.unit import Unit

__all__ = ["STUDY_FIGURES", "BifurcationMap", "MapPanel", "Sample", "bifurcation_map", "map_of_study"]

CAPTION = (
    "Unstable directions of the strain increment (above) and smallest normalised second-order work W2n (below) against "
    "the stress ratio, each sample of a specimen in a colour of its own. Bars go from edge to edge of an unstable "
    "sector; thin bars at the edges are their uncertainty, an edge without could be made by the drift of the null probe "
    "alone, and the sign of an open dot is not sure. Dashed: where W2 first vanishes, between the last ratio at which "
    "it is surely positive and the first at which it is surely negative (shaded). Where a line is broken, a state is "
    "missing."
)


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
        The same in words, or why it was not found.
    """

    track: Track
    first: tuple[float, float, float] | None
    words: str


@dataclass(frozen=True, eq=False)
class MapPanel:
    """One specimen with its samples."""

    label: str
    samples: tuple[Sample, ...]

    @property
    def verdict(self) -> str:
        """What is known of each sample, in one clause."""
        if len(self.samples) == 1:
            return self.samples[0].words
        return "; ".join(f"{one.track.label}: {one.words}" for one in self.samples)


@dataclass(frozen=True, kw_only=True, eq=False)
class BifurcationMap(View):
    """Specimens side by side; directions in sight from `low` to `high` degrees."""

    panels: tuple[MapPanel, ...]
    low: float
    high: float


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
    tracks = [one.track for panel in panels for one in panel.samples]
    low, high = direction_range(sector for track in tracks for here in track.sectors for sector in here)
    return BifurcationMap(
        title=title,
        caption=CAPTION,
        verdict=" ".join(f"{panel.label or 'This specimen'}: {panel.verdict}." for panel in panels),
        tables=(_table(panels),),
        panels=panels,
        low=low,
        high=high,
    )


def _panel(label: str, table: xr.Dataset) -> MapPanel:
    samples = [table.isel(specimen=k) for k in range(table.sizes["specimen"])]
    return MapPanel(label, tuple(_sample(one) for one in samples))


def _sample(one: xr.Dataset) -> Sample:
    eta = one.eta.values
    states = [one.isel(eta=k) for k in range(len(eta))]
    track = Track(
        _name(one.specimen.item()),
        eta,
        tuple(sectors_in(state) if bool(state.is_unstable) else () for state in states),
        one.smallest_w2n.values,
        one.is_significant.values,
        one.drift_share.values,
    )
    first, low, high = (float(one[name]) for name in ("first_eta", "first_eta_from", "first_eta_to"))
    if not np.isfinite(first):
        return Sample(track, None, str(one.first_eta_reason.item()))
    return Sample(track, (first, low, high), f"W2 = 0 first at eta = {first:.3g} ({low:.3g} to {high:.3g})")


def _name(label: str | float) -> str:
    return label if isinstance(label, str) else f"specimen {label}"


def _table(panels: tuple[MapPanel, ...]) -> Table:
    rows: list[tuple[str, ...]] = []
    marks: list[Mark] = []
    for panel in panels:
        for one in panel.samples:
            there = np.isfinite(one.track.smallest)
            negative = there & one.track.is_significant & (one.track.smallest < 0.0)
            name = ", ".join(part for part in (panel.label, one.track.label) if part)
            rows.append((name, str(int(there.sum())), str(int(negative.sum())), one.words))
            marks.append("bad" if negative.any() else "")
    heads = ("sample", "states", "unstable", "where W2 first vanishes")
    return Table("First unstable stress ratio", heads, rows, marks=marks, marked=2)


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
