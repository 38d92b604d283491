"""Tests along paths with plotly: stress and strain, the stress path, volume, and the second-order work along it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rendulic.report.draw import interactive
from rendulic.report.figure import Figure, Trace, categories, numbers
from rendulic.views.paths import TestsAlongPaths

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["tests_along_paths"]

MOST_RECORDS = 400  # of one curve on the page
PANELS = (("eps_1", "q"), ("eps_1", "eps_v"), ("p", "q"), ("eps_1", "w2_normalised"))
AXES: dict[str, tuple[str, float]] = {
    "eps_1": ("ε₁ [%]", 100.0), "eps_v": ("ε_v [%]", 100.0), "p": ("p [kPa]", 1e-3), "q": ("q [kPa]", 1e-3),
    "w2_normalised": ("W2n along the path", 1.0),
}  # fmt: skip


@interactive(TestsAlongPaths)
def tests_along_paths(name: str, views: Mapping[str, TestsAlongPaths]) -> Figure:
    """Four panels, or three where the volume does not change; one family for each view."""
    swells = any(view.swells for view in views.values())
    panels = [panel for panel in PANELS if swells or "eps_v" not in panel]
    layout: dict[str, Any] = {
        "height": 640 if swells else 360, "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom"},
        "grid": {"rows": 2 if swells else 1, "columns": 2 if swells else 3, "pattern": "independent", "ygap": 0.25, "xgap": 0.16},
    }  # fmt: skip
    for k, (across, up) in enumerate(panels):
        axis = str(k + 1) if k else ""
        layout[f"xaxis{axis}"] = {"title": {"text": AXES[across][0]}}
        layout[f"yaxis{axis}"] = {"title": {"text": AXES[up][0]}}
    caption = next(iter(views.values())).caption
    thinned = any(curve.sizes["record"] > MOST_RECORDS for view in views.values() for curve in view.curves.values())
    if thinned:
        caption += f" At most {MOST_RECORDS} records of a curve are drawn here; the files have all."
    families = {
        label: {"": [trace for (test, curve), colour in zip(view.curves.items(), categories(len(view.curves)), strict=True)
                     for trace in _traces(test, curve, colour, panels)]}
        for label, view in views.items()
    }  # fmt: skip
    return Figure(name, caption, families, layout, choice="Tests")


def _traces(name: str, curve: xr.Dataset, colour: str, panels: Sequence[tuple[str, str]]) -> list[Trace]:
    kept = np.unique(np.linspace(0, curve.sizes["record"] - 1, MOST_RECORDS).astype(int))
    traces: list[Trace] = []
    for k, (across, up) in enumerate(panels):
        if up not in curve:
            continue
        axis = str(k + 1) if k else ""
        own = {"type": "scatter", "name": name, "legendgroup": name, "xaxis": f"x{axis}", "yaxis": f"y{axis}"}
        x, y = (numbers(AXES[each][1] * curve[each].values[kept]) for each in (across, up))
        hover = f"{AXES[across][0]} %{{x:.4g}}<br>{AXES[up][0]} %{{y:.4g}}<extra>{name}</extra>"
        line = {
            "mode": "lines",
            "x": x,
            "y": y,
            "line": {"color": colour},
            "showlegend": k == 0,
            "hovertemplate": hover,
        }
        traces.append(own | line)
        if "event_" + across in curve and "event_" + up in curve:
            traces.append(own | _events(curve, across, up, colour))
    return traces


def _events(curve: xr.Dataset, across: str, up: str, colour: str) -> Trace:
    """Events of the assembly; those of single planes are many."""
    chosen = np.flatnonzero(curve.event_plane.values == -1)
    x, y = (numbers(AXES[each][1] * curve[f"event_{each}"].values[chosen]) for each in (across, up))
    return {
        "mode": "markers", "x": x, "y": y, "text": [str(curve.event_kind.values[k]).replace("_", " ") for k in chosen],
        "marker": {"size": 9, "symbol": "diamond", "color": "--paper", "line": {"color": colour, "width": 2}},
        "showlegend": False, "hovertemplate": "%{text}<extra></extra>",
    }  # fmt: skip
