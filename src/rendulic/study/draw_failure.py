"""Figures and tables of failure, from finished units: cones, their opening, bursts, and the grains behind them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from rendulic import figures
from rendulic.foundation.whole_file import whole_file
from rendulic.io.tables import write_csv, write_dataset
from rendulic.loading import directions
from rendulic.probing.amplitude import amplitude_table
from rendulic.probing.bifurcation import map_of
from rendulic.probing.probe import probe
from rendulic.study.failure_tables import anatomy_text, burst_rows, burst_text
from rendulic.study.language.config import ConeSet, ProbeSet
from rendulic.study.plan import Place, Plan
from rendulic.study.results import Results
from rendulic.study.sands import DENSE, LOOSE, MODEL_BURSTS, PROBE_NORM, SANDS, sand_at
from rendulic.study.store.unit import Unit

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["FIGURES", "MAKERS", "needed_by"]


def needed_by(plan: Plan, figure: str) -> list[Unit]:
    """The units that a figure of failure is drawn from."""
    cones = list(plan.cones.values())
    if figure == "cones":
        spheres = [each.name for each in plan.study.probes if each.sphere_directions is not None]
        return cones + [unit for (name, _), batch in plan.probes.items() if name in spheres for unit in batch]
    if figure == "anatomy":
        name = _with_anatomy(plan).name
        batches = [unit for (own, _), batch in plan.probes.items() if own == name for unit in batch]
        return [*batches, *plan.dissections.values()]
    extra = [unit for name, unit in plan.extra.items() if name.startswith(figure)]
    if figure == "map":
        return extra + [unit for unit in cones if unit.kind == "cone"]
    return extra + list(plan.bursts.values())


def _with_anatomy(plan: Plan) -> ProbeSet:
    return next(each for each in plan.study.probes if each.anatomy)


def _title(results: Results) -> str:
    """Number of grains, and size of the probes of the first cones."""
    return f"{_grains(results)}, strain probes of norm {_strain_sets(results)[0].norm:g}"


def _grains(results: Results) -> str:
    counts = sorted({packing.recipe(results.study.shared).n_grains for packing in results.study.packing})
    return f"{' or '.join(map(str, counts))} grains"


def _strain_sets(results: Results) -> list[ConeSet]:
    return [cones for cones in results.study.cones if cones.answering is None]


def _cones(results: Results, folder: Path) -> list[Path]:
    found = {str(place): cone for place, cone in results.cones.items()}
    files = figures.save(figures.cones(found, _title(results)), folder, "cones")
    if laid := results.stress_on_strain:
        tables = {str(place): table for place, table in laid.items()}
        drawn = figures.stress_on_strain(tables, f"{_grains(results)}, stress probes")
        files += figures.save(drawn, folder, "cones_stress")
    for packing, tables in _sweeps(results).items():
        drawn = figures.amplitude(tables, f"{_grains(results)}, {packing}")
        files += figures.save(drawn, folder, f"cones_amplitude_{packing}")
    for probes in (each for each in results.study.probes if each.sphere_directions is not None):
        places = [place for name, place in results.plan.probes if name == probes.name]
        for place in places:
            own = "cones_sphere" if len(places) == 1 else f"cones_sphere_{plain(str(place))}"
            heading = f"{place}, {_grains(results)}, strain probes of norm {probes.norms[-1]:g}"
            sphere = results.probes(probes, place).isel(norm=-1)
            files += figures.save(figures.stereogram(sphere, heading), folder, own)
    return [*files, *figures.save(_side_by_side(results), folder, "cones_models")]


def _sweeps(results: Results) -> dict[str, dict[str, xr.Dataset]]:
    """Cones against the size of the probes, of the first seed of every packing that has several sizes."""
    tables: dict[str, dict[str, xr.Dataset]] = {}
    for chosen in _strain_sets(results):
        if len(chosen.sizes) == 1:
            continue
        for place in (place for name, place in results.plan.cones if name == chosen.name):
            if place.seed == _first_seed(results, place.packing):
                table = amplitude_table(results.sweep(chosen, place))
                tables.setdefault(place.packing, {})[f"$\\eta$ = {place.eta:g}"] = table
    return tables


def _first_seed(results: Results, packing: str) -> int:
    return next(each.seeds[0] for each in results.study.packing if each.name == packing)


def _side_by_side(results: Results) -> Figure:
    """Circular diagrams of grains and, at equal stress ratios, of a loose or dense sand of the model."""
    panels: dict[str, dict[str, xr.Dataset]] = {}
    for packing in results.study.packing:
        cones = {place: cone for place, cone in results.cones.items()
                 if place.packing == packing.name and place.seed == packing.seeds[0]}  # fmt: skip
        if not cones:
            continue
        panels[f"grains, {packing.name}"] = {rf"$\eta$ = {place.eta:g}": cone.probes for place, cone in cones.items()}
        density = "dense" if packing.name.startswith("dense") else "loose"
        pressure = packing.recipe(results.study.shared).pressure_pa
        sand = sand_at(f"{density}, drained", pressure, [place.eta for place in cones])
        panels[f"Chang-Hicher, {packing.name} (e = {DENSE if density == 'dense' else LOOSE:g})"] = {
            rf"$\eta$ = {eta:g}": probe(point, directions.rendulic(step=2), PROBE_NORM, 1) for eta, point in sand
        }
    return figures.circular_panels(panels, f"{_title(results)}; Hostun sand, drained")


def _map(results: Results, folder: Path) -> list[Path]:
    grains = {}
    for packing in results.study.packing:
        seeds = [
            seed for seed in packing.seeds if all(Place(packing.name, seed, e) in results.cones for e in packing.eta)
        ]
        if seeds and packing.eta:
            rows = {eta: [results.cones[Place(packing.name, seed, eta)] for seed in seeds] for eta in packing.eta}
            grains[f"grains, {packing.name}"] = map_of(rows, seeds)
    sands = {f"Chang-Hicher, {sand}": results.part(results.plan.extra[f"map {sand}"], "map") for sand in SANDS}
    files = figures.save(figures.bifurcation_map(sands, "Hostun sand"), folder, "map_model")
    if grains:
        files += figures.save(figures.bifurcation_map(grains, _title(results)), folder, "map_grains")
    for name, table in {**grains, **sands}.items():
        files.append(write_dataset(table, folder / f"map_{plain(name)}.nc"))
    return files


def _bursts(results: Results, folder: Path) -> list[Path]:
    tables = {str(place): table for place, table in results.all_bursts.items()}
    sands = {
        f"Chang-Hicher, {sand}, eta = {eta:g}": results.part(results.plan.extra[f"bursts {sand} {eta:g}"], "bursts")
        for sand, eta in MODEL_BURSTS
    }
    worst = results.most_unstable()
    name = next(name for name, place in results.plan.bursts if place == worst)
    title = f"{_grains(results)}, pushed by {float(tables[str(worst)].attrs['norm']):g}"
    curves = {f"{alpha:.1f}": curve for alpha, curve in results.bursts(name, worst)[1].items()}
    files = figures.save(figures.burst_table(tables, title), folder, "bursts")
    files += figures.save(figures.burst_table(sands, "Hostun sand, loss of controllability"), folder, "bursts_model")
    files += figures.save(figures.bursts(curves, f"{worst}, {title}"), folder, "bursts_curves")
    files += figures.save(figures.equation_1(curves, str(worst)), folder, "bursts_equation_1")
    with whole_file(folder / "bursts.md") as temporary:
        temporary.write_text(burst_text({**tables, **sands}), encoding="utf-8")
    together = burst_rows({**tables, **sands})
    return [*files, folder / "bursts.md", write_csv(together, folder / "bursts.csv")]


def _anatomy(results: Results, folder: Path) -> list[Path]:
    anatomies = results.anatomies(_with_anatomy(results.plan))
    first = next(iter(anatomies))
    around = {rf"$\eta$ = {place.eta:g}": data for place, data in anatomies.items() if place[:2] == first[:2]}
    worst = results.most_negative(anatomies)
    one = results.part(results.plan.dissections[worst], "anatomy")
    size = f"{_grains(results)}, strain probes of norm {float(anatomies[first].norm):g}"
    with whole_file(folder / "anatomy.md") as temporary:
        temporary.write_text(anatomy_text({str(place): data for place, data in anatomies.items()}), "utf-8")
    return [
        *figures.save(
            figures.anatomy_around(around, f"{first.packing}, seed {first.seed}, {size}"), folder, "anatomy_around"
        ),
        *figures.save(figures.anatomy(one, f"{worst}, {one.attrs['alpha']:g} degrees, {size}"), folder, "anatomy"),
        folder / "anatomy.md",
    ]


def plain(name: str) -> str:
    """A name as part of a file's name."""
    return name.lower().replace(",", "").replace(" = ", "_").replace(" ", "_").replace("-", "_")


MAKERS: dict[str, Callable[[Results, Path], list[Path]]] = {
    "cones": _cones, "map": _map, "bursts": _bursts, "anatomy": _anatomy,
}  # fmt: skip
FIGURES = tuple(MAKERS)
