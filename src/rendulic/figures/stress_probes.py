"""Stress probes compared with strain probes of the same states, with matplotlib."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import matplotlib as mpl

from rendulic.figures.draw import draw
from rendulic.figures.style import COLOURS, FAINT, INK, NEGATIVE, RC, new_figure
from rendulic.views.stress_probes import StressProbesView, stress_probes

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["stress_on_strain"]


def stress_on_strain(tables: Mapping[str, xr.Dataset], title: str = "") -> Figure:
    """W2n of stress probes (dots) and of strain probes of equal direction and size (rings), a panel per state.

    Parameters
    ----------
    tables : mapping of label to xarray.Dataset
        From `rendulic.probing.consistency.stress_on_strain`.
    title : str
        Above all.
    """
    return _stress_probes(stress_probes(tables, title))


@draw.register(StressProbesView)
def _stress_probes(view: StressProbesView) -> Figure:
    columns = min(len(view.panels), 4)
    rows = -(-len(view.panels) // columns)
    figure = new_figure(0.6 + 2.4 * columns, 1.2 + 1.7 * rows)
    with mpl.rc_context(RC):
        grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for axes in grid.flat[len(view.panels) :]:
            axes.set_axis_off()
        for axes, one in zip(grid.flat, view.panels, strict=False):
            axes.axhspan(-1.05, 0.0, color=NEGATIVE, alpha=0.07, lw=0)
            axes.axhline(0.0, color=NEGATIVE, lw=0.8, ls="--")
            axes.vlines(one.strain_alpha, one.expected, one.found, color=FAINT, lw=1.0)
            axes.plot(one.strain_alpha, one.expected, "o", mfc="white", mec=INK, ms=4.5, label="strain probes")
            axes.plot(one.strain_alpha, one.found, ".", color=COLOURS[0], ms=5, label="stress probes")
            axes.set_title(
                f"{one.label}\nrms {one.rms:.2g}, {one.n_compared} of {len(one.found)} compared", loc="left", fontsize=8
            )
        grid[0, 0].set_xticks(range(0, 361, 90))
        grid[0, 0].set_ylim(min(-0.2, *(1.1 * float(one.found.min()) for one in view.panels)), 1.1)
        figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
        for axes in grid[:, 0]:
            axes.set_ylabel(r"$W_{2n}$")
        for axes in grid[-1]:
            axes.set_xlabel("direction of strain [degrees]")
        figure.suptitle(view.title, x=0.02, ha="left")
    return figure
