"""Loading curves with plotly: q and volume change against axial strain; a state that is chosen is shown elsewhere, too."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from rendulic.report.draw import interactive
from rendulic.report.figure import Figure, Trace, categories, numbers
from rendulic.views.loading import LoadingCurve, LoadingCurves

__all__ = ["loading_curves"]

MOST_RECORDS = 1500  # of one curve; more are more than the screen has points
MOST_FAINT = 200  # of one curve behind


@interactive(LoadingCurves)
def loading_curves(name: str, views: Mapping[str, LoadingCurves]) -> Figure:
    """Families of samples to choose from."""
    layout = {
        "height": 640,
        "xaxis": {"title": {"text": "axial strain ε₁ [%]"}, "anchor": "y2"},
        "yaxis": {"title": {"text": "q [kPa]"}, "domain": [0.52, 1.0]},
        "yaxis2": {"title": {"text": "ΔV/V = −ε_v [%]"}, "domain": [0.0, 0.46]},
        "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom"},
    }
    caption = f"{next(iter(views.values())).caption} Choose one to see it in the other figures."
    families = {label: {"": _all(view)} for label, view in views.items()}
    return Figure(name, caption, families, layout, choice="Specimens")


def _all(view: LoadingCurves) -> list[Trace]:
    """Single packings faint in one trace for each panel, and all that is full over them."""
    full = [one for one in view.curves if not one.is_faint]
    faint = [one for one in view.curves if one.is_faint]
    traces: list[Trace] = []
    for row, scale in enumerate((1e-3, -100.0)):
        x: list[float | None] = []
        y: list[float | None] = []
        for one in faint:
            kept = np.unique(np.linspace(0, len(one.eps_1) - 1, MOST_FAINT).astype(int))
            x += [*numbers(100.0 * one.eps_1[kept]), None]
            y += [*numbers(scale * (one.eps_v if row else one.q)[kept]), None]
        if faint:
            traces.append({
                "type": "scatter", "mode": "lines", "name": "single packings", "x": x, "y": y, "hoverinfo": "skip", "opacity": 0.5,
                "line": {"color": "--muted", "width": 0.7}, "showlegend": row == 0, "legendgroup": "single", "yaxis": "y2" if row else "y",
            })  # fmt: skip
    for one, colour in zip(full, categories(len(full)), strict=True):
        traces += _band(one, colour) + _traces(one, colour)
    return traces


def _band(one: LoadingCurve, colour: str) -> list[Trace]:
    """The interval of a mean in both panels."""
    traces: list[Trace] = []
    for row, (low, high) in enumerate(one.bands or ()):
        scale, x = (-100.0 if row else 1e-3), numbers(100.0 * one.eps_1)
        traces.append({
            "type": "scatter", "mode": "lines", "fill": "toself", "x": [*x, *x[::-1]], "hoverinfo": "skip", "showlegend": False,
            "y": [*numbers(scale * low), *numbers(scale * high)[::-1]], "line": {"color": colour, "width": 0}, "opacity": 0.35,
            "legendgroup": one.label, "yaxis": "y2" if row else "y",
        })  # fmt: skip
    return traces


def _traces(one: LoadingCurve, colour: str) -> list[Trace]:
    kept = np.unique(np.linspace(0, len(one.eps_1) - 1, MOST_RECORDS).astype(int))
    strain = numbers(100.0 * one.eps_1[kept])
    common = {
        "type": "scatter",
        "mode": "lines",
        "name": one.label,
        "legendgroup": one.label,
        "line": {"color": colour},
    }
    traces: list[Trace] = []
    values = (1e-3 * one.q[kept], -100.0 * one.eps_v[kept])
    for row, (own, unit) in enumerate(zip(values, ("q %{y:.4~g} kPa", "ΔV/V %{y:.4~g} %"), strict=True)):
        traces.append(
            common
            | {"x": strain, "y": numbers(own), "showlegend": row == 0, "yaxis": "y2" if row else "y"}
            | {"hovertemplate": f"{one.label}<br>ε₁ %{{x:.4g}} %<br>{unit}<extra></extra>"}
        )
    if one.marks:
        marks = {
            "type": "scatter", "mode": "markers", "x": numbers([100.0 * mark.eps_1 for mark in one.marks]),
            "legendgroup": one.label, "showlegend": False, "customdata": [mark.state for mark in one.marks], "name": "state",
            "marker": {"size": 10, "color": "--paper", "line": {"color": colour, "width": 2}},
            "hovertemplate": "%{customdata}<br>choose to show<extra></extra>",
        }  # fmt: skip
        traces.append(marks | {"y": numbers([1e-3 * mark.q for mark in one.marks])})
        traces.append(marks | {"y": numbers([-100.0 * mark.eps_v for mark in one.marks]), "yaxis": "y2"})
    return traces
