"""The record of a loading: labelled, with units, as an `xarray.Dataset`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rendulic.tensors.invariants import deviatoric_stress, mean_stress, stress_ratio, volumetric_strain

if TYPE_CHECKING:
    import xarray as xr

    from rendulic.specimen import Specimen

__all__ = ["CurveRecorder"]

QUASI_STATIC_LIMIT = 1e-4  # of the inertial number; theory, section 2

COLUMNS = {
    "eps_1": ("axial strain", "1"),
    "eps_2": ("lateral strain", "1"),
    "eps_3": ("lateral strain", "1"),
    "eps_v": ("volumetric strain, contraction positive", "1"),
    "sigma_1": ("axial stress", "Pa"),
    "sigma_2": ("lateral stress", "Pa"),
    "sigma_3": ("lateral stress", "Pa"),
    "p": ("mean stress", "Pa"),
    "q": ("deviatoric stress", "Pa"),
    "eta": ("stress ratio q/p", "1"),
    "inertial_number": ("inertial number of the loading rate", "1"),
    "unbalanced_force": ("mean resultant over mean contact force", "1"),
    "porosity": ("porosity", "1"),
    "n_contacts": ("closed contacts", "1"),
    "time": ("time", "s"),
}


class CurveRecorder:
    """Collects records of a specimen along a path."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._rows: list[dict[str, float]] = []

    def add(self, specimen: Specimen, **extra: float) -> None:
        """Record stress and strain of `specimen`, what else it knows of itself, and `extra`."""
        sigma, eps = specimen.stress, specimen.strain
        row = {f"eps_{k + 1}": eps[k, k] for k in range(3)} | {f"sigma_{k + 1}": sigma[k, k] for k in range(3)}
        row |= {
            "eps_v": float(volumetric_strain(eps)),
            "p": float(mean_stress(sigma)),
            "q": float(deviatoric_stress(sigma)),
            "eta": float(stress_ratio(sigma)),
        }
        for name in ("porosity", "n_contacts", "time"):
            if hasattr(specimen, name):
                row[name] = getattr(specimen, name)
        self._rows.append(row | extra)

    def dataset(self, **attributes) -> xr.Dataset:
        """The curve so far, dimension `record`; `attributes` are stored with it."""
        import xarray as xr

        variables = {}
        for name, (long_name, units) in COLUMNS.items():
            if self._rows and all(name in row for row in self._rows):
                values = np.array([row[name] for row in self._rows], dtype=float)
                variables[name] = ("record", values, {"long_name": long_name, "units": units})
        attributes = {"path": self.name, "sign": "compression and contraction positive"} | attributes
        if "inertial_number" in variables:
            largest = float(variables["inertial_number"][1].max())
            attributes["largest_inertial_number"] = largest
            attributes["is_quasi_static"] = int(largest <= QUASI_STATIC_LIMIT)
            attributes["largest_unbalanced_force"] = float(variables["unbalanced_force"][1].max())
        return xr.Dataset(variables, attrs=attributes)
