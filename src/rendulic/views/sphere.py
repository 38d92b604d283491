"""Probes in all directions of principal increments: the normalised second-order work on the unit sphere."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rendulic.foundation.errors import InvalidInput
from rendulic.views.catalogue import StudyFigure
from rendulic.views.view import View

if TYPE_CHECKING:
    import xarray as xr

    from rendulic.study.plan import Plan
    from rendulic.study.results import Results
    from rendulic.study.store.unit import Unit

__all__ = ["STUDY_FIGURES", "OnSphere", "on_sphere"]

CAPTION = "Normalised second-order work W2n of probes in all directions of principal increments, on the unit sphere."


@dataclass(frozen=True, kw_only=True, eq=False)
class OnSphere(View):
    """One state; `unit` are (n, 3) directions of principal increments, `weight` their shares of the sphere."""

    unit: np.ndarray
    weight: np.ndarray
    w2_normalised: np.ndarray
    state: str

    @property
    def negative_share(self) -> float:
        """Share of all directions with negative work."""
        return float(self.weight[self.w2_normalised < 0.0].sum())


def on_sphere(probes: xr.Dataset, title: str = "", state: str = "") -> OnSphere:
    """The view of probes of `rd.directions.sphere` at one norm.

    Raises
    ------
    InvalidInput
        If the probes are not on the sphere.
    """
    if "along_1" not in probes.coords or probes.w2_normalised.ndim != 1:
        raise InvalidInput(
            "a stereogram needs probes in rd.directions.sphere(...) at one norm, these have no dimension 'direction'"
        )
    unit = np.column_stack([probes[f"along_{k}"].values for k in (1, 2, 3)])
    work, weight = probes.w2_normalised.values, probes.weight.values
    share = 100.0 * float(weight[work < 0.0].sum())
    verdict = f"Second-order work is negative in {share:.1f} % of all directions of principal increments."
    return OnSphere(
        title=title,
        caption=CAPTION,
        verdict=verdict,
        unit=unit,
        weight=weight,
        w2_normalised=work,
        state=state or title,
    )


def _needs(plan: Plan) -> list[Unit]:
    sets = plan.study.sets("probes")
    return [unit for (name, _), units in plan.of("probes").items() if not sets[name].is_in_the_plane for unit in units]


def _sphere(results: Results) -> dict[str, View]:
    sets, found = results.sets("probes"), results.of("probes")
    places = [(name, state) for name, state in found if not sets[name].is_in_the_plane and state is not None]
    views: dict[str, View] = {}
    for name, state in places:
        stem = "sphere" if len(places) == 1 else f"sphere_{state.sample.folder}_eta_{state.eta:.3f}_{name}"
        title = f"{state}, {sets[name].kind} probes of {sets[name].norms[-1]:g}"
        views[stem] = on_sphere(found[name, state].isel(norm=-1), title, str(state))
    return views


STUDY_FIGURES = (
    StudyFigure("sphere", "W2n in all principal directions", "[[probes]] with sphere_directions", _needs, _sphere),
)
