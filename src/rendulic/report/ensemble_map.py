"""Sure cones and the share of unstable packings against the stress ratio, with plotly."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from rendulic.report.draw import caption_of, interactive
from rendulic.report.figure import Figure, Trace, numbers
from rendulic.report.tracks import level
from rendulic.tensors.rendulic_plane import ISOCHORIC_COMPRESSION
from rendulic.views.ensemble_map import EnsembleMap
from rendulic.views.ensembles import span
from rendulic.views.sectors import Sector

__all__ = ["ensemble_map"]


@interactive(EnsembleMap)
def ensemble_map(name: str, views: Mapping[str, EnsembleMap]) -> Figure:
    """Ensembles and sizes to choose from."""
    low, high = min(view.low for view in views.values()), max(view.high for view in views.values())
    return Figure(
        name, caption_of(views), {label: {"": _traces(view, low, high)} for label, view in views.items()},
        {
            "height": 620,
            "xaxis": {"title": {"text": "stress ratio η = q/p"}, "anchor": "y2"},
            "yaxis": {
                "title": {"text": "α [°]"}, "domain": [0.46, 1.0], "range": [low, high], "dtick": 60 if high - low > 180.0 else 15,
            },
            "yaxis2": {"title": {"text": "packings with W2 < 0"}, "domain": [0.0, 0.38], "range": [-0.03, 1.03], "tickformat": ".0%"},
            "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom"},
        },
        choice="Packings and probes",
    )  # fmt: skip


def _traces(view: EnsembleMap, low: float, high: float) -> list[Trace]:
    ends = (float(view.eta.min()), float(view.eta.max()))
    traces = [
        level(
            ends,
            ISOCHORIC_COMPRESSION,
            line={"color": "--muted", "dash": "dot", "width": 1},
            name="undrained compression",
        )
    ]
    for label, spans, colour, width, opacity in (
        ("may be unstable", view.possible, "--muted", 1.5, 1.0), ("unstable in the mean", view.mean, "--negative", 5, 0.4),
        ("surely unstable", view.sure, "--negative", 10, 1.0),
    ):  # fmt: skip
        x: list[float | None] = []
        y: list[float | None] = []
        words: list[str | None] = []
        for eta, own in zip(view.eta.tolist(), spans, strict=True):
            for pair in own:
                for one in Sector(*pair, 0.0, 0.0).within(low, high):
                    x += [eta, eta, None]
                    y += [*numbers([one.first, one.last]), None]
                    words += [f"η = {eta:g}: {label} from {span(*pair)}"] * 2 + [None]
        traces.append({
            "type": "scatter", "mode": "lines", "name": label, "x": x, "y": y, "opacity": opacity, "text": words,
            "line": {"color": colour, "width": width}, "hovertemplate": "%{text}<extra></extra>",
        })  # fmt: skip
    for label, (value, lower, upper), colour in (
        ("in some direction", view.somewhere, "--c0"), ("where the mean W2n is smallest", view.at_smallest, "--c1"),
    ):  # fmt: skip
        traces.append({
            "type": "scatter", "mode": "lines+markers", "name": label, "x": numbers(view.eta), "y": numbers(value), "yaxis": "y2",
            "line": {"color": colour}, "marker": {"color": colour, "size": 8},
            "error_y": {
                "type": "data", "symmetric": False, "array": numbers(np.maximum(upper - value, 0.0)),
                "arrayminus": numbers(np.maximum(value - lower, 0.0)), "thickness": 1.2,
            },
            "hovertemplate": "η = %{x:.4~g}: %{y:.0%}<extra>%{fullData.name}</extra>",
        })  # fmt: skip
    return traces
