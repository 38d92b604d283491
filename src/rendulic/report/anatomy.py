"""Where second-order work comes from, with plotly: around all directions, and by class of contact in one of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from rendulic.report.draw import interactive
from rendulic.report.figure import Figure, Trace, numbers, sequence
from rendulic.views.anatomy import AnatomyAround, AnatomyView

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["anatomy", "anatomy_around"]

PANELS: tuple[tuple[str, Callable[[xr.Dataset], xr.DataArray]], ...] = (
    ("contacts with negative work [%]", lambda data: 100.0 * data.negative_contacts),
    ("negative over positive work", lambda data: data.negative_over_positive),
    ("contacts that carry half of it [%]", lambda data: 100.0 * data.carriers),
    ("of it in sliding contacts [%]", lambda data: 100.0 * data.w2_negative_sliding / data.w2_negative),
    ("Moran's I beyond a grain, negative", lambda data: data.beyond_index.sel(sign="negative")),
    ("the same of positive work", lambda data: data.beyond_index.sel(sign="positive")),
)


@interactive(AnatomyAround)
def anatomy_around(name: str, views: Mapping[str, AnatomyAround]) -> Figure:
    """Six panels; families of samples and sets."""
    layout: dict = {
        "height": 880, "legend": {"orientation": "h", "y": 1.08, "yanchor": "bottom"},
        "grid": {"rows": 3, "columns": 2, "pattern": "independent", "ygap": 0.28, "xgap": 0.16},
    }  # fmt: skip
    for k, (title, _) in enumerate(PANELS):
        axis = str(k + 1) if k else ""
        layout[f"xaxis{axis}"] = {"dtick": 90, "range": [-5, 365], "title": {"text": "α [°]"}}
        layout[f"yaxis{axis}"] = {"title": {"text": title, "font": {"size": 11}}}
    families = {label: {"": _traces(view)} for label, view in views.items()}
    return Figure(name, next(iter(views.values())).caption, families, layout, choice="Sample and probes")


def _traces(view: AnatomyAround) -> list[Trace]:
    return [
        {
            "type": "scatter", "mode": "lines+markers", "name": label, "legendgroup": label, "showlegend": k == 0,
            "x": numbers(data.alpha.values), "y": numbers(pick(data).values),
            "xaxis": f"x{k + 1 if k else ''}", "yaxis": f"y{k + 1 if k else ''}",
            "line": {"color": colour, "width": 1.5}, "marker": {"size": 4},
            "hovertemplate": "α = %{x:.4~g}°<br>%{y:.3~g}<extra>" + label + "</extra>",
        }
        for colour, (label, data) in zip(sequence(len(view.probes)), view.probes.items(), strict=True)
        for k, (_, pick) in enumerate(PANELS)
    ]  # fmt: skip


@interactive(AnatomyView)
def anatomy(name: str, views: Mapping[str, AnatomyView]) -> Figure:
    """Bars by class of contact."""
    first = next(iter(views.values()))
    families = {label: {"": [_bars(view)]} for label, view in views.items()}
    layout = {"height": 340, "yaxis": {"title": {"text": "W2 [J/m³]"}, "zeroline": True}}
    return Figure(name, f"{first.title}. {first.caption}", families, layout, choice="State")


def _bars(view: AnatomyView) -> Trace:
    works = view.by_class
    return {
        "type": "bar", "x": list(works), "y": numbers(list(works.values())), "hovertemplate": "%{x}: %{y:.4~g} J/m³<extra></extra>",
        "marker": {"color": ["--negative" if value < 0.0 else "--c0" for value in works.values()]},
    }  # fmt: skip
