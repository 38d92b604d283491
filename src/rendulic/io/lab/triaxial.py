"""Triaxial tests from a laboratory, as curves like those that rendulic computes."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rendulic.foundation.checks import finite_array, positive_number
from rendulic.foundation.errors import InvalidInput, one_of
from rendulic.io.lab.plausible import notes_on
from rendulic.io.lab.readings import GLITCH, MOST_DROPPED, Readings, legs_of, one_way, readings_of
from rendulic.io.lab.rows import Layout, Rows, read_rows
from rendulic.specimen.curve import labelled_curve, stress_columns

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["ALL", "MEASURES", "QUANTITIES", "read_triaxial", "read_triaxial_tests"]

STRAIN = {"1": 1.0, "%": 1e-2}
STRESS = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "bar": 1e5}
QUANTITIES = {
    "eps_1": STRAIN, "eps_v": STRAIN, "void_ratio": STRAIN, "q": STRESS, "p": STRESS, "sigma_1": STRESS, "sigma_3": STRESS,
    "pore_pressure": STRESS, "cell_pressure": STRESS,
}  # fmt: skip
MEASURES = ("engineering", "logarithmic")
ALL = "all"  # legs, or tests of a file
# what gives the axial beyond the lateral stress, and the lateral one
WAYS = (
    {"sigma_1", "sigma_3"}, {"q", "sigma_3"}, {"q", "p"}, {"q", "cell_pressure", "pore_pressure"}, {"sigma_1", "p"},
)  # fmt: skip
TOTAL = ({"q"}, {"q", "cell_pressure"})  # undrained, W2 needs no effective stress


def read_triaxial(
    path: str | os.PathLike,
    columns: Mapping[str, str | int],
    units: Mapping[str, str],
    *,
    drainage: str,
    constants: Mapping[str, float] | None = None,
    extension: bool = False,
    dilation_positive: bool = False,
    tension_positive: bool = False,
    strain: str = "engineering",
    initial_void_ratio: float | None = None,
    delimiter: str = ",",
    decimal: str = ".",
    comment: str | None = None,
    heading_line: int = 1,
    first_line: int | None = None,
    last_line: int | None = None,
    encoding: str = "utf-8-sig",
    sheet: str | None = None,
    key: str | None = None,
    where: Mapping[str, str] | None = None,
    leg: int | None = None,
) -> xr.Dataset:
    """Read one loading of a triaxial test from a file of its laboratory.

    1. Rows without numbers, repeated strains, and readings that go back by less than a hundredth of the strain are dropped; each
       is named with its line. More than a twentieth of the readings are not.
    2. The lateral stress is `sigma_3`, `p - q/3`, or the cell pressure less the pore pressure.
    3. The lateral strain is `(eps_v - eps_1) / 2`; undrained, `eps_v` is zero; from void ratios, `ln((1 + e0) / (1 + e))`.
    4. Engineering strains e become logarithmic, `-ln(1 - e)`, as everywhere in rendulic.

    Parameters
    ----------
    path : path
        Text of any kind, a workbook (.xlsx), or an array (.npz, .npy).
    columns : mapping
        Heading of each quantity, or its number from 1 on: `eps_1` (axial strain); `q` (sigma_1 - sigma_3) or effective
        `sigma_1`; effective `p` or `sigma_3`, or `cell_pressure` (total lateral stress) and `pore_pressure`; drained, also `eps_v`
        (volumetric strain) or `void_ratio`. If `pore_pressure` is the excess, `cell_pressure` is the effective pressure at the
        start. Undrained, `q` is enough: stresses are then total, and p and eta are left out.
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
    tension_positive : bool
        Whether strains and stresses of the file are negative in compression. `q` is turned if it then falls at the start.
    strain : {"engineering", "logarithmic"}
        What the file's strains are.
    initial_void_ratio : float, optional
        For `void_ratio`; by default that of the first reading.
    delimiter, decimal, comment, heading_line, first_line, last_line, encoding, sheet, key
        How the file is written: see `rendulic.io.lab.rows.Layout`.
    where : mapping, optional
        Of a file with many tests: a column, and what its entries are for this one, e.g. `{"test_id": "TMD2"}`.
    leg : int, optional
        Of a test with unloading: which stretch of one sense of the axial strain, from 1 on.

    Returns
    -------
    xarray.Dataset
        Dimension `record`, with `eps_1` to `eps_3`, `eps_v`, `sigma_1` to `sigma_3` (effective), `p`, `q` in Pa and
        `eta`, compression and contraction positive; `line` in the file. Attributes: `n_dropped`; `dropped`, lines and reasons;
        `notes`, what is implausible in it, one sentence each.

    Raises
    ------
    InvalidInput
        If quantities, headings or units are missing or unknown, there are two ways to the stresses or none, too many entries
        are no numbers, or the axial strain turns back: the file, line and column are named.
    """
    layout = Layout(delimiter, decimal, comment, heading_line, first_line, last_line, encoding, sheet, key)
    if where is not None and ALL in map(str, where.values()):
        raise InvalidInput(f"{path}: all tests of a file are read by read_triaxial_tests")
    if leg is not None and (isinstance(leg, bool) or not isinstance(leg, int)):
        raise InvalidInput(f"{path}: leg must be a whole number, got {leg!r}; all legs are read by read_triaxial_tests")
    options = _Options(
        drainage,
        dict(constants or {}),
        extension,
        dilation_positive,
        tension_positive,
        strain,
        initial_void_ratio,
        where,
        leg,
    )
    return next(iter(_tests(Path(path), columns, units, layout, options).values()))


def read_triaxial_tests(
    path: str | os.PathLike,
    columns: Mapping[str, str | int],
    units: Mapping[str, str],
    *,
    where: Mapping[str, str] | None = None,
    leg: int | str | None = None,
    **options,
) -> dict[str, xr.Dataset]:
    """All tests of a file, and all legs of a test; everything else as for `read_triaxial`.

    Parameters
    ----------
    where : mapping, optional
        E.g. `{"test_id": "all"}` for every test by the entries of that column.
    leg : int or "all", optional
        By default the whole test if its strain goes one way, else every leg.

    Returns
    -------
    dict of str to xarray.Dataset
        By the test's entry and its leg: "TMD2", "leg 1", "TMD2, leg 1"; "" if there is one of both.
    """
    names = ("drainage", "extension", "dilation_positive", "tension_positive", "strain", "initial_void_ratio")
    own = {name: options.pop(name) for name in names if name in options}
    constants = dict(options.pop("constants", None) or {})
    if "drainage" not in own:
        raise InvalidInput(f"{path}: a test needs its drainage: drained or undrained")
    if isinstance(leg, str) and leg != ALL:
        raise InvalidInput(f"{path}: leg must be a whole number or 'all', got {leg!r}")
    asked = _Options(constants=constants, where=where, leg=ALL if leg is None else leg, may_turn=leg is None, **own)
    return _tests(Path(path), columns, units, Layout(**options), asked)


class _Options:
    """What is said of a test besides its columns."""

    def __init__(
        self, drainage: str, constants: dict[str, float], extension: bool = False, dilation_positive: bool = False,
        tension_positive: bool = False, strain: str = "engineering", initial_void_ratio: float | None = None,
        where: Mapping[str, str] | None = None, leg: int | str | None = None, may_turn: bool = False,
    ) -> None:  # fmt: skip
        self.drainage = one_of(drainage, ("drained", "undrained"), "drainage")
        self.strain = one_of(strain, MEASURES, "strain measure")
        self.constants, self.extension, self.leg, self.may_turn = constants, extension, leg, may_turn
        self.dilation_positive, self.tension_positive = dilation_positive, tension_positive
        self.initial_void_ratio = (
            None if initial_void_ratio is None else positive_number("initial_void_ratio", initial_void_ratio)
        )
        self.where = dict(where or {})

    @property
    def undrained(self) -> bool:
        return self.drainage == "undrained"


def _tests(
    path: Path, columns: Mapping[str, str | int], units: Mapping[str, str], layout: Layout, options: _Options
) -> dict[str, xr.Dataset]:
    """Tests and legs that were asked for."""
    scales = _scales(path, columns, options.constants, units, options.undrained)
    chosen = {f"where {name}": name for name in options.where}
    rows = read_rows(path, dict(columns) | chosen, layout)
    found: dict[str, xr.Dataset] = {}
    for name, part in _parts(rows, options).items():
        readings = readings_of(part, columns, layout.decimal)
        tension = options.tension_positive or _is_tension_positive(readings.columns, options.extension)
        strain = scales["eps_1"] * readings.columns["eps_1"] * (-1.0 if tension else 1.0)
        legs = legs_of(strain)
        legs = [(begin, end) for begin, end in legs if end - begin >= 2 and strain[begin] != strain[end]]
        if options.leg is None or (options.may_turn and _goes_one_way(strain, options.extension)):
            found[name] = _curve(path, readings, columns, scales, options, tension)
            continue
        if options.leg != ALL:
            if not 1 <= int(options.leg) <= len(legs):
                raise InvalidInput(f"{path} has {len(legs)} legs, there is no leg {options.leg}")
            legs = legs[int(options.leg) - 1 : int(options.leg)]
        first = 1 if options.leg == ALL else int(options.leg)
        for number, (begin, end) in enumerate(legs, first):
            turned = bool(strain[end] < strain[begin])
            leg_readings = Readings(
                readings.lines[begin : end + 1],
                {key: values[begin : end + 1] for key, values in readings.columns.items()},
                readings.dropped if number == first else [],
            )
            label = f"{name}, leg {number}" if name else f"leg {number}"
            found[label if options.leg == ALL else name] = _curve(
                path, leg_readings, columns, scales, options, tension, turned, readings
            )
    if not found:
        raise InvalidInput(f"{path}: no leg has readings enough")
    return found


def _goes_one_way(strain: np.ndarray, extension: bool) -> bool:
    """Whether the strain goes one way, but for readings that are dropped."""
    keep, off = one_way(-strain if extension else strain)
    return bool(
        (off <= GLITCH * np.ptp(strain)).all() and (~keep & (off > 0.0)).sum() <= max(1.0, MOST_DROPPED * len(strain))
    )


def _parts(rows: Rows, options: _Options) -> dict[str, Rows]:
    """Rows of each test of the file that was asked for."""
    if not options.where:
        return {"": rows}
    places = [rows.places.pop(f"where {name}") for name in options.where]
    keys = [tuple(row[place] if place < len(row) else "" for place in places) for row in rows.entries]
    wanted = [str(value) for value in options.where.values()]
    found: dict[str, Rows] = {}
    for key in dict.fromkeys(keys):
        if all(value in (ALL, entry) for value, entry in zip(wanted, key, strict=True)) and any(key):
            at = [k for k, own in enumerate(keys) if own == key]
            name = ", ".join(entry for entry, value in zip(key, wanted, strict=True) if value == ALL)
            found[name] = Rows(
                rows.path, [rows.lines[k] for k in at], [rows.entries[k] for k in at], rows.places, [], rows.headings
            )
    if not found:
        known = ", ".join(dict.fromkeys(repr(", ".join(key)) for key in keys))
        raise InvalidInput(f"{rows.path} has no test with {options.where}; there are {known[:300]}")
    return found


def _curve(
    path: Path,
    readings: Readings,
    columns: Mapping[str, str | int],
    scales: Mapping[str, float],
    options: _Options,
    tension: bool,
    turned: bool | None = None,
    start: Readings | None = None,
) -> xr.Dataset:
    """One loading as a curve; `tension`: whether compression is negative in the file, `turned`: whether the strain of a leg falls, `start`: the test that it belongs to."""
    values = {name: scales[name] * column for name, column in readings.columns.items()}
    values |= {name: scales[name] * finite_array(name, value, ()) for name, value in options.constants.items()}
    notes: list[str] = []
    if tension and not options.tension_positive:
        notes.append("strains and stresses are negative in compression, and were read so (tension_positive = true)")
    if tension:
        turn = [name for name in ("eps_1", "eps_v", "p", "sigma_1", "sigma_3") if name in values]
        values |= {name: -values[name] for name in turn}
        if "q" in values and _falls_at_start(values["eps_1"], values["q"]):
            values["q"] = -values["q"]
    falls = options.extension if turned is None else turned
    keep, dropped = _kept(path, readings, columns["eps_1"], values["eps_1"], falls, is_leg=turned is not None)
    lines = readings.lines[keep]
    values = {name: np.broadcast_to(value, keep.shape)[keep] for name, value in values.items()}
    eps_1, eps_v = _strains(path, values, options, tension, start, scales)
    total = "q" in values and not {"p", "sigma_3", "pore_pressure"} & set(values)
    q = values.get("q")
    if q is None:
        q = values["sigma_1"] - values["sigma_3"] if "sigma_3" in values else 1.5 * (values["sigma_1"] - values["p"])
    if "sigma_3" in values:
        lateral = values["sigma_3"]
    elif "p" in values:
        lateral = values["p"] - q / 3.0
    else:
        lateral = values.get("cell_pressure", 0.0 * q) - values.get("pore_pressure", 0.0) + 0.0 * q
    mean = float((lateral + q / 3.0)[0])
    if mean <= 0.0 and not total:
        raise InvalidInput(
            f"{path}, line {lines[0]}: the effective mean stress must be positive at the first reading, got {mean:g} Pa; "
            "are columns or units mixed up?"
        )
    found = stress_columns(_diagonal(lateral + q, lateral), _diagonal(eps_1, 0.5 * (eps_v - eps_1)))
    if total:
        found = {name: column for name, column in found.items() if name not in ("p", "eta")}
    name = f"{options.drainage} triaxial {'extension' if falls else 'compression'}"
    notes += notes_on(found, options.drainage, options.undrained, falls, "p" in values and turned is None)
    told = [f"line {line}: {why}" for line, why in sorted(readings.dropped + dropped)]
    curve = labelled_curve(
        name, found, source=path.name, strain=f"logarithmic, of {options.strain} strains in the file",
        stress="total" if total else "effective", n_dropped=len(told), dropped="; ".join(told), notes="; ".join(notes),
    )  # fmt: skip
    return curve.assign(line=("record", lines, {"long_name": "line in the file", "units": "1"}))


def _is_tension_positive(values: Mapping[str, np.ndarray], extension: bool) -> bool:
    """Whether the file leaves no doubt: its mean stress is negative, and its axial strain falls where it should rise."""
    pressures = [values[name] for name in ("p", "sigma_3", "sigma_1") if name in values]
    falls = bool(values["eps_1"][-1] < values["eps_1"][0])
    return bool(pressures) and falls is not extension and all(float(np.max(pressure)) < 0.0 for pressure in pressures)


def _falls_at_start(strain: np.ndarray, q: np.ndarray) -> bool:
    """Whether q falls where the axial strain rises, over the first tenth of the readings."""
    n = max(5, len(strain) // 10)
    return bool(np.sum((strain[:n] - strain[0]) * (q[:n] - q[0])) < 0.0)


def _kept(
    path: Path, readings: Readings, heading: str | int, strain: np.ndarray, falls: bool, is_leg: bool
) -> tuple[np.ndarray, list[tuple[int, str]]]:
    """Readings whose strain goes on, and what the others are: of a leg, all that went back by too little to end it."""
    keep, off = one_way(-strain if falls else strain)
    span = float(np.ptp(strain))
    bad = np.flatnonzero(off > GLITCH * span)
    back = ~keep & (off > 0.0)
    if keep.sum() < 2 or (not is_leg and (len(bad) or back.sum() > max(1.0, MOST_DROPPED * len(strain)))):
        turns = np.flatnonzero(np.diff(strain) * (-1.0 if falls else 1.0) < 0.0)
        at = int(turns[0]) if len(turns) else 0
        raise InvalidInput(
            f"{path}, line {readings.lines[min(at + 1, len(strain) - 1)]}, column '{heading}': axial strain must "
            f"{'fall' if falls else 'rise'} from reading to reading, but goes from {strain[at]:g} to "
            f"{strain[min(at + 1, len(strain) - 1)]:g}: compression is positive, extension=True is for extension, "
            "and loading and unloading are read one by one (leg = 1, 2, ... or 'all')"
        )
    dropped = []
    for k in np.flatnonzero(~keep):
        why = (
            f"the axial strain goes back by {off[k]:.2g}"
            if off[k] > 0.0
            else f"the axial strain of {strain[k]:.6g} again"
        )
        dropped.append((int(readings.lines[k]), why))
    return keep, dropped


def _strains(
    path: Path,
    values: Mapping[str, np.ndarray],
    options: _Options,
    tension: bool,
    start: Readings | None,
    scales: Mapping[str, float],
) -> tuple[np.ndarray, np.ndarray]:
    """Logarithmic axial and volumetric strains."""
    eps_1, eps_v = values["eps_1"], values.get("eps_v", 0.0 * values["eps_1"])
    if options.dilation_positive and not tension:
        eps_v = -eps_v
    if options.strain == "engineering":
        if max(eps_1.max(), eps_v.max()) >= 1.0:
            raise InvalidInput(
                f"{path}: engineering strains must be below 1, got {max(eps_1.max(), eps_v.max()):g}; in %?"
            )
        eps_1, eps_v = -np.log1p(-eps_1), -np.log1p(-eps_v)
    if "void_ratio" in values:
        voids = values["void_ratio"]
        if voids.min() <= 0.0:
            raise InvalidInput(f"{path}: void ratios must be positive, got {voids.min():g}")
        first = voids[0] if start is None else scales["void_ratio"] * start.columns["void_ratio"][0]
        initial = options.initial_void_ratio or float(first)
        eps_v = np.log((1.0 + initial) / (1.0 + voids))
    return eps_1, eps_v


def _diagonal(axial: np.ndarray, lateral: np.ndarray) -> np.ndarray:
    return np.stack((axial, lateral, lateral), axis=-1)[:, :, None] * np.eye(3)


def _scales(
    path: Path,
    columns: Mapping[str, str | int],
    constants: Mapping[str, float],
    units: Mapping[str, str],
    undrained: bool,
) -> dict[str, float]:
    """Factor to SI of each quantity given, once these are what a test needs."""
    given = [*columns, *constants]
    for name in (*given, *units):
        one_of(name, QUANTITIES, "quantity of a triaxial test")
    kind = "an undrained" if undrained else "a drained"
    if "eps_1" not in columns:
        raise InvalidInput(f"{path}: {kind} test needs a column for eps_1")
    if not {"q", "sigma_1"} & set(columns):
        raise InvalidInput(f"{path}: {kind} test needs a column for q, or sigma_1 and sigma_3")
    volumes = {"eps_v", "void_ratio"} & set(given)
    if undrained and volumes:
        raise InvalidInput(
            f"{path}: an undrained test has no volumetric strain: leave {min(volumes)} out, or say 'drained'"
        )
    if not undrained and len(volumes & set(columns)) != 1:
        raise InvalidInput(f"{path}: a drained test needs a column for eps_v or void_ratio, one of them")
    stresses = set(given) - {"eps_1", "eps_v", "void_ratio"}
    if stresses not in WAYS and not (undrained and stresses in TOTAL):
        rest = stresses - {"q", "sigma_1"}
        raise InvalidInput(
            f"{path}: the mean stress needs either p, or cell_pressure and pore_pressure (columns or constants), or sigma_3; "
            f"got {', '.join(sorted(rest)) or 'none of them'}{' with sigma_1' if 'sigma_1' in stresses else ''}"
        )
    twice = [name for name in constants if name in columns]
    if twice:
        raise InvalidInput(f"{path}: {twice[0]} is given as a column and as a constant; give one of them")
    scales = {}
    for name in given:
        if name == "void_ratio" and name not in units:
            scales[name] = 1.0
            continue
        if name not in units:
            raise InvalidInput(f"{path}: {name} needs a unit, one of {', '.join(QUANTITIES[name])}")
        scales[name] = QUANTITIES[name][one_of(units[name], QUANTITIES[name], f"unit of {name}")]
    return scales
