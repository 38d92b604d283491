"""Stress probes laid on strain probes of the same states."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np

from rendulic.figures.style import COLOURS, FAINT, INK, NEGATIVE, RC, new_figure

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["stress_on_strain"]


def stress_on_strain(tables: Mapping[str, xr.Dataset], title: str = "") -> Figure:
    """W2n of stress probes (full) and of strain probes of equal direction and size (rings), a panel per state.

    Parameters
    ----------
    tables : mapping of label to xarray.Dataset
        From `rendulic.probing.consistency.stress_on_strain`.
    title : str
        Above all.
    """
    columns = min(len(tables), 4)
    rows = -(-len(tables) // columns)
    figure = new_figure(0.6 + 2.4 * columns, 1.2 + 1.7 * rows)
    with mpl.rc_context(RC):
        grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for axes in grid.flat[len(tables) :]:
            axes.set_axis_off()
        for axes, (label, table) in zip(grid.flat, tables.items(), strict=False):
            order = np.argsort(table.strain_alpha.values)
            angle = table.strain_alpha.values[order]
            found, expected = table.w2_normalised.values[order], table.expected.values[order]
            axes.axhspan(-1.05, 0.0, color=NEGATIVE, alpha=0.07, lw=0)
            axes.axhline(0.0, color=NEGATIVE, lw=0.8, ls="--")
            axes.vlines(angle, expected, found, color=FAINT, lw=1.0)
            axes.plot(angle, expected, "o", mfc="white", mec=INK, ms=4.5, label="strain probes")
            axes.plot(angle, found, ".", color=COLOURS[0], ms=5, label="stress probes")
            axes.set_title(
                f"{label}\nrms {table.attrs['rms']:.2g} of {table.attrs['n_compared']}", loc="left", fontsize=8
            )
        grid[0, 0].set_xticks(range(0, 361, 90))
        grid[0, 0].set_ylim(min(-0.2, *(1.1 * float(table.w2_normalised.min()) for table in tables.values())), 1.1)
        figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
        for axes in grid[:, 0]:
            axes.set_ylabel(r"$W_{2n}$")
        for axes in grid[-1]:
            axes.set_xlabel("direction of strain [degrees]")
        figure.suptitle(title, x=0.02, ha="left")
    return figure
