"""Maps of cones against the stress ratio, with plotly."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from rendulic.report.cones import HATCHED, ISOCHORIC, ZERO
from rendulic.report.draw import caption_of, interactive
from rendulic.report.figure import SYMBOLS, Figure, Trace, categories, numbers
from rendulic.report.tracks import box, level, sector_traces, smallest_trace, work_range
from rendulic.tensors.rendulic_plane import ISOCHORIC_COMPRESSION
from rendulic.views.bifurcation import BifurcationMap, MapPanel, Shares

__all__ = ["bifurcation_map"]

ASIDE = 0.12  # of the distance of two states: how far the samples of a specimen are drawn apart in all


@interactive(BifurcationMap)
def bifurcation_map(name: str, views: Mapping[str, BifurcationMap]) -> Figure:
    """Specimens side by side: unstable directions above, the smallest W2n below, and shares of the samples if there are several."""
    labels = list(dict.fromkeys(panel.label for view in views.values() for panel in view.panels))
    low, high = min(view.low for view in views.values()), max(view.high for view in views.values())
    depth = work_range(one.track for view in views.values() for panel in view.panels for one in panel.samples)
    rows = 3 if any(view.has_shares for view in views.values()) else 2
    return Figure(
        name,
        caption_of(views),
        {
            label: {
                "": [
                    trace
                    for panel in view.panels
                    for trace in _panel(panel, labels.index(panel.label), len(labels), (low, high), depth, rows)
                ]
            }
            for label, view in views.items()
        },
        _layout(labels, low, high, depth, rows),
        choice="Probes",
    )


def _layout(labels: list[str], low: float, high: float, depth: tuple[float, float], rows: int) -> dict[str, Any]:
    """Rows of axes; those of a row have the same ordinates, those of a column the same abscissas."""
    count = len(labels)
    looks: list[dict[str, Any]] = [
        {"range": [low, high], "dtick": 60 if high - low > 180.0 else 15},
        {"range": numbers(depth)},
        {"range": [0, 1], "dtick": 0.5},
    ]
    titles = ("α [°]", "smallest W2n", "share")
    heights = ((0.0, 0.45), (0.55, 1.0)) if rows == 2 else ((0.0, 0.12), (0.2, 0.54), (0.6, 1.0))
    axes: dict[str, Any] = {}
    for row in range(rows):
        for k, label in enumerate(labels):
            own, last = _number(row * count + k + 1), _number((rows - 1) * count + k + 1)
            abscissa: dict[str, Any] = {"matches": f"x{last}", "showticklabels": False} if row < rows - 1 else {}
            if row == rows - 1:
                abscissa["title"] = {"text": "stress ratio η = q/p"}
            if row == 0:
                abscissa |= {"title": {"text": label}, "side": "top"}
            ordinate = looks[row] | {"domain": list(heights[rows - 1 - row])}
            ordinate |= {"title": {"text": titles[row]}} if k == 0 else {"matches": f"y{_number(row * count + 1)}"}
            axes |= {f"xaxis{own}": abscissa, f"yaxis{own}": ordinate}
    return axes | {
        "height": 520 + 50 * rows,
        "barmode": "stack",
        "grid": {"rows": rows, "columns": count, "pattern": "independent", "ygap": 0.12, "xgap": 0.08},
        "margin": {"t": 50},
        "legend": {"orientation": "h", "y": -0.12, "yanchor": "top"},
    }


def _number(k: int) -> str:
    return "" if k == 1 else str(k)


def _panel(
    panel: MapPanel, k: int, count: int, seen: tuple[float, float], depth: tuple[float, float], rows: int
) -> list[Trace]:
    numbered = [_number(row * count + k + 1) for row in range(rows)]
    upper, lower, *lowest = ({"xaxis": f"x{number}", "yaxis": f"y{number}"} for number in numbered)
    every = np.concatenate([one.track.at for one in panel.samples])
    ends = (float(every.min()), float(every.max()))
    traces = [
        level(ends, ISOCHORIC_COMPRESSION, line=ISOCHORIC, name="undrained compression", showlegend=not k, **upper),
        level(ends, 0.0, line=ZERO, **lower),
    ]
    apart = ASIDE * (len(panel.samples) > 1) * min(np.diff(one.track.at).min(initial=1.0) for one in panel.samples)
    shifts = np.linspace(-0.5, 0.5, len(panel.samples)) * apart
    for j, (one, colour, shift) in enumerate(zip(panel.samples, categories(len(panel.samples)), shifts, strict=True)):
        name = ", ".join(part for part in (panel.label, one.track.label if len(panel.samples) > 1 else "") if part)
        group = {"legendgroup": name, "name": f"{name}: {one.words}".replace("eta", "η")}
        traces += sector_traces(one.track, *seen, colour, float(shift), upper | group)
        traces.append(smallest_trace(one.track, colour, SYMBOLS[j % len(SYMBOLS)], **lower, **group))
        if one.first is not None:
            at, before, after = one.first
            for axes, span in ((upper, seen), (lower, depth)):
                line: Trace = {"y": numbers(span), "line": {"color": colour, "width": 1.2, "dash": "dash"}}
                traces.append(box((before, after), span, colour, 0.12, legendgroup=name, **axes))
                traces.append(level((at, at), 0.0, legendgroup=name, **axes) | line)
    return traces + [trace | axes for axes in lowest for trace in _shares(panel.shares)]


def _shares(shares: Shares) -> list[Trace]:
    """Bars of the samples that are surely unstable, and of those of which it is not known above them."""
    there = shares.count > 0
    at, count = shares.at[there], shares.count[there]
    width = 0.5 * float(np.diff(shares.at).min(initial=0.2))
    marks: dict[str, Trace] = {"surely unstable": {"color": "--negative", "opacity": 0.75}, "unknown": HATCHED}
    return [
        {
            "type": "bar", "x": numbers(at), "y": numbers(some[there] / count), "width": width, "name": name,
            "marker": marks[name], "showlegend": False, "text": [f"{one} of {all_}" for one, all_ in zip(some[there], count, strict=True)],
            "textposition": "none", "hovertemplate": f"%{{x:.4~g}}: %{{text}} samples {name}<extra></extra>",
        }
        for name, some in zip(marks, (shares.unstable, shares.unknown), strict=True)
    ]  # fmt: skip
