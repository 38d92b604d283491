"""Triaxial tests from a laboratory, as curves like those that rendulic computes."""

from __future__ import annotations

import csv
import os
from collections.abc import Mapping
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rendulic.foundation.checks import finite_array, whole_number
from rendulic.foundation.errors import InvalidInput, nearest, one_of
from rendulic.specimen.curve import labelled_curve, stress_columns

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["read_triaxial"]

STRAIN = {"1": 1.0, "%": 1e-2}
STRESS = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "bar": 1e5}
QUANTITIES = {
    "eps_1": STRAIN, "eps_v": STRAIN, "q": STRESS, "p": STRESS, "pore_pressure": STRESS, "cell_pressure": STRESS,
}  # fmt: skip
MEASURES = ("engineering", "logarithmic")
LARGEST = 100_000_000  # bytes of a file that are read
SHOWN = 300  # letters of a file that an error repeats


def read_triaxial(
    path: str | os.PathLike,
    columns: Mapping[str, str],
    units: Mapping[str, str],
    *,
    drainage: str,
    constants: Mapping[str, float] | None = None,
    extension: bool = False,
    dilation_positive: bool = False,
    strain: str = "engineering",
    delimiter: str = ",",
    decimal: str = ".",
    heading_line: int = 1,
    first_line: int | None = None,
    encoding: str = "utf-8-sig",
) -> xr.Dataset:
    """Read one loading of a triaxial test from a CSV file.

    1. The lateral stress is the cell pressure less the pore pressure, or `p - q/3`.
    2. The lateral strain is `(eps_v - eps_1) / 2`; undrained, `eps_v` is zero.
    3. Engineering strains e become logarithmic, `-ln(1 - e)`, as everywhere in rendulic.

    Parameters
    ----------
    path : path
        A file with one line of headings.
    columns : mapping
        Heading of each quantity: `eps_1` (axial strain) and `q` (sigma_1 - sigma_3); `p` (effective mean stress), or
        `cell_pressure` (total lateral stress) and `pore_pressure`; drained, also `eps_v` (volumetric strain). If
        `pore_pressure` is the excess, `cell_pressure` is the effective pressure at the start.
    units : mapping
        Unit of each quantity, also of constants: "1" or "%" for strains, "Pa", "kPa", "MPa" or "bar" for stresses.
    drainage : {"drained", "undrained"}
        Undrained means constant volume.
    constants : mapping, optional
        Values of pressures that the file has no column for, e.g. `{"cell_pressure": 300, "pore_pressure": 0}`.
    extension : bool
        Whether the axial strain falls instead of rising.
    dilation_positive : bool
        Whether the file's `eps_v` is positive in dilation.
    strain : {"engineering", "logarithmic"}
        What the file's strains are.
    delimiter, decimal : str
        Between columns, and in numbers; ";" and "," in many countries.
    heading_line, first_line : int
        Lines of the headings and of the first reading, counted from 1; by default readings follow the headings.
    encoding : str
        E.g. "latin-1" for older files.

    Returns
    -------
    xarray.Dataset
        Dimension `record`, with `eps_1` to `eps_3`, `eps_v`, `sigma_1` to `sigma_3` (effective), `p`, `q` in Pa and
        `eta`, compression and contraction positive.

    Raises
    ------
    InvalidInput
        If quantities, headings or units are missing or unknown, there are two ways to the mean stress or none, an entry is
        no finite number, or the axial strain turns back: the file, line and column are named.
    """
    one_of(drainage, ("drained", "undrained"), "drainage")
    one_of(strain, MEASURES, "strain measure")
    path, constants = Path(path), dict(constants or {})
    scales = _scales(path, columns, constants, units, drainage == "undrained")
    lines, table = _read(path, columns, delimiter, decimal, heading_line, first_line, encoding)
    values = {name: scales[name] * table[name] for name in columns}
    for name, constant in constants.items():
        values[name] = scales[name] * finite_array(name, constant, ())
    eps_1 = values["eps_1"]
    eps_v = values.get("eps_v", np.zeros(len(eps_1))) * (-1.0 if dilation_positive else 1.0)
    where = f"column '{columns['eps_1']}': axial strain"
    turns = np.flatnonzero(np.diff(eps_1) * (-1.0 if extension else 1.0) < 0.0)
    if len(turns) or len(np.unique(eps_1)) < 2:
        at = int(turns[0]) if len(turns) else 0
        raise InvalidInput(
            f"{path}, line {lines[at + 1]}, {where} must {'fall' if extension else 'rise'} from reading to reading, but goes "
            f"from {eps_1[at]:g} to {eps_1[at + 1]:g}: compression is positive, extension=True is for extension, and loading "
            "and unloading are read one by one"
        )
    if strain == "engineering":
        if max(eps_1.max(), eps_v.max()) >= 1.0:
            raise InvalidInput(
                f"{path}: engineering strains must be below 1, got {max(eps_1.max(), eps_v.max()):g}; in %?"
            )
        eps_1, eps_v = -np.log1p(-eps_1), -np.log1p(-eps_v)
    q = values["q"]
    lateral = values["p"] - q / 3.0 if "p" in values else values["cell_pressure"] - values["pore_pressure"] + 0.0 * q
    start = float(np.ravel(lateral + q / 3.0)[0])
    if start <= 0.0:
        raise InvalidInput(
            f"{path}, line {lines[0]}: the effective mean stress must be positive at the first reading, got {start:g} Pa; "
            "are columns or units mixed up?"
        )
    columns_of = stress_columns(_diagonal(lateral + q, lateral), _diagonal(eps_1, 0.5 * (eps_v - eps_1)))
    name = f"{drainage} triaxial {'extension' if extension else 'compression'}"
    return labelled_curve(name, columns_of, source=path.name, strain=f"logarithmic, of {strain} strains in the file")


