"""Sectors of directions and the smallest W2n along an abscissa, as plotly draws them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from rendulic.probing.edges import is_unknown
from rendulic.report.figure import Trace, numbers
from rendulic.views.sectors import Sector, Track

__all__ = ["box", "edge_traces", "level", "sector_traces", "smallest_trace", "work_range"]


def edge_traces(points: Sequence[tuple[float | str, float, float]], upright: bool = True, **common: Any) -> list[Trace]:
    """Edges of sectors, (abscissa, direction, uncertainty) each: bars of their uncertainty, question marks if unknown.

    Parameters
    ----------
    upright : bool
        Whether directions are ordinates; if not, the two axes are exchanged.
    common
        Of all traces.
    """
    known = [point for point in points if not is_unknown(point[2])]
    unknown = [point for point in points if is_unknown(point[2])]
    base: Trace = {"type": "scatter", "hoverinfo": "skip", "showlegend": False} | common
    across, up, bar = ("x", "y", "error_y") if upright else ("y", "x", "error_x")

    def at(which: list[tuple[float | str, float, float]]) -> Trace:
        return {across: [point[0] for point in which], up: numbers([point[1] for point in which])}

    look = {"array": numbers([point[2] for point in known]), "color": "--ink", "thickness": 1.5, "width": 5}
    traces = []
    if known:
        traces.append(base | at(known) | {"mode": "markers", "marker": {"size": 1, "color": "--ink"}, bar: look})
    if unknown:
        traces.append(base | at(unknown) | {"mode": "text", "text": ["?"] * len(unknown)})
    return traces


def sector_traces(track: Track, low: float, high: float, colour: str, shift: float, common: Trace) -> list[Trace]:
    """Bars from edge to edge, with their uncertainty, and dotted ones where the sign is unknown; shaded between neighbours where
    one sector goes on in the next.
    """
    base: Trace = {"type": "scatter", "name": track.label, "showlegend": False} | common
    x: list[float | None] = []
    y: list[float | None] = []
    for at, one, beyond, other in track.bands():
        for turn in (turned.first - one.first for turned in one.within(low, high)):
            x += [*_short(at + shift, beyond + shift, beyond + shift, at + shift), None]
            y += [*_short(*np.add([one.first, other.first, other.last, one.last], turn).tolist()), None]
    traces: list[Trace] = []
    if x:
        filled = {"mode": "lines", "fill": "toself", "line": {"color": colour, "width": 1}, "hoverinfo": "skip"}
        traces.append(base | filled | {"x": x, "y": y, "opacity": 0.35})

    def within(states: tuple[tuple[Sector, ...], ...]) -> list[tuple[float, Sector]]:
        return [
            (_short(at + shift)[0], sector)
            for at, here in zip(track.at, states, strict=True)
            for one in here
            for sector in one.within(low, high)
        ]

    open_ones, seen = within(track.unknown), within(track.sectors)
    if open_ones:
        traces.append(base | _bars(open_ones, "--muted", "unknown") | {"opacity": 0.6})
    if seen:
        traces.append(base | _bars(seen, colour, "unstable"))
    points = [(at, edge, width) for at, sector in seen for edge, width in sector.edges]
    return traces + edge_traces(points, **common)


def _bars(seen: list[tuple[float, Sector]], colour: str, what: str) -> Trace:
    x = [each for at, _ in seen for each in (at, at, at, None)]
    y = [each for _, one in seen for each in (*_short(one.first, one.middle, one.last), None)]
    words = [each for at, one in seen for each in (*[f"{at:.4g}: {what} from {one}"] * 3, None)]
    return {
        "mode": "lines", "x": x, "y": y, "text": words,
        "line": {"color": colour, "width": 6} | ({"dash": "dot"} if what == "unknown" else {}),
        "hovertemplate": "%{text}<extra>%{fullData.name}</extra>",
    }  # fmt: skip


def smallest_trace(track: Track, colour: str, symbol: str, **common: Any) -> Trace:
    """Smallest W2n along a track with its error, open where its sign is not sure."""
    return {
        "type": "scatter", "mode": "lines+markers", "name": track.label,
        "x": numbers(track.at), "y": numbers(track.smallest),
        "error_y": {"array": numbers(track.error), "thickness": 1}, "line": {"color": colour},
        "marker": {
            "symbol": [symbol if sure else f"{symbol}-open" for sure in track.is_significant], "size": 8, "color": colour,
        },
        "hovertemplate": "%{x:.4~g}<br>smallest W2n = %{y:.3f}<extra>%{fullData.name}</extra>",
    } | common  # fmt: skip


def work_range(tracks: Iterable[Track]) -> tuple[float, float]:
    """Values of W2n to show, the smallest of all tracks and zero among them."""
    work = np.concatenate([[0.0], *(track.smallest for track in tracks)])
    return min(1.15 * float(np.nanmin(work)), -0.2), max(1.15 * float(np.nanmax(work)), 0.4)


def box(across: tuple[float, float], up: tuple[float, float], colour: str, opacity: float, **common: Any) -> Trace:
    """A shaded rectangle of which nothing is told."""
    (left, right), (bottom, top) = across, up
    return {
        "type": "scatter", "mode": "lines", "fill": "toself", "line": {"color": colour, "width": 0},
        "opacity": opacity, "hoverinfo": "skip", "showlegend": False,
        "x": numbers([left, right, right, left]), "y": numbers([bottom, bottom, top, top]),
    } | common  # fmt: skip


def level(ends: tuple[float, float], at: float, **look: Any) -> Trace:
    """A line across at one ordinate, of which nothing is told."""
    return {
        "type": "scatter", "mode": "lines", "x": numbers(ends), "y": [at, at], "hoverinfo": "skip", "showlegend": False,
    } | look  # fmt: skip


def _short(*values: float) -> list[float]:
    return numbers(values)
