"""Circular diagrams of the normalised second-order work, and its macroscopic against its microscopic value."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from rendulic.report.figure import Figure, Section, Table, Trace, numbers, sequence
from rendulic.report.findings import Findings, panel_label
from rendulic.report.spheres import ball, dots, scene
from rendulic.study.plan import Place
from rendulic.tensors.rendulic_plane import AXIAL_COMPRESSION, ISOCHORIC_COMPRESSION, ISOTROPIC_COMPRESSION

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["circles"]

Frames = dict[Place, "xr.Dataset"]  # states of one packing, probed alike
TURN = list(range(0, 361, 3))


def circles(findings: Findings) -> Section | None:
    """Of every set of probes in the Rendulic plane, packing and size."""
    families = dict(_families(findings))
    spheres = dict(_spheres(findings))
    if not families and not spheres:
        return None
    parts: list[Figure | Table] = []
    if families:
        parts += [_diagram(families), _table(families)]
    with_grains = {
        label: frames for label, frames in families.items() if all("w2_boundary" in data for data in frames.values())
    }
    if with_grains:
        parts.append(_macro_micro(with_grains))
    if spheres:
        parts.append(_sphere(spheres))
    return Section("directions", "Second-order work by direction", parts=parts)


def _diagram(families: dict[str, Frames]) -> Figure:
    return Figure(
        "circles",
        "Normalised second-order work W2n of probes from each state, by direction of the strain increment in the "
        "Rendulic "
        "plane (stress increment for stress probes): distance from the centre, −1 there, 0 on the dashed circle. "
        "Within the "
        "circle, second-order work is negative. Open dots do not exceed the drift of the null probe. The table below "
        "says the smallest of each state.",
        {label: _diagrams(frames) for label, frames in families.items()},
        _polar(),
        choice="Packing and probes",
        slide="Stress ratio",
        fixed=[_zero_circle()],
        start=-1,
        linked="state",
    )


def _families(findings: Findings) -> Iterator[tuple[str, Frames]]:
    """Figs. 3 and 4 first: their size of the probes is that which was asked for."""
    first = findings.study.figures.diagram_norm
    for chosen, found in findings.circles():
        unit = "" if chosen.kind == "strain" else " Pa"
        for norm in sorted(chosen.norms, key=lambda norm: norm != first):
            for panel in dict.fromkeys((place.packing, place.seed) for place in found):
                frames = {
                    place: data.sel(norm=norm).sortby("alpha") for place, data in found.items() if place[:2] == panel
                }
                yield f"{panel_label(panel)}, {chosen.kind} probes '{chosen.name}' of {norm:g}{unit}", frames


def _diagrams(frames: Frames) -> dict[str, list[Trace]]:
    """The state that is chosen drawn full, the others faint behind it."""
    colours = dict(zip(frames, sequence(len(frames)), strict=True))
    shown = {}
    for place in frames:
        others = [_curve(other, frames[other], colours[other], False) for other in frames if other != place]
        shown[str(place)] = [*others, _curve(place, frames[place], colours[place], True)]
    return shown


def _curve(place: Place, data: xr.Dataset, colour: str, is_chosen: bool) -> Trace:
    alpha, work = data.alpha.values, data.w2_normalised.values
    sure = data.is_significant.values
    around = [*numbers(alpha), float(alpha[0])]
    values = [*numbers(work), *numbers(work[:1])]
    trace: Trace = {
        "type": "scatterpolar", "theta": around, "r": values, "name": f"η = {place.eta:g}",
        "line": {"color": colour, "width": 3 if is_chosen else 1.2}, "opacity": 1.0 if is_chosen else 0.6,
    }  # fmt: skip
    if not is_chosen:
        return trace | {"mode": "lines", "hoverinfo": "skip"}
    symbols = ["circle" if one else "circle-open" for one in [*sure, sure[0]]]
    note = [f"{'' if one else 'not larger than the drift'}" for one in [*sure, sure[0]]]
    return trace | {
        "mode": "lines+markers",
        "marker": {"size": 7, "color": colour, "symbol": symbols},
        "customdata": note,
        "hovertemplate": "α = %{theta:.4~g}°<br>W2n = %{r:.3f}<br>%{customdata}<extra>" + f"η = {place.eta:g}</extra>",
    }


def _zero_circle() -> Trace:
    return {
        "type": "scatterpolar", "mode": "lines", "theta": TURN, "r": [0.0] * len(TURN), "fill": "toself",
        "fillcolor": "--negative-faint", "line": {"color": "--negative", "width": 1.5, "dash": "dash"},
        "name": "W2n = 0", "hoverinfo": "skip",
    }  # fmt: skip


def _polar() -> dict[str, Any]:
    marks = {
        0.0: "√2 dε₃", ISOTROPIC_COMPRESSION: "isotropic", AXIAL_COMPRESSION: "dε₁ axial",
        ISOCHORIC_COMPRESSION: "isochoric", 180.0: "", ISOTROPIC_COMPRESSION + 180.0: "isotropic extension", 270.0: "",
        ISOCHORIC_COMPRESSION + 180.0: "isochoric extension",
    }  # fmt: skip
    words = [f"{angle:.0f}° {word}".strip() for angle, word in marks.items()]
    return {
        "height": 560,
        "polar": {
            "radialaxis": {"range": [-1.0, 1.0], "angle": 0, "tickangle": 0, "dtick": 0.5},
            "angularaxis": {
                "tickmode": "array",
                "tickvals": list(marks),
                "ticktext": words,
                "direction": "counterclockwise",
            },
        },
        "legend": {"orientation": "h", "y": -0.08, "yanchor": "top"},
        "margin": {"l": 70, "r": 70, "t": 40, "b": 40},
    }


def _table(families: dict[str, Frames]) -> Table:
    rows, targets, marks = [], [], []
    for label, frames in families.items():
        for place, data in frames.items():
            worst = int(np.nanargmin(data.w2_normalised.values))
            one = data.isel(alpha=worst)
            sure, work = bool(one.is_significant), float(one.w2_normalised)
            rows.append([
                str(place), label.partition(", ")[2].partition(", ")[2], f"{work:+.3f}", f"{float(one.alpha):g}",
                str(int((data.w2_normalised.values < 0.0).sum())), "yes" if sure else "no",
            ])  # fmt: skip
            targets.append(str(place))
            marks.append("bad" if work < 0.0 and sure else "doubtful" if not sure else "")
    heads = ("state", "probes", "smallest W2n", "at α [°]", "directions with W2 < 0", "larger than the drift")
    return Table("Smallest normalised second-order work", heads, rows, goes_to=targets, marks=marks, marked=2)


def _macro_micro(families: dict[str, Frames]) -> Figure:
    largest = max(float(data.identity_residual.max()) for frames in families.values() for data in frames.values())
    return Figure(
        "macro-micro",
        "Second-order work of the boundary (line), and of all contacts and grains (circles), which must lie on it; "
        "crosses are the paper's sum "
        f"over contacts in both states. Largest residual of the identity here: {largest:.1e} of its largest term.",
        {label: {str(place): _works(data) for place, data in frames.items()} for label, frames in families.items()},
        {
            "height": 460,
            "xaxis": {"title": {"text": "direction of the increment α [°]"}, "range": [-5, 365], "dtick": 60},
            "yaxis": {"title": {"text": "W2 [J/m³]"}},
            "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom"},
        },
        choice="Packing and probes",
        slide="Stress ratio",
        start=-1,
        linked="state",
    )


def _works(data: xr.Dataset) -> list[Trace]:
    alpha = numbers(data.alpha.values)
    drawn: tuple[tuple[str, Any, Trace], ...] = (
        ("macro: boundary", data.w2_boundary, {"mode": "lines", "line": {"color": "--c0"}}),
        (
            "micro: contacts and grains", data.w2_contacts + data.w2_grains,
            {"mode": "markers", "marker": {"color": "--c1", "symbol": "circle-open", "size": 9, "line": {"width": 2}}},
        ),
        (
            "micro: the paper's sum", data.w2_paper,
            {"mode": "markers", "marker": {"color": "--c2", "symbol": "x-thin-open", "size": 7}},
        ),
        ("inertial term", data.w2_grains, {"mode": "lines", "line": {"color": "--c3", "dash": "dot"}}),
    )  # fmt: skip
    return [
        {"type": "scatter", "name": name, "x": alpha, "y": numbers(values.values)}
        | look
        | {"hovertemplate": "α = %{x:.4~g}°<br>W2 = %{y:.4~g} J/m³<extra>%{fullData.name}</extra>"}
        for name, values, look in drawn
    ]


def _spheres(findings: Findings) -> Iterator[tuple[str, Frames]]:
    for chosen in findings.study.probes:
        if chosen.sphere_directions is None:
            continue
        found = findings.probes(chosen)
        for panel in dict.fromkeys((place.packing, place.seed) for place in found):
            own = {place: data.isel(norm=-1) for place, data in found.items() if place[:2] == panel}
            yield f"{panel_label(panel)}, {chosen.kind} probes '{chosen.name}' of {chosen.norms[-1]:g}", own


def _sphere(families: dict[str, Frames]) -> Figure:
    shares = "; ".join(
        f"{place}: {100.0 * float(data.weight.values[data.w2_normalised.values < 0.0].sum()):.1f} % of all directions "
        "are unstable"
        for frames in families.values()
        for place, data in frames.items()
    )
    return Figure(
        "sphere",
        "Normalised second-order work of probes in all directions of principal increments, on the unit sphere; axis 1 "
        f"upward. {shares}.",
        {
            label: {str(place): [_on_sphere(data)] for place, data in frames.items()}
            for label, frames in families.items()
        },
        scene(),
        choice="Packing and probes",
        slide="Stress ratio",
        fixed=[ball()],
        start=-1,
        linked="state",
    )


def _on_sphere(data: xr.Dataset) -> Trace:
    unit = np.column_stack([data[f"along_{k}"].values for k in (1, 2, 3)])
    work = data.w2_normalised.values
    words = [
        f"increment {one[0]:+.2f}, {one[1]:+.2f}, {one[2]:+.2f}<br>W2n = {value:+.3f}"
        for one, value in zip(unit, work, strict=True)
    ]
    return dots(unit, work, words, "W2n", True)
