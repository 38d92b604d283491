"""Bursts: kinetic energy, strain and energies of a disturbed state; predicted against observed failure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np

from rendulic.figures.style import COLOURS, FAINT, INK, NEGATIVE, RC, new_figure

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["burst_table", "bursts", "equation_1"]

# settles, fails, arrested, undecided, as in `probing.burst.VERDICTS`
MARKS = (("o", COLOURS[0]), ("X", NEGATIVE), ("D", COLOURS[5]), ("s", "#888888"))
WORDS = ("settles", "fails", "avalanche, arrested", "undecided")
HELD = 2


def bursts(curves: Mapping[str, xr.Dataset], title: str = "") -> Figure:
    """Kinetic energy and strain against time after the disturbance, and where the energy of the wildest went.

    Parameters
    ----------
    curves : mapping of label to xarray.Dataset
        From `rd.burst` of grains.
    title : str
        Above the row.
    """
    figure = new_figure(9.6, 3.3)
    with mpl.rc_context(RC):
        energy, strain, books = figure.subplots(1, 3)
        families = {"fails": ("-", NEGATIVE), "arrested": ("-", COLOURS[5]), "settles": ("-", COLOURS[0])}
        seen: set[str] = set()
        ends: list[tuple[float, float, str, str]] = []
        for label, curve in curves.items():
            verdict = curve.attrs["verdict"]
            style, colour = families.get(verdict, (":", "#888888"))
            time, word = 1e3 * curve.time.values, verdict if verdict not in seen else None
            seen.add(verdict)
            kinetic = curve.kinetic_energy.values / curve.attrs["reference_energy"]
            energy.plot(time[1:], np.maximum(kinetic[1:], 1e-6), style, color=colour, lw=1.0, label=word)
            strain.plot(time, curve.strain_along.values / curve.attrs["norm"], style, color=colour, lw=1.0)
            if verdict != "settles":
                ends.append((float(curve.strain_along[-1]) / curve.attrs["norm"], time[-1], label, colour))
        _name_ends(strain, ends)
        one = next(iter(curves.values()))
        released = 1e3 * float(one.time.values[np.flatnonzero(one.phase.values == HELD)[0] - 1])
        for axes in (energy, strain):
            axes.axvspan(0.0, released, color=FAINT, alpha=0.5, lw=0)
            axes.set_xlabel("time [ms]")
        energy.set_yscale("log")
        energy.set_ylabel("kinetic energy / that of the disturbance")
        energy.set_title("kinetic energy", loc="left")
        energy.legend(loc="best")
        strain.set_yscale("symlog", linthresh=1.0)
        strain.set_ylabel("strain along the direction / disturbance")
        strain.set_title("strain", loc="left")
        strain.margins(x=0.15)
        _books(books, max(curves.values(), key=lambda curve: curve.attrs["kinetic_growth"]))
        figure.suptitle(title, x=0.02, ha="left")
    return figure


def _name_ends(axes: Axes, ends: list[tuple[float, float, str, str]]) -> None:
    """Names at the ends of curves, (strain, time, name, colour); curves that end at like strains share one."""
    groups: list[list[tuple[float, float, str, str]]] = []
    for end in sorted(ends):
        if groups and end[3] == groups[-1][0][3] and abs(end[0] - groups[-1][0][0]) < 0.25 * abs(end[0]):
            groups[-1].append(end)
        else:
            groups.append([end])
    for group in groups:
        names = ", ".join(f"{float(name):.0f}" for _, _, name, _ in sorted(group, key=lambda end: float(end[2])))
        axes.annotate(names, (max(end[1] for end in group), group[0][0]), fontsize=6, color=group[0][3],
                      xytext=(3, 0), textcoords="offset points", va="center")  # fmt: skip


def _books(axes: Axes, curve: xr.Dataset) -> None:
    time = 1e3 * curve.time.values
    kept = curve.kinetic_energy.values - curve.kinetic_energy.values[0]
    for values, label, colour in (
        (curve.boundary_work.values, "work of the walls", INK),
        (curve.elastic_energy.values, "stored", COLOURS[0]),
        (curve.friction_work.values, "friction", COLOURS[1]),
        (curve.damping_work.values, "damping", COLOURS[3]),
        (kept, "kinetic", COLOURS[2]),
    ):
        axes.plot(time, values, color=colour, lw=1.2, label=label)
    axes.set_xlabel("time [ms]")
    axes.set_ylabel("energy since rest [J]")
    alpha = curve.attrs.get("alpha", float("nan"))
    axes.set_title(f"energy at {alpha:.0f}°, error {curve.attrs['balance_error']:.0e}", loc="left")
    axes.legend(loc="best")


def equation_1(curves: Mapping[str, xr.Dataset], title: str = "") -> Figure:
    """Eq. 1, step by step: change of kinetic energy in a step against work of first and of second order.

    Parameters
    ----------
    curves : mapping of label to xarray.Dataset
        From `rd.burst` of grains.
    title : str
        Above the diagram.
    """
    figure = new_figure(4.6, 3.6)
    with mpl.rc_context(RC):
        axes = figure.add_subplot()
        left = np.concatenate([curve.d_kinetic.values[1:] for curve in curves.values()])
        second = np.concatenate([0.5 * (curve.b2 - curve.w2).values[1:] for curve in curves.values()])
        first = np.concatenate([curve.first_order.values[1:] for curve in curves.values()])
        smallest = np.quantile(np.abs(left), 0.05)
        span = np.array([-np.abs(left).max(), np.abs(left).max()])
        axes.plot(span, span, color=INK, lw=0.6)
        axes.plot(first + second, left, ".", color=COLOURS[0], ms=3, label=r"$F\cdot dx + (B_2-W_2)/2$")
        axes.plot(second, left, ".", color=COLOURS[1], ms=2, alpha=0.6, label=r"$(B_2-W_2)/2$ alone")
        axes.set_xscale("symlog", linthresh=max(smallest, 1e-300))
        axes.set_yscale("symlog", linthresh=max(smallest, 1e-300))
        decades = 10.0 ** np.arange(np.ceil(np.log10(max(smallest, 1e-300))), np.log10(span[1]) + 1.0, 2.0)
        ticks = [*(-decades[::-1]), 0.0, *decades]
        axes.set_xticks(ticks)
        axes.set_yticks(ticks)
        axes.minorticks_off()
        axes.set_xlabel("work in one time step [J]")
        axes.set_ylabel("change of kinetic energy [J]")
        axes.tick_params(labelsize=6)
        axes.set_title(title, loc="left")
        axes.legend(loc="lower right")
    return figure


def burst_table(tables: Mapping[str, xr.Dataset], title: str = "") -> Figure:
    """Predicted against observed failure around the Rendulic plane, one row per state.

    Each symbol is a burst: its height is the second-order work that predicts (failure below zero), its shape what was
    observed. Full symbols agree, open ones do not.

    Parameters
    ----------
    tables : mapping of label to xarray.Dataset
        From `rd.bursts`.
    title : str
        Above all.
    """
    columns = 1 if len(tables) <= 4 else 2
    rows = -(-len(tables) // columns)
    figure = new_figure(6.4 if columns == 1 else 9.6, 1.0 + 1.3 * rows)
    with mpl.rc_context(RC):
        grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        places = list(grid.T.flat)
        for axes in places[len(tables) :]:
            axes.set_axis_off()
        for axes, (label, table) in zip(places, tables.items(), strict=False):
            alpha, w2n = table.alpha.values, table.w2_normalised.values
            axes.axhspan(-1.05, 0.0, color=NEGATIVE, alpha=0.07, lw=0)
            axes.axhline(0.0, color=NEGATIVE, lw=1.0, ls="--")
            axes.plot(alpha, w2n, color=FAINT, lw=1.0, zorder=1)
            for index, (marker, colour) in enumerate(MARKS):
                here = table.verdict.values == index
                agrees = (table.predicted.values == table.observed.values) & (index != 3)
                for which, face in ((here & agrees, colour), (here & ~agrees, "white")):
                    axes.plot(alpha[which], w2n[which], marker, mfc=face, mec=colour, ms=5, ls="none")
            axes.set_ylim(-1.05, 1.1)
            axes.set_title(label, loc="left")
        for marker, colour, word in [(*mark, word) for mark, word in zip(MARKS, WORDS, strict=True)]:
            places[0].plot([], [], marker, color=colour, ls="none", ms=5, label=word)
        places[0].plot([], [], "o", mfc="white", mec=INK, ls="none", ms=5, label="open: against the prediction")
        figure.legend(loc="outside lower center", ncols=5)
        for axes in grid[:, 0]:
            axes.set_ylabel(r"$W_{2n}$")
        for axes in (places[k - 1] for k in (rows, len(tables))):
            axes.set_xlabel("direction of the strain increment [degrees]")
            axes.tick_params(labelbottom=True)
        places[0].set_xticks(range(0, 361, 45))
        figure.suptitle(title, x=0.02, ha="left")
    return figure
