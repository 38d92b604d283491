"""Finished results under names that people know: states as HDF5, curves and tables as NetCDF, element tests also as CSV."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from rendulic.io.tables import write_dataset
from rendulic.study.element_results import write_curve
from rendulic.study.language.config import ProbeSet
from rendulic.study.plan import Place
from rendulic.study.results import Results
from rendulic.study.store.unit import Unit

__all__ = ["folder_of", "write_products"]

RECORD = "products.json"
Product = tuple[Path, list[Unit], Callable[[Path], object]]


def folder_of(packing: str, seed: int) -> str:
    """Name of the folder of a packing's results."""
    return f"{packing}_seed_{seed}"


def write_products(results: Results, done: set[str]) -> list[Path]:
    """Write what finished units have given into the study's folder; return the files, those there already included.

    Parameters
    ----------
    done : set of str
        Hashes of the finished units. A file that needs others is not written.
    """
    folder, record = results.store.folder, results.store.read_json(RECORD) or {}
    now, files = {}, []
    for place, units, write in _products(results):
        keys = [unit.key for unit in units]
        if not done.issuperset(keys):
            continue
        name, path = place.as_posix(), folder / place
        if record.get(name) != keys or not path.exists():
            write(path)
        now[name] = keys
        files.append(path)
    results.store.write_json(RECORD, now)
    return files


def _products(results: Results) -> Iterator[Product]:
    plan = results.plan

    def state(unit: Unit, path: Path) -> None:
        results.part(unit, "state").to_file(path)

    def table(unit: Unit, part: str, path: Path) -> None:
        write_dataset(results.part(unit, part), path)

    for (packing, seed), unit in plan.packings.items():
        yield Path(folder_of(packing, seed)) / "specimen.h5", [unit], partial(state, unit)
    for place, unit in plan.states.items():
        yield _at(place, "state", "h5"), [unit], partial(state, unit)
        yield _at(place, "curve", "nc"), [unit], partial(table, unit, "curve")
    for (packing, seed), unit in plan.ends.items():
        yield Path(folder_of(packing, seed)) / "curve_end.nc", [unit], partial(table, unit, "curve")
    for probes in results.study.probes:
        for (name, place), batches in plan.probes.items():
            if name == probes.name:
                yield _at(place, f"probes_{name}", "nc"), batches, partial(_write_probes, results, probes, place)
    for (name, place), unit in plan.cones.items():
        yield _at(place, f"cone_{name}", "nc"), [unit], partial(table, unit, "probes")
    for (name, place), unit in plan.bursts.items():
        yield _at(place, f"bursts_{name}", "nc"), [unit], partial(_write_bursts, results, name, place)
    for test in plan.tests:
        yield Path("tests") / f"{test}.nc", [plan.tests[test]], partial(_write_test, results, test)


def _at(place: Place, what: str, suffix: str) -> Path:
    return Path(folder_of(place.packing, place.seed)) / f"{what}_eta_{place.eta:.3f}.{suffix}"


def _write_probes(results: Results, probes: ProbeSet, place: Place, path: Path) -> None:
    write_dataset(results.probes(probes, place), path)


def _write_test(results: Results, name: str, path: Path) -> None:
    write_curve(results.test(name), path.parent, name)


def _write_bursts(results: Results, name: str, place: Place, path: Path) -> None:
    """The table, and the curve of each burst in a folder beside it."""
    table, curves = results.bursts(name, place)
    for alpha, curve in curves.items():
        write_dataset(curve, path.with_suffix("") / f"alpha_{alpha:07.3f}.nc")
    write_dataset(table, path)
