"""Where second-order work comes from: contacts, grains and clusters, for one probe and against direction."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np

from rendulic.figures.draw import draw
from rendulic.figures.style import COLOURS, FAINT, INK, NEGATIVE, RC, new_figure, sequence
from rendulic.views import anatomy as anatomy_view
from rendulic.views.anatomy import AnatomyAround, AnatomyView

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["anatomy", "anatomy_around"]

POSITIVE = COLOURS[0]
SHOWN = 0.1  # of the largest work of a grain: what the map shows


def anatomy(found: xr.Dataset, title: str = "") -> Figure:
    """One probe in six panels: classes, distribution, rose, networks, map, clusters.

    Parameters
    ----------
    found : xarray.Dataset
        From `rd.anatomy`.
    title : str
        Above.

    Notes
    -----
    Map: grains seen along axis 3, coloured if they hold more than a tenth of the largest work of a grain; black dots
    are the contacts that carry half of the negative work.
    """
    return _anatomy(anatomy_view.anatomy(found, title))


@draw.register(AnatomyView)
def _anatomy(view: AnatomyView) -> Figure:
    found = view.found
    figure = new_figure(9.6, 6.0)
    with mpl.rc_context(RC):
        grid = figure.add_gridspec(2, 3)
        _classes(figure.add_subplot(grid[0, 0]), view)
        _distribution(figure.add_subplot(grid[0, 1]), found)
        _rose(figure.add_subplot(grid[0, 2], projection="polar"), found)
        _networks(figure.add_subplot(grid[1, 0]), found)
        _map(figure.add_subplot(grid[1, 1]), found)
        _clusters(figure.add_subplot(grid[1, 2]), found)
        figure.suptitle(view.title, x=0.02, ha="left")
    return figure


def _classes(axes: Axes, view: AnatomyView) -> None:
    names, values = list(view.by_class), list(view.by_class.values())
    axes.bar(names, values, color=[NEGATIVE if value < 0.0 else POSITIVE for value in values], width=0.7)
    axes.axhline(0.0, color=INK, lw=0.6)
    axes.axvline(len(names) - 1.5, color=FAINT, lw=0.8)
    axes.tick_params(axis="x", rotation=35)
    axes.set_ylabel(r"$W_2$  [J/m$^3$]")
    axes.set_title("by class of contact", loc="left")


def _distribution(axes: Axes, found: xr.Dataset) -> None:
    work = found.w2.values / np.abs(found.w2.values).mean()
    for values, colour, word in ((work[work > 0.0], POSITIVE, "positive"), (-work[work < 0.0], NEGATIVE, "negative")):
        if len(values):
            ordered = np.sort(values)[::-1]
            axes.plot(ordered, np.arange(1, len(ordered) + 1) / len(work), color=colour, label=word)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlim(1e-4, None)
    axes.set_xlabel(r"$|w_2|$ of a contact / mean")
    axes.set_ylabel("share of contacts beyond")
    axes.set_title(f"per contact: {100 * float(found.negative_contacts):.0f} % negative", loc="left")
    axes.legend(loc="lower left")


def _rose(axes: Any, found: xr.Dataset) -> None:
    """Number of contacts by direction per solid angle, those of negative work within; axis 1 upward."""
    polar, width = np.radians(found.polar.values), np.pi / 2.0 / found.sizes["polar"]
    # a bin of the polar angle is a ring of this solid angle
    ring = np.cos(polar - 0.5 * width) - np.cos(polar + 0.5 * width)
    total = float(found.contacts_by_polar.sum()) or 1.0
    for name, colour, word in (
        ("contacts_by_polar", FAINT, "contacts"),
        ("negative_by_polar", NEGATIVE, "negative $w_2$"),
    ):
        density = found[name].values / ring / total
        every = np.concatenate((polar, np.pi - polar, np.pi + polar, 2.0 * np.pi - polar))
        axes.bar(every, np.tile(density, 4), width=width, color=colour, edgecolor="white", lw=0.4, label=word)
    axes.set_theta_zero_location("N")
    axes.set_yticks([])
    axes.set_xticks(np.radians([0, 90, 180, 270]), ["1", "", "", ""])
    axes.spines["polar"].set_visible(False)
    axes.grid(False)
    axes.set_title("normals, per solid angle", loc="left", x=-0.2)
    axes.legend(loc="upper left", bbox_to_anchor=(-0.25, 0.05))


def _networks(axes: Axes, found: xr.Dataset) -> None:
    cells = [(network, slides) for network in found.network.values for slides in found.slides.values]
    values = [float(found.w2_by_network.sel(network=n, slides=s)) for n, s in cells]
    axes.bar(range(len(cells)), values, color=[NEGATIVE if value < 0.0 else POSITIVE for value in values], width=0.7)
    axes.axhline(0.0, color=INK, lw=0.6)
    labels = []
    for network, slides in cells:
        count = int(found.contacts_by_network.sel(network=network, slides=slides))
        negative = int(found.negative_by_network.sel(network=network, slides=slides))
        share = f"{100 * negative / count:.0f} % neg." if count else "none"
        labels.append(f"{network},\n{'sliding' if slides else 'sticking'}\n{count}\n{share}")
    axes.set_xticks(range(len(cells)), labels, fontsize=6.5)
    axes.set_ylabel(r"$W_2$  [J/m$^3$]")
    axes.set_title("strong and weak, sticking and sliding", loc="left")


def _map(axes: Axes, found: xr.Dataset) -> None:
    from rendulic.probing.anatomy import carriers

    work, centre, radius = found.grain_w2.values, found.grain_position.values, found.grain_radius.values
    largest = float(np.abs(work).max()) or 1.0
    shown = np.flatnonzero(np.abs(work) > SHOWN * largest)
    shown = shown[np.argsort(np.abs(work[shown]))]
    circles = [mpl.patches.Circle((centre[k, 1], centre[k, 0]), radius[k]) for k in shown]
    norm = mpl.colors.SymLogNorm(linthresh=SHOWN * largest, linscale=0.4, vmin=-largest, vmax=largest)
    grains = mpl.collections.PatchCollection(circles, cmap="RdBu", norm=norm, alpha=0.75, lw=0)
    grains.set_array(work[shown])
    axes.add_collection(grains)
    carry = carriers(found.w2.values)
    at = found.position.values[carry]
    axes.plot(at[:, 1], at[:, 0], ".", color=INK, ms=2.0)
    axes.set_aspect("equal")
    low, high = centre[:, [1, 0]].min(axis=0) - radius.max(), centre[:, [1, 0]].max(axis=0) + radius.max()
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_xlabel("axis 2 [m]")
    axes.set_ylabel("axis 1 [m]")
    bar = axes.figure.colorbar(grains, ax=axes, ticks=[-largest, 0.0, largest], shrink=0.8)
    bar.ax.set_yticklabels([f"-{largest:.0e}", "0", f"{largest:.0e}"], fontsize=7)
    bar.set_label(r"$W_2$ of a grain [J]", fontsize=7.5)
    axes.set_title(f"{100 * float(found.carriers):.1f} % carry half of the negative", loc="left")


def _clusters(axes: Axes, found: xr.Dataset) -> None:
    """Carriers of both signs where they share no grain, and what chance makes of the displacements."""
    index, kept = found.beyond_index.values, found.beyond_kept.values
    axes.bar([0, 1], index, color=[NEGATIVE, POSITIVE], width=0.6)
    axes.errorbar([2], [kept[1]], [[kept[1] - kept[0]], [kept[2] - kept[1]]], fmt="o", color=INK, ms=4, capsize=4)
    axes.axhline(0.0, color=INK, lw=0.6)
    names = ("carriers of\nnegative", "of positive\nwork", "displacements\nkept")
    axes.set_xticks(range(3), names, fontsize=7)
    axes.set_xlim(-0.6, 2.6)
    axes.set_ylabel("Moran's I beyond a grain")
    axes.set_title("clusters and controls", loc="left")


def anatomy_around(probes: Mapping[str, xr.Dataset], title: str = "") -> Figure:
    """Origin of the second-order work against direction, state by state; grey: what displacements alone make of clusters.

    Parameters
    ----------
    probes : mapping of label to xarray.Dataset
        From `rd.probe(..., anatomy=True)` in the Rendulic plane, at one norm; in the order of the stress ratio.
    title : str
        Above.

    Raises
    ------
    InvalidInput
        If a dataset has no anatomy.
    """
    return _anatomy_around(anatomy_view.anatomy_around(probes, title))


@draw.register(AnatomyAround)
def _anatomy_around(view: AnatomyAround) -> Figure:
    probes = view.probes
    figure = new_figure(9.6, 6.0)
    panels = (
        ("negative_contacts", "share of contacts\nwith negative $w_2$"),
        ("negative_over_positive", "negative over positive work"),
        ("carriers", "share that carries half\nof the negative work"),
        ("sliding", "share of the negative work\nin sliding contacts"),
        ("negative", "Moran's I beyond a grain:\ncarriers of negative work"),
        ("positive", "the same of positive work"),
    )
    with mpl.rc_context(RC):
        grid = figure.subplots(2, 3, sharex=True)
        for axes, (name, label) in zip(grid.T.flat, panels, strict=True):
            axes.axvspan(60, 240, color="#f4f4f4", lw=0)
            for (state, data), colour in zip(probes.items(), sequence(len(probes)), strict=True):
                axes.plot(data.alpha, _drawn(data, name), "o-", ms=2.5, lw=1.0, color=colour, label=state)
                if name == "negative":
                    low, high = (data.beyond_kept.sel(bound=bound) for bound in ("low", "high"))
                    axes.fill_between(data.alpha, low, high, color=FAINT, alpha=0.3, lw=0)
            axes.set_ylabel(label)
        for axes in grid[1]:
            axes.set_xlabel(r"direction of strain increment $\alpha$  [deg]")
            axes.set_xticks(range(0, 361, 60))
        grid[1, 0].axhline(1.0, color=NEGATIVE, lw=0.8, ls="--")
        ends = [axes.get_ylim() for axes in grid[:, 2]]  # both signs on one scale
        for axes in grid[:, 2]:
            axes.set_ylim(min(low for low, _ in ends), max(high for _, high in ends))
        figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=len(probes))
        figure.suptitle(view.title, x=0.02, ha="left")
    return figure


def _drawn(data: xr.Dataset, name: str) -> xr.DataArray:
    if name == "sliding":
        return data.w2_negative_sliding / data.w2_negative
    return data.beyond_index.sel(sign=name) if name in data.sign.values else data[name]
