"""Clustering of negative second-order work beside its controls, with plotly."""

from __future__ import annotations

from collections.abc import Mapping

from rendulic.probing.anatomy_controls import CONTROLS
from rendulic.report.draw import caption_of, interactive
from rendulic.report.figure import SYMBOLS, Figure, Trace, numbers
from rendulic.views.anatomy_controls import COMPARED, ControlsView

__all__ = ["cluster_controls"]

COLOURS = ("--negative", "--c0", "--c1", "--c2")


@interactive(ControlsView)
def cluster_controls(name: str, views: Mapping[str, ControlsView]) -> Figure:
    """Two panels; families of specimens and sets."""
    layout = {
        "height": 420, "legend": {"orientation": "h", "y": 1.08, "yanchor": "bottom"},
        "grid": {"rows": 1, "columns": 2, "pattern": "independent", "xgap": 0.16},
        "xaxis": {"type": "category"}, "xaxis2": {"type": "category"},
        "yaxis": {"title": {"text": "Moran's I beyond a grain"}, "zeroline": True},
        "yaxis2": {"title": {"text": "I in the direction studied less control"}, "zeroline": True},
    }  # fmt: skip
    return Figure(
        name,
        caption_of(views),
        {label: {"": _traces(view)} for label, view in views.items()},
        layout,
        choice="Specimen",
    )


def _traces(view: ControlsView) -> list[Trace]:
    states = list(view.controls)
    traces: list[Trace] = [
        {
            "type": "scatter", "mode": "markers", "name": compared, "legendgroup": compared, "x": states,
            "y": numbers(view.index_of(compared)), "marker": {"color": colour, "symbol": symbol, "size": 9},
            "hovertemplate": "%{x}<br>I = %{y:.3f}<extra>" + compared + "</extra>",
        }
        for compared, colour, symbol in zip(COMPARED, COLOURS, SYMBOLS, strict=False)
    ]  # fmt: skip
    for control, colour, symbol in zip(CONTROLS, COLOURS[1:], SYMBOLS[1:], strict=False):
        value, low, high = view.left_by(control).T
        traces.append({
            "type": "scatter", "mode": "markers", "name": control, "legendgroup": control, "showlegend": False, "x": states,
            "y": numbers(value), "xaxis": "x2", "yaxis": "y2", "marker": {"color": colour, "symbol": symbol, "size": 9},
            "error_y": {"type": "data", "symmetric": False, "array": numbers(high - value), "arrayminus": numbers(value - low)},
            "hovertemplate": "%{x}<br>%{y:+.3f}<extra>less " + control + "</extra>",
        })  # fmt: skip
    return traces
