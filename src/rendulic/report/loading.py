"""The loading: deviatoric stress and volume against axial strain, with the states that were probed."""

from __future__ import annotations

import numpy as np

from rendulic.dem.measure.equilibrium import unbalanced_force
from rendulic.report.figure import Figure, Section, Table, Trace, categories, numbers
from rendulic.report.findings import Findings, panel_label
from rendulic.tensors.invariants import deviatoric_stress

__all__ = ["loading"]

MOST_RECORDS = 1500  # of one curve; more are more than the screen has points


def loading(findings: Findings) -> Section | None:
    """Curves and states of the packings."""
    if not findings.curves:
        return None
    traces: list[Trace] = []
    for colour, (panel, curve) in zip(categories(len(findings.curves)), findings.curves.items(), strict=True):
        kept = np.unique(np.linspace(0, curve.sizes["record"] - 1, MOST_RECORDS).astype(int))
        strain, name = numbers(100.0 * curve.eps_1.values[kept]), panel_label(panel)
        common = {"type": "scatter", "mode": "lines", "name": name, "legendgroup": name, "line": {"color": colour}}
        values = (1e-3 * curve.q.values[kept], -100.0 * curve.eps_v.values[kept])
        for row, (own, unit) in enumerate(zip(values, ("q %{y:.4~g} kPa", "ΔV/V %{y:.4~g} %"), strict=True)):
            traces.append(
                common
                | {"x": strain, "y": numbers(own), "showlegend": row == 0, "yaxis": "y2" if row else "y"}
                | {"hovertemplate": f"{name}<br>ε₁ %{{x:.4g}} %<br>{unit}<extra></extra>"}
            )
        traces += _marks(findings, panel, colour)
    layout = {
        "height": 640,
        "xaxis": {"title": {"text": "axial strain ε₁ [%]"}, "anchor": "y2"},
        "yaxis": {"title": {"text": "q [kPa]"}, "domain": [0.52, 1.0]},
        "yaxis2": {"title": {"text": "ΔV/V = −ε_v [%]"}, "domain": [0.0, 0.46]},
        "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom"},
    }
    peaks = "; ".join(
        f"{panel_label(panel)}: largest q {1e-3 * float(curve.q.max()):.1f} kPa at "
        f"{100 * float(curve.eps_1[int(np.argmax(curve.q.values))]):.2f} %"
        for panel, curve in findings.curves.items()
    )
    caption = (
        "Deviatoric stress and change of volume against axial strain; contraction is negative. Dots are states at rest "
        "that "
        f"were probed: choose one to see it in the figures below. {peaks}."
    )
    return Section(
        "loading", "Loading", parts=[Figure("loading", caption, {"": {"": traces}}, layout), _table(findings)]
    )


def _marks(findings: Findings, panel: tuple[str, int], colour: str) -> list[Trace]:
    """States at rest; choosing one is told by `customdata`."""
    states = {place: state for place, state in findings.states.items() if place[:2] == panel}
    if not states:
        return []
    strain = numbers([100.0 * state.strain[0, 0] for state in states.values()])
    q = numbers([1e-3 * float(deviatoric_stress(state.stress)) for state in states.values()])
    volume = numbers([-100.0 * np.trace(state.strain) for state in states.values()])
    common = {
        "type": "scatter", "mode": "markers", "x": strain, "legendgroup": panel_label(panel), "showlegend": False,
        "customdata": [str(place) for place in states], "name": "state",
        "marker": {"size": 10, "color": "--paper", "line": {"color": colour, "width": 2}},
        "hovertemplate": "%{customdata}<br>choose to show<extra></extra>",
    }  # fmt: skip
    return [common | {"y": q}, common | {"y": volume, "yaxis": "y2"}]


def _table(findings: Findings) -> Table:
    heads = ("state", "q [kPa]", "p [kPa]", "ε₁ [%]", "ε_v [%]", "porosity", "contacts", "unbalanced force")
    rows = [
        [
            str(place), f"{1e-3 * float(deviatoric_stress(state.stress)):.1f}", f"{np.trace(state.stress) / 3e3:.1f}",
            f"{100 * state.strain[0, 0]:.3f}", f"{100 * np.trace(state.strain):.3f}", f"{state.porosity:.4f}",
            str(state.n_contacts), f"{unbalanced_force(state):.1e}",
        ]
        for place, state in findings.states.items()
    ]  # fmt: skip
    return Table("States at rest", heads, rows, goes_to=[str(place) for place in findings.states])
