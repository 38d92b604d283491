"""The figures of a study of grains, from its finished units: loading, circular diagrams, macro against micro."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rendulic import figures
from rendulic.dem.measure.equilibrium import unbalanced_force
from rendulic.foundation.errors import one_of
from rendulic.io.tables import write_dataset
from rendulic.study import draw_failure
from rendulic.study.language.config import ProbeSet
from rendulic.study.plan import Place, Plan
from rendulic.study.results import Results
from rendulic.study.store.unit import Unit
from rendulic.tensors.invariants import deviatoric_stress, mean_stress

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["draw", "needed_by", "state_table"]

Panel = tuple[str, int]  # packing and seed


def needed_by(plan: Plan, figure: str) -> list[Unit]:
    """The units that a figure is drawn from."""
    if figure in draw_failure.FIGURES:
        return draw_failure.needed_by(plan, figure)
    if figure == "elements":
        return list(plan.tests.values())
    units = [plan.states[place] for panel in _panels(plan, figure) for place in _places(plan, panel)]
    if figure in ("fig1", "fig2"):
        return units + [plan.ends[panel] for panel in _panels(plan, figure)]
    around = plan.study.around
    return units + [
        unit for (name, _), batch in plan.probes.items() if around and name == around.name for unit in batch
    ]


def draw(results: Results, wanted: Iterable[str], folder: Path) -> dict[str, list[Path]]:
    """Draw figures whose units are finished, with the tables beside them; return the files of each.

    Raises
    ------
    InvalidInput
        If a figure is unknown, its units are not finished, or the folder cannot be written.
    """
    makers: dict[str, Callable[[Results, Path], list[Path]]] = {
        "fig1": lambda results, folder: _loading(results, folder, "fig1", figures.deviatoric_stress),
        "fig2": lambda results, folder: _loading(results, folder, "fig2", figures.volume_change),
        "fig3": _circles,
        "fig4": _macro_micro,
        "elements": _elements,
        **draw_failure.MAKERS,
    }
    return {one_of(name, makers, "figure"): makers[name](results, folder) for name in wanted}


def _panels(plan: Plan, figure: str) -> list[Panel]:
    """Packings that a figure shows, each in a picture of its own."""
    if figure in ("fig1", "fig2"):
        return list(plan.ends)
    around = plan.study.around
    return list(dict.fromkeys(place[:2] for name, place in plan.probes if around and name == around.name))


def _places(plan: Plan, panel: Panel) -> list[Place]:
    return [place for place in plan.states if place[:2] == panel]


def _file(results: Results, figure: str, panel: Panel) -> str:
    one = len(_panels(results.plan, figure)) == 1
    return figure if one else f"{figure}_{panel[0]}_seed_{panel[1]}"


def _grains(results: Results, panel: Panel) -> str:
    packing = next(packing for packing in results.study.packing if packing.name == panel[0])
    return f"{packing.recipe(results.study.shared).n_grains} grains"


def _loading(results: Results, folder: Path, figure: str, make: Callable) -> list[Path]:
    import xarray as xr

    files = []
    for panel in _panels(results.plan, figure):
        places = _places(results.plan, panel)
        curves = [*(results.curve(place) for place in places), results.end(*panel)]
        whole = xr.concat(curves, "record", combine_attrs="drop")
        states = state_table(results, places).swap_dims(state="record")
        files += figures.save(make(whole, states), folder, _file(results, figure, panel))
    return files


def _around(results: Results, panel: Panel) -> dict[Place, xr.Dataset]:
    around = _circle(results)
    return {place: results.probes(around, place) for name, place in results.plan.probes
            if name == around.name and place[:2] == panel}  # fmt: skip


def _circle(results: Results) -> ProbeSet:
    assert results.study.around is not None
    return results.study.around


def _norm(results: Results) -> float:
    return results.study.figures.diagram_norm or _circle(results).norms[0]


def _circles(results: Results, folder: Path) -> list[Path]:
    files, norm = [], _norm(results)
    for panel in _panels(results.plan, "fig3"):
        found = _around(results, panel)
        probes = {f"$\\eta$ = {place.eta:g}": data for place, data in found.items()}
        grains, name = _grains(results, panel), _file(results, "fig3", panel)
        at_norm = {label: data.sel(norm=norm) for label, data in probes.items()}
        files += figures.save(
            figures.circular_diagram(at_norm, f"{grains}, strain probes of norm {norm:g}"), folder, name
        )
        files += figures.save(
            figures.circular_diagrams(probes, grains), folder, name.replace("fig3", "fig3_amplitudes")
        )
        table = state_table(results, list(found), list(found.values()))
        write_dataset(table, folder / f"{name.replace('fig3', 'table')}.nc")
    return files


def _macro_micro(results: Results, folder: Path) -> list[Path]:
    files, norm = [], _norm(results)
    for panel in _panels(results.plan, "fig4"):
        place, data = list(_around(results, panel).items())[-1]
        title = f"$\\eta$ = {place.eta:g}, {_grains(results, panel)}, strain probes of norm {norm:g}"
        files += figures.save(figures.macro_micro(data.sel(norm=norm), title), folder, _file(results, "fig4", panel))
    return files


def _elements(results: Results, folder: Path) -> list[Path]:
    curves = {name: results.test(name) for name in results.plan.tests}
    return figures.save(figures.element_tests(curves), folder, "elements")


def state_table(results: Results, places: list[Place], probes: list[xr.Dataset] | None = None) -> xr.Dataset:
    """One row per state: what it is, how it was reached, and, with its probes, its answer at every norm."""
    import xarray as xr

    samples = [results.state(place) for place in places]
    stresses = np.array([sample.stress for sample in samples])
    columns: dict[str, tuple[str, str, Any]] = {
        "eta": ("stress ratio at rest", "1", [sample.eta for sample in samples]),
        "p": ("mean stress at rest", "Pa", mean_stress(stresses)),
        "q": ("deviatoric stress at rest", "Pa", deviatoric_stress(stresses)),
        "eps_1": ("axial strain at rest", "1", [sample.strain[0, 0] for sample in samples]),
        "eps_v": ("volumetric strain at rest", "1", [np.trace(sample.strain) for sample in samples]),
        "porosity": ("porosity", "1", [sample.porosity for sample in samples]),
        "n_contacts": ("closed contacts", "1", [sample.n_contacts for sample in samples]),
        "unbalanced_force": ("unbalanced force at rest", "1", [unbalanced_force(sample) for sample in samples]),
        "crept": (
            "axial strain crept while coming to rest",
            "1",
            [results.curve(place).attrs["crept"][0] for place in places],
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
