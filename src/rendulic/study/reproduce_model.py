"""The paper's figures of the Chang-Hicher model, and the model's own circular diagrams."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rendulic import figures
from rendulic.chang_hicher import ChangHicher, Parameters, material, plane_law
from rendulic.chang_hicher.law.plane_law import FORMULATIONS
from rendulic.foundation.errors import one_of
from rendulic.foundation.progress import Progress, silent
from rendulic.foundation.whole_file import writable_folder
from rendulic.io.tables import write_dataset
from rendulic.loading import directions, paths
from rendulic.probing.probe import probe
from rendulic.study.sands import DENSE, LOOSE, PROBE_NORM

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["FIGURES", "reproduce_model", "shear_stiffness", "undrained_hostun"]

FIGURES = ("fig6", "fig7", "fig9", "fig10", "fig3_model")

# Fig. 6: what is varied, over the paper's ranges
VARIED: dict[str, tuple[str, tuple[float, ...], Callable[[float], str]]] = {
    "dilatancy D": ("dilatancy", (1.0, 2.0, 3.0), lambda value: f"D = {value:g}"),
    "normal stiffness": ("k_n0", (10e3, 15e3, 20e3), lambda value: rf"$k_{{n0}}$ = {value / 1e3:g} N/mm"),
    "plastic ratio": ("k_pR", (0.5, 1.0, 2.0), lambda value: rf"$k_{{pR}}$ = {value:g}"),
    "shear ratio": ("k_rR", (0.1, 0.5, 1.0), lambda value: rf"$k_{{rR}}$ = {value:g}"),
}
PRESSURE, AXIAL_STRAIN = 300e3, 0.2  # Fig. 7
TESTS: tuple[tuple[str, Callable[..., paths.Path]], ...] = (
    ("drained", paths.drained_triaxial),
    ("undrained", paths.constant_volume),
)
STRESS_RATIOS = (0.0, 0.5, 0.8, 0.9, 1.0)


def shear_stiffness(parameters: Parameters, x: np.ndarray) -> np.ndarray:
    """`K_rr` in N/m at normalised obliquities x, Eq. 40 as printed, at f_n = f_ref (Fig. 6)."""
    tan_phi, k_n = parameters.tan_phi_mu, parameters.k_n0
    modulus = plane_law.hardening_modulus(parameters.k_pR * k_n, x)
    eta = x * tan_phi
    beta = plane_law.dilatancy(parameters.dilatancy, tan_phi, eta)
    return plane_law.stiffness(k_n, parameters.k_rR * k_n, modulus, eta, beta)[3]


def undrained_hostun(formulation: str = "consistent", void_ratio: float = LOOSE) -> xr.Dataset:
    """The undrained test of Fig. 7 on loose Hostun sand, 300 kPa."""
    point = ChangHicher.preset("hostun_loose", formulation=formulation).at(PRESSURE, void_ratio)
    return point.load(paths.constant_volume(AXIAL_STRAIN), least_records=400)


@dataclass
class _Results:
    """What the figures need, computed when the first of them asks."""

    progress: Progress

    @cached_property
    def undrained(self) -> dict[str, xr.Dataset]:
        curves = {}
        for k, formulation in enumerate(reversed(FORMULATIONS)):
            self.progress(k, len(FORMULATIONS), f"undrained test, {formulation}")
            curves[formulation] = undrained_hostun(formulation)
        self.progress(1, 1, "undrained tests")
        return curves

    @cached_property
    def circles(self) -> dict[str, dict[str, xr.Dataset]]:
        panels: dict[str, dict[str, xr.Dataset]] = {}
        around = directions.rendulic(step=2)
        for density, void_ratio in (("loose", LOOSE), ("dense", DENSE)):
            for name, path in TESTS:
                panel = panels.setdefault(f"{name}, {density} (e = {void_ratio:g})", {})
                point = ChangHicher.preset("hostun_loose").at(PRESSURE, void_ratio)
                for eta in STRESS_RATIOS:
                    self.progress(len(panels) - 1, 4, f"{name}, {density}: probes at eta = {eta:g}")
                    if eta > 0.0 and point.load(path(0.5, until_eta=eta)).attrs["stopped_by"] != "eta":
                        break
                    panel[rf"$\eta$ = {eta:g}"] = probe(point, around, PROBE_NORM, 1)
        self.progress(1, 1, "circular diagrams")
        return panels


def reproduce_model(
    folder: str | os.PathLike,
    wanted: Iterable[str] = FIGURES,
    *,
    stage: Callable[[str], Progress] = lambda _name: silent,
) -> dict[str, list[Path]]:
    """Draw the wanted figures of the model into a folder and return their files.

    The curves behind Figs. 7, 9 and 10 are written beside them.

    Raises
    ------
    InvalidInput
        If a figure is unknown or the folder cannot be written.
    """
    wanted = [one_of(name, FIGURES, "figure") for name in wanted]
    folder = writable_folder(Path(folder))
    results = _Results(stage("Chang-Hicher model"))
    test = f"undrained, {PRESSURE / 1e3:g} kPa, e = {LOOSE:g}"
    makers: dict[str, Callable[[], Figure]] = {
        "fig6": lambda: figures.plane_stiffness(_fig6()),
        "fig7": lambda: figures.element_tests(results.undrained, f"Loose Hostun sand, {test}"),
        "fig9": lambda: figures.plane_paths(results.undrained["consistent"], f"Contact planes, {test}"),
        "fig10": lambda: figures.plane_work(results.undrained["consistent"], f"Contact planes, {test}"),
        "fig3_model": lambda: figures.circular_panels(results.circles, "Chang-Hicher model, Hostun sand, 300 kPa"),
    }
    files = {name: figures.save(makers[name](), folder, name) for name in wanted}
    if {"fig7", "fig9", "fig10"} & set(wanted):
        for formulation, curve in results.undrained.items():
            write_dataset(curve, folder / f"undrained_{formulation}.nc")
    return files


def _fig6() -> dict[str, dict[str, tuple[np.ndarray, np.ndarray]]]:
    base, x = material("fig6_base"), np.linspace(0.0, 1.0, 501)
    return {
        heading: {label(value): (x, shear_stiffness(base.model_copy(update={name: value}), x)) for value in values}
        for heading, (name, values, label) in VARIED.items()
    }
