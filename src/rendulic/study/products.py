"""Finished results under names that people know: states as HDF5, curves and tables as NetCDF, tests also as CSV."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from rendulic.io.tables import write_dataset
from rendulic.study.ids import StateId
from rendulic.study.results import Results
from rendulic.study.store.unit import Unit

__all__ = ["write_products"]

RECORD = "products.json"
Product = tuple[Path, tuple[Unit, ...], Callable[[Path], object]]


def write_products(results: Results) -> list[Path]:
    """Write what finished units have given into the study's folder; return the files, those there already included."""
    folder, record = results.store.folder, results.store.read_json(RECORD) or {}
    now: dict[str, Any] = {}
    files: list[Path] = []
    for place, units, write in _products(results):
        if not results.is_done(*units):
            continue
        keys, name, path = [unit.key for unit in units], place.as_posix(), folder / place
        there = record.get(name, {}) if isinstance(record, dict) else {}
        if (
            not isinstance(there, dict)
            or there.get("of") != keys
            or not all((folder / each).exists() for each in there["files"])
        ):
            written = write(path)
            made = written if isinstance(written, list) else [path]
            there = {"of": keys, "files": [each.relative_to(folder).as_posix() for each in made]}
        now[name] = there
        files += [folder / each for each in there["files"]]
    results.store.write_json(RECORD, now)
    return files


def _products(results: Results) -> Iterator[Product]:
    plan = results.plan

    def state(unit: Unit, path: Path) -> None:
        results.part(unit, "state").to_file(path)

    def curve(unit: Unit, path: Path) -> None:
        write_dataset(results.part(unit, "curve"), path)

    def measured(table: str, where: tuple[str, StateId | None], path: Path) -> list[Path]:
        return results.sets(table)[where[0]].write(results.of(table)[where], path)

    for sample, unit in plan.samples.items():
        yield Path(sample.folder) / "specimen.h5", (unit,), partial(state, unit)
    for at, unit in plan.states.items():
        yield _at(at, "state", ".h5"), (unit,), partial(state, unit)
        yield _at(at, "curve", ".nc"), (unit,), partial(curve, unit)
    for sample, unit in plan.ends.items():
        yield Path(sample.folder) / "curve_end.nc", (unit,), partial(curve, unit)
    for measurement in results.study.measurements():
        table = measurement.table
        for where, units in plan.of(table).items():
            if where[0] == measurement.name:
                yield _at(where[1], f"{table}_{where[0]}"), units, partial(measured, table, where)


def _at(state: StateId | None, what: str, suffix: str = "") -> Path:
    if state is None:
        return Path(f"{what}{suffix}")
    at = "" if state.eta is None else f"_eta_{state.eta:.3f}"
    return Path(state.sample.folder) / f"{what}{at}{suffix}"
