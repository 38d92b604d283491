"""Cones of many states as one labelled table, and what they have in common."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from rendulic.foundation.checks import finite_array
from rendulic.foundation.errors import InvalidInput
from rendulic.probing.cone import Cone
from rendulic.probing.edges import Sectors, is_unknown, wrap

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["STATISTICS", "circular_quantiles", "cone_table", "with_spread"]

STATISTICS = {"smallest": 0.0, "lower_quartile": 0.25, "median": 0.5, "upper_quartile": 0.75, "largest": 1.0}
LEAST_CONCENTRATION = 0.3  # of directions that have a middle to speak of
# of variables: the label, the unit, and the attribute of a cone
NUMBERS = {
    "smallest_w2n": ("smallest normalised second-order work", "1", "smallest_w2n"),
    "smallest_alpha": ("its direction of strain", "degree", "smallest_strain_alpha"),
    "smallest_error": ("its error", "1", "smallest_error"),
    "drift_share": ("what the drift of the null probe has in it", "1", "drift_share"),
    "opening": ("angle of all unstable sectors of strain together", "degree", "strain_opening"),
    "unknown_opening": ("angle of all sectors of strain of unknown sign together", "degree", "strain_unknown_opening"),
}
YES_OR_NO: dict[str, tuple[str, Callable[[Cone], bool]]] = {
    "is_present": ("there is such a state", lambda cone: True),
    "is_significant": ("the sign of the smallest value is sure", lambda cone: cone.is_significant),
    "is_unstable": ("second-order work is surely negative in some direction", lambda cone: cone.verdict == "unstable"),
    "is_stable": ("second-order work is surely positive in all directions", lambda cone: cone.verdict == "stable"),
}
ENDS = {
    "edge_from": ("first direction of an unstable sector", 0, False),
    "edge_to": ("last direction of an unstable sector, beyond the first", 1, False),
    "edge_from_uncertainty": ("uncertainty of the first direction, either way", 0, True),
    "edge_to_uncertainty": ("uncertainty of the last direction, either way", 1, True),
}
UNKNOWN_ENDS = {
    "unknown_from": ("first direction of a sector of unknown sign", 0),
    "unknown_to": ("last direction of a sector of unknown sign, beyond the first", 1),
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
        `edge_from`) and their uncertainties, NaN where there are fewer sectors. `unknown_sector`, likewise: `unknown_from`,
        `unknown_to`. `smallest_w2n`, `smallest_alpha`, `smallest_error`, `drift_share`, `opening`, `unknown_opening`,
        `n_sectors`, `n_unknown_sectors`; `is_significant`, whether the sign of the smallest value is sure. A state is `is_unstable`,
        `is_stable`, or unknown: neither, though `is_present`. Numbers of missing states are NaN.
    """
    import xarray as xr

    def each(pick, missing) -> np.ndarray:
        values = [missing if cone is None else pick(cone) for cone in cones.flat]
        return np.array(values).reshape(*cones.shape, *np.shape(missing))

    axes = tuple(coords)
    present = [cone for cone in cones.flat if cone is not None]
    variables: dict[str, Any] = {}
    for name, (label, unit, attribute) in NUMBERS.items():
        values = each(lambda cone, a=attribute: getattr(cone, a), np.nan)
        variables[name] = (axes, values, {"long_name": label, "units": unit})
    for name, label, attribute in (
        ("n_sectors", "unstable sectors", "sectors"),
        ("n_unknown_sectors", "sectors of unknown sign", "unknown_sectors"),
    ):
        variables[name] = (axes, each(lambda cone, a=attribute: len(getattr(cone, a)), 0), {"long_name": label})
    for name, (label, pick) in YES_OR_NO.items():
        variables[name] = (axes, each(pick, False), {"long_name": label})
    count = max([1, *(len(cone.sectors) for cone in present)])
    for name, (label, end, is_uncertainty) in ENDS.items():
        values = each(lambda cone, e=end, u=is_uncertainty: _edges(cone, e, u, count), np.full(count, np.nan))
        variables[name] = ((*axes, "sector"), values, {"long_name": label, "units": "degree"})
    most = max([1, *(len(cone.unknown_sectors) for cone in present)])
    for name, (label, end) in UNKNOWN_ENDS.items():
        values = each(lambda cone, e=end: _unknown_ends(cone, e, most), np.full(most, np.nan))
        variables[name] = ((*axes, "unknown_sector"), values, {"long_name": label, "units": "degree"})
    labels = {**coords, "sector": np.arange(count), "unknown_sector": np.arange(most)}
    return xr.Dataset(variables, labels, {"directions": "strain"})


def _edges(cone: Cone, end: int, is_uncertainty: bool, count: int) -> np.ndarray:
    """One end of every sector, or its uncertainty, the widest sector first."""
    pairs = cone.strain_edge_uncertainty if is_uncertainty else cone.strain_sectors
    return _ends(pairs, cone.strain_sectors, end, count)


def _unknown_ends(cone: Cone, end: int, count: int) -> np.ndarray:
    return _ends(cone.strain_unknown_sectors, cone.strain_unknown_sectors, end, count)


def _ends(pairs: Sectors, sectors: Sectors, end: int, count: int) -> np.ndarray:
    """One of each pair, in the order of their sectors, the widest first."""
    widest_first = np.argsort([first - last for first, last in sectors], kind="stable")
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
        a new dimension `statistic`. Edges are those of the states with a cone that has edges, unknown ones left out;
        directions are circular (`circular_quantiles`), and `smallest_alpha_concentration` tells how alike they are.
        `n_present` is how many states there are; `unstable_share`, `stable_share` and `unknown_share` are the shares of these
        that are so, of sum 1.
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
    widest = {}
    for name in ("edge_from", "edge_to"):
        is_known = has_edges & ~xr.apply_ufunc(is_unknown, table[f"{name}_uncertainty"].isel(sector=0, drop=True))
        widest[name] = table[name].isel(sector=0, drop=True).where(is_known)
    for name, values in {"smallest_alpha": table.smallest_alpha, **widest}.items():
        table[f"{name}_summary"] = summarised(values, directions)
    # as in a cone, the end of a sector lies beyond its beginning
    first, last = (table[f"{name}_summary"].sel(statistic="median", drop=True) for name in widest)
    turns = (last - first) // 360.0
    table["edge_to_summary"] = (table.edge_to_summary - 360.0 * turns).assign_attrs(table.edge_to.attrs)
    table["smallest_alpha_concentration"] = xr.apply_ufunc(
        lambda values: circular_quantiles(values)[1], table.smallest_alpha, input_core_dims=[[dim]], vectorize=True
    ).assign_attrs(long_name="concentration of its directions", units="1")
    present = table.is_present.sum(dim)
    table["n_present"] = present.assign_attrs(long_name="states that there are")
    unknown = table.is_present & ~table.is_unstable & ~table.is_stable
    for name, which in (("unstable", table.is_unstable), ("stable", table.is_stable), ("unknown", unknown)):
        table[f"{name}_share"] = (which.sum(dim) / present.where(present > 0)).assign_attrs(
            long_name=f"share of states that are {name}", units="1"
        )
    return table
