"""Macroscopic against microscopic second-order work (Fig. 4 of the paper), with matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib as mpl

from rendulic.figures.draw import draw
from rendulic.figures.style import COLOURS, INK, RC, new_figure
from rendulic.views import macro_micro as view_of
from rendulic.views.macro_micro import MacroMicro

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["macro_micro"]

GREY = "#777777"


def macro_micro(probes: xr.Dataset, title: str = "") -> Figure:
    """W2 of the boundary, of contacts and grains, and of the paper's truncated sum, against alpha.

    Below, the differences from the boundary value: the exact form has none that could be seen.

    Parameters
    ----------
    probes : xarray.Dataset
        From `rd.probe` on grains, at one norm.
    """
    return _macro_micro(view_of.macro_micro({"": probes}, title))


@draw.register(MacroMicro)
def _macro_micro(view: MacroMicro) -> Figure:
    """The last of the view's states."""
    works = view.states[-1]
    figure = new_figure(5.6, 5.0)
    with mpl.rc_context(RC):
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
        for axes in (upper, lower):
            axes.axhline(0.0, color=INK, lw=0.6)
        for k, single in enumerate(works.single):
            upper.plot(
                works.alpha, single, color=GREY, lw=0.5, alpha=0.5, label=None if k else "macro, single packings"
            )
        if works.band is not None:
            upper.fill_between(works.alpha, *works.band, color=COLOURS[0], alpha=0.25, lw=0)
        upper.plot(works.alpha, works.boundary, color=COLOURS[0], label=r"macro: $\sum_w \delta F\cdot\delta u\,/\,V$")
        upper.plot(
            works.alpha,
            works.micro,
            "o",
            ms=4,
            mfc="none",
            mec=COLOURS[1],
            label="micro: all contacts and grains (exact)",
        )
        upper.plot(
            works.alpha, works.paper, "x", ms=4, color=COLOURS[2], label="micro: contacts in both states (paper)"
        )
        upper.plot(
            works.alpha,
            works.inertial,
            ":",
            color=COLOURS[3],
            label=r"inertial term $\sum_p \delta f\cdot\delta x\,/\,V$",
        )
        upper.set_ylabel(r"$W_2$  [J/m$^3$]")
        figure.suptitle(view.title, x=0.02, ha="left")
        upper.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
        share = 100.0 / float(abs(works.boundary).max())
        lower.plot(works.alpha, share * (works.paper - works.boundary), "x-", ms=4, lw=0.8, color=COLOURS[2],
                   label="paper's form")  # fmt: skip
        lower.plot(works.alpha, share * (works.micro - works.boundary), "o-", ms=3, lw=0.8, color=COLOURS[1],
                   label="exact form")  # fmt: skip
        lower.set_ylabel("micro \N{MINUS SIGN} macro\n[% of largest W$_2$]")
        lower.set_xlabel(r"direction of strain increment $\alpha$  [deg]")
        lower.set_xticks(range(0, 361, 60))
        lower.legend(loc="best")
    return figure
