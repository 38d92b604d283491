"""The shear stiffness of one contact plane against obliquity (Fig. 6 of the paper)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rendulic.views.catalogue import StudyFigure
from rendulic.views.view import Table, View

if TYPE_CHECKING:
    import xarray as xr

    from rendulic.study.results import Results

__all__ = ["STUDY_FIGURES", "PlaneStiffness", "Stiffness", "plane_stiffness"]

CAPTION = (
    "Tangent shear stiffness K_rr of one contact plane against the obliquity over its peak. Below the dashed line it is negative: "
    "the plane can fail. Dots mark where it vanishes before the limit."
)
HEADINGS: dict[str, tuple[str, Callable[[float], str]]] = {
    "dilatancy": ("dilatancy D", lambda value: f"D = {value:g}"),
    "k_n0": ("normal stiffness", lambda value: f"k_n0 = {value / 1e3:g} N/mm"),
    "k_pR": ("plastic ratio", lambda value: f"k_pR = {value:g}"),
    "k_rR": ("shear ratio", lambda value: f"k_rR = {value:g}"),
}


@dataclass(frozen=True, eq=False)
class Stiffness:
    """One case: obliquities over the peak, K_rr in N/m, and where it first vanishes (NaN: nowhere)."""

    label: str
    x: np.ndarray
    k_rr: np.ndarray
    zero: float


@dataclass(frozen=True, kw_only=True, eq=False)
class PlaneStiffness(View):
    """Cases by panel."""

    panels: Mapping[str, tuple[Stiffness, ...]]


def plane_stiffness(
    panels: Mapping[str, Mapping[str, tuple[np.ndarray, np.ndarray]]], title: str = ""
) -> PlaneStiffness:
    """The view of curves (x, K_rr) by heading and label."""
    made = {
        heading: tuple(Stiffness(label, x, k_rr, _zero(x, k_rr)) for label, (x, k_rr) in curves.items())
        for heading, curves in panels.items()
    }
    rows = [
        (one.label, f"{one.zero:.4f}" if np.isfinite(one.zero) else "nowhere", f"{1e-3 * one.k_rr.min():.3f}",
         f"{one.x[int(one.k_rr.argmin())]:.3f}")
        for cases in made.values() for one in cases
    ]  # fmt: skip
    table = Table("Where the shear stiffness vanishes", ("case", "K_rr = 0 at x", "smallest K_rr [N/mm]", "at x"), rows)
    return PlaneStiffness(title=title, caption=CAPTION, tables=(table,), panels=made)


def _zero(x: np.ndarray, k_rr: np.ndarray) -> float:
    """The first zero before the limit, linear between points."""
    crossing = np.flatnonzero((k_rr[:-1] > 0.0) & (k_rr[1:] <= 0.0))
    if not len(crossing):
        return float("nan")
    k = int(crossing[0])
    return float(x[k] + (x[k + 1] - x[k]) * k_rr[k] / (k_rr[k] - k_rr[k + 1]))


def _of_table(table: xr.Dataset) -> PlaneStiffness:
    panels: dict[str, dict[str, tuple[np.ndarray, np.ndarray]]] = {}
    for k in range(table.sizes["case"]):
        name, value = str(table.parameter.values[k]), float(table.value[k])
        heading, label = HEADINGS.get(name, (name, lambda value, name=name: f"{name} = {value:g}"))
        panels.setdefault(heading, {})[label(value)] = (table.x.values, table.shear_stiffness.values[k])
    return plane_stiffness(panels)


def _fig6(results: Results) -> dict[str, View]:
    found = results.of("plane_law")
    return {"fig6" if len(found) == 1 else f"fig6_{name}": _of_table(table) for (name, _), table in found.items()}


STUDY_FIGURES = (
    StudyFigure(
        "fig6", "shear stiffness of a contact plane", "[[plane_law]]",
        lambda plan: [unit for units in plan.of("plane_law").values() for unit in units], _fig6,
    ),
)  # fmt: skip
