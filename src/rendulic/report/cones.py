"""The cone map: unstable sectors against the stress ratio, and the smallest second-order work."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rendulic.probing.cone import Cone
from rendulic.probing.edges import give_or_take, is_unknown
from rendulic.report.figure import SYMBOLS, Figure, Section, Table, Trace, categories, numbers
from rendulic.report.findings import Findings, panel_label
from rendulic.study.plan import Place
from rendulic.tensors.rendulic_plane import ISOCHORIC_COMPRESSION

__all__ = ["cones"]

Found = dict[Place, Cone]
SPREAD = 0.004  # of the stress ratio, between packings at the same one


def cones(findings: Findings) -> Section | None:
    """Of every set of cones."""
    if not findings.cones:
        return None
    sets: dict[str, Found] = {}
    for (name, place), cone in findings.cones.items():
        sets.setdefault(f"{cone.kind} probes '{name}'", {})[place] = cone
    unstable = sum(not cone.is_empty for cone in findings.cones.values())
    figure = Figure(
        "cones",
        "Above: directions of strain within which second-order work is negative, for each state (bars); thin lines at "
        "their ends are the uncertainty of the edges; open dots: no unstable direction was found. Below: the smallest "
        "normalised "
        f"second-order work, bars are the drift's share in it. {unstable} of {len(findings.cones)} cones are not "
        "empty.",
        {name: {"": _map(found)} for name, found in sets.items()},
        {
            "height": 640,
            "xaxis": {"title": {"text": "stress ratio η = q/p"}, "anchor": "y2"},
            "yaxis": {"title": {"text": "α [°]"}, "domain": [0.48, 1.0], "dtick": 60, "range": [0, 360]},
            "yaxis2": {"title": {"text": "smallest W2n"}, "domain": [0.0, 0.4]},
            "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom"},
        },
        choice="Probes",
    )
    return Section("cones", "Cones of unstable directions", parts=[figure, _table(sets)])


def _map(found: Found) -> list[Trace]:
    panels = list(dict.fromkeys((place.packing, place.seed) for place in found))
    etas = numbers([min(place.eta for place in found), max(place.eta for place in found)])
    line = {"type": "scatter", "mode": "lines", "hoverinfo": "skip", "showlegend": False}
    traces: list[Trace] = [
        line | {"x": etas, "y": [0, 0], "yaxis": "y2", "line": {"color": "--negative", "width": 1.2, "dash": "dash"}},
        line
        | {"x": etas, "y": [ISOCHORIC_COMPRESSION] * 2, "name": "isochoric", "showlegend": True}
        | {"line": {"color": "--muted", "width": 1, "dash": "dot"}},
    ]
    for k, (panel, colour) in enumerate(zip(panels, categories(len(panels)), strict=True)):
        own = {place: cone for place, cone in found.items() if place[:2] == panel}
        aside = SPREAD * (k - 0.5 * (len(panels) - 1))
        traces += _sectors(own, panel_label(panel), colour, aside)
        traces.append(_smallest(own, panel_label(panel), colour, SYMBOLS[k % len(SYMBOLS)]))
    return traces


def _sectors(own: Found, label: str, colour: str, aside: float) -> list[Trace]:
    traces: list[Trace] = []
    common = {"type": "scatter", "legendgroup": label, "showlegend": False, "name": label}
    for place, cone in own.items():
        eta = float(f"{place.eta + aside:.5g}")
        for (first, last), (low, high) in _with_turns(cone):
            traces.append(common | {
                "mode": "lines", "x": [eta, eta, eta], "y": numbers([first, 0.5 * (first + last), last]),
                "line": {"color": colour, "width": 9}, "opacity": 0.85 if cone.is_significant else 0.35,
                "text": [f"{place}<br>{_span(first % 360.0, first % 360.0 + last - first, low, high)}"] * 3,
                "hovertemplate": "%{text}<extra></extra>",
            })  # fmt: skip
            ends = [
                (edge, shift)
                for edge, shift in ((first, low), (last, high))
                if np.isfinite(shift) and not is_unknown(shift)
            ]
            if ends:
                traces.append(common | {
                    "mode": "markers", "x": [eta] * len(ends), "y": numbers([edge for edge, _ in ends]),
                    "hoverinfo": "skip",
                    "marker": {"size": 1, "color": "--ink"},
                    "error_y": {
                        "array": numbers([shift for _, shift in ends]), "color": "--ink", "thickness": 1.5, "width": 6,
                    },
                })  # fmt: skip
    empty = [place for place, cone in own.items() if not cone.strain_sectors]
    if empty:
        traces.append(common | {
            "mode": "markers", "x": numbers([place.eta + aside for place in empty]),
            "y": [ISOCHORIC_COMPRESSION] * len(empty),
            "marker": {"symbol": "circle-open", "color": colour, "size": 7},
            "text": [f"{place}<br>no unstable direction" for place in empty], "hovertemplate": "%{text}<extra></extra>",
        })  # fmt: skip
    return traces


def _with_turns(cone: Cone) -> Iterator[tuple[tuple[float, float], tuple[float, float]]]:
    """Sectors with the uncertainty of their edges; one that goes beyond 360 degrees is drawn a turn lower, too."""
    for (first, last), uncertainty in zip(cone.strain_sectors, cone.strain_edge_uncertainty, strict=True):
        yield (first, last), uncertainty
        if last > 360.0:
            yield (first - 360.0, last - 360.0), uncertainty


def _smallest(own: Found, label: str, colour: str, symbol: str) -> Trace:
    symbols = [symbol if cone.is_significant else f"{symbol}-open" for cone in own.values()]
    return {
        "type": "scatter", "mode": "lines+markers", "yaxis": "y2", "name": label, "legendgroup": label,
        "x": numbers([place.eta for place in own]), "y": numbers([cone.smallest_w2n for cone in own.values()]),
        "error_y": {"array": numbers([cone.drift_share for cone in own.values()]), "thickness": 1},
        "line": {"color": colour}, "marker": {"symbol": symbols, "size": 8, "color": colour},
        "customdata": numbers([cone.smallest_strain_alpha for cone in own.values()]),
        "hovertemplate": "η = %{x:.3~g}<br>W2n = %{y:.3f}<br>at α = %{customdata:.4~g}°<extra>" + label + "</extra>",
    }  # fmt: skip


def _span(first: float, last: float, low: float, high: float) -> str:
    if last - first >= 360.0:
        return "all directions"
    return f"{first:.4g}{_give_or_take(low)} to {last:.4g}{_give_or_take(high)} °"


def _give_or_take(uncertainty: float) -> str:
    return f" ± {give_or_take(uncertainty)}"


def _table(sets: dict[str, Found]) -> Table:
    rows, marks, targets = [], [], []
    for name, found in sets.items():
        for place, cone in found.items():
            pairs = zip(cone.strain_sectors, cone.strain_edge_uncertainty, strict=True)
            spans = "; ".join(_span(*sector, *uncertainty) for sector, uncertainty in pairs) or "none"
            rows.append([
                str(place), name, spans, f"{cone.strain_opening:.4g}", f"{cone.smallest_w2n:+.3f}",
                f"{cone.smallest_strain_alpha:.4g}", "yes" if cone.is_significant else "no",
            ])  # fmt: skip
            marks.append("doubtful" if not cone.is_significant else "bad" if cone.sectors else "")
            targets.append(str(place))
    heads = (
        "state",
        "probes",
        "unstable from … to",
        "opening [°]",
        "smallest W2n",
        "at α [°]",
        "larger than the drift",
    )
    return Table("Cones", heads, rows, goes_to=targets, marks=marks, marked=4)
