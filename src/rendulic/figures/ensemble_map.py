"""Sure cones and the share of unstable packings against the stress ratio, with matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np

from rendulic.figures.cones import direction_ticks, landmarks, say_none
from rendulic.figures.draw import draw
from rendulic.figures.style import COLOURS, NEGATIVE, RC, new_figure
from rendulic.views.ensemble_map import EnsembleMap
from rendulic.views.sectors import Sector

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

GREY = "#777777"


@draw.register(EnsembleMap)
def _ensemble_map(view: EnsembleMap) -> Figure:
    figure = new_figure(5.6, 5.2)
    with mpl.rc_context(RC):
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
        for spans, look in (
            (view.possible, {"color": GREY, "lw": 1.2, "label": "may be unstable"}),
            (view.mean, {"color": NEGATIVE, "lw": 4, "alpha": 0.35, "label": "unstable in the mean"}),
            (view.sure, {"color": NEGATIVE, "lw": 8, "label": "surely unstable"}),
        ):
            _bars(upper, view, spans, look)
        if not any(view.sure):
            say_none(upper, 0.5, "axes fraction")
        upper.set_ylim(view.low, view.high)
        direction_ticks(upper.yaxis, view.low, view.high)
        landmarks([upper], view.low, view.high, upright=False)
        upper.set_ylabel(r"direction of strain $\alpha$  [deg]")
        upper.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, borderpad=0.0)
        for shares, colour, label in (
            (view.somewhere, COLOURS[0], "in some direction"),
            (view.at_smallest, COLOURS[1], r"where the mean $W_{2n}$ is smallest"),
        ):
            value, low, high = shares
            lower.errorbar(
                view.eta,
                value,
                np.maximum([value - low, high - value], 0.0),
                fmt="o-",
                ms=4,
                color=colour,
                capsize=3,
                label=label,
            )
        lower.set_ylim(-0.03, 1.03)
        lower.set_ylabel(r"packings with $W_2 < 0$")
        lower.set_xlabel(r"stress ratio $\eta = q/p$")
        lower.legend(loc="upper left")
        lower.grid(visible=True)
        figure.suptitle(view.title, x=0.02, ha="left")
    return figure


def _bars(axes: Axes, view: EnsembleMap, spans: tuple, look: dict) -> None:
    """From the first to the last direction of every sector; one label."""
    label = look["label"]
    for eta, own in zip(view.eta, spans, strict=True):
        for first, last in own:
            for seen in Sector(first, last, 0.0, 0.0).within(view.low, view.high):
                axes.plot([eta, eta], [seen.first, seen.last], solid_capstyle="butt", **look | {"label": label})
                label = None
