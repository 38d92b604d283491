"""Tests along paths: stress and strain, the stress path, and the second-order work along it (Fig. 7 of the paper)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rendulic.views.catalogue import StudyFigure
from rendulic.views.view import Table, View

if TYPE_CHECKING:
    import xarray as xr

    from rendulic.study.ids import StateId
    from rendulic.study.plan import Plan
    from rendulic.study.results import Results
    from rendulic.study.store.unit import Unit

__all__ = ["STUDY_FIGURES", "TestsAlongPaths", "labels_of", "tests_along_paths"]

CAPTION = (
    "Deviatoric stress q against axial strain, the stress path, and the normalised second-order work W2n along the path; the "
    "volumetric strain where it changes. Marks are where the second-order work of the assembly vanishes."
)
HEADS = ("test", "path", "ended by", "peak q, p [kPa]", "ε₁ at the peak [%]", "end q, p [kPa]", "W2 < 0 from ε₁ [%]",
         "first plane with W2 < 0 at ε₁ [%] (angle)")  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False)
class TestsAlongPaths(View):
    """Curves by label, as `load` gives them: records with eps_1, eps_v, q, p and, where there is one, W2 along the path."""

    curves: Mapping[str, xr.Dataset]

    @property
    def swells(self) -> bool:
        """Whether the volume changes in any of them."""
        return any(float(np.abs(curve.eps_v).max()) > 1e-9 for curve in self.curves.values())


def tests_along_paths(curves: Mapping[str, xr.Dataset], title: str = "") -> TestsAlongPaths:
    """The view of curves from `load`, by label."""
    rows = [_row(label, curve) for label, curve in curves.items()]
    table = Table("Tests", HEADS, rows)
    lost = {label: _w2_lost(curve) for label, curve in curves.items()}
    told = [f"{label}: W2 negative from {where} % axial strain" for label, where in lost.items() if where]
    verdict = "; ".join(told) if told else "W2 does not turn negative in any of these tests"
    return TestsAlongPaths(title=title, caption=CAPTION, verdict=f"{verdict}.", tables=(table,), curves=dict(curves))


def _row(label: str, curve: xr.Dataset) -> tuple[str, ...]:
    peak, plane = _first(curve, "q_peak"), _first(curve, "plane_w2_lost")
    q, p = curve.q.values, curve.p.values
    where = int(np.argmax(q))
    at = (q[where], p[where], curve.eps_1.values[where])
    if peak is not None:
        at = (curve.event_q.values[peak], curve.event_p.values[peak], curve.event_eps_1.values[peak])
    of_plane = ""
    if plane is not None:
        angle = float(curve.inclination[int(curve.event_plane[plane])])
        of_plane = f"{100 * float(curve.event_eps_1[plane]):.2f} ({angle:.0f}°)"
    return (
        label, str(curve.attrs.get("path", "")), str(curve.attrs.get("stopped_by", "")), f"{1e-3 * at[0]:.1f}, {1e-3 * at[1]:.1f}",
        f"{100 * at[2]:.2f}", f"{1e-3 * q[-1]:.1f}, {1e-3 * p[-1]:.1f}", _w2_lost(curve), of_plane,
    )  # fmt: skip


def _first(curve: xr.Dataset, kind: str) -> int | None:
    """Index of the first event of a kind."""
    if "event_kind" not in curve:
        return None
    found = (curve.event_kind.values == kind).nonzero()[0]
    return int(found[0]) if len(found) else None


def _w2_lost(curve: xr.Dataset) -> str:
    event = _first(curve, "w2_lost")
    return "" if event is None else f"{100 * float(curve.event_eps_1[event]):.3g}"


# -- of a study ----------------------------------------------------------------------------------


def labels_of(results: Results) -> dict[tuple[str, StateId | None], str]:
    """A label for each path: its set, its state, or both, whatever tells them apart in the fewest words."""
    found = [key for key in results.of("path") if key[1] is not None]
    sets = {name for name, _ in found}
    samples = {state for _, state in found}
    if len(sets) == len(found):
        return {key: key[0] for key in found}
    if len(samples) == len(found):
        return {key: str(key[1].sample if key[1].eta is None else key[1]) for key in found if key[1] is not None}
    return {key: f"{key[0]}, {key[1].sample if key[1].eta is None else key[1]}" for key in found if key[1] is not None}


def _needs(plan: Plan) -> list[Unit]:
    return [unit for units in plan.of("path").values() for unit in units]


def _needs_undrained(plan: Plan) -> list[Unit]:
    sets = plan.study.sets("path")
    return [unit for (name, _), units in plan.of("path").items() if sets[name].path == "undrained" for unit in units]


def _elements(results: Results) -> dict[str, View]:
    curves = {label: results.of("path")[key] for key, label in labels_of(results).items()}
    return {"elements": tests_along_paths(curves, "Tests")} if curves else {}


def _fig7(results: Results) -> dict[str, View]:
    sets = results.sets("path")
    keys = {key: label for key, label in labels_of(results).items() if sets[key[0]].path == "undrained"}
    curves = {label: results.of("path")[key] for key, label in keys.items()}
    return {"fig7": tests_along_paths(curves, "Undrained tests")} if curves else {}


STUDY_FIGURES = (
    StudyFigure("elements", "all tests along paths", "[[path]]", _needs, _elements),
    StudyFigure("fig7", "undrained tests", '[[path]] with path = "undrained"', _needs_undrained, _fig7),
)
