"""The bifurcation map: unstable directions against stress ratio."""

from __future__ import annotations

from collections.abc import Mapping
from textwrap import wrap
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np

from rendulic.figures.cones import GREY, direction_ticks, draw_smallest, draw_track, landmarks, say_none
from rendulic.figures.draw import draw
from rendulic.figures.style import NEGATIVE, RC, categories, new_figure
from rendulic.views.bifurcation import BifurcationMap, MapPanel
from rendulic.views.bifurcation import bifurcation_map as bifurcation_map_view

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["bifurcation_map"]

WIDEST = 50  # characters of a line that fits a panel
ASIDE = 0.12  # of the distance of two states: how far the samples of a specimen are drawn apart in all


def bifurcation_map(maps: Mapping[str, xr.Dataset], title: str = "") -> Figure:
    """Unstable directions against stress ratio, with the smallest W2n beneath, one column for each specimen.

    Parameters
    ----------
    maps : mapping of label to xarray.Dataset
        From `rd.bifurcation_map`, e.g. loose grains, dense grains, and the Chang-Hicher model.
    title : str
        Above.

    Notes
    -----
    Each sample of a specimen has a colour of its own. Bars go from edge to edge of a sector whose W2n exceeds the
    drift; edges that the drift alone could make are open. Sectors are joined where one goes on in the next. Dashed line:
    the first stress ratio with W2 = 0, shaded from the last positive to the first negative one. Beneath, open dots do
    not exceed the drift.

    Raises
    ------
    InvalidInput
        If there is no map, or a table is none.
    """
    return _map(bifurcation_map_view(maps, title))


@draw.register(BifurcationMap)
def _map(view: BifurcationMap) -> Figure:
    count = len(view.panels)
    figure = new_figure(0.9 + 2.6 * max(count, 2), 5.1)
    with mpl.rc_context(RC):
        grid = figure.subplots(2, count, sharex="col", sharey="row", squeeze=False, height_ratios=(3, 1.7))
        for (upper, lower), panel in zip(grid.T, view.panels, strict=True):
            _panel(upper, lower, panel, view)
            lower.set_xlabel(r"stress ratio $\eta = q/p$")
        upper = grid[0, 0]
        upper.set_ylim(view.low, view.high)
        direction_ticks(upper.yaxis, view.low, view.high)
        upper.set_ylabel(r"direction of strain $\alpha$  [deg]")
        grid[1, 0].set_ylabel(r"smallest $W_{2n}$")
        landmarks(grid[0], view.low, view.high, upright=False)
        figure.suptitle(view.title, x=0.02, ha="left")
    return figure


def _panel(upper: Axes, lower: Axes, panel: MapPanel, view: BifurcationMap) -> None:
    several = len(panel.samples) > 1
    colours = categories(len(panel.samples)) if several else [NEGATIVE]
    apart = ASIDE * several * min(np.diff(one.track.at).min(initial=1.0) for one in panel.samples)
    shifts = np.linspace(-0.5, 0.5, len(panel.samples)) * apart
    for one, colour, shift in zip(panel.samples, colours, shifts, strict=True):
        draw_track(upper, one.track, view.low, view.high, colour, float(shift))
        draw_smallest(lower, one.track, colour, label=_wrapped(f"{one.track.label}: {one.words}"))
        if one.first is None:
            continue
        at, before, after = one.first
        for axes in (upper, lower):
            axes.axvspan(before, after, color=colour, alpha=0.08, lw=0, zorder=0)
            axes.axvline(at, color=colour, lw=1.0, ls="--")
    if not any(here for one in panel.samples for here in one.track.sectors):
        say_none(upper, 0.5, "axes fraction")
    if several:
        lower.legend(loc="upper left", bbox_to_anchor=(-0.05, -0.35), fontsize=7, borderpad=0.0)
    words = f"{len(panel.samples)} samples" if several else _wrapped(panel.samples[0].words)
    upper.set_title(panel.label + "\n" * (1 + words.count("\n")), loc="left")
    upper.annotate(words, (0.0, 1.03), xycoords="axes fraction", fontsize=8, color=GREY)


def _wrapped(words: str) -> str:
    """In lines as wide as a panel, symbols as in formulas."""
    return "\n".join(_mathematics(line) for line in wrap(words, WIDEST))


def _mathematics(words: str) -> str:
    return words.replace("W2 = 0", "$W_2 = 0$").replace("W2 ", "$W_2$ ").replace("eta", r"$\eta$")
