"""Element tests from their study to tables and figures, in this process."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rendulic import figures
from rendulic.foundation.progress import Progress, silent
from rendulic.foundation.whole_file import writable_folder
from rendulic.io.tables import write_csv, write_dataset
from rendulic.study.language.element import ElementStudy, check_states, follow_test

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["ElementResult", "run_element_study", "write_curve"]


@dataclass(frozen=True)
class ElementResult:
    """What one test gave.

    Parameters
    ----------
    name : str
        Of the test.
    curve : xarray.Dataset
        All legs one after the other, with the coordinate `leg`.
    files : list of Path
        What was written.
    """

    name: str
    curve: xr.Dataset
    files: list[Path]


def run_element_study(
    study: ElementStudy, folder: str | os.PathLike, *, stage: Callable[[str], Progress] = lambda _name: silent
) -> list[ElementResult]:
    """Run every test and write its curve, events and planes as CSV, all of it as NetCDF, and figures.

    A test ends early where no quasi-static continuation exists; `stopped_by` of its curve says why, and
    the legs after it are not run.

    Raises
    ------
    InvalidInput
        If a state is not admissible or the folder cannot be written; the test is named.
    """
    folder = writable_folder(Path(folder))
    check_states(study)
    curves = {test.name: follow_test(study, test, stage(test.name)) for test in study.test}
    files = {
        name: [*write_curve(curve, folder, name), *draw_curve(curve, folder, name)] for name, curve in curves.items()
    }
    if len(curves) > 1:
        figures.save(figures.element_tests(curves), folder, "all_tests")
    return [ElementResult(name, curve, files[name]) for name, curve in curves.items()]


def write_curve(curve: xr.Dataset, folder: Path, name: str) -> list[Path]:
    """The curve of a test as NetCDF, its records, events and planes as CSV."""
    tables = [write_csv(table, folder / f"{name}{suffix}.csv") for suffix, table in _tables(curve).items()]
    return [write_dataset(curve, folder / f"{name}.nc"), *tables]


def draw_curve(curve: xr.Dataset, folder: Path, name: str) -> list[Path]:
    """The figures of one test."""
    return [
        *figures.save(figures.element_tests({name: curve}), folder, name),
        *figures.save(figures.plane_paths(curve, name), folder, f"{name}_plane_paths"),
        *figures.save(figures.plane_work(curve, name), folder, f"{name}_plane_work"),
    ]


def _tables(curve: xr.Dataset) -> dict[str, xr.Dataset]:
    """The curve in tables of one index each."""
    plain = curve.reset_coords()

    def with_dims(*dims: str) -> list[str]:
        return [str(name) for name in plain.data_vars if plain[name].dims == dims]

    return {
        "": plain[with_dims("record")],
        "_events": plain[with_dims("event")],
        "_planes": plain[[*with_dims("record", "plane"), "inclination", "plane_weight", "eps_1", "leg"]],
    }
