"""Figure 4 of the paper: macroscopic against microscopic second-order work."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib as mpl

from rendulic.figures.style import COLOURS, INK, RC, new_figure

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["macro_micro"]


def macro_micro(probes: xr.Dataset, title: str = "") -> Figure:
    """W2 of the boundary, of contacts and grains, and of the paper's truncated sum, against alpha.

    Below, the differences from the boundary value: the exact form has none that could be seen.

    Parameters
    ----------
    probes : xarray.Dataset
        From `rd.probe` on grains, at one norm.
    """
    figure = new_figure(5.6, 5.0)
    with mpl.rc_context(RC):
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
        data = probes.sortby("alpha")
        alpha, exact = data.alpha, data.w2_contacts + data.w2_grains
        for axes in (upper, lower):
            axes.axvspan(60, 240, color="#f1f1f1", lw=0)
            axes.axhline(0.0, color=INK, lw=0.6)
        upper.plot(alpha, data.w2_boundary, color=COLOURS[0], label=r"macro: $\sum_w \delta F\cdot\delta u\,/\,V$")
        upper.plot(
            alpha,
            exact,
            "o",
            ms=4,
            mfc="none",
            mec=COLOURS[1],
            label="micro: all contacts and grains (exact)",
        )
        upper.plot(alpha, data.w2_paper, "x", ms=4, color=COLOURS[2], label="micro: contacts in both states (paper)")
        upper.plot(
            alpha,
            data.w2_grains,
            ":",
            color=COLOURS[3],
            label=r"inertial term $\sum_p \delta f\cdot\delta x\,/\,V$",
        )
        upper.set_ylabel(r"$W_2$  [J/m$^3$]")
        figure.suptitle(title)
        upper.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
        largest = float(abs(data.w2_boundary).max())
        lower.plot(alpha, 100 * (data.w2_paper - data.w2_boundary) / largest, "x-", ms=4, lw=0.8, color=COLOURS[2],
                   label="paper's form")  # fmt: skip
        lower.plot(
            alpha,
            100 * (exact - data.w2_boundary) / largest,
            "o-",
            ms=3,
            lw=0.8,
            color=COLOURS[1],
            label="exact form",
        )
        lower.set_ylabel("micro - macro\n[% of largest W$_2$]")
        lower.set_xlabel(r"direction of strain increment $\alpha$  [deg]")
        lower.set_xticks(range(0, 361, 60))
        lower.legend(loc="best")
    return figure
