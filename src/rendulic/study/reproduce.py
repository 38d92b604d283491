"""The paper's discrete-element study, stage by stage; finished stages are found again."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING, cast

import numpy as np

from rendulic import figures
from rendulic.dem.assembly import Assembly
from rendulic.dem.equilibrium import unbalanced_force
from rendulic.errors import InvalidInput, RendulicError, one_of
from rendulic.io.tables import write_dataset
from rendulic.progress import Progress, silent
from rendulic.state import State
from rendulic.study.config import GrainStudy
from rendulic.study.stages import claim, file_of, final_curve, probes_at, specimen_of, state_at
from rendulic.tensors.invariants import deviatoric_stress, mean_stress

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["FIGURES", "Reproduction", "reproduce"]

FIGURES = ("fig1", "fig2", "fig3", "fig4")


@dataclass(frozen=True)
class Reproduction:
    """What `reproduce` made.

    Parameters
    ----------
    folder : Path
        Where everything lies: states, curves, probes, figures.
    figures : dict of str to list of Path
        The files of each figure.
    table : xarray.Dataset
        One row per probed state, dimension `state`: what it is, how it was reached, what it answered.
    """

    folder: Path
    figures: dict[str, list[Path]]
    table: xr.Dataset


def reproduce(
    study: GrainStudy,
    folder: str | os.PathLike,
    wanted: Iterable[str] = FIGURES,
    *,
    workers: int | None = None,
    stage: Callable[[str], Progress] = lambda _name: silent,
) -> Reproduction:
    """Prepare, shear, rest, probe and draw (paper, section 4).

    1. A packing at rest under isotropic pressure: `specimen.h5`.
    2. Drained compression to each stress ratio; there it is paused, then held at constant stress,
       until at rest: `state_*.h5`, with the curve up to it.
    3. The compression goes on to the final strain (only for Figs. 1 and 2).
    4. Probes of every state in all directions: `probes_*.nc`.
    5. Figures and the table.

    Parameters
    ----------
    study : GrainStudy
        E.g. `preset("paper")`.
    folder : path
        Made if absent. Stages that a folder of the same study holds are not repeated.
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
    import xarray as xr

    wanted = [one_of(name, FIGURES, "figure") for name in wanted]
    folder = claim(Path(folder), study)
    sample, made = specimen_of(study, folder, stage("specimen"))
    etas = study.loading.eta
    curves, probes = [], []
    fresh = []  # whether a state was made now: what follows from it is then made again, too
    for eta in etas:
        curve, made = state_at(study, folder, sample, eta, made, stage(f"shear to eta = {eta:g}"))
        curves.append(curve)
        fresh.append(made)
    needs_curve, needs_probes = {"fig1", "fig2"} & set(wanted), {"fig3", "fig4"} & set(wanted)
    left = study.loading.axial_strain - float(sample.strain[0, 0])
    if needs_curve and left <= 0.0:
        raise InvalidInput(
            f"axial_strain = {study.loading.axial_strain:g} ends before the last state, at {sample.strain[0, 0]:.4f}"
        )
    stop = Event()
    with ThreadPoolExecutor(max_workers=1) as beside:
        try:
            if needs_curve:
                progress = _stoppable(stage("shear to the end"), stop)
                final = beside.submit(final_curve, study, folder, sample.clone(), left, made, progress)
            if needs_probes:
                probes = [
                    probes_at(study, folder, eta, now, workers, stage(f"probes at eta = {eta:g}"))
                    for eta, now in zip(etas, fresh, strict=True)
                ]
            whole = xr.concat([*curves, final.result()], "record", combine_attrs="drop") if needs_curve else None
        except BaseException:
            stop.set()
            raise
    table = _table(study, folder, curves, probes)
    write_dataset(table, folder / "table.nc")
    return Reproduction(folder, _draw(study, folder, wanted, whole, table, probes), table)


