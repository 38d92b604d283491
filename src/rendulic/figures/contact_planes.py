"""Figures 6, 9 and 10 of the paper: what happens on the contact planes."""

from __future__ import annotations

from collections.abc import Mapping
from string import ascii_lowercase
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np

from rendulic.figures.draw import draw
from rendulic.figures.style import COLOURS, INK, NEGATIVE, RC, categories, new_figure, sequence
from rendulic.views import plane_law
from rendulic.views import planes as planes_view
from rendulic.views.plane_law import PlaneStiffness
from rendulic.views.planes import PlanePaths, PlaneWork

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["plane_paths", "plane_stiffness", "plane_work"]


def plane_stiffness(panels: Mapping[str, Mapping[str, tuple[np.ndarray, np.ndarray]]]) -> Figure:
    """K_rr against the normalised obliquity (Fig. 6).

    Parameters
    ----------
    panels : mapping of heading to mapping of label to (x, K_rr)
        `x = f_r / (f_n tan phi)`; K_rr in N/m.

    Notes
    -----
    Dots mark the zero before the limit. The shaded half is where the tangent shear stiffness is negative.
    """
    return _stiffness(plane_law.plane_stiffness(panels))


@draw.register(PlaneStiffness)
def _stiffness(view: PlaneStiffness) -> Figure:
    rows = -(-len(view.panels) // 2)
    figure = new_figure(7.2, 2.7 * rows)
    with mpl.rc_context(RC):
        grid = figure.subplots(rows, 2, sharex=True, squeeze=False)
        for axes in list(grid.flat)[len(view.panels) :]:
            axes.set_axis_off()
        for axes, letter, (heading, cases) in zip(grid.flat, ascii_lowercase, view.panels.items(), strict=False):
            for colour, one in zip(sequence(len(cases)), cases, strict=True):
                axes.plot(one.x, 1e-3 * one.k_rr, color=colour, label=one.label)
                if np.isfinite(one.zero):
                    axes.plot(one.zero, 0.0, "o", ms=4, color=colour, mec=INK, mew=0.5, zorder=5)
            low, high = axes.get_ylim()
            axes.axhspan(low, 0.0, color=NEGATIVE, alpha=0.06, lw=0)
            axes.set_ylim(low, high)
            axes.axhline(0.0, color=NEGATIVE, lw=0.8, ls="--")
            axes.set_title(f"({letter}) {heading}", loc="left")
            axes.legend(loc="upper right")
            axes.grid(visible=True)
        for axes in grid[-1]:
            axes.set_xlabel(r"normalised obliquity $f_r / (f_n \tan\varphi)$")
        for axes in grid[:, 0]:
            axes.set_ylabel(r"$K_{rr}$  [N/mm]")
    return figure


def plane_paths(curve: xr.Dataset, title: str = "") -> Figure:
    """Local stress paths, shear against normal stress, of one plane of every inclination (Fig. 9).

    Dots mark where the second-order work of the assembly vanishes, circles where that of the plane does.
    """
    return _paths(planes_view.plane_paths(curve, title))


@draw.register(PlanePaths)
def _paths(view: PlanePaths) -> Figure:
    curve, planes = view.curve, view.representatives
    figure = new_figure(5.6, 4.2)
    with mpl.rc_context(RC):
        axes = figure.add_subplot()
        largest = float(curve.sigma_plane.max())
        for colour, (angle, plane) in zip(categories(len(planes)), planes.items(), strict=True):
            one = curve.isel(plane=plane)
            axes.plot(1e-3 * one.sigma_plane, 1e-3 * one.tau_plane, color=colour, label=rf"{angle:g}$\degree$")
            for strain, marker in ((view.first("w2_lost", -1), "o"), (view.first("plane_w2_lost", plane), "D")):
                if strain is not None:
                    x, y = (1e-3 * np.interp(strain, curve.eps_1, one[name]) for name in ("sigma_plane", "tau_plane"))
                    axes.plot(x, y, marker, ms=5, mfc=colour if marker == "o" else "white", mec=colour, zorder=5)
        line = 1e-3 * largest * np.array([0.0, 1.0])
        for tangent, style, when in (
            (float(curve.tan_phi_p[0]), ":", "start"),
            (float(curve.tan_phi_p[-1]), "--", "end"),
        ):
            axes.plot(line, tangent * line, style, color=INK, lw=0.8, label=rf"$\tan\varphi_p$ at the {when}")
        axes.plot([], [], "o", color=INK, ms=5, label=r"$W_2 = 0$, assembly")
        axes.plot([], [], "D", mfc="white", mec=INK, ms=5, label=r"$W_2 = 0$, plane")
        axes.set(
            xlabel=r"normal stress on the plane $\sigma^\alpha$  [kPa]", ylabel=r"shear stress $\tau^\alpha$  [kPa]"
        )
        axes.set_xlim(0.0, 1.02e-3 * largest)
        axes.set_ylim(0.0, 1.25e-3 * float(curve.tau_plane.max()))
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), title="angle of normal to axis 1")
        axes.grid(visible=True)
        axes.set_title(view.title, loc="left")
    return figure


def plane_work(curve: xr.Dataset, title: str = "") -> Figure:
    """Normalised second-order work of one plane of every inclination along the path (Fig. 10).

    Dots mark the onset of instability of the assembly; in the red stretches the plane loses work.
    """
    return _work(planes_view.plane_work(curve, title))


@draw.register(PlaneWork)
def _work(view: PlaneWork) -> Figure:
    curve, planes = view.curve, view.representatives
    columns = 3
    rows = -(-len(planes) // columns)
    figure = new_figure(2.6 * columns, 2.1 * rows + 0.3)
    with mpl.rc_context(RC):
        grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        onset = view.first("w2_lost", -1)
        strain = 100 * np.abs(curve.eps_1.values)
        for axes, (angle, plane) in zip(grid.flat, planes.items(), strict=False):
            work = curve.w2n_plane.values[:, plane]
            axes.plot(strain, work, color=COLOURS[0])
            axes.plot(strain, np.where(work < 0.0, work, np.nan), color=NEGATIVE, lw=1.8)
            axes.axhline(0.0, color=NEGATIVE, lw=0.8, ls="--")
            if onset is not None:
                axes.plot(100 * onset, np.interp(100 * onset, strain, work), "o", color=INK, ms=5, zorder=5)
            axes.set_title(rf"{angle:g}$\degree$" + ("" if (work < 0.0).any() else ", never negative"), loc="left")
            axes.grid(visible=True)
        grid[0, 0].set_xscale("log")
        grid[0, 0].set_xlim(1e-3 * strain[-1], strain[-1])
        grid[0, 0].xaxis.set_major_formatter("{x:g}")
        for axes in list(grid.flat)[len(planes) :]:
            axes.set_axis_off()
        for axes in grid[-1]:
            axes.set_xlabel(r"axial strain $\varepsilon_1$  [%]")
        for axes in grid[:, 0]:
            axes.set_ylabel(r"$W_{2n}^\alpha$")
        figure.suptitle(view.title, x=0.02, ha="left")
    return figure
