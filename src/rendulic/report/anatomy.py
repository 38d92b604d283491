"""Anatomy: which contacts second-order work comes from, around all directions and in one of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from rendulic.micro.clustering import verdict_of
from rendulic.report.figure import Figure, Section, Table, Trace, numbers, sequence
from rendulic.report.findings import Findings, panel_label
from rendulic.study.plan import Place

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["anatomy"]

PANELS: tuple[tuple[str, Callable[[xr.Dataset], xr.DataArray]], ...] = (
    ("contacts with negative work [%]", lambda data: 100.0 * data.negative_contacts),
    ("negative over positive work", lambda data: data.negative_over_positive),
    ("contacts that carry half of it [%]", lambda data: 100.0 * data.carriers),
    ("of it in sliding contacts [%]", lambda data: 100.0 * data.w2_negative_sliding / data.w2_negative),
)


def anatomy(findings: Findings) -> Section | None:
    """Of the sets of probes with anatomy, and of the one direction that was dissected."""
    families: dict[str, dict[Place, xr.Dataset]] = {}
    for chosen, found in findings.circles():
        if not chosen.anatomy:
            continue
        for panel in dict.fromkeys((place.packing, place.seed) for place in found):
            own = {place: data.isel(norm=-1).sortby("alpha") for place, data in found.items() if place[:2] == panel}
            families[f"{panel_label(panel)}, probes '{chosen.name}' of {chosen.norms[-1]:g}"] = own
    parts: list[Figure | Table] = []
    if families:
        parts += [_around(families), _table(families)]
    if findings.dissection is not None:
        parts.append(_by_class(findings.dissection))
    return Section("anatomy", "Where in the grains it comes from", parts=parts) if parts else None


def _around(families: dict[str, dict[Place, xr.Dataset]]) -> Figure:
    shown = {}
    for label, frames in families.items():
        traces: list[Trace] = []
        for colour, (place, data) in zip(sequence(len(frames)), frames.items(), strict=True):
            name = f"η = {place.eta:g}"
            for k, (_, pick) in enumerate(PANELS):
                axis = str(k + 1) if k else ""
                traces.append({
                    "type": "scatter", "mode": "lines+markers", "name": name, "legendgroup": name, "showlegend": k == 0,
                    "x": numbers(data.alpha.values), "y": numbers(pick(data).values),
                    "xaxis": f"x{axis}", "yaxis": f"y{axis}",
                    "line": {"color": colour, "width": 1.5}, "marker": {"size": 4},
                    "hovertemplate": "α = %{x:.4~g}°<br>%{y:.3~g}<extra>" + name + "</extra>",
                })  # fmt: skip
        shown[label] = {"": traces}
    layout: dict = {
        "height": 640, "legend": {"orientation": "h", "y": 1.08, "yanchor": "bottom"},
        "grid": {"rows": 2, "columns": 2, "pattern": "independent", "ygap": 0.28, "xgap": 0.16},
    }  # fmt: skip
    for k, (title, _) in enumerate(PANELS):
        axis = str(k + 1) if k else ""
        layout[f"xaxis{axis}"] = {"dtick": 90, "range": [-5, 365], "title": {"text": "α [°]"}}
        layout[f"yaxis{axis}"] = {"title": {"text": title, "font": {"size": 11}}}
    caption = (
        "Against the direction of the increment: the share of contacts whose second-order work is negative; their work "
        "over that of the others; the "
        "fewest contacts that carry half of the negative work; and how much of it is in sliding contacts. The table "
        "has the most unstable direction."
    )
    return Figure("anatomy", caption, shown, layout, choice="Packing and probes")


def _table(families: dict[str, dict[Place, xr.Dataset]]) -> Table:
    rows = []
    for frames in families.values():
        for place, data in frames.items():
            one = data.isel(alpha=int(np.nanargmin(data.w2_normalised.values)))
            before, carry = one.sel(instant="before"), one.sel(which="carriers")
            rows.append([
                str(place), f"{float(one.alpha):g}", f"{float(one.w2_normalised):+.3f}",
                f"{100 * float(one.negative_contacts):.0f} %",
                f"{float(one.negative_over_positive):.2f}", f"{100 * float(one.carriers):.1f} %",
                f"{float(carry.cluster_index):.3f}",
                verdict_of(float(carry.cluster_score)), f"{float(before.mechanical_coordination):.2f}",
                f"{float(before.fabric_anisotropy):+.2f}",
            ])  # fmt: skip
    heads = ("state", "α [°]", "W2n", "negative contacts", "negative / positive", "carriers of half",
             "Moran's I of these", "they are", "coordination without rattlers", "fabric")  # fmt: skip
    return Table("The most unstable direction of each state", heads, rows, goes_to=[row[0] for row in rows])


def _by_class(found: xr.Dataset) -> Figure:
    names = [*map(str, found.contact_class.values), "inertial", "total"]
    values = [*found.w2_by_class.values.tolist(), float(found.w2_inertial), float(found.w2_boundary)]
    words = ", ".join(f"{name} {value:.3g}" for name, value in zip(names, values, strict=True))
    trace: Trace = {
        "type": "bar", "x": names, "y": numbers(values), "hovertemplate": "%{x}: %{y:.4~g} J/m³<extra></extra>",
        "marker": {"color": ["--negative" if value < 0.0 else "--c0" for value in values]},
    }  # fmt: skip
    return Figure(
        "classes",
        f"Second-order work in J/m³ by class of contact, at {found.attrs['alpha']:g} degrees: {words}.",
        {"": {"": [trace]}},
        {"height": 340, "yaxis": {"title": {"text": "W2 [J/m³]"}, "zeroline": True}},
    )
