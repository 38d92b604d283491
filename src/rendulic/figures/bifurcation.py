"""The bifurcation map: unstable directions against stress ratio."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np

from rendulic.errors import InvalidInput
from rendulic.figures.cones import GREY, LANDMARKS, direction_range
from rendulic.figures.style import COLOURS, FAINT, INK, NEGATIVE, RC, new_figure

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
    Red: between the edges of the widest sector, their median for several specimens, with quartiles about them; dots with
    error bars are the edges of all sectors of each specimen whose W2n exceeds the drift. Dashed line: the first
    stress ratio with W2 = 0 (median), and grey the bracket, from the last positive to the first negative of all specimens. Beneath, open
    dots do not exceed the drift.

    Raises
    ------
    InvalidInput
        If a table is no bifurcation map.
    """
    for label, table in maps.items():
        if "eta" not in table.dims or "first_eta" not in table:
            raise InvalidInput(f"a figure of bifurcation maps needs tables of rd.bifurcation_map, {label!r} is none")
    edges = [np.concatenate([t[name].where(t.is_unstable).values.ravel() for t in maps.values()]) for name in ("edge_from", "edge_to")]  # fmt: skip
    low, high = direction_range(*edges)
    figure = new_figure(0.9 + 2.5 * max(len(maps), 2), 4.9)
    with mpl.rc_context(RC):
        grid = figure.subplots(2, len(maps), sharex="col", sharey="row", squeeze=False, height_ratios=(3, 1.7))
        for (upper, lower), (label, table) in zip(grid.T, maps.items(), strict=True):
            _first_eta(upper, lower, table)
            _edges(upper, table, high)
            _smallest(lower, table)
            upper.set_title(f"{label}\n", loc="left")
            upper.annotate(_first_words(table), (0.0, 1.03), xycoords="axes fraction", fontsize=8, color=GREY)
            lower.set_xlabel(r"stress ratio $\eta = q/p$")
        upper = grid[0, 0]
        upper.set_ylim(low, high)
        upper.yaxis.set_major_locator(mpl.ticker.MultipleLocator(60 if high - low > 180.0 else 15))
        upper.set_ylabel(r"direction of strain increment $\alpha$  [deg]")
        grid[1, 0].set_ylabel(r"smallest $W_{2n}$")
        _landmarks(list(grid[0]), low, high)
        figure.suptitle(title, x=0.02, ha="left")
    return figure


def _first_words(table: xr.Dataset) -> str:
    first = table.first_eta.values
    known = np.isfinite(first)
    count = len(first)
    if not known.any():
        reasons = set(table.first_eta_reason.values.tolist())
        return reasons.pop().replace("W2", "$W_2$") if len(reasons) == 1 else "no first stress ratio"
    if count == 1:
        return rf"$W_2 = 0$ first at $\eta$ = {first[0]:.3g} ({table.first_eta_from[0]:.3g} to {table.first_eta_to[0]:.3g})"
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


def _edges(axes: Axes, table: xr.Dataset, high: float) -> None:
    eta, several = table.eta.values, table.sizes["specimen"] > 1
    ends = [table[f"edge_{end}_summary"].sel(statistic="median").values for end in ("from", "to")]
    # a sector across 360 degrees shows its beginning only
    axes.fill_between(eta, ends[0], np.minimum(ends[1], high), color=NEGATIVE, alpha=0.2, lw=0)
    for end, middle in zip(("from", "to"), ends, strict=True):
        axes.plot(eta, middle, "-", color=NEGATIVE, lw=1.4)
        if several:
            low, up = (table[f"edge_{end}_summary"].sel(statistic=f"{q}_quartile").values for q in ("lower", "upper"))
            axes.fill_between(eta, low, up, color=COLOURS[0], alpha=0.2, lw=0)
        shift = np.linspace(-0.5, 0.5, table.sizes["specimen"]) * several * 0.15 * np.diff(eta).min(initial=1.0)
        for k in range(table.sizes["specimen"]):
            one = table.isel(specimen=k)
            for sector in range(table.sizes["sector"]):
                values = one[f"edge_{end}"].isel(sector=sector).where(one.is_unstable).values
                error = one[f"edge_{end}_uncertainty"].isel(sector=sector).values
                axes.errorbar(
                    eta + shift[k], np.where(values > high, values - 360.0, values), yerr=error, fmt="o", ms=2.5,
                    color=COLOURS[0] if several else NEGATIVE, ecolor=INK, elinewidth=0.9, capsize=1.5,
                )  # fmt: skip


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


def _landmarks(row: list[Axes], low: float, high: float) -> None:
    """Thin lines at the directions of common tests, named right of the last panel."""
    for name, alpha in LANDMARKS:
        if low < alpha < high:
            for axes in row:
                axes.axhline(alpha, color=FAINT, lw=0.8, zorder=0)
            row[-1].annotate(
                name.replace(" ", "\n"), (1.0, alpha), xycoords=("axes fraction", "data"), xytext=(4, 0),
                textcoords="offset points", fontsize=7, color=GREY, va="center", linespacing=1.0,
            )  # fmt: skip
