"""Bursts: kinetic energy, strain and energies of a disturbed state; predicted against observed failure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np

from rendulic.figures.draw import draw
from rendulic.figures.style import COLOURS, FAINT, INK, NEGATIVE, RC, new_figure
from rendulic.probing.burst import VERDICTS
from rendulic.views import burst_curves
from rendulic.views.burst_curves import BurstCurve, BurstCurves, Energies, Equation1
from rendulic.views.bursts import BurstsOfState, PredictedObserved, predicted_observed

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["burst_table", "bursts", "equation_1"]

# of each verdict its symbol, colour and words
LOOKS = {
    "settles": ("o", COLOURS[0], "settles"),
    "fails": ("X", NEGATIVE, "fails"),
    "arrested": ("D", COLOURS[5], "avalanche, arrested"),
    "undecided": ("s", "#888888", "undecided"),
    "too fast": ("^", "#bbbbbb", "pushed too fast"),
}
LIKE = 0.25  # of a strain: curves that end less far apart share one label
ENERGIES = (INK, COLOURS[0], COLOURS[1], COLOURS[3], COLOURS[2])


def bursts(curves: Mapping[str, xr.Dataset], title: str = "") -> Figure:
    """Kinetic energy and strain against time after the disturbance, and where the energy of the wildest went.

    Parameters
    ----------
    curves : mapping of label to xarray.Dataset
        From `rd.burst` of grains.
    title : str
        Above the row.
    """
    return _curves(burst_curves.burst_curves(curves, title))


@draw.register(BurstCurves)
def _curves(view: BurstCurves) -> Figure:
    figure = new_figure(9.6, 3.3)
    with mpl.rc_context(RC):
        energy, strain, balance = figure.subplots(1, 3)
        seen: set[str] = set()
        for curve in view.curves:
            style = ":" if curve.verdict in ("undecided", "too fast") else "-"
            colour = LOOKS[curve.verdict][1]
            word = curve.verdict if curve.verdict not in seen else None
            seen.add(curve.verdict)
            energy.plot(curve.time[1:], curve.kinetic[1:], style, color=colour, lw=1.0, label=word)
            strain.plot(curve.time, curve.strain, style, color=colour, lw=1.0)
        _name_ends(strain, [curve for curve in view.curves if curve.verdict not in ("settles", "too fast")])
        for axes in (energy, strain):
            axes.axvspan(view.begun, 0.0, color=FAINT, alpha=0.5, lw=0)
            axes.set_xlabel("time since the load is back [ms]")
        energy.set_yscale("log")
        energy.set_ylabel("kinetic energy / stored energy")
        energy.set_title("kinetic energy", loc="left")
        energy.legend(loc="best")
        strain.set_yscale("symlog", linthresh=1.0)
        strain.set_ylabel("strain along the push / its size")
        strain.set_title("strain", loc="left")
        strain.margins(x=0.15)
        _balance(balance, view.energies)
        figure.suptitle(view.title, x=0.02, ha="left")
    return figure


def _name_ends(axes: Axes, curves: list[BurstCurve]) -> None:
    """Directions at the ends of curves; curves of one verdict that end at like strains share one label."""
    groups: list[list[BurstCurve]] = []
    for curve in sorted(curves, key=lambda one: one.strain[-1]):
        end = curve.strain[-1]
        before = groups[-1][0] if groups else None
        if before and curve.verdict == before.verdict and abs(end - before.strain[-1]) < LIKE * abs(end):
            groups[-1].append(curve)
        else:
            groups.append([curve])
    for group in groups:
        names = ", ".join(f"{name:.0f}" for name in sorted(float(curve.label) for curve in group))
        axes.annotate(names, (max(curve.time[-1] for curve in group), group[0].strain[-1]), fontsize=6,
                      color=LOOKS[group[0].verdict][1], xytext=(3, 0), textcoords="offset points",
                      va="center")  # fmt: skip


def _balance(axes: Axes, energies: Energies) -> None:
    for (label, values), colour in zip(energies.parts.items(), ENERGIES, strict=True):
        axes.plot(energies.time, values, color=colour, lw=1.2, label=label)
    axes.set_xlabel("time since the load is back [ms]")
    axes.set_ylabel("energy since rest [J]")
    axes.set_title(f"{energies.alpha:.0f}°: balance error {energies.error:.0e}", loc="left")
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
    return _equation_1(burst_curves.equation_1(curves, title))


@draw.register(Equation1)
def _equation_1(view: Equation1) -> Figure:
    figure = new_figure(4.6, 3.6)
    with mpl.rc_context(RC):
        axes = figure.add_subplot()
        largest = np.abs(view.d_kinetic).max()
        axes.plot([-largest, largest], [-largest, largest], color=INK, lw=0.6)
        axes.plot(
            view.first + view.second, view.d_kinetic, ".", color=COLOURS[0], ms=3, label=r"$F\cdot dx + (B_2-W_2)/2$"
        )
        axes.plot(view.second, view.d_kinetic, ".", color=COLOURS[1], ms=2, alpha=0.6, label=r"$(B_2-W_2)/2$ alone")
        axes.set_xscale("symlog", linthresh=view.smallest)
        axes.set_yscale("symlog", linthresh=view.smallest)
        decades = 10.0 ** np.arange(np.ceil(np.log10(view.smallest)), np.log10(largest) + 1.0, 2.0)
        ticks = [*(-decades[::-1]), 0.0, *decades]
        axes.set_xticks(ticks)
        axes.set_yticks(ticks)
        axes.minorticks_off()
        axes.set_xlabel("work in one time step [J]")
        axes.set_ylabel("change of kinetic energy [J]")
        axes.tick_params(labelsize=6)
        axes.set_title(view.title, loc="left")
        axes.legend(loc="lower right")
    return figure


def burst_table(tables: Mapping[str, xr.Dataset], title: str = "") -> Figure:
    """Predicted against observed failure around the Rendulic plane, one row per state.

    Each symbol is a burst: its height is the second-order work that predicts (failure below zero), its shape what was
    observed. Open symbols are against the prediction.

    Parameters
    ----------
    tables : mapping of label to xarray.Dataset
        From `rd.bursts`.
    title : str
        Above all.
    """
    return _predicted_observed(predicted_observed(tables, title))


@draw.register(PredictedObserved)
def _predicted_observed(view: PredictedObserved) -> Figure:
    count = len(view.panels)
    columns = 1 if count <= 4 else 2
    rows = -(-count // columns)
    figure = new_figure(6.4 if columns == 1 else 9.6, 1.2 + 1.3 * rows)
    with mpl.rc_context(RC):
        grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        places = list(grid.T.flat)
        for axes in places[count:]:
            axes.set_axis_off()
        for axes, panel in zip(places, view.panels, strict=False):
            _directions(axes, panel)
        for marker, colour, word in LOOKS.values():
            places[0].plot([], [], marker, color=colour, ls="none", ms=5, label=word)
        places[0].plot([], [], "o", mfc="white", mec=INK, ls="none", ms=5, label="open: against the prediction")
        figure.legend(loc="outside lower center", ncols=3)
        for axes in grid[:, 0]:
            axes.set_ylabel(r"$W_{2n}$")
        for axes in (places[k - 1] for k in (rows, count)):
            axes.set_xlabel("direction of the strain increment [degrees]")
            axes.tick_params(labelbottom=True)
        places[0].set_xticks(range(0, 361, 45))
        figure.suptitle(view.title, x=0.02, ha="left")
    return figure


def _directions(axes: Axes, panel: BurstsOfState) -> None:
    table = panel.table
    alpha, w2n = table.alpha.values, table.w2_normalised.values
    axes.axhspan(-1.05, 0.0, color=NEGATIVE, alpha=0.07, lw=0)
    axes.axhline(0.0, color=NEGATIVE, lw=1.0, ls="--")
    axes.plot(alpha, w2n, color=FAINT, lw=1.0, zorder=1)
    for verdict, (marker, colour, _) in LOOKS.items():
        here = table.verdict.values == VERDICTS.index(verdict)
        for which, face in ((here & ~panel.is_against, colour), (here & panel.is_against, "white")):
            axes.plot(alpha[which], w2n[which], marker, mfc=face, mec=colour, ms=5, ls="none")
    axes.set_ylim(-1.05, 1.1)
    words = "" if panel.is_watched else " (model: a test of the code)"
    axes.set_title(f"{panel.label}{words}", loc="left")
