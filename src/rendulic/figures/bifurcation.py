"""The bifurcation map: unstable directions against stress ratio."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np

from rendulic.figures.cones import GREY, TURNS, direction_range, draw_edges, draw_sector, landmarks, say_none
from rendulic.figures.style import COLOURS, FAINT, INK, NEGATIVE, RC, new_figure
from rendulic.foundation.errors import InvalidInput

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["bifurcation_map"]


def bifurcation_map(maps: Mapping[str, xr.Dataset], title: str = "") -> Figure:
    """Unstable directions against stress ratio, with the smallest W2n beneath, one column for each material.

    Parameters
    ----------
    maps : mapping of label to xarray.Dataset
        From `rd.bifurcation_map`, e.g. loose grains, dense grains, and the Chang-Hicher model.
    title : str
        Above.

    Notes
    -----
    Red: between the edges of the widest sector, their median for several specimens, with quartiles about them; dots
    with error bars are the edges of all sectors of each specimen whose W2n exceeds the drift, open dots those that the
    drift alone could make. Dashed line: the first stress ratio with W2 = 0 (median), and grey the bracket, from the
    last positive to the first negative of all specimens. Beneath, open dots do not exceed the drift.

    Raises
    ------
    InvalidInput
        If a table is no bifurcation map.
    """
    for label, table in maps.items():
        if "eta" not in table.dims or "first_eta" not in table:
            raise InvalidInput(f"a figure of bifurcation maps needs tables of rd.bifurcation_map, {label!r} is none")
    low, high = direction_range(
        *(
            np.concatenate([table[name].where(table.is_unstable).values.ravel() for table in maps.values()])
            for name in ("edge_from", "edge_to")
        )
    )
    figure = new_figure(0.9 + 2.5 * max(len(maps), 2), 4.9)
    with mpl.rc_context(RC):
        grid = figure.subplots(2, len(maps), sharex="col", sharey="row", squeeze=False, height_ratios=(3, 1.7))
        for (upper, lower), (label, table) in zip(grid.T, maps.items(), strict=True):
            _first_eta(upper, lower, table)
            _edges(upper, table)
            _smallest(lower, table)
            upper.set_title(f"{label}\n", loc="left")
            upper.annotate(_first_words(table), (0.0, 1.03), xycoords="axes fraction", fontsize=8, color=GREY)
            lower.set_xlabel(r"stress ratio $\eta = q/p$")
        upper = grid[0, 0]
        upper.set_ylim(low, high)
        upper.yaxis.set_major_locator(mpl.ticker.MultipleLocator(60 if high - low > 180.0 else 15))
        upper.set_ylabel(r"direction of strain increment $\alpha$  [deg]")
        grid[1, 0].set_ylabel(r"smallest $W_{2n}$")
        landmarks(grid[0], low, high, upright=False)
        figure.suptitle(title, x=0.02, ha="left")
    return figure


def _first_words(table: xr.Dataset) -> str:
    first = table.first_eta.values
    known = np.isfinite(first)
    count = len(first)
    if not known.any():
        reasons = set(table.first_eta_reason.values.tolist())
        return (
            reasons.pop().replace("W2", "$W_2$").replace("eta", r"$\eta$")
            if len(reasons) == 1
            else "no first stress ratio"
        )
    if count == 1:
        low, high = float(table.first_eta_from[0]), float(table.first_eta_to[0])
        return rf"$W_2 = 0$ first at $\eta$ = {first[0]:.3g} ({low:.3g} to {high:.3g})"
    return rf"$W_2 = 0$ first at $\eta$ = {np.median(first[known]):.2g}, {known.sum()} of {count} specimens"


def _first_eta(upper: Axes, lower: Axes, table: xr.Dataset) -> None:
    first = table.first_eta.values
    if not np.isfinite(first).any():
        return
    for axes in (upper, lower):
        axes.axvspan(
            float(table.first_eta_from.min()), float(table.first_eta_to.max()), color=FAINT, alpha=0.5, lw=0, zorder=0
        )
        axes.axvline(float(np.nanmedian(first)), color=INK, lw=1.0, ls="--")


def _edges(axes: Axes, table: xr.Dataset) -> None:
    eta, several = table.eta.values, table.sizes["specimen"] > 1
    ends = [table[f"edge_{end}_summary"].sel(statistic="median").values for end in ("from", "to")]
    if not table.is_unstable.any():
        say_none(axes, 0.5, "axes fraction")
    draw_sector(axes, eta, *ends, color=NEGATIVE, alpha=0.2)
    for end, middle in zip(("from", "to"), ends, strict=True):
        axes.plot(eta, np.add.outer(middle, TURNS), "-", color=NEGATIVE, lw=1.4)
        if several:
            low, up = (table[f"edge_{end}_summary"].sel(statistic=f"{q}_quartile").values for q in ("lower", "upper"))
            draw_sector(axes, eta, low, up, color=COLOURS[0], alpha=0.2)
        shift = np.linspace(-0.5, 0.5, table.sizes["specimen"]) * several * 0.15 * np.diff(eta).min(initial=1.0)
        for k in range(table.sizes["specimen"]):
            one = table.isel(specimen=k)
            for sector in range(table.sizes["sector"]):
                values = one[f"edge_{end}"].isel(sector=sector).where(one.is_unstable).values
                error = one[f"edge_{end}_uncertainty"].isel(sector=sector).values
                draw_edges(axes, eta + shift[k], values, error, COLOURS[0] if several else NEGATIVE)


def _smallest(axes: Axes, table: xr.Dataset) -> None:
    eta = table.eta.values
    axes.axhline(0.0, color=INK, lw=0.6)
    for k in range(table.sizes["specimen"]):
        one = table.isel(specimen=k)
        values, sure = one.smallest_w2n.values, one.is_significant.values
        axes.plot(eta, values, "-", color=COLOURS[0], lw=0.8, alpha=0.7)
        axes.plot(eta[sure], values[sure], "o", color=COLOURS[0], ms=3)
        axes.plot(eta[~sure], values[~sure], "o", mfc="white", mec=COLOURS[0], ms=3.5)
    if table.sizes["specimen"] > 1:
        axes.plot(eta, table.smallest_w2n_summary.sel(statistic="median"), "-", color=INK, lw=1.6)
