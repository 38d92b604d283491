"""Means of packings against the stress ratio: where a cone is sure, and the share of packings that is unstable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rendulic.probing.ensemble_response import FEW
from rendulic.views.catalogue import StudyFigure
from rendulic.views.circular import norm_of, norms_of, stems
from rendulic.views.ensembles import StudyEnsemble, ensemble_table, ensemble_units, ensembles
from rendulic.views.sectors import Sector, direction_range
from rendulic.views.view import View

if TYPE_CHECKING:
    import xarray as xr

    from rendulic.study.results import Results

__all__ = ["STUDY_FIGURES", "EnsembleMap", "ensemble_map"]

CAPTION = (
    "Means of packings that differ in their seeds, against the stress ratio. Above: directions in which W2 of the mean response is surely "
    "negative (wide bars), negative in the mean (narrow bars), and may be negative (thin lines), each with 95 % intervals over packings. "
    "Below: share of packings with W2 < 0 in some direction, and in the direction of the smallest mean W2n, with Wilson intervals."
)
Spans = tuple[tuple[float, float], ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class EnsembleMap(View):
    """One entry for each stress ratio in all tuples and arrays.

    Parameters
    ----------
    eta : (n,) array
        Increasing.
    sure, mean, possible : tuples of n tuples of (first, last)
        Sectors in degrees; what may be negative is empty where there are too few packings for intervals.
    somewhere, at_smallest : (3, n) arrays
        Shares of packings, and their lower and upper bounds.
    low, high : float
        Directions in sight.
    """

    eta: np.ndarray
    sure: tuple[Spans, ...]
    mean: tuple[Spans, ...]
    possible: tuple[Spans, ...]
    somewhere: np.ndarray
    at_smallest: np.ndarray
    low: float
    high: float


def ensemble_map(responses: Mapping[float, xr.Dataset], title: str = "", states: Sequence[str] = ()) -> EnsembleMap:
    """The map of mean responses by their stress ratio, each of `rd.ensemble_response` at one norm; `states` are their names."""
    responses = dict(sorted(responses.items()))
    sure = tuple(_spans(data, "sure_from", "sure_to") for data in responses.values())
    mean = tuple(_spans(data, "sector_from", "sector_to") for data in responses.values())
    possible = tuple(
        _spans(data, "possible_from", "possible_to") if data.attrs["n_specimens"] >= FEW else ()
        for data in responses.values()
    )
    low, high = direction_range(Sector(*span, 0.0, 0.0) for own in (*sure, *mean) for span in own)
    return EnsembleMap(
        title=title,
        caption=CAPTION,
        verdict=_verdict(responses),
        tables=(ensemble_table({f"η = {eta:g}": data for eta, data in responses.items()}, states),),
        eta=np.array(list(responses)),
        sure=sure, mean=mean, possible=possible,
        somewhere=np.array([_share(data, "negative_somewhere_share") for data in responses.values()]).T,
        at_smallest=np.array([
            _share(data.isel(alpha=int(np.nanargmin(data.w2_normalised.values))), "negative_share") for data in responses.values()
        ]).T,
        low=low, high=high,
    )  # fmt: skip


def _spans(data: xr.Dataset, first: str, last: str) -> Spans:
    pairs = zip(data[first].values.tolist(), data[last].values.tolist(), strict=True)
    return tuple((a, b) for a, b in pairs if np.isfinite(a))


def _share(data: xr.Dataset, name: str) -> tuple[float, float, float]:
    return float(data[name]), float(data[f"{name}_lower"]), float(data[f"{name}_upper"])


def _verdict(responses: Mapping[float, xr.Dataset]) -> str:
    """From which stress ratio on the cone of the mean is sure."""
    sure = [float(data.sure_opening) > 0.0 for data in responses.values()]
    etas = list(responses)
    if max(data.attrs["n_specimens"] for data in responses.values()) < FEW:
        return f"Fewer than {FEW} packings: no cone can be called sure."
    if not any(sure):
        return f"The mean of the packings has no sure cone up to η = {etas[-1]:g}."
    first = sure.index(True)
    before = f"none up to η = {etas[first - 1]:g}" if first else "the first that was probed"
    gaps = [f"{eta:g}" for eta, is_sure in zip(etas[first:], sure[first:], strict=True) if not is_sure]
    return f"The mean of the packings has a sure cone from η = {etas[first]:g} on ({before})" + (
        f", but not at {', '.join(gaps)}." if gaps else "."
    )


# -- of a study ----------------------------------------------------------------------------------


def _title(one: StudyEnsemble, norm: float) -> str:
    return f"{one.specimen}, {one.size} packings ({one.about}), strain probes of norm {norm:g}"


def _of(one: StudyEnsemble, norm: float) -> EnsembleMap:
    return ensemble_map(
        {eta: data.sel(norm=norm) for eta, data in one.responses.items()},
        _title(one, norm),
        [one.state(eta) for eta in one.responses],
    )


def _map(results: Results) -> dict[str, View]:
    many = ensembles(results)
    names = stems("ensemble", [(one.name, one.specimen) for one in many])
    return {stem: _of(one, norm_of(results, one.name)) for one, stem in zip(many, names, strict=True)}


def _families(results: Results) -> dict[str, View]:
    return {
        f"{one.specimen}, probes '{one.name}' of {norm:g}": _of(one, norm)
        for one in ensembles(results) for norm in norms_of(results, one.name)
    }  # fmt: skip


STUDY_FIGURES = (
    StudyFigure(
        "ensemble", "sure cones and share of unstable packings against the stress ratio, for packings of several seeds",
        "[[probes]] of strain in the Rendulic plane at states of a specimen of grains with several seeds",
        ensemble_units, _map, _families,
    ),
)  # fmt: skip
