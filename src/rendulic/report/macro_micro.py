"""Macroscopic against microscopic second-order work, with plotly."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rendulic.report.draw import caption_of, interactive
from rendulic.report.figure import Figure, Trace, numbers
from rendulic.views.macro_micro import MacroMicro, Works

__all__ = ["macro_micro"]


@interactive(MacroMicro)
def macro_micro(name: str, views: Mapping[str, MacroMicro]) -> Figure:
    """Families of states to choose from, and a slider over the states of each."""
    return Figure(
        name, caption_of(views), {label: {one.state: _traces(one) for one in view.states} for label, view in views.items()},
        {
            "height": 460,
            "xaxis": {"title": {"text": "direction of the increment α [°]"}, "range": [-5, 365], "dtick": 60},
            "yaxis": {"title": {"text": "W2 [J/m³]"}},
            "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom"},
        },
        choice="Sample and probes", slide="State", start=-1, linked="state",
    )  # fmt: skip


def _traces(works: Works) -> list[Trace]:
    alpha = numbers(works.alpha)
    drawn: tuple[tuple[str, Any, Trace], ...] = (
        ("macro: boundary", works.boundary, {"mode": "lines", "line": {"color": "--c0"}}),
        (
            "micro: contacts and grains", works.micro,
            {"mode": "markers", "marker": {"color": "--c1", "symbol": "circle-open", "size": 9, "line": {"width": 2}}},
        ),
        (
            "micro: the paper's sum", works.paper,
            {"mode": "markers", "marker": {"color": "--c2", "symbol": "x-thin-open", "size": 7}},
        ),
        ("inertial term", works.inertial, {"mode": "lines", "line": {"color": "--c3", "dash": "dot"}}),
    )  # fmt: skip
    behind: list[Trace] = []
    if works.single:
        y = [each for one in works.single for each in (*numbers(one), None)]
        behind.append({
            "type": "scatter", "mode": "lines", "name": "macro, single packings", "x": [*alpha, None] * len(works.single), "y": y,
            "line": {"color": "--muted", "width": 0.7}, "opacity": 0.5, "hoverinfo": "skip",
        })  # fmt: skip
    if works.band is not None:
        low, high = works.band
        behind.append({
            "type": "scatter", "mode": "lines", "fill": "toself", "x": [*alpha, *alpha[::-1]], "y": [*numbers(low), *numbers(high)[::-1]],
            "line": {"color": "--c0", "width": 0}, "opacity": 0.3, "hoverinfo": "skip", "showlegend": False,
        })  # fmt: skip
    return behind + [
        {"type": "scatter", "name": name, "x": alpha, "y": numbers(values)}
        | look
        | {"hovertemplate": "α = %{x:.4~g}°<br>W2 = %{y:.4~g} J/m³<extra>%{fullData.name}</extra>"}
        for name, values, look in drawn
    ]
