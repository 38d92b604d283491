"""Stress probes compared with strain probes, with plotly."""

from __future__ import annotations

from collections.abc import Mapping

from rendulic.report.draw import caption_of, interactive
from rendulic.report.figure import Figure, Trace, numbers
from rendulic.views.stress_probes import Compared, StressProbesView

__all__ = ["stress_probes"]


@interactive(StressProbesView)
def stress_probes(name: str, views: Mapping[str, StressProbesView]) -> Figure:
    """A slider over the states."""
    return Figure(
        name, caption_of(views),
        {label: {one.label: _traces(one) for one in view.panels} for label, view in views.items()},
        {
            "height": 420,
            "xaxis": {"title": {"text": "direction of strain [°]"}, "range": [-5, 365], "dtick": 60},
            "yaxis": {"title": {"text": "W2n"}, "range": [-1.05, 1.1]},
            "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom"},
        },
        choice="Set", slide="State", start=-1, linked="state",
    )  # fmt: skip


def _traces(one: Compared) -> list[Trace]:
    alpha = numbers(one.strain_alpha)
    rings = {"color": "--c1", "symbol": "circle-open", "size": 10}
    return [
        {"type": "scatter", "mode": "markers", "name": "strain probes", "x": alpha, "y": numbers(one.expected), "marker": rings},
        {
            "type": "scatter", "mode": "markers", "name": "stress probes", "x": alpha, "y": numbers(one.found),
            "marker": {"color": "--c0", "size": 6},
        },
    ]  # fmt: skip