def _diagonal(axial: np.ndarray, lateral: np.ndarray) -> np.ndarray:
    return np.stack((axial, lateral, lateral), axis=-1)[:, :, None] * np.eye(3)


def _scales(
    path: Path, columns: Mapping[str, str], constants: Mapping[str, float], units: Mapping[str, str], undrained: bool
) -> dict[str, float]:
    """Factor to SI of each quantity given, once these are what a test needs."""
    given = [*columns, *constants]
    for name in (*given, *units):
        one_of(name, QUANTITIES, "quantity of a triaxial test")
    needed = ["eps_1", "q"] if undrained else ["eps_1", "q", "eps_v"]
    missing = [name for name in needed if name not in columns]
    if missing:
        raise InvalidInput(
            f"{path}: {'an undrained' if undrained else 'a drained'} test needs a column for {missing[0]}"
        )
    if undrained and "eps_v" in given:
        raise InvalidInput(f"{path}: an undrained test has no volumetric strain: leave eps_v out, or say 'drained'")
    ways = {name for name in ("p", "cell_pressure", "pore_pressure") if name in given}
    if ways not in ({"p"}, {"cell_pressure", "pore_pressure"}):
        raise InvalidInput(
            f"{path}: the mean stress needs either p, or cell_pressure and pore_pressure (columns or constants); "
            f"got {', '.join(sorted(ways)) or 'none of them'}"
        )
    twice = [name for name in constants if name in columns]
    if twice:
        raise InvalidInput(f"{path}: {twice[0]} is given as a column and as a constant; give one of them")
    scales = {}
    for name in given:
        if name not in units:
            raise InvalidInput(f"{path}: {name} needs a unit, one of {', '.join(QUANTITIES[name])}")
        scales[name] = QUANTITIES[name][one_of(units[name], QUANTITIES[name], f"unit of {name}")]
    return scales


def _read(
    path: Path,
    columns: Mapping[str, str],
    delimiter: str,
    decimal: str,
    heading_line: int,
    first_line: int | None,
    encoding: str,
) -> tuple[list[int], dict[str, np.ndarray]]:
    """Line numbers of the readings, and the columns as they stand in the file."""
    one_of(decimal, (".", ","), "decimal sign")
    if len(delimiter) != 1 or delimiter == decimal:
        raise InvalidInput(f"the delimiter must be one sign other than the decimal sign '{decimal}', got {delimiter!r}")
    heading_line = whole_number("heading_line", heading_line, 1)
    first_line = heading_line + 1 if first_line is None else whole_number("first_line", first_line, heading_line + 1)
    if not path.is_file():
        raise InvalidInput(f"no test at {path}: check the path")
    if path.stat().st_size > LARGEST:
        raise InvalidInput(f"{path} has {path.stat().st_size} bytes; a test of more than {LARGEST} is not read")
    try:
        with path.open(encoding=encoding, newline="") as file:
            reader = csv.reader(file, delimiter=delimiter)
            rows = [(reader.line_num, [field.strip() for field in row]) for row in reader]
    except (OSError, ValueError, TypeError, LookupError, csv.Error) as error:
        raise InvalidInput(f"{path} is not a CSV file in the encoding '{encoding}': {error}; try 'latin-1'") from None
    headings = next((row for line, row in rows if line == heading_line), [])
    if not any(headings):
        raise InvalidInput(f"{path} has no headings in line {heading_line}; it has {len(rows)} lines")
    places = {}
    for name, heading in columns.items():
        if headings.count(heading) != 1:
            near = nearest(heading, headings)
            raise InvalidInput(
                f"{path} has {'no' if heading not in headings else 'more than one'} column '{heading}' for {name}"
                f"{f'; did you mean {near!r}?' if near and near != heading else ''}: the headings in line {heading_line}, "
                f"parted by {delimiter!r}, are {', '.join(map(repr, headings))[:SHOWN]}"
            )
        places[name] = headings.index(heading)
    readings = [(line, row) for line, row in rows if line >= first_line and any(row)]
    if len(readings) < 2:
        raise InvalidInput(f"{path} has {len(readings)} readings from line {first_line} on; a test has at least 2")
    for line, row in readings:
        if len(row) > len(headings) and any(row[len(headings) :]):
            raise InvalidInput(
                f"{path}, line {line} has {len(row)} entries under {len(headings)} headings: with decimal commas, the "
                "columns must be parted by another sign, and decimal=',' given"
            )
    found = {
        name: np.array([_number(path, line, columns[name], row[place : place + 1], decimal) for line, row in readings])
        for name, place in places.items()
    }
    return [line for line, _row in readings], found


def _number(path: Path, line: int, heading: str, entry: list[str], decimal: str) -> float:
    text = entry[0] if entry else ""
    other = "," if decimal == "." else "."
    try:
        number = float("no number" if other in text or "_" in text else text.replace(decimal, "."))
    except ValueError:
        number = float("nan")
    if not isfinite(number):
        hint = f"; a decimal {'comma' if other == ',' else 'point'} needs decimal='{other}'" if other in text else ""
        raise InvalidInput(
            f"{path}, line {line}, column '{heading}': expected a finite number, got {text[:SHOWN]!r}{hint}"
        )
    return number
