"""The record of a loading: labelled, with units, as an `xarray.Dataset`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Protocol

import numpy as np

from rendulic.tensors.invariants import deviatoric_stress, mean_stress, stress_ratio, volumetric_strain

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["COLUMNS", "CurveRecorder", "labelled_curve", "stress_columns"]

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
    "void_ratio": ("void ratio", "1"),
    "n_contacts": ("closed contacts", "1"),
    "time": ("time", "s"),
    "phase": ("what is done to the specimen", "1"),
    "strain_along": ("strain along the direction of the burst", "1"),
    "load": ("conjugate stress sigma : u", "Pa"),
    "kinetic_energy": ("kinetic energy", "J"),
    "boundary_work": ("work of the walls since rest", "J"),
    "elastic_energy": ("change of stored elastic energy since rest", "J"),
    "friction_work": ("what friction took since rest", "J"),
    "damping_work": ("what damping took since rest", "J"),
    "energy_error": ("boundary work that the energies do not account for", "J"),
}


class HasStressAndStrain(Protocol):
    """What a record needs of a specimen."""

    @property
    def stress(self) -> np.ndarray: ...

    @property
    def strain(self) -> np.ndarray: ...


class CurveRecorder:
    """Collects records of a specimen along a path."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._rows: list[dict[str, float]] = []

    def add(self, specimen: HasStressAndStrain, **extra: float) -> None:
        """Record stress and strain of `specimen`, what else it knows of itself, and `extra`."""
        row = {name: float(value) for name, value in stress_columns(specimen.stress, specimen.strain).items()}
        for name in ("porosity", "n_contacts", "time"):
            if hasattr(specimen, name):
                row[name] = getattr(specimen, name)
        self._rows.append(row | extra)

    def dataset(self, **attributes) -> xr.Dataset:
        """The curve so far, dimension `record`; `attributes` are stored with it."""
        names = [name for name in COLUMNS if self._rows and all(name in row for row in self._rows)]
        columns = {name: np.array([row[name] for row in self._rows], dtype=float) for name in names}
        curve = labelled_curve(self.name, columns, **attributes)
        if "inertial_number" in columns:
            largest = float(columns["inertial_number"].max())
            curve.attrs["largest_inertial_number"] = largest
            curve.attrs["is_quasi_static"] = int(largest <= QUASI_STATIC_LIMIT)
            curve.attrs["largest_unbalanced_force"] = float(columns["unbalanced_force"].max())
        return curve


def labelled_curve(path_name: str, columns: Mapping[str, np.ndarray], **attributes) -> xr.Dataset:
    """Columns of `COLUMNS`, each of one length, as a curve with units; `attributes` are stored with it."""
    import xarray as xr

    variables = {
        name: ("record", columns[name], {"long_name": long_name, "units": units})
        for name, (long_name, units) in COLUMNS.items()
        if name in columns
    }
    return xr.Dataset(variables, attrs={"path": path_name, "sign": "compression and contraction positive"} | attributes)


def stress_columns(sigma: np.ndarray, eps: np.ndarray) -> dict[str, np.ndarray]:
    """The columns that follow from stresses and strains (..., 3, 3)."""
    columns = {f"eps_{k + 1}": eps[..., k, k] for k in range(3)}
    columns |= {f"sigma_{k + 1}": sigma[..., k, k] for k in range(3)}
    return columns | {
        "eps_v": volumetric_strain(eps),
        "p": mean_stress(sigma),
        "q": deviatoric_stress(sigma),
        "eta": stress_ratio(sigma),
    }
