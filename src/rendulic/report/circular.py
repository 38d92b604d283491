"""Circular diagrams with plotly: states are stepped through, the others stand faint behind."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rendulic.report.draw import interactive
from rendulic.report.figure import Figure, Trace, numbers, sequence
from rendulic.views.circular import CENTRE, LANDMARKS, Around, CircularDiagram

__all__ = ["circular_diagram"]

TURN = list(range(0, 361, 3))


@interactive(CircularDiagram)
def circular_diagram(name: str, views: Mapping[str, CircularDiagram]) -> Figure:
    """Families of states to choose from, and a slider over the states of each."""
    first = next(iter(views.values()))
    return Figure(
        name, f"{first.verdict} {first.caption}" if len(views) == 1 else first.caption,
        {label: _frames(view) for label, view in views.items()}, _polar(), choice="Sample and probes", slide="State",
        fixed=[_zero_circle()], start=-1, linked="state",
    )  # fmt: skip


def _frames(view: CircularDiagram) -> dict[str, list[Trace]]:
    """The state that is chosen drawn full, the others faint behind it."""
    colours = sequence(len(view.curves))
    return {
        one.state: [
            *(
                _curve(other, colour, False)
                for other, colour in zip(view.curves, colours, strict=True)
                if other is not one
            ),
            _curve(one, colours[view.curves.index(one)], True),
        ]
        for one in view.curves
    }


def _curve(one: Around, colour: str, is_chosen: bool) -> Trace:
    alpha, work, sure = one.alpha, one.w2_normalised, one.is_significant
    trace: Trace = {
        "type": "scatterpolar", "theta": [*numbers(alpha), float(alpha[0])], "r": [*numbers(work), *numbers(work[:1])],
        "name": one.label, "line": {"color": colour, "width": 3 if is_chosen else 1.2}, "opacity": 1.0 if is_chosen else 0.6,
    }  # fmt: skip
    if not is_chosen:
        return trace | {"mode": "lines", "hoverinfo": "skip"}
    closed = [*sure, sure[0]]
    return trace | {
        "mode": "lines+markers",
        "marker": {"size": 7, "color": colour, "symbol": ["circle" if each else "circle-open" for each in closed]},
        "customdata": ["" if each else "the sign is not sure" for each in closed],
        "hovertemplate": f"α = %{{theta:.4~g}}°<br>W2n = %{{r:.3f}}<br>%{{customdata}}<extra>{one.label}</extra>",
    }


def _zero_circle() -> Trace:
    return {
        "type": "scatterpolar", "mode": "lines", "theta": TURN, "r": [0.0] * len(TURN), "fill": "toself",
        "fillcolor": "--negative-faint", "line": {"color": "--negative", "width": 1.5, "dash": "dash"},
        "name": "W2n = 0", "hoverinfo": "skip",
    }  # fmt: skip


def _polar() -> dict[str, Any]:
    marks = {0.0: "√2 dε₃", **{angle: word for word, angle in LANDMARKS.items()}, 180.0: ""}
    angles = sorted(marks)
    return {
        "height": 560,
        "polar": {
            "radialaxis": {"range": [CENTRE, 1.0], "angle": 0, "tickangle": 0, "dtick": 0.5},
            "angularaxis": {
                "tickmode": "array", "tickvals": angles, "direction": "counterclockwise",
                "ticktext": [f"{angle:.0f}° {marks[angle]}".strip() for angle in angles],
            },
        },
        "legend": {"orientation": "h", "y": -0.08, "yanchor": "top"},
        "margin": {"l": 70, "r": 70, "t": 40, "b": 40},
    }  # fmt: skip
