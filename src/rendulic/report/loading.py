"""Loading curves with plotly: q and volume change against axial strain; a state that is chosen is shown elsewhere, too."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from rendulic.report.draw import interactive
from rendulic.report.figure import Figure, Trace, categories, numbers
from rendulic.views.loading import LoadingCurve, LoadingCurves

__all__ = ["loading_curves"]

MOST_RECORDS = 1500  # of one curve; more are more than the screen has points


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
    families = {label: {"": [trace for one, colour in zip(view.curves, categories(len(view.curves)), strict=True)
                             for trace in _traces(one, colour)]} for label, view in views.items()}  # fmt: skip
    return Figure(name, caption, families, layout, choice="Specimens")


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
