"""The shear stiffness of a contact plane with plotly."""

from __future__ import annotations

from collections.abc import Mapping

from rendulic.report.draw import interactive
from rendulic.report.figure import Figure, Trace, numbers, sequence
from rendulic.views.plane_law import PlaneStiffness, Stiffness

__all__ = ["plane_stiffness"]


@interactive(PlaneStiffness)
def plane_stiffness(name: str, views: Mapping[str, PlaneStiffness]) -> Figure:
    """A family for each parameter that is varied."""
    families = {
        heading if len(views) == 1 else f"{label}: {heading}": {"": _traces(cases)}
        for label, view in views.items()
        for heading, cases in view.panels.items()
    }
    layout = {
        "height": 420,
        "xaxis": {"title": {"text": "obliquity over its peak"}, "range": [0, 1]},
        "yaxis": {"title": {"text": "K_rr [N/mm]"}},
        "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom"},
    }
    zero: Trace = {
        "type": "scatter", "mode": "lines", "x": [0, 1], "y": [0, 0], "hoverinfo": "skip", "showlegend": False,
        "line": {"color": "--negative", "width": 1.2, "dash": "dash"},
    }  # fmt: skip
    return Figure(name, next(iter(views.values())).caption, families, layout, choice="Parameter", fixed=[zero])


def _traces(cases: tuple[Stiffness, ...]) -> list[Trace]:
    return [
        {
            "type": "scatter", "mode": "lines", "name": one.label, "x": numbers(one.x[::5]), "y": numbers(1e-3 * one.k_rr[::5]),
            "line": {"color": colour}, "hovertemplate": "x = %{x:.3f}<br>K_rr = %{y:.4~g} N/mm<extra>%{fullData.name}</extra>",
        }
        for one, colour in zip(cases, sequence(len(cases)), strict=True)
    ]  # fmt: skip
