"""The bifurcation map: unstable directions against stress ratio."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import wrap
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np

from rendulic.figures.cones import GREY, UNKNOWN_FACE, direction_ticks, draw_smallest, draw_track, landmarks, say_none
from rendulic.figures.draw import draw
from rendulic.figures.style import FAINT, NEGATIVE, RC, categories, new_figure
from rendulic.views.bifurcation import BifurcationMap, MapPanel, Shares
from rendulic.views.bifurcation import bifurcation_map as bifurcation_map_view

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["bifurcation_map"]

WIDEST = 40  # characters of a line above a panel, and
LEGEND = 52  # of one in the legend beneath it
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
    Each sample of a specimen has a colour of its own. Bars go from edge to edge of an unstable sector; edges that the error
    alone could make are open. Sectors of one sample are joined where one goes on in the next. Grey and dotted: directions whose
    sign is unknown. Dashed line: the first stress ratio with W2 = 0, shaded from the last one up to which all are surely stable to
    the first that is surely unstable. Beneath, open dots are not sure. If a specimen has several samples, the shares of them
    that are surely unstable (red) and unknown (grey) are at the bottom.

    Raises
    ------
    InvalidInput
        If there is no map, or a table is none.
    """
    return _map(bifurcation_map_view(maps, title))


@draw.register(BifurcationMap)
def _map(view: BifurcationMap) -> Figure:
    count = len(view.panels)
    heights = (3, 1.7, 0.8) if view.has_shares else (3, 1.7)
    figure = new_figure(0.9 + 2.6 * max(count, 2), 1.1 * sum(heights))
    with mpl.rc_context(RC):
        grid = figure.subplots(len(heights), count, sharex="col", sharey="row", squeeze=False, height_ratios=heights)
        for column, panel in zip(grid.T, view.panels, strict=True):
            _panel(column, panel, view)
            column[-1].set_xlabel(r"stress ratio $\eta = q/p$")
        upper = grid[0, 0]
        upper.set_ylim(view.low, view.high)
        direction_ticks(upper.yaxis, view.low, view.high)
        upper.set_ylabel(r"direction of strain $\alpha$  [deg]")
        grid[1, 0].set_ylabel(r"smallest $W_{2n}$")
        if view.has_shares:
            grid[2, 0].set_ylabel("share of\nsamples")
            grid[2, 0].set_ylim(0.0, 1.0)
        landmarks(grid[0], view.low, view.high, upright=False)
        figure.suptitle(view.title, x=0.02, ha="left")
    return figure


def _panel(column: Sequence[Axes], panel: MapPanel, view: BifurcationMap) -> None:
    upper, lower = column[:2]
    several = len(panel.samples) > 1
    colours = categories(len(panel.samples)) if several else [NEGATIVE]
    apart = ASIDE * several * min(np.diff(one.track.at).min(initial=1.0) for one in panel.samples)
    shifts = np.linspace(-0.5, 0.5, len(panel.samples)) * apart
    for one, colour, shift in zip(panel.samples, colours, shifts, strict=True):
        draw_track(upper, one.track, view.low, view.high, colour, float(shift))
        draw_smallest(lower, one.track, colour, label=_wrapped(f"{one.track.label}: {one.words}", LEGEND))
        if one.first is None:
            continue
        at, before, after = one.first
        for axes in column[:2]:
            axes.axvspan(before, after, color=colour, alpha=0.08, lw=0, zorder=0)
            axes.axvline(at, color=colour, lw=1.0, ls="--")
    if not any(one.track.every for one in panel.samples):
        say_none(upper, 0.5, "axes fraction")
    if view.has_shares:
        _shares(column[2], panel.shares)
    if several:
        column[-1].legend(
            *lower.get_legend_handles_labels(),
            loc="upper left",
            bbox_to_anchor=(-0.05, -0.95 if view.has_shares else -0.35),
            fontsize=7,
            borderpad=0.0,
        )
    words = _wrapped(f"median of {len(panel.samples)} samples: {panel.median}" if several else panel.samples[0].words)
    upper.set_title(panel.label + "\n" * (1 + words.count("\n")), loc="left")
    upper.annotate(words, (0.0, 1.03), xycoords="axes fraction", fontsize=8, color=GREY)


def _shares(axes: Axes, shares: Shares) -> None:
    """Bars of the samples that are surely unstable, and of those of which it is not known above them."""
    there = shares.count > 0
    at, count = shares.at[there], shares.count[there]
    unstable, unknown = shares.unstable[there] / count, shares.unknown[there] / count
    width = 0.5 * np.diff(shares.at).min(initial=0.2)
    axes.bar(at, np.ones(len(at)), width, facecolor="none", edgecolor=FAINT, lw=0.8)
    axes.bar(at, unstable, width, color=NEGATIVE, lw=0)
    axes.bar(at, unknown, width, bottom=unstable, lw=0.0, **UNKNOWN_FACE)


def _wrapped(words: str, width: int = WIDEST) -> str:
    """In lines, symbols as in formulas."""
    return "\n".join(_mathematics(line) for line in wrap(words, width))


def _mathematics(words: str) -> str:
    return words.replace("W2 = 0", "$W_2 = 0$").replace("W2 ", "$W_2$ ").replace("eta", r"$\eta$")
