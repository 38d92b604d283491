"""The normalised second-order work on the sphere of principal increments, with plotly."""

from __future__ import annotations

from collections.abc import Mapping

from rendulic.report.draw import caption_of, interactive
from rendulic.report.figure import Figure, Trace
from rendulic.report.spheres import ball, dots, scene
from rendulic.views.sphere import OnSphere

__all__ = ["on_sphere"]


@interactive(OnSphere)
def on_sphere(name: str, views: Mapping[str, OnSphere]) -> Figure:
    """A family for each state and set."""
    return Figure(
        name, f"{caption_of(views)} Axis 1 is upward.",
        {label: {view.state: [_traces(view)]} for label, view in views.items()}, scene(), choice="State and probes",
        fixed=[ball()], start=-1,
    )  # fmt: skip


def _traces(view: OnSphere) -> Trace:
    words = [
        f"increment {one[0]:+.2f}, {one[1]:+.2f}, {one[2]:+.2f}<br>W2n = {value:+.3f}"
        for one, value in zip(view.unit, view.w2_normalised, strict=True)
    ]
    return dots(view.unit, view.w2_normalised, words, "W2n", True)
