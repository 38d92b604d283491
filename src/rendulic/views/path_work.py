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
    "and the volumetric strain where it changes. Grey dots are readings, lines what was fitted. A red dot marks where W2 turns "
    "negative, its bar how sure that is; the band about W2n is two standard deviations of noise."
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
    def swells(self) -> bool:
        """Whether the volume changes."""
        return float(np.abs(self.measured.eps_v).max()) > 1e-9

    @property
    def band(self) -> tuple[xr.DataArray, xr.DataArray]:
        """W2n less and plus two standard deviations of its noise."""
        along = self.along
        with np.errstate(divide="ignore", invalid="ignore"):
            error = 2.0 * along.w2_error * np.abs(along.w2_normalised / along.w2)
        return along.w2_normalised - error, along.w2_normalised + error


def path_work(measured: xr.Dataset, along: xr.Dataset, title: str = "") -> PathWork:
    """The view of a measured test."""
    return PathWork(title=title, caption=CAPTION, verdict=str(along.attrs["verdict"]), measured=measured, along=along)
