"""A laboratory test described in a TOML file: second-order work along it, tables and a figure."""

from __future__ import annotations

import csv
import math
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field, model_validator

from rendulic.foundation.errors import InvalidInput
from rendulic.foundation.validation import Positive, Section, read_toml, validated
from rendulic.foundation.whole_file import whole_file, writable_folder
from rendulic.io.lab import read_triaxial_tests
from rendulic.io.tables import write_csv, write_dataset, write_tables
from rendulic.probing.path_work import w2_along

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["LabPart", "LabResult", "LabTest", "example", "read_lab_test", "run_lab_test"]


class Format(Section):
    """How the file is written; see `rd.io.read_triaxial`."""

    delimiter: str = Field(",", description='one sign, or "blanks": any run of blanks and tabs')
    decimal: Literal[".", ","] = "."
    comment: str | None = Field(None, min_length=1, description="what lines begin with that are not read")
    heading_line: int = Field(1, ge=0, description="0: there is none, and columns are numbers, from 1 on")
    first_line: int | None = Field(None, ge=1, description="of readings")
    last_line: int | None = Field(None, ge=1)
    encoding: str = "utf-8-sig"
    sheet: str | None = Field(None, description="of a workbook (.xlsx)")
    key: str | None = Field(None, description="of an array in an .npz file")
    where: dict[str, str] | None = Field(None, description='of a file with many tests: column and entry, or "all"')
    leg: int | Literal["all"] | None = Field(None, description="of a test with unloading; all, if none is given")
    extension: bool = False
    dilation_positive: bool = False
    tension_positive: bool = False
    initial_void_ratio: Positive | None = None
    strain: Literal["engineering", "logarithmic"] = "engineering"


class Analysis(Section):
    """How the second-order work is found; see `rd.w2_along`."""

    window: Positive | None = None


class LabTest(Section):
    """A triaxial test, or several in a file. Entries of `[format]` may stand beside `file`, too."""

    file: str = Field(min_length=1, description="text, .xlsx or .npz, beside the description")
    drainage: Literal["drained", "undrained"]
    columns: dict[str, str | int]
    units: dict[str, str]
    constants: dict[str, float] = Field(default_factory=dict)
    format: Format = Format()
    analysis: Analysis = Analysis()

    @model_validator(mode="before")
    @classmethod
    def _all_in_format(cls, table: Any) -> Any:
        if not isinstance(table, dict) or not isinstance(table.get("format", {}), dict):
            return table
        inner = dict(table.get("format", {}))
        outer = {name: value for name, value in table.items() if name in cls.model_fields}
        for name, value in table.items():
            if name not in outer:
                (inner if name in Format.model_fields and name not in inner else outer)[name] = value
        constants = outer.get("constants")
        if isinstance(constants, dict) and "initial_void_ratio" in constants:
            outer["constants"] = {name: value for name, value in constants.items() if name != "initial_void_ratio"}
            inner.setdefault("initial_void_ratio", constants["initial_void_ratio"])
        return outer | ({"format": inner} if inner else {})


@dataclass(frozen=True)
class LabPart:
    """What one loading gave.

    Parameters
    ----------
    title : str
        The file, the test and the leg, and the drainage.
    measured : xarray.Dataset
        Of `rd.io.read_triaxial`.
    along : xarray.Dataset, optional
        Of `rd.w2_along`; None if there are too few readings.
    folder : Path
        Where its tables are.
    why_not : str
        Why there is no `along`.
    """

    title: str
    measured: xr.Dataset
    along: xr.Dataset | None
    folder: Path
    why_not: str = ""


@dataclass(frozen=True)
class LabResult:
    """What a description gave.

    Parameters
    ----------
    parts : list of LabPart
        The loading, or each test and leg.
    files : list of Path
        What was written.
    """

    parts: list[LabPart]
    files: list[Path]

    @property
    def measured(self) -> xr.Dataset:
        """Readings of the first loading."""
        return self.parts[0].measured

    @property
    def along(self) -> xr.Dataset | None:
        """Second-order work along the first loading."""
        return self.parts[0].along


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


def write_edges(along: Mapping[str, xr.Dataset], path: Path) -> Path:
    """Where W2 is negative: one line for each stretch, logarithmic strains, empty where it stays open; tests by name."""
    with whole_file(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        several = len(along) > 1
        writer.writerow([*EDGES, *(["test"] if several else [])])
        for name, found in along.items():
            for row in zip(*(found[column].values.tolist() for column in EDGES), strict=True):
                writer.writerow(["" if math.isnan(value) else value for value in row] + ([name] if several else []))
    return path


def run_lab_test(path: str | os.PathLike, folder: str | os.PathLike) -> LabResult:
    """Read the test described at `path`; write readings and second-order work into `folder`.

    Several tests, or legs, get folders of their own, and `edges.csv` lists the edges of all.

    Raises
    ------
    InvalidInput
        As of `read_lab_test`, `rd.io.read_triaxial` and `rd.w2_along`, or if the folder cannot be written.
    """
    test = read_lab_test(path)
    readings = Path(path).parent / test.file
    tests = read_triaxial_tests(
        readings, test.columns, test.units, drainage=test.drainage, constants=test.constants, **test.format.model_dump()
    )
    parts, told = [], [f"{readings.name}, {test.drainage}"]
    for name, measured in tests.items():
        along, why_not = None, ""
        try:
            along = w2_along(measured, test.analysis.window)
        except InvalidInput as error:
            if len(tests) == 1:
                raise InvalidInput(f"{readings}: {error}") from None
            why_not = str(error)
        title = ", ".join([*told, name] if name else told)
        parts.append(LabPart(title, measured, along, Path(folder) / re.sub(r"[^\w.-]+", "_", name), why_not))
    folder = writable_folder(folder)
    files = []
    for part in parts:
        place = writable_folder(part.folder)
        files += [write_dataset(part.measured, place / "measured.nc"), write_csv(part.measured, place / "measured.csv")]
        if part.along is not None:
            files.append(write_dataset(part.along, place / "w2.nc"))
            files += write_tables(part.along.drop_dims("edge"), place / "w2.csv")
            files.append(write_edges({"": part.along}, place / "edges.csv"))
    if len(parts) > 1:
        every = {name: part.along for name, part in zip(tests, parts, strict=True) if part.along is not None}
        files.append(write_edges(every, folder / "edges.csv"))
    return LabResult(parts, files)
