"""The bifurcation map: how the cone opens as the stress ratio grows, and where it first does."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rendulic.foundation.checks import finite_array
from rendulic.foundation.errors import InvalidInput
from rendulic.loading.directions import Directions
from rendulic.loading.paths import Path
from rendulic.probing.cone import Cone, instability_cone
from rendulic.probing.cone_table import cone_table, with_spread
from rendulic.specimen.protocol import Specimen
from rendulic.tensors.invariants import stress_ratio

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["bifurcation_map", "censored_median", "first_negative", "map_of", "states_along"]

MaybeSpecimen = Specimen | None  # None: it has no such state
THERE = 1e-9  # of a stress ratio that need not be loaded to


def states_along(
    specimens: Specimen | Iterable[Specimen],
    path: Callable[[float], Path],
    etas: Sequence[float],
    at_rest: Callable[[Any], object] | None = None,
    **options: Any,
) -> Iterator[tuple[float, list[MaybeSpecimen]]]:
    """Load specimens from one stress ratio to the next, and yield each ratio with copies of the states there.

    For `bifurcation_map`. The specimens are loaded in place, when the next ratio is asked for.

    Parameters
    ----------
    specimens : Specimen or iterable of Specimen
        In their first state.
    path : callable
        The path to a stress ratio, e.g. `lambda eta: rd.paths.drained_triaxial(0.3, until_eta=eta)`.
    etas : sequence of float
        Stress ratios in the order of loading.
    at_rest : callable, optional
        Called with the copy before it is yielded; for grains `lambda copy: rd.dem.bring_to_rest(copy, "stress")`.
    options
        For the loading of this kind of specimen.

    Yields
    ------
    eta, states
        A list as long as there are specimens, with None for one whose path ended before this ratio.
    """
    every: list[MaybeSpecimen] = [specimens] if isinstance(specimens, Specimen) else list(specimens)
    for eta in finite_array("etas", etas, (None,)).tolist():
        copies: list[MaybeSpecimen] = []
        for k, specimen in enumerate(every):
            if specimen is not None and abs(float(stress_ratio(specimen.stress)) - eta) > THERE:
                curve = specimen.load(path(eta), **options)
                if curve.attrs["stopped_by"] != "eta":
                    every[k] = specimen = None
            copy = None if specimen is None else specimen.clone()
            if copy is not None and at_rest is not None:
                at_rest(copy)
            copies.append(copy)
        yield eta, copies


def bifurcation_map(
    states: Mapping[float, MaybeSpecimen | Sequence[MaybeSpecimen]]
    | Iterable[tuple[float, MaybeSpecimen | Sequence[MaybeSpecimen]]],
    directions: Directions | None = None,
    norm: float | None = None,
    n_steps: int | None = None,
    *,
    labels: Sequence[Any] | None = None,
    refine_smallest: bool = True,
    **options: Any,
) -> xr.Dataset:
    """Cone edges against stress ratio, and the first ratio at which the second-order work vanishes.

    Parameters
    ----------
    states : mapping of eta to state(s), or iterable of such pairs
        Of each stress ratio a specimen, or a list of several of one recipe, always in the same order, with None for
        one that has no such state. Pairs are taken one after the other: see `states_along`.
    directions, norm, n_steps, options
        As for `rd.instability_cone`.
    labels : sequence, optional
        One for each specimen of a list, e.g. the seeds.
    refine_smallest : bool
        Whether the smallest W2n is sought between the directions, too; the first ratio rests on it.

    Returns
    -------
    xarray.Dataset
        Dimensions `eta`, `specimen`, `sector`; for each state as `rd.cone_ensemble`, with its `measured_eta`, and the
        summaries over specimens at each eta, `unstable_share` among them. For each specimen `first_eta_from` and
        `first_eta_to`: the last ratio up to which it is surely stable at all ratios, and the first at which it is surely
        unstable; W2 first vanishes between the two. NaN where there is no such ratio: then it does so at or below
        `first_eta_to`, or not by `first_eta_from`. Where there are both, `first_eta` is where the smallest W2n vanishes, linear
        between the last ratio at which it is surely positive and the first at which it is surely negative.
        `first_eta_reason` says all that in words. Over the specimens, counting those that have only one of
        the two, the median lies between `first_eta_median_from` and `first_eta_median_to`.

    Raises
    ------
    InvalidInput
        If there are no states, a stress ratio comes twice, or lists differ in length.

    Examples
    --------
    >>> import rendulic as rd
    >>> sand = rd.ChangHicher().at(pressure=300e3, void_ratio=0.9)
    >>> drained = lambda eta: rd.paths.drained_triaxial(0.3, until_eta=eta)
    >>> table = rd.bifurcation_map(rd.states_along(sand, drained, [0.8, 0.9, 1.0]), norm=1e-7)
    >>> round(float(table.first_eta[0]), 2), table.first_eta_reason.item()
    (0.88, 'found')
    """
    rows: dict[float, list[Cone | None]] = {}
    measured: dict[float, list[float]] = {}
    for eta, here in states.items() if isinstance(states, Mapping) else states:
        (eta,) = finite_array("eta of a bifurcation map", [eta], (1,)).tolist()
        if eta in rows:
            raise InvalidInput(f"eta = {eta:g} comes twice: give all specimens of one stress ratio in one list")
        row = [here] if here is None or isinstance(here, Specimen) else list(here)
        _checked_labels(labels, {len(row), *map(len, rows.values())})  # before hours of probing
        rows[eta] = [
            None if one is None else instability_cone(
                one, directions, norm, n_steps, refine_smallest=refine_smallest, **options
            )
            for one in row
        ]  # fmt: skip
        measured[eta] = [np.nan if one is None else float(stress_ratio(one.stress)) for one in row]
    table = map_of(rows, labels)
    about = {"long_name": "stress ratio of the state that was probed", "units": "1"}
    table["measured_eta"] = (("eta", "specimen"), np.array([measured[eta] for eta in table.eta.values]), about)
    some = next((cone.probes for row in rows.values() for cone in row if cone is not None), None)
    return table if some is None else table.assign_attrs(norm=float(some.norm), rate=some.attrs["rate"])


def map_of(cones: Mapping[float, Sequence[Cone | None]], labels: Sequence[Any] | None = None) -> xr.Dataset:
    """The map from cones that are known: of each stress ratio one for each specimen; see `bifurcation_map`."""
    labels = _checked_labels(labels, {len(row) for row in cones.values()})
    etas, count = sorted(cones), len(labels)
    grid = np.empty((len(etas), count), dtype=object)
    grid[:] = [list(cones[eta]) for eta in etas]
    table = cone_table(grid, {"eta": etas, "specimen": labels})
    table.eta.attrs = {"long_name": "stress ratio q/p", "units": "1"}
    columns = [table.isel(specimen=k) for k in range(count)]
    first = [
        first_negative(
            np.array(etas), one.smallest_w2n.values, one.is_unstable.values, one.is_stable.values, one.is_present.values
        )
        for one in columns
    ]
    for name, label, column in (
        ("first_eta", "stress ratio at which W2 first vanishes", 0),
        ("first_eta_from", "last stress ratio up to which all are surely stable", 1),
        ("first_eta_to", "first stress ratio that is surely unstable", 2),
    ):
        values = np.array([row[column] for row in first], dtype=float)
        table[name] = ("specimen", values, {"long_name": label, "units": "1"})
    about = {"long_name": "where W2 first vanishes, in words"}
    table["first_eta_reason"] = ("specimen", np.array([row[3] for row in first]), about)
    known = table.is_present.any("eta").values
    low, high = censored_median(table.first_eta_from.values[known], table.first_eta_to.values[known])
    for name, value, side in (("from", low, "lower"), ("to", high, "upper")):
        about = {"long_name": f"{side} bound of the median of the specimens", "units": "1"}
        table[f"first_eta_median_{name}"] = ((), value, about)
    kinds = {cone.kind for cone in grid.flat if cone is not None}
    return with_spread(table).assign_attrs(kind=", ".join(kinds))


def _checked_labels(labels: Sequence[Any] | None, counts: set[int]) -> list[Any]:
    """One label for each specimen, if there are equally many at all stress ratios."""
    if len(counts) != 1 or counts == {0}:
        raise InvalidInput(
            "a bifurcation map needs at every stress ratio the same number of specimens, one at least (None for one "
            f"that has no such state), got {sorted(counts) or 'no stress ratio'}"
        )
    (count,) = counts
    labels = list(range(count) if labels is None else labels)
    if len(labels) != count:
        raise InvalidInput(
            f"there are {count} specimens at each stress ratio and {len(labels)} labels: give one for each"
        )
    return labels


def first_negative(
    eta: np.ndarray, smallest: np.ndarray, is_unstable: np.ndarray, is_stable: np.ndarray, is_present: np.ndarray
) -> tuple[float, float, float, str]:
    """The first eta at which the smallest W2n vanishes, the ratios on both sides of it, and how it was found.

    The lower ratio is the last one up to which every state is surely stable: one that is unknown can be the first. The upper one
    is the first that is surely unstable. Ratios without a state are left out.

    Parameters
    ----------
    eta, smallest : (n,) arrays
        Increasing ratios, and the smallest W2n of each; NaN where there is none.
    is_unstable, is_stable, is_present : (n,) arrays of bool
        What is sure of each, and whether there is such a state. One that is there and neither is unknown.

    Returns
    -------
    (float, float, float, str)
        NaN for what is not known.

    Examples
    --------
    >>> ratios, work, there = np.array([0.2, 0.4, 0.6]), np.array([0.3, 0.1, -0.1]), np.ones(3, dtype=bool)
    >>> first_negative(ratios, work, work < 0, work > 0, there)
    (0.5, 0.4, 0.6, 'found')
    >>> first_negative(ratios, np.array([0.1, 0.0, -0.1]), work < 0, work > 0.2, there)
    (0.4, 0.2, 0.6, 'found')
    """
    nan = float("nan")
    eta, smallest, is_unstable, is_stable = (each[is_present] for each in (eta, smallest, is_unstable, is_stable))
    if not len(eta):
        return nan, nan, nan, "no state"
    leading = (
        len(eta) if is_stable.all() else int(np.argmin(is_stable))
    )  # ratios from the first on that are surely stable
    low = float(eta[leading - 1]) if leading else nan
    is_unknown = ~is_stable & ~is_unstable
    if not is_unstable.any():
        unknown = f"unknown at eta = {_some(eta[is_unknown])}"
        if leading:
            return nan, low, nan, f"not by eta = {low:g}" + (f", {unknown}" if is_unknown.any() else "")
        return nan, nan, nan, unknown
    after = int(np.argmax(is_unstable))
    high = float(eta[after])
    if not leading:
        before = f"unknown at {_some(eta[:after][is_unknown[:after]])}" if after else "the first that was probed"
        return nan, nan, high, f"at or below eta = {high:g}, {before}"
    last = int(np.flatnonzero(is_stable[:after])[-1])
    share = smallest[last] / (smallest[last] - smallest[after])
    return float(eta[last] + share * (eta[after] - eta[last])), low, high, "found"


def _some(values: np.ndarray) -> str:
    """Ratios as they are said, the first three of many."""
    return ", ".join(f"{value:g}" for value in values[:3]) + (", ..." if len(values) > 3 else "")


def censored_median(low: np.ndarray, high: np.ndarray) -> tuple[float, float]:
    """Bounds of the median of values of which only bounds are known; NaN where it has none.

    Parameters
    ----------
    low, high : (n,) arrays
        Of each value, NaN where there is none.

    Examples
    --------
    One between 0.2 and 0.3, one at or below 0.2, and one above 0.6:

    >>> nan = float("nan")
    >>> censored_median(np.array([0.2, nan, 0.6]), np.array([0.3, 0.2, nan]))
    (0.2, 0.3)
    >>> censored_median(np.array([0.2, 0.6]), np.array([0.3, nan]))
    (0.2, nan)
    """
    if not len(low):
        return float("nan"), float("nan")
    first = float(np.quantile(np.where(np.isnan(low), -np.inf, low), 0.5, method="lower"))
    last = float(np.quantile(np.where(np.isnan(high), np.inf, high), 0.5, method="higher"))
    return (first if np.isfinite(first) else float("nan")), (last if np.isfinite(last) else float("nan"))
