"""Second-order work of one increment, by class of contact, with matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib as mpl

from rendulic.figures.draw import draw
from rendulic.figures.style import COLOURS, INK, NEGATIVE, RC, new_figure
from rendulic.views import work_by_class as view_of
from rendulic.views.work_by_class import WorkByClass

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rendulic.probing.second_order_work import SecondOrderWork

__all__ = ["work_by_class"]


def work_by_class(work: SecondOrderWork, title: str = "") -> Figure:
    """Bars of each class of contact and of the inertial term, which together are that of the walls.

    Parameters
    ----------
    work : SecondOrderWork
        Of `rd.second_order_work`.
    title : str
        Above.
    """
    return _work_by_class(view_of.work_by_class(work, title))


@draw.register(WorkByClass)
def _work_by_class(view: WorkByClass) -> Figure:
    values = view.works
    figure = new_figure()
    with mpl.rc_context(RC):
        axes = figure.add_subplot()
        colours = [NEGATIVE if value < 0.0 else COLOURS[0] for value in values.values()]
        axes.bar(list(values), list(values.values()), color=colours, width=0.7)
        axes.axhline(0.0, color=INK, lw=0.6)
        axes.axvline(len(values) - 1.5, color=INK, lw=0.4)
        axes.tick_params(axis="x", rotation=35)
        axes.set_ylabel(r"$W_2$  [J/m$^3$]")
        axes.set_title(view.title, loc="left")
    return figure
