"""Failure itself: cones, their opening with the stress ratio, bursts that prove them, and the grains behind them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from rendulic import figures
from rendulic.chang_hicher import ChangHicher
from rendulic.errors import one_of
from rendulic.io.tables import read_dataset, write_csv, write_dataset
from rendulic.loading import directions, paths
from rendulic.probing.amplitude import amplitude_table
from rendulic.probing.bifurcation import bifurcation_map, map_of, states_along
from rendulic.probing.burst import bursts
from rendulic.probing.cone import instability_cone
from rendulic.probing.probe import probe
from rendulic.progress import Progress, silent
from rendulic.specimen import Specimen
from rendulic.study.config import GrainStudy
from rendulic.study.failure import FailureResults, PackedState, around_and_within
from rendulic.study.failure_tables import anatomy_text, burst_rows, burst_text
from rendulic.study.reproduce_model import DENSE, PROBE_NORM, VOID_RATIO
from rendulic.study.stages import claim, kept
from rendulic.whole_file import whole_file

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["FIGURES", "reproduce_failure"]

FIGURES = ("cones", "map", "bursts", "anatomy")

# of the Chang-Hicher model: density, void ratio, kind of test
SANDS: dict[str, tuple[float, Callable[..., paths.Path]]] = {
    "loose, drained": (VOID_RATIO, paths.drained_triaxial),
    "dense, drained": (DENSE, paths.drained_triaxial),
    "loose, undrained": (VOID_RATIO, paths.constant_volume),
}
MODEL_ETAS = (0.1, 0.3, 0.48, 0.6, 0.7, 0.8, 0.85, 0.9, 0.925, 0.95, 0.975, 1.0, 1.05, 1.1, 1.15, 1.2, 1.3, 1.4, 1.5)
MODEL_BURSTS = (("loose, drained", 0.6), ("loose, drained", 0.95), ("loose, drained", 1.0), ("loose, undrained", 1.0))
MODEL_TOLERANCE = 0.05  # degrees
BURST_NORM = 1e-9  # small enough that the path of the load stays in the tangent's zone
LONGEST = 0.5  # axial strain of the model's tests


def reproduce_failure(
    study: GrainStudy,
    folder: str | os.PathLike,
    wanted: Iterable[str] = FIGURES,
    *,
    workers: int | None = None,
    stage: Callable[[str], Progress] = lambda _name: silent,
) -> dict[str, list[Path]]:
    """Draw the wanted figures of failure into a folder and return their files, tables among them.

    - `cones`: the unstable sectors of all states with the uncertainty of their edges; stress probes laid on strain
      probes; the sectors against the size of the probes, over the whole sphere, and beside the Chang-Hicher model's at equal eta.
    - `map`: the sectors against the stress ratio, loose and dense, grains and model.
    - `bursts`: what is predicted against what fails, with the curves of the bursts and Eq. 1.
    - `anatomy`: which contacts and grains the second-order work of the first loose packing comes from.

    Parameters
    ----------
    study : GrainStudy
        Its section `failure` says how many packings there are, and how they are probed.
    folder : path
        Made if absent; every packing has a folder in it. What is finished is found again.
    wanted : iterable of str
        Which of `FIGURES`.
    workers : int, optional
        Threads of the probes.
    stage : callable
        Gives the `Progress` of each named stage.

    Raises
    ------
    InvalidInput
        If a figure is unknown, the folder cannot be written or holds another study.
    DidNotConverge, NotEquilibrated, UnstableTimeStep
        If the mechanics does not get there.
    """
    wanted = [one_of(name, FIGURES, "figure") for name in wanted]
    folder = claim(Path(folder), study)
    results = FailureResults(study, folder, workers, stage)
    makers = {"cones": _cones, "map": _map, "bursts": _bursts, "anatomy": _anatomy}
    return {name: makers[name](results, folder) for name in wanted}


def _title(results: FailureResults) -> str:
    study = results.study
    return f"{study.specimen.n_grains} grains, strain probes of norm {study.failure.norm:g}"


def _cones(results: FailureResults, folder: Path) -> list[Path]:
    found = {state.name: cone for state, cone in results.cones.items()}
    stress = {state.name: table for state, table in results.stress_probes.items()}
    sweeps = {
        density: {
            f"$\\eta$ = {state.eta:g}": amplitude_table(results.sweeps[state])
            for state in results.states
            if state.packing.density == density and state.packing.seed == results.first_packing.seed
        }
        for density in ("loose", "dense")
    }
    grains = f"{results.study.specimen.n_grains} grains"
    sphere = figures.stereogram(results.sphere, f"{results.most_unstable.name}, {_title(results)}")
    return [
        *figures.save(figures.cones(found, _title(results)), folder, "cones"),
        *figures.save(figures.stress_on_strain(stress, f"{grains}, stress probes"), folder, "cones_stress"),
        *[
            path
            for density, tables in sweeps.items()
            for path in figures.save(
                figures.amplitude(tables, f"{grains}, {density}"), folder, f"cones_amplitude_{density}"
            )
        ],
        *figures.save(sphere, folder, "cones_sphere"),
        *figures.save(_side_by_side(results), folder, "cones_models"),
    ]


def _side_by_side(results: FailureResults) -> Figure:
    """Circular diagrams of grains and of the model, each pair at equal stress ratios."""
    pressure, norm = results.study.specimen.pressure_pa, results.study.failure.norm
    panels: dict[str, dict[str, xr.Dataset]] = {}
    seed = results.study.specimen.seed
    for density in ("loose", "dense"):
        states = [s for s in results.states if s.packing.density == density and s.packing.seed == seed]
        panels[f"grains, {density}"] = {
            rf"$\eta$ = {state.eta:g}": results.sweeps[state].sel(norm=norm) for state in states
        }
        sand = sand_at(f"{density}, drained", pressure, [state.eta for state in states])
        panels[f"Chang-Hicher, {density}"] = {
            rf"$\eta$ = {eta:g}": probe(point, directions.rendulic(step=2), PROBE_NORM, 1) for eta, point in sand
        }
    return figures.circular_panels(panels, f"{_title(results)}; Hostun sand, drained")


def _map(results: FailureResults, folder: Path) -> list[Path]:
    grains = {}
    for density in ("loose", "dense"):
        packings = [packing for packing in results.packings if packing.density == density]
        rows = {
            eta: [results.cones[PackedState(packing, eta)] for packing in packings]
            for eta in packings[0].study.loading.eta
        }
        grains[f"grains, {density}"] = map_of(rows, [packing.seed for packing in packings])
    progress = results.stage("map of the Chang-Hicher model")
    sands = {}
    for k, sand in enumerate(SANDS):
        name = f"Chang-Hicher, {sand}"
        sands[name] = kept(folder / f"map_{_plain(name)}.nc", False, partial(_map_of_model, results, sand))
        progress(k + 1, len(SANDS), sand)
    files = [*figures.save(figures.bifurcation_map(grains, _title(results)), folder, "map_grains")]
    files += figures.save(figures.bifurcation_map(sands, "Hostun sand"), folder, "map_model")
    for name, table in grains.items():
        files.append(write_dataset(table, folder / f"map_{_plain(name)}.nc"))
    return files


def _map_of_model(results: FailureResults, sand: str) -> xr.Dataset:
    states = sand_at(sand, results.study.specimen.pressure_pa, MODEL_ETAS)
    return bifurcation_map(states, directions.rendulic(5), PROBE_NORM, 1, tolerance=MODEL_TOLERANCE)


def _bursts(results: FailureResults, folder: Path) -> list[Path]:
    tables = {state.name: table for state, table in results.bursts.items()}
    progress = results.stage("bursts of the Chang-Hicher model")
    sands = {}
    for k, (sand, eta) in enumerate(MODEL_BURSTS):
        for _, point in sand_at(sand, results.study.specimen.pressure_pa, [eta]):
            cone = instability_cone(point, directions.rendulic(2), PROBE_NORM, 1, tolerance=MODEL_TOLERANCE)
            within = around_and_within(cone, results.study.failure.burst_step_deg)
            sands[f"Chang-Hicher, {sand}, eta = {eta:g}"] = bursts(point, within, BURST_NORM, 1, cone=cone)
        progress(k + 1, len(MODEL_BURSTS), sand)
    title = f"{results.study.specimen.n_grains} grains, pushed by {results.study.failure.norm:g}"
    files = figures.save(figures.burst_table(tables, title), folder, "bursts")
    files += figures.save(figures.burst_table(sands, "Hostun sand, loss of controllability"), folder, "bursts_model")
    worst = max(results.states, key=lambda state: float(results.bursts[state].observed.sum()))
    curves = {
        f"{alpha:.1f}": read_dataset(worst.burst_file(alpha)) for alpha in results.bursts[worst].alpha.values.tolist()
    }
    files += figures.save(figures.bursts(curves, f"{worst.name}, {title}"), folder, "bursts_curves")
    files += figures.save(figures.equation_1(curves, worst.name), folder, "bursts_equation_1")
    with whole_file(folder / "bursts.md") as temporary:
        temporary.write_text(burst_text({**tables, **sands}), encoding="utf-8")
    together = burst_rows({**tables, **sands})
    return [*files, folder / "bursts.md", write_csv(together, folder / "bursts.csv")]


def _anatomy(results: FailureResults, folder: Path) -> list[Path]:
    around = {rf"$\eta$ = {state.eta:g}": data for state, data in results.anatomies.items()}
    alpha, one = results.dissected(results.most_unstable)
    heading = f"{results.most_unstable.name}, {alpha:g} degrees, {_title(results)}"
    with whole_file(folder / "anatomy.md") as temporary:
        temporary.write_text(anatomy_text({state.name: data for state, data in results.anatomies.items()}), "utf-8")
    return [
        *figures.save(
            figures.anatomy_around(around, f"{results.first_packing.name}, {_title(results)}"), folder, "anatomy_around"
        ),
        *figures.save(figures.anatomy(one, heading), folder, "anatomy"),
        folder / "anatomy.md",
    ]


def sand_at(sand: str, pressure: float, etas: Iterable[float]) -> Iterator[tuple[float, Specimen]]:
    """A Chang-Hicher sand at one stress ratio after another, as far as its test goes."""
    void_ratio, path = SANDS[sand]
    point = ChangHicher.preset("hostun_loose").at(pressure, void_ratio)
    for eta, (state,) in states_along(point, lambda eta: path(LONGEST, until_eta=eta), list(etas)):
        if state is None:
            return
        yield eta, state


def _plain(name: str) -> str:
    """A name as part of a file's name."""
    return name.lower().replace(",", "").replace(" ", "_").replace("-", "_")
