"""What happens on the contact planes of a test: local stress paths and second-order work (Figs. 9 and 10 of the paper)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rendulic.foundation.errors import InvalidInput
from rendulic.views.catalogue import StudyFigure
from rendulic.views.paths import labels_of
from rendulic.views.view import View

if TYPE_CHECKING:
    import xarray as xr

    from rendulic.study.plan import Plan
    from rendulic.study.results import Results
    from rendulic.study.store.unit import Unit

__all__ = ["STUDY_FIGURES", "PlanePaths", "PlaneWork", "PlanesView", "plane_paths", "plane_work", "planes"]

PATHS = (
    "Local stress paths, shear against normal stress, of one plane of every inclination to the axis (of many, those next to "
    "the paper's). Full dots are where the second-order work of the assembly vanishes, open ones where that of the plane does."
)
WORK = (
    "Normalised second-order work of one plane of every inclination (of many, those next to the paper's) along the path; red "
    "where it is negative. Dots are where the assembly loses second-order work."
)
SPHERE = "Contact planes at their normals (each at both ends) on the unit sphere, axis 1 upward, as the test goes on."
MOST_INCLINATIONS = 12  # that one figure can show
PAPER = (18.0, 28.3, 45.0, 54.7, 70.4, 72.0)  # degrees


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanesView(View):
    """All contact planes of a test.

    Parameters
    ----------
    curve : xarray.Dataset
        From `MaterialPoint.load`, dimensions `record`, `plane`, `event`.
    """

    curve: xr.Dataset

    @property
    def representatives(self) -> dict[float, int]:
        """One plane for every inclination to the axis other than 0 and 90 degrees: {inclination: plane}.

        In an axisymmetric test all planes of one inclination respond alike. Of sphere rules with many inclinations those
        nearest to the six of the paper.
        """
        angles = np.round(self.curve.inclination.values, 1)
        every = [float(angle) for angle in np.unique(angles) if 0.0 < angle < 90.0]
        if len(every) > MOST_INCLINATIONS:
            every = sorted({every[int(np.abs(np.array(every) - wanted).argmin())] for wanted in PAPER})
        return {angle: int(np.flatnonzero(angles == angle)[0]) for angle in every}

    def first(self, kind: str, plane: int) -> float | None:
        """Axial strain of the first event of a kind on a plane (-1: the assembly)."""
        curve = self.curve
        found = np.flatnonzero((curve.event_kind.values == kind) & (curve.event_plane.values == plane))
        return float(curve.event_eps_1[found[0]]) if len(found) else None


class PlanePaths(PlanesView):
    """Local stress paths."""


class PlaneWork(PlanesView):
    """Local second-order work."""


def _checked(curve: xr.Dataset) -> xr.Dataset:
    if "plane" not in curve.dims:
        raise InvalidInput("this figure shows contact planes, which only curves of the Chang-Hicher model have")
    return curve


def plane_paths(curve: xr.Dataset, title: str = "") -> PlanePaths:
    """The view of local stress paths of a curve from `MaterialPoint.load`."""
    return PlanePaths(title=title, caption=PATHS, curve=_checked(curve))


def plane_work(curve: xr.Dataset, title: str = "") -> PlaneWork:
    """The view of local second-order work of a curve from `MaterialPoint.load`."""
    view = PlaneWork(title=title, caption=WORK, curve=_checked(curve))
    lost = {angle: view.first("plane_w2_lost", plane) for angle, plane in view.representatives.items()}
    order = sorted((strain, angle) for angle, strain in lost.items() if strain is not None)
    told = ", ".join(f"{angle:g}° at {100 * strain:.2f} %" for strain, angle in order)
    onset = view.first("w2_lost", -1)
    verdict = "W2 does not turn negative, neither on a plane nor in the assembly."
    if order or onset is not None:
        whole = "in the assembly it does not" if onset is None else f"in the assembly at {100 * onset:.2f} %"
        where = (
            f"W2 turns negative on planes (angle to axis 1, axial strain): {told}"
            if order
            else "W2 turns negative on no plane"
        )
        verdict = f"{where}; {whole}."
    return PlaneWork(title=title, caption=WORK, verdict=verdict, curve=curve)


def planes(curve: xr.Dataset, title: str = "") -> PlanesView:
    """The view of all planes on the sphere."""
    end = int((_checked(curve).w2_plane.values[-1] < 0.0).sum())
    verdict = f"At its end {end} of {curve.sizes['plane']} planes have negative second-order work."
    return PlanesView(title=title, caption=SPHERE, verdict=verdict, curve=curve)


def _needs(plan: Plan) -> list[Unit]:
    return [
        unit
        for (_, state), units in plan.of("path").items()
        if state is not None and not plan.has_grains(state)
        for unit in units
    ]


def _of_sands(results: Results) -> dict[str, xr.Dataset]:
    return {
        label: results.of("path")[key]
        for key, label in labels_of(results).items()
        if "plane" in results.of("path")[key].dims
    }


def _stem(name: str, label: str, first: bool) -> str:
    return name if first else f"{name}_{label.replace(' = ', '_').replace(', ', '_').replace(' ', '_')}"


def _each(results: Results, name: str, make) -> dict[str, View]:
    return {
        _stem(name, label, k == 0): make(curve, label) for k, (label, curve) in enumerate(_of_sands(results).items())
    }


def _sphere(results: Results) -> dict[str, View]:
    return {label: planes(curve, label) for label, curve in _of_sands(results).items()}


SAND = "[[path]] of a sand"
STUDY_FIGURES = (
    StudyFigure("fig9", "local stress paths on contact planes", SAND, _needs,
                lambda results: _each(results, "fig9", plane_paths), _sphere),
    StudyFigure("fig10", "second-order work on contact planes", SAND, _needs,
                lambda results: _each(results, "fig10", plane_work)),
)  # fmt: skip
