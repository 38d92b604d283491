"""Figures 6, 9 and 10 of the paper: what happens on the contact planes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np

from rendulic.figures.style import COLOURS, INK, NEGATIVE, RC, categories, new_figure, sequence

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["plane_paths", "plane_stiffness", "plane_work", "representatives"]


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
    figure = new_figure(7.2, 5.4)
    with mpl.rc_context(RC):
        grid = figure.subplots(2, 2, sharex=True)
        for axes, letter, (heading, curves) in zip(grid.flat, "abcd", panels.items(), strict=True):
            for colour, (label, (x, k_rr)) in zip(sequence(len(curves)), curves.items(), strict=True):
                axes.plot(x, 1e-3 * k_rr, color=colour, label=label)
                crossing = np.flatnonzero((k_rr[:-1] > 0.0) & (k_rr[1:] <= 0.0))
                for k in crossing[:1]:
                    zero = x[k] + (x[k + 1] - x[k]) * k_rr[k] / (k_rr[k] - k_rr[k + 1])
                    axes.plot(zero, 0.0, "o", ms=4, color=colour, mec=INK, mew=0.5, zorder=5)
            low, high = axes.get_ylim()
            axes.axhspan(low, 0.0, color=NEGATIVE, alpha=0.06, lw=0)
            axes.set_ylim(low, high)
            axes.axhline(0.0, color=NEGATIVE, lw=0.8, ls="--")
            axes.set_title(f"({letter}) {heading}", loc="left")
            axes.legend(loc="upper right")
            axes.grid(visible=True)
        for axes in grid[1]:
            axes.set_xlabel(r"normalised obliquity $f_r / (f_n \tan\varphi)$")
        for axes in grid[:, 0]:
            axes.set_ylabel(r"$K_{rr}$  [N/mm]")
    return figure


def representatives(curve: xr.Dataset) -> dict[float, int]:
    """One plane for every inclination to the axis other than 0 and 90 degrees: {inclination: plane}.

    In an axisymmetric test all planes of one inclination respond alike.
    """
    angles = np.round(curve.inclination.values, 1)
    return {float(angle): int(np.flatnonzero(angles == angle)[0]) for angle in np.unique(angles) if 0.0 < angle < 90.0}


def plane_paths(curve: xr.Dataset, title: str = "") -> Figure:
    """Local stress paths, shear against normal stress, of one plane of every inclination (Fig. 9).

    Dots mark where the second-order work of the assembly vanishes, circles where that of the plane does.
    """
    planes = representatives(curve)
    figure = new_figure(5.6, 4.2)
    with mpl.rc_context(RC):
        axes = figure.add_subplot()
        largest = float(curve.sigma_plane.max())
        for colour, (angle, plane) in zip(categories(len(planes)), planes.items(), strict=True):
            one = curve.isel(plane=plane)
            axes.plot(1e-3 * one.sigma_plane, 1e-3 * one.tau_plane, color=colour, label=rf"{angle:g}$\degree$")
            for strain, marker in ((_first(curve, "w2_lost", -1), "o"), (_first(curve, "plane_w2_lost", plane), "D")):
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
        axes.set_title(title, loc="left")
    return figure


def plane_work(curve: xr.Dataset, title: str = "") -> Figure:
    """Normalised second-order work of one plane of every inclination along the path (Fig. 10).

    Dots mark the onset of instability of the assembly; in the red stretches the plane loses work.
    """
    planes = representatives(curve)
    columns = 3
    rows = -(-len(planes) // columns)
    figure = new_figure(2.6 * columns, 2.1 * rows + 0.3)
    with mpl.rc_context(RC):
        grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        onset = _first(curve, "w2_lost", -1)
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
        figure.suptitle(title, x=0.02, ha="left")
    return figure


def _first(curve: xr.Dataset, kind: str, plane: int) -> float | None:
    """Axial strain of the first event of a kind on a plane (-1: the assembly)."""
    found = np.flatnonzero((curve.event_kind.values == kind) & (curve.event_plane.values == plane))
    return float(curve.event_eps_1[found[0]]) if len(found) else None
