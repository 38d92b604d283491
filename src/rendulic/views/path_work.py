"""A measured test: stress and strain, the stress path, and the second-order work along it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rendulic.views.view import View

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["PathWork", "path_work"]

CAPTION = (
    "A measured test: deviatoric stress against axial strain, the stress path, the normalised second-order work W2n along the path, "
    "and the volumetric strain where it changes. Grey dots are readings, lines what was fitted. Full dots mark where W2 turns "
    "negative, open ones where it turns positive again, their bars how sure that is; on shaded stretches W2 is negative. The band "
    "about W2n is two standard deviations of noise."
)


@dataclass(frozen=True, kw_only=True, eq=False)
class PathWork(View):
    """Readings and what was found along them.

    Parameters
    ----------
    measured : xarray.Dataset
        From `rd.io.read_triaxial`.
    along : xarray.Dataset
        From `rd.w2_along` of it.
    """

    measured: xr.Dataset
    along: xr.Dataset

    @property
    def is_effective(self) -> bool:
        """Whether there is a mean effective stress."""
        return "p" in self.along

    @property
    def swells(self) -> bool:
        """Whether the volume changes."""
        return float(np.abs(self.measured.eps_v).max()) > 1e-9

    @property
    def edges(self) -> list[Edge]:
        """In the order of the path; those that were seen."""
        along, found = self.along, []
        strain, order = along.eps_1.values, np.argsort(along.eps_1.values)
        for k in range(along.sizes["edge"]):
            for side, falls in (("from", True), ("to", False)):
                at, error = (float(along[f"{side}_{name}"][k]) for name in ("eps_1", "error"))
                if np.isfinite(error):
                    q, p = (
                        float(np.interp(at, strain[order], along[name].values[order])) if name in along else np.nan
                        for name in ("q", "p")
                    )
                    found.append(Edge(at, error, q, p, falls))
        return found

    @property
    def stretches(self) -> list[tuple[float, float]]:
        """Axial strains from and to which W2 is negative."""
        ends = np.where(np.isnan(self.along.to_eps_1), self.along.eps_1[-1], self.along.to_eps_1)
        return list(zip(self.along.from_eps_1.values.tolist(), ends.tolist(), strict=True))

    @property
    def band(self) -> tuple[xr.DataArray, xr.DataArray]:
        """W2n less and plus two standard deviations of its noise."""
        along = self.along
        with np.errstate(divide="ignore", invalid="ignore"):
            error = 2.0 * along.w2_error * np.abs(along.w2_normalised / along.w2)
        return along.w2_normalised - error, along.w2_normalised + error


@dataclass(frozen=True)
class Edge:
    """Where W2 changes its sign."""

    eps_1: float
    error: float
    q: float
    p: float
    falls: bool


def path_work(measured: xr.Dataset, along: xr.Dataset, title: str = "") -> PathWork:
    """The view of a measured test."""
    return PathWork(title=title, caption=CAPTION, verdict=str(along.attrs["verdict"]), measured=measured, along=along)
