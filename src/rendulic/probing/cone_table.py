"""Cones of many states as one labelled table, and what they have in common."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from rendulic.foundation.checks import finite_array
from rendulic.foundation.errors import InvalidInput
from rendulic.probing.cone import Cone
from rendulic.probing.edges import wrap

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["STATISTICS", "circular_quantiles", "cone_table", "with_spread"]

STATISTICS = {"smallest": 0.0, "lower_quartile": 0.25, "median": 0.5, "upper_quartile": 0.75, "largest": 1.0}
LEAST_CONCENTRATION = 0.3  # of directions that have a middle to speak of
# of variables: the label, the unit, and the attribute of a cone
NUMBERS = {
    "smallest_w2n": ("smallest normalised second-order work", "1", "smallest_w2n"),
    "smallest_alpha": ("its direction of strain", "degree", "smallest_strain_alpha"),
    "drift_share": ("what the drift of the null probe has in it", "1", "drift_share"),
    "opening": ("angle of all unstable sectors of strain together", "degree", "strain_opening"),
}
ENDS = {
    "edge_from": ("first direction of an unstable sector", 0, False),
    "edge_to": ("last direction of an unstable sector, beyond the first", 1, False),
    "edge_from_uncertainty": ("uncertainty of the first direction, either way", 0, True),
    "edge_to_uncertainty": ("uncertainty of the last direction, either way", 1, True),
}


def cone_table(cones: np.ndarray, coords: Mapping[str, Any]) -> xr.Dataset:
    """Cones as one table; all directions are those of strain, also of stress probes.

    Parameters
    ----------
    cones : array of Cone or None
        One axis for each of `coords`; None where there is no such state.
    coords : mapping of dimension to its labels
        In the order of the axes.

    Returns
    -------
    xarray.Dataset
        The dimensions of `coords`, and `sector`, the widest first: `edge_from`, `edge_to` (degrees, `edge_to` beyond
        `edge_from`) and their uncertainties, NaN where there are fewer sectors. `smallest_w2n`,
        `smallest_alpha`, `drift_share`, `opening`, `n_sectors`; `is_significant`, whether the smallest value exceeds
        the drift, and `is_unstable`, whether it is negative, too. Numbers of missing states are NaN.
    """
    import xarray as xr

    def each(pick, missing) -> np.ndarray:
        values = [missing if cone is None else pick(cone) for cone in cones.flat]
        return np.array(values).reshape(*cones.shape, *np.shape(missing))

    axes = tuple(coords)
    count = max([1, *(len(cone.sectors) for cone in cones.flat if cone is not None)])
    variables: dict[str, Any] = {}
    for name, (label, unit, attribute) in NUMBERS.items():
        values = each(lambda cone, a=attribute: getattr(cone, a), np.nan)
        variables[name] = (axes, values, {"long_name": label, "units": unit})
    variables["n_sectors"] = (axes, each(lambda cone: len(cone.sectors), 0), {"long_name": "unstable sectors"})
    for name, label, pick in (
        ("is_significant", "smallest value exceeds the drift", lambda cone: cone.is_significant),
        ("is_unstable", "smallest value is negative and exceeds the drift", _is_unstable),
    ):
        variables[name] = (axes, each(pick, False), {"long_name": label})
    for name, (label, end, is_uncertainty) in ENDS.items():
        values = each(lambda cone, e=end, u=is_uncertainty: _ends(cone, e, u, count), np.full(count, np.nan))
        variables[name] = ((*axes, "sector"), values, {"long_name": label, "units": "degree"})
    return xr.Dataset(variables, {**coords, "sector": np.arange(count)}, {"directions": "strain"})


def _is_unstable(cone: Cone) -> bool:
    return cone.smallest_w2n < 0.0 and cone.is_significant


def _ends(cone: Cone, end: int, is_uncertainty: bool, count: int) -> np.ndarray:
    """One end of every sector, or its uncertainty, the widest sector first."""
    widest_first = np.argsort([first - last for first, last in cone.strain_sectors], kind="stable")
    pairs = cone.strain_edge_uncertainty if is_uncertainty else cone.strain_sectors
    values = np.full(count, np.nan)
    values[: len(pairs)] = [pairs[k][end] for k in widest_first]
    return values


def circular_quantiles(angles, shares=(0.25, 0.5, 0.75)) -> tuple[np.ndarray, float]:
    """Quantiles of directions in degrees, counter-clockwise, and their concentration.

    Directions are measured from their mean direction, that of the sum of their unit vectors, so that
    359 and 1 degrees have 0 in their middle. NaN are left out.

    Returns
    -------
    quantiles : array, as `shares`
        Less than half a turn from a mean direction in [0, 360), so that they are in order across 0 degrees, too. NaN if
        the concentration is below 0.3: such directions have no middle.
    concentration : float
        Length of the mean unit vector: 1 if all are alike, 0 if they point everywhere.

    Examples
    --------
    >>> quantiles, concentration = circular_quantiles([350.0, 0.0, 20.0], [0.0, 0.5, 1.0])
    >>> quantiles.round(6).tolist(), round(concentration, 2)
    ([-10.0, 0.0, 20.0], 0.98)
    """
    angles = np.asarray(angles, dtype=float)
    angles = angles[np.isfinite(angles)]
    shares = finite_array("shares of quantiles", shares, (None,))
    if not len(angles):
        return np.full(len(shares), np.nan), float("nan")
    total = np.exp(1j * np.radians(angles)).mean()
    concentration = float(min(abs(total), 1.0))
    if concentration < LEAST_CONCENTRATION:
        return np.full(len(shares), np.nan), concentration
    middle = np.degrees(np.angle(total)) % 360.0
    return middle + np.quantile(wrap(angles - middle), shares), concentration


def with_spread(table: xr.Dataset, dim: str = "specimen") -> xr.Dataset:
    """The table with median, quartiles and extremes over one dimension, and the share that is unstable.

    Parameters
    ----------
    table : xarray.Dataset
        Of `cone_table`.
    dim : str
        What to summarise over.

    Returns
    -------
    xarray.Dataset
        With `..._summary` of the smallest value, its direction, the opening, and the edges of the widest sector, along
        a new dimension `statistic`. Edges are those of the states with a significant cone that has edges; directions
        are circular (`circular_quantiles`), and `smallest_alpha_concentration` tells how alike they are.
        `unstable_share` is the share of the present states with a significant cone, `n_present` how many are present.
    """
    import xarray as xr

    if dim not in table.dims:
        raise InvalidInput(f"a table is summarised over one of its dimensions, {tuple(table.dims)}, not {dim!r}")
    table = table.copy()
    shares = np.array(list(STATISTICS.values()))

    def summarised(values: xr.DataArray, function) -> xr.DataArray:
        return xr.apply_ufunc(
            function, values, input_core_dims=[[dim]], output_core_dims=[["statistic"]], vectorize=True
        ).assign_attrs(values.attrs)

    def plain(values: np.ndarray) -> np.ndarray:
        present = values[np.isfinite(values)]
        return np.quantile(present, shares) if len(present) else np.full(len(shares), np.nan)

    def directions(values: np.ndarray) -> np.ndarray:
        return circular_quantiles(values, shares)[0]

    table.coords["statistic"] = list(STATISTICS)
    for name in ("smallest_w2n", "opening"):
        table[f"{name}_summary"] = summarised(table[name], plain)
    has_edges = table.is_unstable & (table.opening < 360.0)
    widest = {name: table[name].isel(sector=0, drop=True).where(has_edges) for name in ("edge_from", "edge_to")}
    for name, values in {"smallest_alpha": table.smallest_alpha, **widest}.items():
        table[f"{name}_summary"] = summarised(values, directions)
    # as in a cone, the end of a sector lies beyond its beginning
    first, last = (table[f"{name}_summary"].sel(statistic="median", drop=True) for name in widest)
    turns = (last - first) // 360.0
    table["edge_to_summary"] = (table.edge_to_summary - 360.0 * turns).assign_attrs(table.edge_to.attrs)
    table["smallest_alpha_concentration"] = xr.apply_ufunc(
        lambda values: circular_quantiles(values)[1], table.smallest_alpha, input_core_dims=[[dim]], vectorize=True
    ).assign_attrs(long_name="concentration of its directions", units="1")
    present = table.smallest_w2n.notnull().sum(dim)
    table["n_present"] = present.assign_attrs(long_name="states that there are")
    table["unstable_share"] = (table.is_unstable.sum(dim) / present.where(present > 0)).assign_attrs(
        long_name="share of states with a significant cone", units="1"
    )
    return table