def _stoppable(progress: Progress, stop: Event) -> Progress:
    """A progress callback that ends the work it belongs to once `stop` is set."""

    def show(done: float, total: float, note: str = "") -> None:
        if stop.is_set():
            raise RendulicError("stopped, because another stage ended early")
        progress(done, total, note)

    return show


def _table(study: GrainStudy, folder: Path, curves: list[xr.Dataset], probes: list[xr.Dataset]) -> xr.Dataset:
    """One row per state: what it is, how it was reached, and its answer at every norm."""
    import xarray as xr

    samples = [Assembly.from_state(State.from_file(file_of(folder, "state", eta, "h5"))) for eta in study.loading.eta]
    stresses = np.array([sample.stress for sample in samples])
    columns = {
        "eta": ("stress ratio at rest", "1", [sample.eta for sample in samples]),
        "p": ("mean stress at rest", "Pa", mean_stress(stresses)),
        "q": ("deviatoric stress at rest", "Pa", deviatoric_stress(stresses)),
        "eps_1": ("axial strain at rest", "1", [sample.strain[0, 0] for sample in samples]),
        "eps_v": ("volumetric strain at rest", "1", [np.trace(sample.strain) for sample in samples]),
        "porosity": ("porosity", "1", [sample.porosity for sample in samples]),
        "n_contacts": ("closed contacts", "1", [sample.n_contacts for sample in samples]),
        "unbalanced_force": (
            "unbalanced force at rest",
            "1",
            [unbalanced_force(sample) for sample in samples],
        ),
        "crept": (
            "axial strain crept while coming to rest",
            "1",
            [curve.attrs["crept"][0] for curve in curves],
        ),
    }
    table = xr.Dataset({name: ("state", np.array(values), {"long_name": label, "units": unit})
                        for name, (label, unit, values) in columns.items()})  # fmt: skip
    if not probes:
        return table
    answers = xr.concat(probes, "state", data_vars="all", combine_attrs="drop")
    worst = answers.w2_normalised.argmin("alpha")
    found = {
        "smallest_w2n": ("smallest normalised second-order work", "1", answers.w2_normalised.isel(alpha=worst)),
        "smallest_w2n_alpha": ("its direction", "degree", answers.alpha[worst]),
        "smallest_w2n_is_significant": ("larger than the drift", "1", answers.is_significant.isel(alpha=worst)),
        "largest_identity_residual": ("error of the micro-macro identity", "1", answers.identity_residual.max("alpha")),
    }
    for name, (label, unit, values) in found.items():
        table[name] = values.drop_vars("alpha", errors="ignore").assign_attrs(long_name=label, units=unit)
    return table


def _draw(
    study: GrainStudy,
    folder: Path,
    wanted: list[str],
    curve: xr.Dataset | None,
    table: xr.Dataset,
    probes: list[xr.Dataset],
) -> dict[str, list[Path]]:
    states = table.swap_dims(state="record") if "state" in table.dims else table
    norm = study.probes.diagram_norm
    labels = [f"$\\eta$ = {eta:g}" for eta in study.loading.eta]
    grains = f"{study.specimen.n_grains} grains"
    size = f"{grains}, strain probes of norm {norm:g}"
    makers: dict[str, dict[str, Callable[[], Figure]]] = {
        "fig1": {"fig1": lambda: figures.deviatoric_stress(cast("xr.Dataset", curve), states)},
        "fig2": {"fig2": lambda: figures.volume_change(cast("xr.Dataset", curve), states)},
        "fig3": {
            "fig3": lambda: figures.circular_diagram(
                {label: data.sel(norm=norm) for label, data in zip(labels, probes, strict=True)}, size
            ),
            "fig3_amplitudes": lambda: figures.circular_diagrams(dict(zip(labels, probes, strict=True)), grains),
        },
        "fig4": {"fig4": lambda: figures.macro_micro(probes[-1].sel(norm=norm), f"{labels[-1]}, {size}")},
    }
    return {
        name: [path for file, make in makers[name].items() for path in figures.save(make(), folder, file)]
        for name in wanted
    }
