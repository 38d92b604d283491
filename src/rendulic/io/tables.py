"""Labelled results as NetCDF and CSV files."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from rendulic.foundation.errors import InvalidInput
from rendulic.foundation.hdf5 import plain_file
from rendulic.foundation.whole_file import whole_file

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["read_dataset", "write_csv", "write_dataset", "write_tables"]


def write_dataset(dataset: xr.Dataset, path: str | os.PathLike) -> Path:
    """Write a dataset as NetCDF 4, whole or not at all, and return the path."""
    with whole_file(path) as temporary:
        dataset.to_netcdf(temporary, engine="h5netcdf")
    return Path(path)


def write_csv(dataset: xr.Dataset, path: str | os.PathLike) -> Path:
    """Write a dataset as CSV, one row per point of its dimensions, units in the headings; return the path.

    Whole or not at all. Values have the digits that give them back exactly.
    """
    frame = dataset.to_dataframe()
    units = {name: dataset[name].attrs.get("units", "1") for name in frame.columns}
    frame = frame.rename(columns={name: f"{name} [{unit}]" for name, unit in units.items() if unit != "1"})
    with whole_file(path) as temporary:
        frame.to_csv(temporary)
    return Path(path)


def write_tables(dataset: xr.Dataset, path: str | os.PathLike) -> list[Path]:
    """Write all variables as CSV, those along different dimensions into files of their own; return the paths.

    `path` has the variables along the dimensions of the first one; the others are beside it, with their dimensions added to
    the name: `curve.csv`, `curve_event.csv`, `curve_record_plane.csv`; single values are in `curve_values.csv`.
    """
    path, plain = Path(path), dataset.reset_coords()
    groups: dict[tuple, list] = {}
    for name, variable in plain.data_vars.items():
        groups.setdefault(variable.dims, []).append(name)
    written = []
    for dims, names in groups.items():
        table = plain[names] if dims else plain[names].expand_dims("value")
        added = "" if dims == next(iter(groups)) else "_" + "_".join(map(str, dims or ("values",)))
        written.append(write_csv(table, path.with_name(f"{path.stem}{added}{path.suffix}")))
    return written


def read_dataset(path: str | os.PathLike) -> xr.Dataset:
    """Read a NetCDF file into memory.

    Raises
    ------
    InvalidInput
        If there is no such file.
    CorruptFile
        If it is truncated or not NetCDF.
    """
    import xarray as xr
    from xarray.conventions import decode_cf_variables

    path = Path(path)
    if not path.is_file():
        raise InvalidInput(f"no table at {path}: check the path")
    with plain_file(path, "NetCDF file") as file:
        found = file.variables()
        raw = {name: xr.Variable(*own) for name, own in found["variables"].items()}
        variables, attributes, coords = decode_cf_variables(raw, found["attributes"])
        return xr.Dataset(variables, attrs=attributes).set_coords(coords & set(variables)).load()
