"""Bursts: failure that second-order work predicts and that was observed, and the motion of one state, with plotly."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from rendulic.probing.burst import VERDICTS
from rendulic.report.draw import caption_of, interactive
from rendulic.report.figure import Figure, Trace, numbers
from rendulic.report.tracks import box
from rendulic.views.burst_curves import BurstCurve, BurstCurves, Energies, Equation1
from rendulic.views.bursts import BurstsOfState, PredictedObserved

__all__ = ["burst_curves", "equation_1", "predicted_observed"]

LOOKS = {
    "settles": ("circle", "--c0"),
    "fails": ("x", "--negative"),
    "arrested": ("diamond", "--doubtful"),
    "undecided": ("square", "--muted"),
    "too fast": ("triangle-up", "--muted"),
}
ENERGIES = ("--ink", "--c0", "--c1", "--c3", "--c2")
MOST_POINTS = 2000  # of Eq. 1; more are thinned out
ALPHA = "direction of the strain increment α [°]"


@interactive(PredictedObserved)
def predicted_observed(name: str, views: Mapping[str, PredictedObserved]) -> Figure:
    """One state at a time: W2n by direction, and what was observed there."""
    first = next(iter(views.values()))
    worst = max(range(len(first.panels)), key=lambda k: int(first.panels[k].table.observed.sum()))
    return Figure(
        name,
        caption_of(views),
        {label: {panel.label: _directions(panel) for panel in view.panels} for label, view in views.items()},
        {
            "height": 420,
            "xaxis": {"title": {"text": ALPHA}, "range": [-5, 365], "dtick": 45},
            "yaxis": {"title": {"text": "W2n"}, "range": [-1.05, 1.1]},
            "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom"},
        },
        choice="Bursts",
        slide="State",
        fixed=[box((-5.0, 365.0), (-1.05, 0.0), "--negative", 0.15)],
        start=worst,
        linked="state",
    )  # fmt: skip


def _directions(panel: BurstsOfState) -> list[Trace]:
    table = panel.table
    alpha, work = table.alpha.values, table.w2_normalised.values
    traces: list[Trace] = [{
        "type": "scatter", "mode": "lines", "x": numbers(alpha), "y": numbers(work), "hoverinfo": "skip",
        "line": {"color": "--muted", "width": 1}, "showlegend": False,
    }]  # fmt: skip
    for verdict, (symbol, colour) in LOOKS.items():
        here = np.flatnonzero(table.verdict.values == VERDICTS.index(verdict)).tolist()
        if not here:
            continue
        words = [f"predicted: {panel.prediction(k)}<br>{panel.judgement(k)}" for k in here]
        traces.append({
            "type": "scatter", "mode": "markers", "name": verdict, "x": numbers(alpha[here]), "y": numbers(work[here]),
            "marker": {
                "size": 10, "color": colour,
                "symbol": [f"{symbol}-open" if panel.is_against[k] else symbol for k in here],
            },
            "customdata": words,
            "hovertemplate": "α = %{x:.4~g}°<br>W2n = %{y:.3f}<br>%{customdata}<extra>%{fullData.name}</extra>",
        })  # fmt: skip
    return traces


@interactive(BurstCurves)
def burst_curves(name: str, views: Mapping[str, BurstCurves]) -> Figure:
    """Kinetic energy, strain and energies of a state, side by side."""
    time = {"title": {"text": "time since the load is back [ms]"}}
    return Figure(
        name,
        caption_of(views),
        {label: {"": [*_motion(view), *_balance(view.energies)]} for label, view in views.items()},
        {
            "height": 420,
            "grid": {"rows": 1, "columns": 3, "pattern": "independent", "xgap": 0.16},
            "xaxis": time, "xaxis2": time, "xaxis3": time,
            "yaxis": {"title": {"text": "kinetic / stored energy"}, "type": "log", "exponentformat": "power"},
            "yaxis2": {"title": {"text": "strain / push"}, **_both_signs(_largest(views))},
            "yaxis3": {"title": {"text": "energy since rest [J]"}},
            "legend": {"orientation": "h", "y": -0.2, "yanchor": "top"},
        },
        choice="State",
    )  # fmt: skip


def _largest(views: Mapping[str, BurstCurves]) -> float:
    return max(float(np.abs(curve.strain).max()) for view in views.values() for curve in view.curves)


def _motion(view: BurstCurves) -> list[Trace]:
    traces = _push(view)
    seen: set[str] = set()
    for curve in view.curves:
        traces += _curve(curve, curve.verdict not in seen)
        seen.add(curve.verdict)
    return traces


def _push(view: BurstCurves) -> list[Trace]:
    """Shaded from the beginning until the push is taken back."""
    kinetic = np.concatenate([curve.kinetic[1:] for curve in view.curves])
    strain = np.arcsinh(np.concatenate([curve.strain for curve in view.curves]))
    return [
        box((view.begun, 0.0), (float(values.min()), float(values.max())), "--muted", 0.3, xaxis=across, yaxis=up)
        for values, across, up in ((kinetic, "x", "y"), (strain, "x2", "y2"))
    ]


def _curve(curve: BurstCurve, is_first: bool) -> list[Trace]:
    common: Trace = {
        "type": "scatter", "mode": "lines", "name": curve.verdict, "legendgroup": curve.verdict,
        "line": {"color": LOOKS[curve.verdict][1], "width": 1.3},
    }  # fmt: skip
    told = f"<extra>{curve.label}°, {curve.verdict}</extra>"
    return [
        common | {
            "x": numbers(curve.time[1:]), "y": numbers(curve.kinetic[1:]), "showlegend": is_first,
            "hovertemplate": "%{x:.3~g} ms<br>%{y:.3~g}" + told,
        },
        common | {
            "x": numbers(curve.time), "y": numbers(np.arcsinh(curve.strain)), "xaxis": "x2", "yaxis": "y2",
            "showlegend": False, "customdata": numbers(curve.strain),
            "hovertemplate": "%{x:.3~g} ms<br>%{customdata:.3~g}" + told,
        },
    ]  # fmt: skip


def _balance(energies: Energies) -> list[Trace]:
    return [
        {
            "type": "scatter", "mode": "lines", "name": name, "x": numbers(energies.time), "y": numbers(values),
            "xaxis": "x3", "yaxis": "y3", "line": {"color": colour, "width": 1.5},
            "hovertemplate": "%{x:.3~g} ms<br>%{y:.3~g} J<extra>" + f"{name}, {energies.alpha:.4g}°</extra>",
        }
        for (name, values), colour in zip(energies.parts.items(), ENERGIES, strict=True)
    ]  # fmt: skip


def _both_signs(largest: float, smallest: float = 1.0, every: int = 1) -> dict[str, Any]:
    """Ticks of an axis whose values are drawn as asinh(value / smallest): linear about zero, logarithmic beyond."""
    first = int(np.ceil(np.log10(smallest)))
    decades = [10.0**k for k in range(first, int(np.floor(np.log10(max(largest, 10.0 * smallest)))) + 1, every)]
    values = [*(-decade for decade in reversed(decades)), 0.0, *decades]
    return {
        "tickmode": "array",
        "tickvals": numbers(np.arcsinh(np.array(values) / smallest)),
        "ticktext": [f"{value:g}".replace("-", "\N{MINUS SIGN}", 1) if value < 0 else f"{value:g}" for value in values],
    }


@interactive(Equation1)
def equation_1(name: str, views: Mapping[str, Equation1]) -> Figure:
    """The change of kinetic energy in single steps against the work that should equal it."""
    smallest = min(view.smallest for view in views.values())
    largest = max(float(np.abs(view.d_kinetic).max()) for view in views.values())
    count = max(len(view.d_kinetic) for view in views.values())
    every = -(-count // MOST_POINTS)
    thinned = f" One of {every} steps is drawn." if every > 1 else ""
    ticks = _both_signs(largest, smallest, 2)
    return Figure(
        name,
        caption_of(views) + thinned,
        {label: {"": _steps(view, smallest, every)} for label, view in views.items()},
        {
            "height": 460,
            "xaxis": {"title": {"text": "work in one time step [J]"}, **ticks},
            "yaxis": {"title": {"text": "change of kinetic energy [J]"}, **ticks},
            "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom"},
        },
        choice="State",
    )


def _steps(view: Equation1, smallest: float, every: int) -> list[Trace]:
    kinetic, first, second = (values[::every] for values in (view.d_kinetic, view.first, view.second))
    end = float(np.arcsinh(np.abs(view.d_kinetic).max() / smallest))
    line: Trace = {
        "type": "scatter", "mode": "lines", "x": numbers([-end, end]), "y": numbers([-end, end]), "hoverinfo": "skip",
        "line": {"color": "--muted", "width": 1}, "showlegend": False,
    }  # fmt: skip
    return [
        line,
        *(
            {
                "type": "scatter", "mode": "markers", "name": name,
                "x": numbers(np.arcsinh(work / smallest)), "y": numbers(np.arcsinh(kinetic / smallest)),
                "marker": {"size": size, "color": colour}, "customdata": numbers(np.column_stack([work, kinetic])),
                "hovertemplate": "work %{customdata[0]:.4~g} J<br>change %{customdata[1]:.4~g} J"
                "<extra>%{fullData.name}</extra>",
            }
            for name, work, size, colour in (
                ("first and second order", first + second, 5, "--c0"), ("second order alone", second, 4, "--c1"),
            )
        ),
    ]  # fmt: skip
