"""Cones of unstable directions, and how they depend on the size of the probes, with plotly."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from rendulic.report.draw import caption_of, interactive
from rendulic.report.figure import Figure, Trace, numbers
from rendulic.report.tracks import box, edge_traces, level, sector_traces, smallest_trace, work_range
from rendulic.tensors.rendulic_plane import ISOCHORIC_COMPRESSION
from rendulic.views.amplitude import Amplitude, Sizes
from rendulic.views.cones import ConeOfState, ConesView
from rendulic.views.sectors import Sector, Track

__all__ = ["amplitude", "cones"]

ROW = 26  # pixels
MOST_TICKS = 8
ZERO = {"color": "--negative", "width": 1.2, "dash": "dash"}
HATCHED = {"color": "--muted", "opacity": 0.5, "pattern": {"shape": "/", "size": 6, "solidity": 0.4}}
ISOCHORIC = {"color": "--muted", "width": 1, "dash": "dot"}


@interactive(ConesView)
def cones(name: str, views: Mapping[str, ConesView]) -> Figure:
    """Rows of states: sectors as bars, and beside them the smallest W2n."""
    low, high = min(view.low for view in views.values()), max(view.high for view in views.values())
    return Figure(
        name,
        caption_of(views),
        {label: {"": _rows(view, low, high)} for label, view in views.items()},
        {
            "height": 140 + ROW * max(len(view.rows) for view in views.values()),
            "barmode": "overlay",
            "xaxis": {
                "title": {"text": "α [°]"}, "domain": [0.0, 0.66],
                "range": [low, high], "dtick": 60 if high - low > 180.0 else 15,
            },
            "xaxis2": {"title": {"text": "smallest W2n"}, "domain": [0.7, 1.0]},
            "yaxis": {"autorange": "reversed", "type": "category"},
            "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom"},
        },
        choice="Probes",
    )  # fmt: skip


def _rows(view: ConesView, low: float, high: float) -> list[Trace]:
    seen, open_ones = (
        [(row, one) for row in view.rows for sector in which(row) for one in sector.within(low, high)]
        for which in (lambda row: row.sectors, lambda row: row.unknown)
    )
    labels = [row.label for row in view.rows]
    ends = [labels[0], labels[-1]]
    points = [(row.label, edge, width) for row, one in seen for edge, width in one.edges]
    none = [row.label for row in view.rows if row.verdict == "stable"]
    line: Trace = {"type": "scatter", "mode": "lines", "hoverinfo": "skip", "y": ends}
    return [
        _smallest(view.rows),  # first: it has all rows in their order
        line | {"x": [ISOCHORIC_COMPRESSION] * 2, "line": ISOCHORIC, "name": "undrained compression"},
        line | {"x": [0, 0], "xaxis": "x2", "line": ZERO, "showlegend": False},
        _bars(seen, "unstable") | {"marker": {"color": "--negative", "opacity": 0.75}},
        _bars(open_ones, "unknown") | {"marker": HATCHED, "name": "unknown", "showlegend": bool(open_ones)},
        *edge_traces(points, upright=False),
        {
            "type": "scatter", "mode": "text", "y": none, "x": [0.5 * (low + high)] * len(none),
            "text": ["none"] * len(none), "hoverinfo": "skip", "showlegend": False,
        },
    ]  # fmt: skip


def _bars(seen: list[tuple[ConeOfState, Sector]], what: str) -> Trace:
    return {
        "type": "bar", "orientation": "h", "y": [row.label for row, _ in seen], "showlegend": False,
        "base": numbers([one.first for _, one in seen]), "x": numbers([one.last - one.first for _, one in seen]),
        "width": 0.6, "text": [str(one) for _, one in seen], "textposition": "none",
        "hovertemplate": f"%{{y}}<br>{what} from %{{text}}<extra></extra>",
    }  # fmt: skip


def _smallest(rows: tuple[ConeOfState, ...]) -> Trace:
    return {
        "type": "scatter", "mode": "markers", "xaxis": "x2", "showlegend": False,
        "x": numbers([row.smallest for row in rows]), "y": [row.label for row in rows],
        "error_x": {"array": numbers([row.error for row in rows]), "thickness": 1, "color": "--muted"},
        "marker": {
            "symbol": ["circle" if row.is_significant else "circle-open" for row in rows], "size": 8,
            "color": ["--negative" if row.smallest < 0.0 else "--c0" for row in rows],
        },
        "customdata": numbers([row.at for row in rows]),
        "hovertemplate": "%{y}<br>smallest W2n = %{x:.3f}<br>at α = %{customdata:.4~g}°<extra></extra>",
    }  # fmt: skip


@interactive(Amplitude)
def amplitude(name: str, views: Mapping[str, Amplitude]) -> Figure:
    """One state at a time: the smallest W2n above, the edges of its sectors below."""
    first = next(iter(views.values()))
    low, high = min(view.low for view in views.values()), max(view.high for view in views.values())
    tracks = [one.track for view in views.values() for one in view.columns]
    depth = work_range(tracks)
    return Figure(
        name,
        caption_of(views),
        {
            label: {one.track.label: _sizes(one, low, high, depth) for one in view.columns}
            for label, view in views.items()
        },
        {
            "height": 560,
            "xaxis": {"title": {"text": first.quantity}, "type": "log", "anchor": "y2", **_ticks(tracks)},
            "yaxis": {"title": {"text": "smallest W2n"}, "domain": [0.48, 1.0], "range": numbers(depth)},
            "yaxis2": {
                "title": {"text": "α [°]"}, "domain": [0.0, 0.42], "range": [low, high],
                "dtick": 60 if high - low > 180.0 else 15,
            },
            "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom"},
        },
        choice="Sample",
        slide="State",
        start=-1,
        linked="state",
    )  # fmt: skip


def _ticks(tracks: list[Track]) -> dict[str, Any]:
    """At the norms themselves, if they are few."""
    norms = sorted({float(norm) for track in tracks for norm in track.at})
    if len(norms) > MOST_TICKS:
        return {"exponentformat": "e"}
    return {"tickvals": numbers(norms), "ticktext": [f"{norm:g}" for norm in norms]}


def _sizes(one: Sizes, low: float, high: float, depth: tuple[float, float]) -> list[Trace]:
    track = one.track
    ends = (float(track.at[0]), float(track.at[-1]))
    error = np.minimum(np.nan_to_num(track.error, nan=2.0), 2.0)
    filled: Trace = {"type": "scatter", "mode": "lines", "fill": "toself", "hoverinfo": "skip", "opacity": 0.4}
    around = {"x": numbers([*track.at, *track.at[::-1]]), "y": numbers([*error, *-error[::-1]])}
    traces: list[Trace] = [filled | around | {"name": "error", "line": {"color": "--muted", "width": 0}}]
    if one.plateau:
        traces.append(box(one.plateau, depth, "--c0", 0.25, name="plateau", showlegend=True))
        traces.append(box(one.plateau, (low, high), "--c0", 0.25, yaxis="y2"))
    traces += [
        level(ends, 0.0, line=ZERO),
        smallest_trace(track, "--negative", "circle", showlegend=False),
        level(ends, ISOCHORIC_COMPRESSION, yaxis="y2", line=ISOCHORIC, name="undrained compression", showlegend=True),
    ]
    return traces + sector_traces(track, low, high, "--negative", 0.0, {"yaxis": "y2"})
