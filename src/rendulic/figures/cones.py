"""Cones with the uncertainty of their edges, and how they depend on the size of the probes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np

from rendulic.figures.draw import draw
from rendulic.figures.style import COLOURS, FAINT, INK, NEGATIVE, RC, new_figure
from rendulic.probing.edges import is_unknown
from rendulic.views.amplitude import Amplitude, Sizes
from rendulic.views.amplitude import amplitude as amplitude_view
from rendulic.views.circular import LANDMARKS
from rendulic.views.cones import ConeOfState, ConesView
from rendulic.views.cones import cones as cones_view

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rendulic.probing.cone import Cone
    from rendulic.views.sectors import Track

__all__ = [
    "GREY",
    "UNKNOWN_FACE",
    "amplitude",
    "cones",
    "direction_ticks",
    "draw_smallest",
    "draw_track",
    "landmarks",
    "say_none",
]

GREY = "#777777"
WORD_BOX: Any = {"facecolor": "white", "edgecolor": "none", "pad": 0.6}  # behind words that stand on something
UNKNOWN_FACE: Any = {"facecolor": mpl.colors.to_rgba(GREY, 0.15), "edgecolor": GREY, "hatch": "//////"}


def cones(found: Mapping[str, Cone], title: str = "") -> Figure:
    """Unstable and unknown sectors as bars, with the uncertainty of their edges, beside the smallest W2n with its error.

    Parameters
    ----------
    found : mapping of label to Cone
        From `rd.instability_cone`; cones of stress probes are shown in directions of strain.
    title : str
        Above.

    Notes
    -----
    Red: surely unstable. Grey and hatched: the sign is unknown, which is not stable. An edge without an error bar and with a question
    mark could be made by the error alone. Right: the bar about a value is its error; open where its sign is not sure.
    """
    return _cones(cones_view(found, title))


@draw.register(ConesView)
def _cones(view: ConesView) -> Figure:
    figure = new_figure(7.4, 1.5 + 0.34 * len(view.rows))
    with mpl.rc_context(RC):
        left, right = figure.subplots(1, 2, sharey=True, width_ratios=(2.2, 1.0))
        for row, cone in enumerate(view.rows):
            _sector_bars(left, row, cone, view.low, view.high)
            colour = NEGATIVE if cone.smallest < 0.0 else COLOURS[0]
            right.errorbar(
                cone.smallest, row, xerr=np.nan_to_num(cone.error), fmt="o", ms=4.5, color=colour, capsize=2.5, lw=1.0,
                mfc=colour if cone.is_significant else "white",
            )  # fmt: skip
        landmarks([left], view.low, view.high)
        left.set_yticks(range(len(view.rows)), [cone.label for cone in view.rows])
        left.set_ylim(len(view.rows) - 0.4, -0.6)
        left.set_xlim(view.low, view.high)
        direction_ticks(left.xaxis, view.low, view.high)
        left.set_xlabel(r"direction of strain increment $\alpha$  [deg]")
        left.tick_params(axis="y", length=0)
        right.axvline(0.0, color=INK, lw=0.6)
        right.set_xlabel(r"smallest $W_{2n}$")
        right.margins(x=0.12)
        right.tick_params(axis="y", length=0)
        figure.suptitle(view.title, x=0.02, ha="left")
    return figure


def _sector_bars(axes: Axes, row: int, cone: ConeOfState, low: float, high: float) -> None:
    if cone.verdict == "stable":
        say_none(axes, row)
    bar: Any = {"height": 0.5, "lw": 0.8}
    seen = [turned for one in cone.sectors for turned in one.within(low, high)]
    for sector in seen:
        face = mpl.colors.to_rgba(NEGATIVE, 0.35)
        axes.barh(row, sector.last - sector.first, left=sector.first, facecolor=face, edgecolor=NEGATIVE, **bar)
    for sector in (turned for one in cone.unknown for turned in one.within(low, high)):
        axes.barh(row, sector.last - sector.first, left=sector.first, **UNKNOWN_FACE, **bar)
    for at, width in (edge for sector in seen for edge in sector.edges):
        if is_unknown(width):
            look: Any = {"color": INK, "fontsize": 9, "fontweight": "bold", "bbox": WORD_BOX, "annotation_clip": True}
            axes.annotate("?", (at, row), ha="center", va="center", **look)
        else:
            axes.errorbar(at, row, xerr=width, fmt="none", color=INK, capsize=3, lw=1.1, capthick=1.1)
    if sum(one.last - one.first for one in cone.unknown) >= 360.0:
        say_none(axes, row, words="unknown")


def say_none(axes: Axes, height: float, unit: str = "data", words: str = "none") -> None:
    """The word for a state without a cone, in the middle of the axes and at this height."""
    look: Any = {"ha": "center", "va": "center", "color": GREY, "fontsize": 8, "bbox": WORD_BOX}
    axes.annotate(words, (0.5, height), xycoords=("axes fraction", unit), **look)


def direction_ticks(axis: Any, low: float, high: float) -> None:
    """Ticks of an axis of directions that shows those from `low` to `high` degrees."""
    axis.set_major_locator(mpl.ticker.MultipleLocator(60 if high - low > 180.0 else 15))


def draw_track(axes: Axes, track: Track, low: float, high: float, colour: str, shift: float = 0.0) -> None:
    """Sectors of a track from edge to edge, joined where one goes on in the next; unknown ones dotted; abscissas moved by `shift`."""
    for at, one, beyond, other in track.bands():
        for turn in (turned.first - one.first for turned in one.within(low, high)):
            pair = (at + shift, beyond + shift)
            first, last = ([getattr(sector, end) + turn for sector in (one, other)] for end in ("first", "last"))
            axes.fill_between(pair, first, last, color=colour, alpha=0.15, lw=0)
            for ends in (first, last):
                axes.plot(pair, ends, "-", color=colour, lw=1.0)
    for at, here, unknown in zip(track.at + shift, track.sectors, track.unknown, strict=True):
        for sector in (turned for one in unknown for turned in one.within(low, high)):
            ends = [sector.first, sector.last]
            axes.plot([at, at], ends, color=GREY, lw=4.0, ls=(0, (0.35, 0.35)), solid_capstyle="butt", zorder=1.5)
        for sector in (turned for one in here for turned in one.within(low, high)):
            axes.plot([at, at], [sector.first, sector.last], "-", color=colour, lw=2.5, alpha=0.35)
            for edge, width in sector.edges:
                if is_unknown(width):
                    axes.plot(at, edge, "o", mfc="white", mec=colour, ms=4, zorder=3)
                else:
                    axes.errorbar(at, edge, yerr=width, fmt="o", ms=3, color=colour, ecolor=INK, lw=0.9, capsize=1.4)


def draw_smallest(axes: Axes, track: Track, colour: str, **look: Any) -> None:
    """Smallest W2n along a track, open where its sign is not sure."""
    sure = track.is_significant
    axes.axhline(0.0, color=INK, lw=0.6)
    axes.plot(track.at, track.smallest, "-", color=colour, lw=1.0, **look)
    axes.plot(track.at[sure], track.smallest[sure], "o", color=colour, ms=3.5)
    axes.plot(track.at[~sure], track.smallest[~sure], "o", mfc="white", mec=colour, ms=4)


def landmarks(row: Sequence[Axes], low: float, high: float, upright: bool = True) -> None:
    """Thin lines at the directions of common tests between `low` and `high` degrees, named at the last of the axes.

    Parameters
    ----------
    upright : bool
        Whether directions are abscissas, and the names above; if not, ordinates, and the names to the right.
    """
    look: Any = {"fontsize": 7, "color": GREY, "linespacing": 1.0}
    last = row[-1]
    for name, alpha in LANDMARKS.items():
        if low < alpha < high:
            for axes in row:
                (axes.axvline if upright else axes.axhline)(alpha, color=FAINT, lw=0.8, zorder=0)
            words = name.replace(" ", "\n")
            if upright:
                if high - low > 180.0:
                    words = words.replace("compression", "compr.").replace("extension", "ext.")
                last.text(alpha, 1.01, words, transform=last.get_xaxis_transform(), ha="center", va="bottom", **look)
            else:
                last.text(1.02, alpha, words, transform=last.get_yaxis_transform(), va="center", **look)


def amplitude(tables: Mapping[str, xr.Dataset], title: str = "") -> Figure:
    """Smallest W2n and edges of the unstable sectors against the size of the probes, state by state.

    Parameters
    ----------
    tables : mapping of label to xarray.Dataset
        From `rd.cones_by_amplitude`.
    title : str
        Above.

    Notes
    -----
    Grey: values that the error could make; open dots do not exceed it, nor do the edges of open dots. Below, grey and dotted:
    directions whose sign is unknown. Blue: the plateau, where the smallest W2n does not depend on the size.

    Raises
    ------
    InvalidInput
        If a table has no norms, or some are of strain and some of stress probes.
    """
    return _amplitude(amplitude_view(tables, title))


@draw.register(Amplitude)
def _amplitude(view: Amplitude) -> Figure:
    figure = new_figure(0.8 + 2.7 * max(len(view.columns), 2), 4.6)
    with mpl.rc_context(RC):
        grid = figure.subplots(2, len(view.columns), sharex="col", sharey="row", squeeze=False, height_ratios=(3, 2))
        for (upper, lower), one in zip(grid.T, view.columns, strict=True):
            _amplitude_column(upper, lower, one, view)
            upper.set_title(f"{one.track.label}\n", loc="left")
            words = f"plateau {one.found if one.plateau else 'none'}"
            upper.annotate(words, (0.0, 1.03), xycoords="axes fraction", fontsize=8, color=COLOURS[0])
            lower.set_xlabel(view.quantity)
        smallest = np.concatenate([[0.0], *(one.track.smallest for one in view.columns)])
        grid[0, 0].set_ylim(min(-0.4, 1.15 * np.nanmin(smallest)), max(0.4, 1.15 * np.nanmax(smallest)))
        grid[0, 0].set_ylabel(r"smallest $W_{2n}$")
        grid[1, 0].set_ylabel("edges of the\nunstable sectors  [deg]")
        grid[1, 0].set_ylim(view.low, view.high)
        direction_ticks(grid[1, 0].yaxis, view.low, view.high)
        figure.suptitle(view.title, x=0.02, ha="left")
    return figure


def _amplitude_column(upper: Axes, lower: Axes, one: Sizes, view: Amplitude) -> None:
    track = one.track
    error = np.minimum(np.nan_to_num(track.error, nan=2.0), 2.0)
    upper.fill_between(track.at, -error, error, color=FAINT, lw=0, label="error")
    draw_smallest(upper, track, NEGATIVE)
    upper.set_xscale("log")
    if np.log10(track.at[-1] / track.at[0]) < 2.0:  # decades alone would leave the axis without numbers
        shown = track.at[:: -(-len(track.at) // 4)]
        lower.set_xticks(shown, [f"{norm:g}" for norm in shown])
        lower.xaxis.set_minor_formatter(mpl.ticker.NullFormatter())
    for axes in (upper, lower):
        if one.plateau:
            axes.axvspan(*one.plateau, color=COLOURS[4], alpha=0.18, lw=0, zorder=0)
    if not track.every:
        say_none(lower, 0.5, "axes fraction")
    draw_track(lower, track, view.low, view.high, NEGATIVE)
