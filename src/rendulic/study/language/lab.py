"""A laboratory test described in a TOML file: second-order work along it, tables and a figure."""

from __future__ import annotations

import os
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from pydantic import Field

from rendulic.foundation.errors import InvalidInput
from rendulic.foundation.validation import Positive, Section, read_toml, validated
from rendulic.foundation.whole_file import whole_file, writable_folder
from rendulic.io.lab import read_triaxial
from rendulic.io.tables import write_csv, write_dataset, write_tables
from rendulic.probing.path_work import w2_along

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["LabResult", "LabTest", "example", "read_lab_test", "run_lab_test"]


class Format(Section):
    """How the file is written; see `rd.io.read_triaxial`."""

    extension: bool = False
    dilation_positive: bool = False
    strain: Literal["engineering", "logarithmic"] = "engineering"
    delimiter: str = ","
    decimal: Literal[".", ","] = "."
    heading_line: int = Field(1, ge=1)
    first_line: int | None = None
    encoding: str = "utf-8-sig"


class Analysis(Section):
    """How the second-order work is found; see `rd.w2_along`."""

    window: Positive | None = None


class LabTest(Section):
    """One loading of a triaxial test."""

    file: str = Field(min_length=1, description="CSV, beside the description")
    drainage: Literal["drained", "undrained"]
    columns: dict[str, str]
    units: dict[str, str]
    constants: dict[str, float] = Field(default_factory=dict)
    format: Format = Format()
    analysis: Analysis = Analysis()


@dataclass(frozen=True)
class LabResult:
    """What a test gave.

    Parameters
    ----------
    title : str
        The file and the drainage.
    measured : xarray.Dataset
        Of `rd.io.read_triaxial`.
    along : xarray.Dataset
        Of `rd.w2_along`.
    files : list of Path
        What was written.
    """

    title: str
    measured: xr.Dataset
    along: xr.Dataset
    files: list[Path]


def example() -> str:
    """The text of a commented description to begin with."""
    return resources.files("rendulic.study").joinpath("presets", "lab_test.toml").read_text(encoding="utf-8")


def read_lab_test(path: str | os.PathLike) -> LabTest:
    """Read and check a description; the file of readings is not opened yet.

    Raises
    ------
    InvalidInput
        If there is no such file, it is not TOML, or an entry is not admissible: the entry is named.
    """
    missing = f"no description of a test at {path}: check the path, or write one with --init"
    table = read_toml(path, missing, "; the readings go into a CSV file that it names")
    return validated(LabTest, table, str(path))


EDGES = ("from_eps_1", "to_eps_1", "from_error", "to_error")


def write_edges(along: xr.Dataset, path: Path) -> Path:
    """Where W2 is negative: one line for each stretch, logarithmic strains, empty where it stays open."""
    with whole_file(path) as temporary:
        along[list(EDGES)].to_dataframe()[list(EDGES)].to_csv(temporary, index=False)
    return path


def run_lab_test(path: str | os.PathLike, folder: str | os.PathLike) -> LabResult:
    """Read the test described at `path`; write readings and second-order work into `folder`.

    Raises
    ------
    InvalidInput
        As of `read_lab_test`, `rd.io.read_triaxial` and `rd.w2_along`, or if the folder cannot be written.
    """
    test = read_lab_test(path)
    readings = Path(path).parent / test.file
    measured = read_triaxial(
        readings,
        test.columns,
        test.units,
        drainage=test.drainage,
        constants=test.constants,
        **test.format.model_dump(),
    )
    try:
        along = w2_along(measured, test.analysis.window)
    except InvalidInput as error:
        raise InvalidInput(f"{readings}: {error}") from None
    folder = writable_folder(folder)
    files = [write_dataset(measured, folder / "measured.nc"), write_csv(measured, folder / "measured.csv")]
    files += [write_dataset(along, folder / "w2.nc"), *write_tables(along.drop_dims("edge"), folder / "w2.csv")]
    files.append(write_edges(along, folder / "edges.csv"))
    return LabResult(f"{readings.name}, {test.drainage}", measured, along, files)
