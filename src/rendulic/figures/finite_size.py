"""Cones and shares against the number of grains, with matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np

from rendulic.figures.draw import draw
from rendulic.figures.style import INK, RC, new_figure, sequence
from rendulic.views.finite_size import FiniteSize

if TYPE_CHECKING:
    from matplotlib.figure import Figure

APART = 0.06  # of a decade: how far stress ratios are drawn apart


@draw.register(FiniteSize)
def _finite_size(view: FiniteSize) -> Figure:
    figure = new_figure(5.2, 6.4)
    with mpl.rc_context(RC):
        panels = figure.subplots(3, 1, sharex=True)
        for axes, words in zip(
            panels, ("opening of the cone  [deg]", r"smallest mean $W_{2n}$", r"packings with $W_2 < 0$"), strict=True
        ):
            axes.set_ylabel(words)
            axes.grid(visible=True)
        shifts = APART * (np.arange(len(view.series)) - 0.5 * (len(view.series) - 1))
        for colour, shift, one in zip(sequence(len(view.series)), shifts, view.series, strict=True):
            at = one.n_grains * 10.0**shift
            for axes, (value, low, high) in zip(panels, (one.opening, one.smallest, one.share), strict=True):
                bars = np.maximum([value - low, high - value], 0.0)
                axes.errorbar(at, value, bars, fmt="o-", ms=4, lw=1.0, capsize=3, color=colour, label=one.label)
            panels[2].plot(one.n_grains, one.share[0][0] * one.n_grains[0] / one.n_grains, "--", color=colour, lw=0.8)
        panels[1].axhline(0.0, color=INK, lw=0.6)
        panels[2].plot([], [], "--", color=INK, lw=0.8, label="1/N")
        panels[2].set_xscale("log")
        panels[2].set_yscale("symlog", linthresh=0.01)
        panels[2].set_ylim(0.0, 1.2)
        panels[2].set_xlabel("number of grains N")
        panels[2].legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
        figure.suptitle(view.title, x=0.02, ha="left")
    return figure
