"""Values on the unit sphere, in three dimensions: of directions of increments, or of contact planes."""

from __future__ import annotations

from typing import Any

import numpy as np

from rendulic.report.figure import Trace, numbers

__all__ = ["DIVERGING", "SEQUENTIAL", "ball", "dots", "scene"]

DIVERGING = [[0.0, "--negative"], [0.5, "--neutral"], [1.0, "--positive"]]
SEQUENTIAL = "Cividis"
INSIDE = 0.96  # radius of the ball, so that dots stand out of it
AXES = ("axis 2", "axis 3", "axis 1")  # axis 1 is drawn upward


def dots(unit: np.ndarray, values: Any, words: list[str], title: str, signed: bool, largest: float = 1.0) -> Trace:
    """Dots at (n, 3) unit vectors, axis 1 first, coloured from -largest or 0 to largest."""
    x, y, z = (numbers(unit[:, axis], 4) for axis in (1, 2, 0))
    return {
        "type": "scatter3d", "mode": "markers", "x": x, "y": y, "z": z, "text": words, "showlegend": False,
        "hovertemplate": "%{text}<extra></extra>",
        "marker": {
            "size": 8, "color": numbers(values, 4), "cmin": -largest if signed else 0.0, "cmax": largest,
            "colorscale": DIVERGING if signed else SEQUENTIAL, "line": {"color": "--muted", "width": 1},
            "colorbar": {"title": {"text": title, "side": "right"}, "thickness": 14, "len": 0.7},
        },
    }  # fmt: skip


def ball() -> Trace:
    """What hides the far side."""
    polar, around = np.meshgrid(np.linspace(0.0, np.pi, 25), np.linspace(0.0, 2.0 * np.pi, 49))
    return {
        "type": "surface", "x": numbers(INSIDE * np.sin(polar) * np.cos(around), 3),
        "y": numbers(INSIDE * np.sin(polar) * np.sin(around), 3), "z": numbers(INSIDE * np.cos(polar), 3),
        "showscale": False, "hoverinfo": "skip", "colorscale": [[0, "--ball"], [1, "--ball"]], "opacity": 1.0,
        "contours": {axis: {"highlight": False} for axis in "xyz"},
        "lighting": {"ambient": 0.85, "diffuse": 0.3, "specular": 0.02},
    }  # fmt: skip


def scene() -> dict[str, Any]:
    """Layout of a view in three dimensions, all axes alike."""
    bare = {"showbackground": False, "showticklabels": False, "showspikes": False, "zeroline": False}
    axes = {
        name: bare | {"title": {"text": text}} for name, text in zip(("xaxis", "yaxis", "zaxis"), AXES, strict=True)
    }
    return {
        "height": 540,
        "margin": {"l": 0, "r": 0, "t": 10, "b": 0},
        "scene": axes | {"aspectmode": "data", "camera": {"eye": {"x": 1.25, "y": 1.25, "z": 0.8}}},
        "legend": {"orientation": "h", "y": 0.0, "yanchor": "top"},
    }
