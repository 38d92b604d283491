"""Cones with the uncertainty of their edges, and how they depend on the size of the probes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np

from rendulic.figures.style import COLOURS, FAINT, INK, NEGATIVE, RC, new_figure
from rendulic.foundation.errors import InvalidInput
from rendulic.probing.edges import is_unknown
from rendulic.tensors.rendulic_plane import AXIAL_COMPRESSION, ISOCHORIC_COMPRESSION, ISOTROPIC_COMPRESSION

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rendulic.probing.cone import Cone

__all__ = [
    "GREY",
    "TURNS",
    "amplitude",
    "cones",
    "direction_range",
    "draw_edges",
    "draw_sector",
    "landmarks",
    "say_none",
]

LANDMARKS = (
    ("isotropic compression", ISOTROPIC_COMPRESSION),
    ("axial compression", AXIAL_COMPRESSION),
    ("undrained compression", ISOCHORIC_COMPRESSION),
    ("isotropic extension", ISOTROPIC_COMPRESSION + 180.0),
    ("axial extension", AXIAL_COMPRESSION + 180.0),
    ("undrained extension", ISOCHORIC_COMPRESSION + 180.0),
)
MARGIN = 10.0  # degrees about the directions that are shown
TURNS = (-360.0, 0.0, 360.0)  # what has a direction is drawn at all of these; the axes cut what is out of sight
GREY = "#777777"


def direction_range(first, last) -> tuple[float, float]:
    """Directions in degrees to show sectors in: about all of them, or all around if they lie apart.

    Parameters
    ----------
    first, last : arrays
        Edges, `last` beyond `first`; NaN are left out.

    Examples
    --------
    >>> direction_range([116.0], [145.0])
    (105.0, 165.0)
    >>> direction_range([350.0], [370.0])
    (0.0, 360.0)
    """
    first, last = np.ravel(first), np.ravel(last)
    known = np.isfinite(first) & np.isfinite(last)
    if not known.any() or last[known].max() > 360.0 or np.ptp([first[known].min(), last[known].max()]) > 180.0:
        return 0.0, 360.0
    # the landmark that the cone is compared with stays in sight
    low = min(first[known].min(), ISOCHORIC_COMPRESSION) - MARGIN
    high = max(last[known].max(), ISOCHORIC_COMPRESSION) + MARGIN
    return float(max(15.0 * np.floor(low / 15.0), 0.0)), float(min(15.0 * np.ceil(high / 15.0), 360.0))


def cones(found: Mapping[str, Cone], title: str = "") -> Figure:
    """Unstable sectors as bars with the uncertainty of their edges, beside the smallest W2n with its drift.

    Parameters
    ----------
    found : mapping of label to Cone
        From `rd.instability_cone`; cones of stress probes are shown in directions of strain.
    title : str
        Above.

    Notes
    -----
    Open bars: the smallest W2n does not exceed the drift. An edge without an error bar and with a question
    mark could be made by the drift alone. Right: the bar about a value is the drift's share in it.
    """
    sectors = [sector for cone in found.values() for sector in cone.strain_sectors]
    low, high = direction_range([first for first, _ in sectors], [last for _, last in sectors])
    figure = new_figure(7.4, 1.5 + 0.34 * len(found))
    with mpl.rc_context(RC):
        left, right = figure.subplots(1, 2, sharey=True, width_ratios=(2.2, 1.0))
        for row, cone in enumerate(found.values()):
            _sector_bars(left, row, cone)
            colour = NEGATIVE if cone.smallest_w2n < 0.0 else COLOURS[0]
            right.errorbar(
                cone.smallest_w2n, row, xerr=cone.drift_share, fmt="o", ms=4.5, color=colour, capsize=2.5, lw=1.0,
                mfc=colour if cone.is_significant else "white",
            )  # fmt: skip
        landmarks([left], low, high)
        left.set_yticks(range(len(found)), list(found))
        left.set_ylim(len(found) - 0.4, -0.6)
        left.set_xlim(low, high)
        left.xaxis.set_major_locator(mpl.ticker.MultipleLocator(60 if high - low > 180.0 else 15))
        left.set_xlabel(r"direction of strain increment $\alpha$  [deg]")
        left.tick_params(axis="y", length=0)
        right.axvline(0.0, color=INK, lw=0.6)
        right.set_xlabel(r"smallest $W_{2n}$")
        right.margins(x=0.12)
        right.tick_params(axis="y", length=0)
        figure.suptitle(title, x=0.02, ha="left")
    return figure


def _sector_bars(axes: Axes, row: int, cone: Cone) -> None:
    if not cone.strain_sectors:
        say_none(axes, row)
    face = mpl.colors.to_rgba(NEGATIVE, 0.35 * cone.is_significant)
    for sector, uncertainty in zip(cone.strain_sectors, cone.strain_edge_uncertainty, strict=True):
        for first, last in (np.add(sector, turn) for turn in TURNS):
            axes.barh(row, last - first, left=first, height=0.5, facecolor=face, edgecolor=NEGATIVE, lw=0.8)
            for at, width in zip((first, last), uncertainty, strict=True):
                if is_unknown(width):
                    axes.annotate("?", (at, row), ha="center", va="center", color=INK, fontsize=9)
                else:
                    axes.errorbar(at, row, xerr=width, fmt="none", color=INK, capsize=3, lw=1.1, capthick=1.1)


def say_none(axes: Axes, height: float, unit: str = "data") -> None:
    """The word for a state without a cone, in the middle of the axes and at this height."""
    where = ("axes fraction", unit)
    axes.annotate("none", (0.5, height), xycoords=where, ha="center", va="center", color=GREY, fontsize=8)


def draw_sector(axes: Axes, abscissa, first, last, **look: Any) -> None:
    """Fill between two curves of directions in degrees, also across 0."""
    for turn in TURNS:
        axes.fill_between(abscissa, first + turn, last + turn, lw=0, **look)


def draw_edges(axes: Axes, abscissa, alpha, uncertainty, colour: str, link: str = "") -> None:
    """Edges in degrees as dots with error bars; open dots, without, where the drift alone could make the edge."""
    is_known = ~is_unknown(uncertainty)
    for turn in TURNS:
        axes.errorbar(
            abscissa, alpha + turn, yerr=np.where(is_known, uncertainty, np.nan), fmt=f"o{link}", ms=3, lw=1.0,
            color=colour, ecolor=INK, elinewidth=0.9, capsize=1.4,
        )  # fmt: skip
        axes.plot(abscissa, np.where(is_known, np.nan, alpha + turn), "o", mfc="white", mec=colour, ms=4, zorder=3)


def landmarks(row: Sequence[Axes], low: float, high: float, upright: bool = True) -> None:
    """Thin lines at the directions of common tests between `low` and `high` degrees, named at the last of the axes.

    Parameters
    ----------
    upright : bool
        Whether directions are abscissas, and the names above; if not, ordinates, and the names to the right.
    """
    look: Any = {"fontsize": 7, "color": GREY, "linespacing": 1.0}
    last = row[-1]
    for name, alpha in LANDMARKS:
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
    """Smallest W2n and edges of the widest sector against the size of the probes, state by state.

    Parameters
    ----------
    tables : mapping of label to xarray.Dataset
        From `rd.cones_by_amplitude`.
    title : str
        Above.

    Notes
    -----
    Grey: values that the drift of the null probe could make; open dots do not exceed it, nor do the edges of open dots.
    Blue: the plateau, where the smallest W2n does not depend on the size.

    Raises
    ------
    InvalidInput
        If a table has no norms.
    """
    for label, table in tables.items():
        if "norm" not in table.dims or "is_plateau" not in table:
            raise InvalidInput(f"a figure of amplitudes needs tables of rd.cones_by_amplitude, {label!r} is none")
    low, high = direction_range(
        np.concatenate([t.edge_from.values.ravel() for t in tables.values()]),
        np.concatenate([t.edge_to.values.ravel() for t in tables.values()]),
    )
    figure = new_figure(0.8 + 3.3 * len(tables), 4.6)
    with mpl.rc_context(RC):
        grid = figure.subplots(2, len(tables), sharex="col", sharey="row", squeeze=False, height_ratios=(3, 2))
        for (upper, lower), (label, table) in zip(grid.T, tables.items(), strict=True):
            _amplitude_column(upper, lower, table)
            upper.set_title(f"{label}\n", loc="left")
            plateau = table.plateau_verdict if table.is_plateau.any() else "none"
            upper.annotate(f"plateau {plateau}", (0.0, 1.03), xycoords="axes fraction", fontsize=8, color=COLOURS[0])
            unit = "" if table.attrs["kind"] == "strain" else "  [Pa]"
            lower.set_xlabel(rf"norm of the {table.attrs['kind']} increment{unit}")
        smallest = np.concatenate([table.smallest_w2n.values for table in tables.values()])
        grid[0, 0].set_ylim(min(-0.4, 1.15 * np.nanmin(smallest)), max(0.4, 1.15 * np.nanmax(smallest)))
        grid[0, 0].set_ylabel(r"smallest $W_{2n}$")
        grid[1, 0].set_ylabel("edges of the widest\nunstable sector  [deg]")
        grid[1, 0].set_ylim(low, high)
        grid[1, 0].yaxis.set_major_locator(mpl.ticker.MultipleLocator(60 if high - low > 180.0 else 15))
        figure.suptitle(title, x=0.02, ha="left")
    return figure


def _amplitude_column(upper: Axes, lower: Axes, table: xr.Dataset) -> None:
    norm, smallest, sure = table.norm.values, table.smallest_w2n.values, table.is_significant.values
    share = np.minimum(np.nan_to_num(table.drift_share.values, nan=2.0), 2.0)
    upper.fill_between(norm, -share, share, color=FAINT, lw=0, label="drift")
    upper.axhline(0.0, color=INK, lw=0.6)
    upper.plot(norm, smallest, "-", color=NEGATIVE, lw=1.2)
    upper.plot(norm[sure], smallest[sure], "o", color=NEGATIVE, ms=4)
    upper.plot(norm[~sure], smallest[~sure], "o", mfc="white", mec=NEGATIVE, ms=4.5)
    upper.set_xscale("log")
    for axes in (upper, lower):
        if table.is_plateau.any():
            axes.axvspan(table.plateau_from, table.plateau_to, color=COLOURS[4], alpha=0.18, lw=0, zorder=0)
    if not table.n_sectors.any():
        say_none(lower, 0.5, "axes fraction")
    ends = [table[name].isel(sector=0).values for name in ("edge_from", "edge_to")]
    draw_sector(lower, norm, *ends, color=NEGATIVE, alpha=0.15)
    for values, name in zip(ends, ("edge_from_uncertainty", "edge_to_uncertainty"), strict=True):
        draw_edges(lower, norm, values, table[name].isel(sector=0).values, NEGATIVE, "-")
