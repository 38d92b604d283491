"""Maps of cones against the stress ratio, with plotly."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from rendulic.report.cones import ISOCHORIC, ZERO
from rendulic.report.draw import caption_of, interactive
from rendulic.report.figure import SYMBOLS, Figure, Trace, categories, numbers
from rendulic.report.tracks import box, level, sector_traces, smallest_trace, work_range
from rendulic.tensors.rendulic_plane import ISOCHORIC_COMPRESSION
from rendulic.views.bifurcation import BifurcationMap, MapPanel

__all__ = ["bifurcation_map"]

ASIDE = 0.12  # of the distance of two states: how far the samples of a specimen are drawn apart in all


@interactive(BifurcationMap)
def bifurcation_map(name: str, views: Mapping[str, BifurcationMap]) -> Figure:
    """Specimens side by side: unstable directions above, the smallest W2n below."""
    labels = list(dict.fromkeys(panel.label for view in views.values() for panel in view.panels))
    low, high = min(view.low for view in views.values()), max(view.high for view in views.values())
    depth = work_range(one.track for view in views.values() for panel in view.panels for one in panel.samples)
    return Figure(
        name,
        caption_of(views),
        {
            label: {
                "": [
                    trace
                    for panel in view.panels
                    for trace in _panel(panel, labels.index(panel.label), len(labels), (low, high), depth)
                ]
            }
            for label, view in views.items()
        },
        _layout(labels, low, high, depth),
        choice="Probes",
    )


def _layout(labels: list[str], low: float, high: float, depth: tuple[float, float]) -> dict[str, Any]:
    """Two rows of axes; those of a row have the same ordinates, those of a column the same abscissas."""
    count = len(labels)
    axes: dict[str, Any] = {}
    for k, label in enumerate(labels):
        upper, lower = _number(k + 1), _number(count + k + 1)
        axes[f"xaxis{upper}"] = {
            "matches": f"x{lower}",
            "showticklabels": False,
            "title": {"text": label},
            "side": "top",
        }
        axes[f"yaxis{upper}"] = {"range": [low, high], "dtick": 60 if high - low > 180.0 else 15, "matches": "y"}
        axes[f"xaxis{lower}"] = {"title": {"text": "stress ratio η = q/p"}}
        axes[f"yaxis{lower}"] = {"range": numbers(depth), "matches": f"y{count + 1}"}
    axes["yaxis"]["title"] = {"text": "α [°]"}
    axes[f"yaxis{count + 1}"]["title"] = {"text": "smallest W2n"}
    del axes["yaxis"]["matches"], axes[f"yaxis{count + 1}"]["matches"]
    return axes | {
        "height": 620,
        "grid": {"rows": 2, "columns": count, "pattern": "independent", "ygap": 0.12, "xgap": 0.08},
        "margin": {"t": 50},
        "legend": {"orientation": "h", "y": -0.12, "yanchor": "top"},
    }


def _number(k: int) -> str:
    return "" if k == 1 else str(k)


def _panel(panel: MapPanel, k: int, count: int, seen: tuple[float, float], depth: tuple[float, float]) -> list[Trace]:
    upper = {"xaxis": f"x{_number(k + 1)}", "yaxis": f"y{_number(k + 1)}"}
    lower = {"xaxis": f"x{_number(count + k + 1)}", "yaxis": f"y{_number(count + k + 1)}"}
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
    return traces
