"""Cones and shares against the number of grains, with plotly."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from rendulic.report.draw import caption_of, interactive
from rendulic.report.figure import Figure, Trace, numbers, sequence
from rendulic.views.finite_size import FiniteSize, SizeSeries

__all__ = ["finite_size"]


@interactive(FiniteSize)
def finite_size(name: str, views: Mapping[str, FiniteSize]) -> Figure:
    """Three rows over one abscissa."""
    families = {
        label: {"": [trace for one, colour in zip(view.series, sequence(len(view.series)), strict=True) for trace in _traces(one, colour)]}
        for label, view in views.items()
    }  # fmt: skip
    return Figure(
        name, caption_of(views), families,
        {
            "height": 760,
            "xaxis": {"type": "log", "title": {"text": "number of grains N"}, "anchor": "y3"},
            "yaxis": {"title": {"text": "opening [°]"}, "domain": [0.7, 1.0]},
            "yaxis2": {"title": {"text": "smallest mean W2n"}, "domain": [0.36, 0.64]},
            "yaxis3": {"title": {"text": "packings with W2 < 0"}, "domain": [0.0, 0.3], "tickformat": ".0%", "range": [-0.03, 1.03]},
            "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom"},
        },
        choice="Packings",
    )  # fmt: skip


def _traces(one: SizeSeries, colour: str) -> list[Trace]:
    traces: list[Trace] = []
    for row, (value, low, high) in enumerate((one.opening, one.smallest, one.share)):
        traces.append({
            "type": "scatter", "mode": "lines+markers", "name": one.label, "legendgroup": one.label, "showlegend": row == 0,
            "x": numbers(one.n_grains), "y": numbers(value), "yaxis": f"y{row + 1}" if row else "y", "line": {"color": colour},
            "error_y": {
                "type": "data", "symmetric": False, "array": numbers(np.maximum(high - value, 0.0)),
                "arrayminus": numbers(np.maximum(value - low, 0.0)), "thickness": 1.2,
            },
            "hovertemplate": f"{one.label}, N = %{{x}}: %{{y:.3~g}}<extra></extra>",
        })  # fmt: skip
    inverse = one.share[0][0] * one.n_grains[0] / one.n_grains
    traces.append({
        "type": "scatter", "mode": "lines", "name": "1/N", "legendgroup": one.label, "x": numbers(one.n_grains), "y": numbers(inverse),
        "yaxis": "y3", "line": {"color": colour, "dash": "dash", "width": 1}, "hoverinfo": "skip", "showlegend": False,
    })  # fmt: skip
    return traces
