"""Macroscopic against microscopic second-order work (Fig. 4 of the paper)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rendulic.foundation.errors import InvalidInput
from rendulic.views.catalogue import StudyFigure
from rendulic.views.circular import IN_THE_PLANE, around_units, norm_of, of_grains, stems
from rendulic.views.view import View

if TYPE_CHECKING:
    import xarray as xr

    from rendulic.study.results import Results

__all__ = ["STUDY_FIGURES", "MacroMicro", "Works", "macro_micro"]

CAPTION = (
    "Second-order work of the boundary (line), and of all contacts and grains (circles): an identity, so that they must agree to "
    "rounding, which tests the code's sums and not the data. Crosses are the paper's sum over contacts that are there in both states. The inertial term is the work of the "
    "resultants on the grains."
)


@dataclass(frozen=True, eq=False)
class Works:
    """The works of one state in all directions, in J/m3; directions in degrees, increasing."""

    label: str
    alpha: np.ndarray
    boundary: np.ndarray
    micro: np.ndarray
    paper: np.ndarray
    inertial: np.ndarray
    residual: float
    state: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class MacroMicro(View):
    """One entry for each state."""

    states: tuple[Works, ...]


def macro_micro(probes: dict[str, xr.Dataset], title: str = "", states: dict[str, str] | None = None) -> MacroMicro:
    """The view of probes of grains at one norm.

    Raises
    ------
    InvalidInput
        If they are not of grains.
    """
    works = []
    for label, data in probes.items():
        if "w2_boundary" not in data:
            raise InvalidInput(
                "macroscopic and microscopic work are compared for grains: these probes have no contacts"
            )
        data = data.sortby("alpha")
        micro = (data.w2_contacts + data.w2_grains).values
        works.append(Works(
            label, data.alpha.values, data.w2_boundary.values, micro, data.w2_paper.values, data.w2_grains.values,
            float(data.identity_residual.max()), (states or {}).get(label, label),
        ))  # fmt: skip
    largest = max(one.residual for one in works)
    verdict = (
        f"W2 of contacts and grains is that of the boundary to {largest:.0e} of its largest term, in every direction."
    )
    return MacroMicro(title=title, caption=CAPTION, verdict=verdict, states=tuple(works))


def _fig4(results: Results) -> dict[str, View]:
    """The last state of each sample."""
    found = of_grains(results)
    views: dict[str, View] = {}
    for (name, sample, states), stem in zip(found, stems("fig4", [one[:2] for one in found]), strict=True):
        state, data = list(states.items())[-1]
        norm = norm_of(results, name)
        title = f"{state} ({results.about(sample)}), strain probes of norm {norm:g}"
        views[stem] = macro_micro({f"η = {state.eta:g}": data.sel(norm=norm)}, title)
    return views


def _families(results: Results) -> dict[str, View]:
    views: dict[str, View] = {}
    for name, sample, states in of_grains(results):
        first = norm_of(results, name)
        for norm in sorted(results.sets("probes")[name].norms, key=lambda norm: norm != first):
            probes = {f"η = {state.eta:g}": data.sel(norm=norm) for state, data in states.items()}
            labels = {f"η = {state.eta:g}": str(state) for state in states}
            views[f"{sample}, probes '{name}' of {norm:g}"] = macro_micro(probes, "", labels)
    return views


STUDY_FIGURES = (
    StudyFigure(
        "fig4", "macroscopic against microscopic work, for grains", f"{IN_THE_PLANE} at states of grains",
        lambda plan: around_units(plan, True), _fig4, _families,
    ),
)  # fmt: skip
