"""Element tests of the Chang-Hicher model: the curves, and what its contact planes do."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rendulic.report.figure import Figure, Section, Table, Trace, categories, numbers
from rendulic.report.findings import Findings
from rendulic.report.spheres import ball, dots, scene

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["model"]

MOST_RECORDS, FRAMES = 400, 13
PANELS = (("eps_1", "q"), ("eps_1", "eps_v"), ("p", "q"), ("eps_1", "w2_normalised"))
AXES: dict[str, tuple[str, float]] = {
    "eps_1": ("ε₁ [%]", 100.0), "eps_v": ("ε_v [%]", 100.0), "p": ("p [kPa]", 1e-3), "q": ("q [kPa]", 1e-3),
    "w2_normalised": ("W2n along the path", 1.0),
}  # fmt: skip
ON_PLANES = (("w2n_plane", "W2n of the plane", True), ("x_plane", "obliquity over peak friction", False))


def model(findings: Findings) -> Section | None:
    """Of all element tests that are finished."""
    if not findings.tests:
        return None
    return Section(
        "model", "Chang-Hicher model", parts=[_curves(findings.tests), _planes(findings.tests), _table(findings.tests)]
    )


def _records(curve: xr.Dataset, most: int) -> np.ndarray:
    return np.unique(np.linspace(0, curve.sizes["record"] - 1, most).astype(int))


def _curves(tests: dict[str, xr.Dataset]) -> Figure:
    traces: list[Trace] = []
    for colour, (name, curve) in zip(categories(len(tests)), tests.items(), strict=True):
        kept = _records(curve, MOST_RECORDS)
        for k, (across, up) in enumerate(PANELS):
            axis = str(k + 1) if k else ""
            own = {"type": "scatter", "name": name, "legendgroup": name, "xaxis": f"x{axis}", "yaxis": f"y{axis}"}
            x, y = (numbers(AXES[each][1] * curve[each].values[kept]) for each in (across, up))
            hover = f"{AXES[across][0]} %{{x:.4g}}<br>{AXES[up][0]} %{{y:.4g}}<extra>{name}</extra>"
            traces.append(
                own
                | {
                    "mode": "lines",
                    "x": x,
                    "y": y,
                    "line": {"color": colour},
                    "showlegend": k == 0,
                    "hovertemplate": hover,
                }
            )
            if "event_" + across in curve and "event_" + up in curve:
                traces.append(own | _events(curve, across, up, colour))
    layout: dict[str, Any] = {
        "height": 640, "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom"},
        "grid": {"rows": 2, "columns": 2, "pattern": "independent", "ygap": 0.25, "xgap": 0.16},
    }  # fmt: skip
    for k, (across, up) in enumerate(PANELS):
        axis = str(k + 1) if k else ""
        layout[f"xaxis{axis}"] = {"title": {"text": AXES[across][0]}}
        layout[f"yaxis{axis}"] = {"title": {"text": AXES[up][0]}}
    words = "; ".join(f"{name}: largest q {1e-3 * float(curve.q.max()):.1f} kPa" for name, curve in tests.items())
    caption = (
        "Element tests: deviatoric stress and volumetric strain against axial strain, the stress path, and the "
        "normalised second-order work along "
        f"the path. Marks are events of the whole assembly, such as peaks or zeros of second-order work. {words}."
    )
    return Figure("element-tests", caption, {"": {"": traces}}, layout)


def _events(curve: xr.Dataset, across: str, up: str, colour: str) -> Trace:
    """Events of the assembly; those of single planes are many."""
    chosen = np.flatnonzero(curve.event_plane.values == -1)
    x, y = (numbers(AXES[each][1] * curve[f"event_{each}"].values[chosen]) for each in (across, up))
    return {
        "mode": "markers", "x": x, "y": y, "text": [str(curve.event_kind.values[k]).replace("_", " ") for k in chosen],
        "marker": {"size": 9, "symbol": "diamond", "color": "--paper", "line": {"color": colour, "width": 2}},
        "showlegend": False, "hovertemplate": "%{text}<extra></extra>",
    }  # fmt: skip


def _planes(tests: dict[str, xr.Dataset]) -> Figure:
    families = {
        f"{name}: {title}": {
            f"ε₁ = {100 * float(curve.eps_1[at]):.3g} %": [_on_sphere(curve.isel(record=at), quantity, title, signed)]
            for at in _records(curve, FRAMES).tolist()
        }
        for name, curve in tests.items()
        for quantity, title, signed in ON_PLANES
    }
    words = "; ".join(
        f"{name}: at its end {int((curve.w2_plane.values[-1] < 0.0).sum())} of {curve.sizes['plane']} planes have "
        "negative second-order work"
        for name, curve in tests.items()
    )
    caption = (
        "Contact planes at their normals (each at both ends) on the unit sphere, axis 1 upward, as the test goes on. "
        f"{words}."
    )
    return Figure("planes", caption, families, scene(), "Test and quantity", "Axial strain", [ball()], start=-1)


def _on_sphere(now: xr.Dataset, quantity: str, title: str, signed: bool) -> Trace:
    normals, values = now.plane_normal.transpose("plane", "component").values, now[quantity].values
    words = [
        f"plane {k}, {float(now.inclination[k]):.1f}° to axis 1<br>σ {1e-3 * float(now.sigma_plane[k]):.4g} kPa, τ "
        f"{1e-3 * float(now.tau_plane[k]):.4g} kPa<br>obliquity {float(now.x_plane[k]):.3f}, W2n "
        f"{float(now.w2n_plane[k]):+.3f}"
        f"<br>{'plastic' if bool(now.is_loading[k]) else 'elastic'}"
        for k in range(len(values))
    ]
    return dots(np.concatenate((normals, -normals)), np.concatenate((values, values)), words * 2, title, signed)


def _table(tests: dict[str, xr.Dataset]) -> Table:
    rows = [
        [
            name, str(curve.attrs["path"]), str(curve.attrs["stopped_by"]), f"{1e-3 * float(curve.q.max()):.1f}",
            f"{100 * float(curve.eps_1[-1]):.3g}", f"{float(curve.void_ratio[0]):.3f}", f"{float(curve.void_ratio[-1]):.3f}",
            _first_negative(curve),
        ]
        for name, curve in tests.items()
    ]  # fmt: skip
    heads = (
        "test",
        "path",
        "ended by",
        "largest q [kPa]",
        "ε₁ at end [%]",
        "e at first",
        "e at end",
        "W2 < 0 first at",
    )
    return Table("Element tests", heads, rows)


def _first_negative(curve: xr.Dataset) -> str:
    negative = np.flatnonzero(curve.w2.values < 0.0)
    return f"ε₁ = {100 * float(curve.eps_1[negative[0]]):.3g} %" if len(negative) else "nowhere"
