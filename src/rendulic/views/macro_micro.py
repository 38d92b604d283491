"""Macroscopic against microscopic second-order work (Fig. 4 of the paper)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rendulic.foundation.errors import InvalidInput
from rendulic.probing.bootstrap import interval_of_mean
from rendulic.views.catalogue import StudyFigure
from rendulic.views.circular import (
    IN_THE_PLANE,
    around_units,
    ensemble_title,
    norm_of,
    norms_of,
    of_grains,
    stems,
)
from rendulic.views.ensembles import CHANCE, StudyEnsemble, ensembles
from rendulic.views.view import View

if TYPE_CHECKING:
    import xarray as xr

    from rendulic.study.results import Results

__all__ = ["STUDY_FIGURES", "MacroMicro", "Works", "macro_micro", "mean_works"]

CAPTION = (
    "Second-order work of the boundary (line), and of all contacts and grains (circles): an identity, so that they must agree to "
    "rounding, which tests the code's sums and not the data. Crosses are the paper's sum over contacts that are there in both states. The inertial term is the work of the "
    "resultants on the grains."
)
OF_MANY = (
    " Means of many packings, the boundary's with its 95 % interval; faint lines are the boundaries of single packings."
)


@dataclass(frozen=True, eq=False)
class Works:
    """The works of one state in all directions, in J/m3; directions in degrees, increasing.

    Or their means over many packings: `band` are the bounds of that of the boundary, `single` this of each packing.
    """

    label: str
    alpha: np.ndarray
    boundary: np.ndarray
    micro: np.ndarray
    paper: np.ndarray
    inertial: np.ndarray
    residual: float
    state: str = ""
    band: tuple[np.ndarray, np.ndarray] | None = None
    single: tuple[np.ndarray, ...] = ()


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
    return _view([_works(label, data, (states or {}).get(label, label)) for label, data in probes.items()], title)


def _view(works: list[Works], title: str) -> MacroMicro:
    largest = max(one.residual for one in works)
    verdict = (
        f"W2 of contacts and grains is that of the boundary to {largest:.0e} of its largest term, in every direction."
    )
    caption = CAPTION + (OF_MANY if any(one.single for one in works) else "")
    return MacroMicro(title=title, caption=caption, verdict=verdict, states=tuple(works))


def _works(label: str, data: xr.Dataset, state: str) -> Works:
    if "w2_boundary" not in data:
        raise InvalidInput("macroscopic and microscopic work are compared for grains: these probes have no contacts")
    data = data.sortby("alpha")
    micro = (data.w2_contacts + data.w2_grains).values
    return Works(
        label, data.alpha.values, data.w2_boundary.values, micro, data.w2_paper.values, data.w2_grains.values,
        float(data.identity_residual.max()), state,
    )  # fmt: skip


def mean_works(label: str, probes: Iterable[xr.Dataset], state: str = "") -> Works:
    """Means of the works of packings at one state and norm, at the same directions; bounds of the boundary's by resampling."""
    each = [_works(label, data, state) for data in probes]
    alpha = each[0].alpha
    each = [one for one in each if np.array_equal(one.alpha, alpha)]
    boundary, micro, paper, inertial = (
        np.mean([getattr(one, name) for one in each], axis=0) for name in ("boundary", "micro", "paper", "inertial")
    )
    low, high = interval_of_mean(np.array([one.boundary for one in each]))
    band = (low, high) if np.isfinite(high - low).all() else None
    residual = max(one.residual for one in each)
    return Works(
        label, alpha, boundary, micro, paper, inertial, residual, state, band, tuple(one.boundary for one in each)
    )


def _of_ensemble(one: StudyEnsemble, eta: float, norm: float) -> Works:
    found = [data.sel(norm=norm) for data in one.probes[eta].values() if not isinstance(data, str)]
    return mean_works(f"η = {eta:g}", found, one.state(eta))


def _fig4(results: Results) -> dict[str, View]:
    """The last state of each ensemble, and of each packing alone."""
    many, alone = ensembles(results), of_grains(results)
    names = stems("fig4", [(one.name, one.specimen) for one in many] + [(name, one.folder) for name, one, _ in alone])
    views: dict[str, View] = {}
    for one, stem in zip(many, names, strict=False):
        norm, eta = norm_of(results, one.name), max(one.responses)
        views[stem] = _view([_of_ensemble(one, eta, norm)], f"η = {eta:g}: {ensemble_title(one, norm)}")
    for (name, sample, states), stem in zip(alone, names[len(many) :], strict=True):
        state, data = list(states.items())[-1]
        norm = norm_of(results, name)
        title = f"{state} ({results.about(sample)}; {CHANCE}), strain probes of norm {norm:g}"
        views[stem] = macro_micro({f"η = {state.eta:g}": data.sel(norm=norm)}, title)
    return views


def _families(results: Results) -> dict[str, View]:
    views: dict[str, View] = {}
    for one in ensembles(results):
        for norm in norms_of(results, one.name):
            label = f"{one.specimen}, mean of {one.size} packings, probes '{one.name}' of {norm:g}"
            views[label] = _view([_of_ensemble(one, eta, norm) for eta in one.responses], "")
    for name, sample, states in of_grains(results):
        for norm in norms_of(results, name):
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
