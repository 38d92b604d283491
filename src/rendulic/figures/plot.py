"""The figure that belongs to a result, whatever result it is."""

from __future__ import annotations

from functools import singledispatch
from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

from rendulic.figures.anatomy import anatomy
from rendulic.figures.anatomy_controls import cluster_controls
from rendulic.figures.bifurcation import bifurcation_map
from rendulic.figures.bursts import burst_table
from rendulic.figures.circular import circular_diagram, circular_diagrams
from rendulic.figures.cones import cones
from rendulic.figures.draw import draw
from rendulic.figures.element import element_tests
from rendulic.figures.forces import forces
from rendulic.figures.stereogram import stereogram
from rendulic.figures.work_by_class import work_by_class
from rendulic.foundation.errors import InvalidInput
from rendulic.probing.anatomy_controls import ClusterControls
from rendulic.probing.cone import Cone
from rendulic.probing.second_order_work import SecondOrderWork
from rendulic.specimen.snapshot import Snapshot
from rendulic.views.loading import loading_curves

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["plot"]


def plot(result: Any, title: str = "") -> Figure:
    """The figure of a result: of probes their circular diagram, of a cone its sectors, and so on.

    Parameters
    ----------
    result : Cone, ClusterControls, SecondOrderWork, Snapshot or xarray.Dataset
        Of `rd.probe`, `rd.bursts`, `rd.bifurcation_map`, `rd.anatomy`, or a loading.
    title : str
        Above.

    Raises
    ------
    InvalidInput
        If no figure belongs to it.

    Examples
    --------
    >>> import rendulic as rd
    >>> sand = rd.ChangHicher().at(pressure=300e3, void_ratio=0.9)
    >>> probes = rd.probe(sand, rd.directions.rendulic(step=10), norm=1e-7, n_steps=1)
    >>> len(rd.plot(probes, "loose sand").axes)
    1
    """
    return _figure(result, title)


@singledispatch
def _figure(result: Any, title: str) -> Figure:
    if hasattr(result, "data_vars"):
        return _of_dataset(result, title)
    raise InvalidInput(f"no figure belongs to {type(result).__name__}: see rd.figures for all that there are")


@_figure.register
def _(result: Cone, title: str) -> Figure:
    return cones({result.kind: result}, title)


@_figure.register
def _(result: ClusterControls, title: str) -> Figure:
    return cluster_controls({"": result}, title)


@_figure.register
def _(result: SecondOrderWork, title: str) -> Figure:
    return work_by_class(result, title)


@_figure.register
def _(result: Snapshot, title: str) -> Figure:
    return forces(result, title)


def _of_dataset(data: xr.Dataset, title: str) -> Figure:
    """Which result it is, told by what it has."""
    if "verdict" in data and "alpha" in data.dims:
        return burst_table({"bursts": data}, title)
    if "first_eta" in data:
        return bifurcation_map({"": data}, title)
    if "pair" in data.dims:
        return anatomy(data, title)
    if "plane" in data.dims:
        return element_tests({"": data}, title)
    if "w2_normalised" in data and "direction" in data.dims:
        return stereogram(data.isel(norm=-1) if "norm" in data.dims else data, title)
    if "w2_normalised" in data and "alpha" in data.dims:
        return circular_diagrams({"": data}, title) if "norm" in data.dims else circular_diagram({"": data}, title)
    if {"q", "eps_1"} <= set(data.data_vars):
        return draw(loading_curves({"": data}, title=title))
    raise InvalidInput(
        f"no figure belongs to a dataset of {', '.join(map(str, data.data_vars)) or 'nothing'}: see rd.figures for all "
        "that there are"
    )
