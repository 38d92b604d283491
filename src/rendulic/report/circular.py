"""Circular diagrams with plotly: states are stepped through, the others stand faint behind."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rendulic.report.draw import caption_of, interactive
from rendulic.report.figure import Figure, Trace, numbers, sequence
from rendulic.views.circular import CENTRE, LANDMARKS, Around, CircularDiagram, CircularPanels

__all__ = ["circular_diagram", "circular_panels"]

TURN = list(range(0, 361, 3))
LEGEND = {"orientation": "h", "y": -0.08, "yanchor": "top"}


@interactive(CircularDiagram)
def circular_diagram(name: str, views: Mapping[str, CircularDiagram]) -> Figure:
    """Families of states to choose from, and a slider over the states of each."""
    return Figure(
        name, caption_of(views), {label: _frames(view) for label, view in views.items()},
        {"height": 560, "polar": _polar(), "legend": LEGEND, "margin": {"l": 70, "r": 70, "t": 40, "b": 40}},
        choice="Sample and probes", slide="State", fixed=[_zero_circle()], start=-1, linked="state",
    )  # fmt: skip


@interactive(CircularPanels)
def circular_panels(name: str, views: Mapping[str, CircularPanels]) -> Figure:
    """All states of all panels at once, in the colours of their labels."""
    most = max(views.values(), key=lambda view: len(view.panels))
    return Figure(
        name, caption_of(views), {label: {"": _panels(view)} for label, view in views.items()},
        {"height": 60 + 440 * -(-len(most.panels) // most.columns), "legend": LEGEND, **_grid(most)}, choice="Panels",
    )  # fmt: skip


def _panels(view: CircularPanels) -> list[Trace]:
    colours = dict(zip(view.labels, sequence(len(view.labels)), strict=True))
    seen: set[str] = set()
    traces: list[Trace] = []
    for subplot, panel in zip(_subplots(view), view.panels.values(), strict=True):
        traces.append(_zero_circle() | {"subplot": subplot, "showlegend": not traces})
        for one in panel.curves:
            group = {"legendgroup": one.label, "showlegend": one.label not in seen}
            traces += [
                trace | {"subplot": subplot, "legendgroup": one.label} for trace in _of_many(one, colours[one.label])
            ]
            traces.append(_curve(one, colours[one.label], True) | group | {"subplot": subplot})
            seen.add(one.label)
    return traces


def _subplots(view: CircularPanels) -> list[str]:
    return ["polar", *(f"polar{k}" for k in range(2, len(view.panels) + 1))]


def _grid(view: CircularPanels) -> Trace:
    """A diagram with its heading above for each panel."""
    rows = -(-len(view.panels) // view.columns)
    wide, high = 1.0 / view.columns, 1.0 / rows
    layout: Trace = {"annotations": [], "margin": {"l": 20, "r": 20, "t": 20, "b": 40}}
    for k, (subplot, heading) in enumerate(zip(_subplots(view), view.panels, strict=True)):
        row, column = divmod(k, view.columns)
        left, top = column * wide, 1.0 - row * high
        layout[subplot] = _polar(brief=True) | {
            "domain": {
                "x": numbers([left + 0.1 * wide, left + 0.9 * wide]),
                "y": numbers([top - 0.95 * high, top - 0.15 * high]),
            },
        }
        layout["annotations"].append({
            "text": heading.replace("\n", ", "), "x": left + 0.5 * wide, "y": top - 0.01 * high, "xref": "paper", "yref": "paper",
            "showarrow": False, "xanchor": "center", "yanchor": "top",
        })  # fmt: skip
    return layout


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
            *_of_many(one, colours[view.curves.index(one)]),
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


def _of_many(one: Around, colour: str) -> list[Trace]:
    """Single packings, faint in one trace, and the band of their mean."""
    traces: list[Trace] = []
    common: Trace = {"type": "scatterpolar", "mode": "lines", "hoverinfo": "skip", "showlegend": False}
    if len(one.single):
        theta, r = [], []
        for work in one.single:
            theta += [*numbers(one.alpha), float(one.alpha[0]), None]
            r += [*numbers(work), *numbers(work[:1]), None]
        traces.append(common | {"theta": theta, "r": r, "line": {"color": "--muted", "width": 0.7}, "opacity": 0.5})
    if one.band is not None:
        low, high = one.band
        around = [*numbers(one.alpha), float(one.alpha[0])]
        ring = [*numbers(high), *numbers(high[:1]), *numbers(low[:1]), *numbers(low)[::-1]]
        traces.append(common | {
            "theta": [*around, *around[::-1]], "r": ring, "fill": "toself", "opacity": 0.35, "line": {"color": colour, "width": 0},
        })  # fmt: skip
    return traces


def _zero_circle() -> Trace:
    return {
        "type": "scatterpolar", "mode": "lines", "theta": TURN, "r": [0.0] * len(TURN), "fill": "toself",
        "fillcolor": "--negative-faint", "line": {"color": "--negative", "width": 1.5, "dash": "dash"},
        "name": "W2n = 0", "hoverinfo": "skip",
    }  # fmt: skip


def _polar(brief: bool = False) -> dict[str, Any]:
    """Axes from `CENTRE` to 1 with the landmarks around; angles only if `brief`."""
    marks = {0.0: "√2 dε₃", **{angle: word for word, angle in LANDMARKS.items()}, 180.0: ""}
    angles = sorted(marks)
    return {
        "radialaxis": {"range": [CENTRE, 1.0], "angle": 0, "tickangle": 0, "dtick": 0.5},
        "angularaxis": {
            "tickmode": "array", "tickvals": angles, "direction": "counterclockwise",
            "ticktext": [f"{angle:.0f}°" if brief else f"{angle:.0f}° {marks[angle]}".strip() for angle in angles],
        },
    }  # fmt: skip
