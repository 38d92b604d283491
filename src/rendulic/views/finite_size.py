"""Packings of one recipe and several sizes: what of a cone belongs to the number of grains, and what to the material."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rendulic.views.catalogue import StudyFigure
from rendulic.views.circular import norm_of
from rendulic.views.ensembles import StudyEnsemble, ensemble_units, ensembles, interval, said
from rendulic.views.view import Table, View

if TYPE_CHECKING:
    import xarray as xr

    from rendulic.study.plan import Plan
    from rendulic.study.results import Results
    from rendulic.study.store.unit import Unit

__all__ = ["STUDY_FIGURES", "FiniteSize", "SizeSeries", "exponent_of_share", "finite_size"]

CAPTION = (
    "Packings of one recipe with different numbers of grains N, probed alike. Above: angle of all directions in which the mean is unstable; the bar "
    "goes from the angle that is sure to that which may be. Middle: W2n of the mean at its smallest, with its 95 % interval. Below: share of packings "
    "with W2 < 0 in some direction, with Wilson intervals; dashed, 1/N through the smallest size: what rare local collapses would do to a packing of "
    "fixed strain."
)
HEADS = ("state", "grains", "packings", "share with W2 < 0 [95 %]", "smallest mean W2n [95 %]", "what the mean says")
DRAWS = 4000  # of shares, for the interval of their exponent


@dataclass(frozen=True, eq=False)
class SizeSeries:
    """One stress ratio; arrays over the sizes.

    Parameters
    ----------
    label : str
        The stress ratio.
    n_grains : (n,) array
        Increasing.
    opening, smallest, share : (3, n) arrays
        Values with lower and upper bounds: degrees, W2n, share of packings.
    exponent : (3,)
        Of the share in N, with its bounds.
    """

    label: str
    n_grains: np.ndarray
    opening: np.ndarray
    smallest: np.ndarray
    share: np.ndarray
    exponent: np.ndarray


@dataclass(frozen=True, kw_only=True, eq=False)
class FiniteSize(View):
    """One entry for each stress ratio."""

    series: tuple[SizeSeries, ...]


def exponent_of_share(
    n_grains: Sequence[int], unstable: Sequence[int], total: Sequence[int], seed: int = 0
) -> np.ndarray:
    """Exponent k of `share ~ N^k` with its 95 % bounds: slopes of logarithms over draws from the shares' posterior.

    Shares are drawn from beta distributions (Jeffreys' prior), so that sizes with none or all unstable count, too.

    >>> exponent_of_share([1000, 10000], [32, 3], [64, 64]).round(1).tolist()
    [-1.0, -1.6, -0.6]
    """
    counts, totals = np.asarray(unstable, dtype=float), np.asarray(total, dtype=float)
    draws = np.random.default_rng(seed).beta(counts + 0.5, totals - counts + 0.5, size=(DRAWS, len(counts)))
    x = np.log(np.asarray(n_grains, dtype=float))
    x -= x.mean()
    slopes = np.log(draws) @ x / (x @ x)
    return np.quantile(slopes, (0.5, 0.025, 0.975))


def finite_size(responses: Mapping[float, Mapping[int, xr.Dataset]], title: str = "") -> FiniteSize:
    """The view of mean responses by stress ratio and number of grains, each of `rd.ensemble_response` at one norm."""
    series = tuple(_series(eta, dict(sorted(own.items()))) for eta, own in sorted(responses.items()) if len(own) > 1)
    rows = [
        (
            f"η = {eta:g}", str(size), str(data.attrs["n_specimens"]),
            interval(*(float(data[f"negative_somewhere_share{end}"]) for end in ("", "_lower", "_upper"))),
            interval(*_smallest(data)), said(data),
        )
        for eta, own in sorted(responses.items()) for size, data in sorted(own.items())
    ]  # fmt: skip
    verdict = " ".join(f"{one.label}: {_told(one)}." for one in series)
    return FiniteSize(
        title=title, caption=CAPTION, verdict=verdict, tables=(Table("Sizes of packings", HEADS, rows),), series=series
    )


def _series(eta: float, own: Mapping[int, xr.Dataset]) -> SizeSeries:
    data = list(own.values())
    counts = [round(float(one.negative_somewhere_share) * one.attrs["n_specimens"]) for one in data]
    return SizeSeries(
        f"η = {eta:g}", np.array(list(own)),
        np.array([[float(one[name]) for name in ("opening", "sure_opening", "possible_opening")] for one in data]).T,
        np.array([_smallest(one) for one in data]).T,
        np.array([[float(one[f"negative_somewhere_share{end}"]) for end in ("", "_lower", "_upper")] for one in data]).T,
        exponent_of_share(list(own), counts, [one.attrs["n_specimens"] for one in data]),
    )  # fmt: skip


def _smallest(data: xr.Dataset) -> tuple[float, float, float]:
    least = data.isel(alpha=int(np.nanargmin(data.w2_normalised.values)))
    return float(least.w2_normalised), float(least.w2_normalised_lower), float(least.w2_normalised_upper)


def _told(one: SizeSeries) -> str:
    """Whether the share of unstable packings falls as 1/N, stays, or cannot be told."""
    value, low, high = one.exponent
    words = f"the share of unstable packings goes as N^{value:.2f} [{low:.2f}, {high:.2f}]"
    falls, stays = low <= -1.0 <= high, low <= 0.0 <= high
    if falls and stays:
        return f"{words}, which does not tell 1/N from no change"
    if falls:
        return f"{words}, as 1/N would"
    return f"{words}, as no change would" if stays else words


# -- of a study ----------------------------------------------------------------------------------


def _groups(plan: Plan, many: Sequence[tuple[str, str]]) -> list[list[tuple[str, str]]]:
    """Sets and specimens that differ in their number of grains, and in their seeds and names, only."""
    alike: dict[tuple[str, str], list[tuple[str, str]]] = {}
    for name, specimen in many:
        section = plan.specimen(specimen)
        recipe = section.model_dump_json(exclude={"name", "seeds", "n_grains", "eta", "to_the_end", "axial_strain"})
        probes = plan.study.sets("probes")[name].model_dump_json(
            exclude={"name", "specimens", "seeds", "void_ratios", "eta"}
        )
        alike.setdefault((recipe, probes), []).append((name, specimen))
    return [own for own in alike.values() if len({plan.specimen(specimen).n_grains for _, specimen in own}) > 1]


def _views(results: Results) -> dict[str, View]:
    many = {(one.name, one.specimen): one for one in ensembles(results)}
    groups = _groups(results.plan, list(many))
    views: dict[str, View] = {}
    for own in groups:
        together = [many[each] for each in own]
        norm = norm_of(results, together[0].name)
        view = _of(results, together, norm)
        if view.series:
            views["sizes" if len(groups) == 1 else f"sizes_{together[0].specimen}_{together[0].name}"] = view
    return views


def _of(results: Results, together: Sequence[StudyEnsemble], norm: float) -> FiniteSize:
    responses: dict[float, dict[int, xr.Dataset]] = {}
    for one in together:
        for eta, data in one.responses.items():
            responses.setdefault(eta, {})[results.plan.specimen(one.specimen).n_grains] = data.sel(norm=norm)
    names = ", ".join(dict.fromkeys(one.specimen for one in together))
    return finite_size(responses, f"{names}: number of grains, strain probes of norm {norm:g}")


def _needs(plan: Plan) -> list[Unit]:
    states = {
        (name, state.specimen) for name, state in plan.of("probes") if state is not None and plan.has_grains(state)
    }
    return ensemble_units(plan) if _groups(plan, sorted(states)) else []


STUDY_FIGURES = (
    StudyFigure(
        "sizes", "cone and share of unstable packings against the number of grains",
        "[[probes]] of strain in the Rendulic plane of specimens of grains that differ in n_grains, with several seeds",
        _needs, _views,
    ),
)  # fmt: skip
