"""The cone of unstable directions, its edges refined by bisection, each with its uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from rendulic.foundation.checks import positive_number
from rendulic.foundation.errors import InvalidInput
from rendulic.foundation.notebooks import Shown
from rendulic.foundation.progress import Progress, silent
from rendulic.loading.directions import Directions, as_directions, axisymmetric, rendulic
from rendulic.loading.rate import norms_of, rate_of
from rendulic.probing.edges import (
    ROUNDING,
    Edge,
    Sectors,
    between,
    error_of,
    find_edges,
    give_or_take,
    is_unknown,
    largest_gap,
    sectors_of,
    share_of_drift,
    signs_of,
    size_of,
    smallest_of,
    unknown_between,
    wrap,
)
from rendulic.probing.probe import probes_of, warn_of_doubts
from rendulic.probing.refinement import probes_wanted
from rendulic.specimen.protocol import Specimen
from rendulic.tensors.rendulic_plane import direction_of

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Cone", "cone_of", "instability_cone", "probe_to_edges"]

FINEST = 1e-9  # degrees to which an edge can be bracketed
WIDEST = 60.0  # degrees between the directions that are probed first
MOST_SECTORS = 3  # of unknown sign that are said one by one


@dataclass(frozen=True, eq=False)
class Cone(Shown):
    """Sectors of the Rendulic plane in which the second-order work is negative, and those in which its sign is unknown.

    Parameters
    ----------
    sectors : tuple of (from, to)
        Directions in degrees, counter-clockwise, `from` in [0, 360), `to` beyond it; (0, 360) if W2 is
        negative all around. Directions are those of what was imposed: strain, or stress for stress probes.
    tolerance : float
        Width in degrees to which each change of sign was bracketed.
    smallest_w2n : float
        Smallest normalised second-order work: of the directions that are surely unstable, or of all if there are none. NaN if no
        direction has one.
    smallest_alpha : float
        Its direction in degrees.
    is_significant : bool
        Whether its sign is sure: it exceeds its error, and if it is positive no direction is unknown.
    probes : xarray.Dataset
        Every direction that was probed, sorted; see `rd.probe`. Also `strain_alpha`: the direction in degrees of the
        strain, of stress probes that of the response; and `w2_sign`: -1 or 1 where the sign of W2 is sure, else 0.
    edge_uncertainty : tuple of (of from, of to)
        Degrees either way, for each edge of `sectors`; see Notes. 180 if the error alone could make the edge, NaN for a
        sector without edges.
    smallest_error : float
        The error of `smallest_w2n`: what counts in its sign, and
    drift_share : float
        `|w2_drift|` over the norms of stress and strain: what the null probe's drift has in it.
    kind : {"strain", "stress"}
        What was imposed.
    strain_sectors, strain_edge_uncertainty : tuples
        The sectors in directions of strain, and their uncertainty: for strain probes the same, for stress probes those
        that the strains of the responses within each sector span. Only so do cones of both kinds compare.
    unknown_sectors : tuple of (from, to)
        Where the sign of W2 is not known: directions that have no number or one that does not exceed its error, or was not
        reached, as far as the next ones on either side whose signs are sure. These are neither stable nor unstable.
    strain_unknown_sectors : tuple
        The same in directions of strain.

    Notes
    -----
    An edge lies between two directions of opposite signs that are both sure, with no other sure one between them: in the middle,
    give or take half the distance and the error of W2n over its slope. Where that error makes directions between the two
    unknown, the distance itself is as far as the error reaches, and the same directions are an unknown sector. Where unknown
    directions lie between two that are surely unstable, they count as part of the sector if their values are negative, too, and are named as
    unknown; if not, the sector ends there, at an edge of uncertainty 180. Edges in directions of strain also have the angle
    `asin(|d_eps_0| / |d_eps|)` by which the null probe's drift of strain, marked 0, can turn it. What other realisations of
    the same state would give is not in it: see `rd.cone_ensemble`.
    """

    sectors: Sectors
    tolerance: float
    smallest_w2n: float
    smallest_alpha: float
    is_significant: bool
    probes: xr.Dataset = field(repr=False)
    edge_uncertainty: Sectors
    smallest_error: float
    drift_share: float
    kind: str
    strain_sectors: Sectors
    strain_edge_uncertainty: Sectors
    unknown_sectors: Sectors
    strain_unknown_sectors: Sectors

    @property
    def verdict(self) -> str:
        """ "unstable" if W2 is surely negative in some direction, "stable" if it is surely positive in all, else "unknown"."""
        return "unstable" if self.sectors else "unknown" if self.unknown_sectors else "stable"

    @property
    def is_empty(self) -> bool:
        """Whether no direction is unstable, and none unknown."""
        return self.verdict == "stable"

    @property
    def opening(self) -> float:
        """Angle of all sectors together, in degrees."""
        return _opening(self.sectors)

    @property
    def unknown_opening(self) -> float:
        """Angle of all unknown sectors together, in degrees; what an edge leaves open is in it and in part in `opening`."""
        return _opening(self.unknown_sectors)

    @property
    def strain_opening(self) -> float:
        """Angle of all `strain_sectors` together, in degrees."""
        return _opening(self.strain_sectors)

    @property
    def strain_unknown_opening(self) -> float:
        """Angle of all `strain_unknown_sectors` together, in degrees."""
        return _opening(self.strain_unknown_sectors)

    @property
    def smallest_strain_alpha(self) -> float:
        """Direction in degrees of the strain with the smallest value; for strain probes `smallest_alpha`."""
        return float(self.probes.strain_alpha.sel(alpha=self.smallest_alpha))

    def _facts(self) -> dict[str, object]:
        return {
            "second-order work": str(self),
            "imposed": self.kind,
            "directions probed": self.probes.sizes["alpha"],
            "of these unknown": int((self.probes.w2_sign == 0).sum()),
            "opening": f"{self.opening:.4g} degrees",
            "unknown": f"{self.unknown_opening:.4g} degrees",
            "edges bracketed within": f"{self.tolerance:.2g} degrees",
            "error of the smallest W2n": f"{self.smallest_error:.1e}",
            "of this the drift's share": f"{self.drift_share:.1e}",
        }

    def __str__(self) -> str:
        unit = "degrees" + (" of stress" if self.kind == "stress" else "")
        unknown = _unknown_in_words(self.unknown_sectors, unit)
        if self.opening == 360.0:
            words = ["unstable in all directions"]
        elif self.sectors:
            sectors = ", ".join(
                f"{first:.4g} +- {give_or_take(low)} to {last:.4g} +- {give_or_take(high)}"
                for (first, last), (low, high) in zip(self.sectors, self.edge_uncertainty, strict=True)
            )
            words = [f"unstable from {sectors} {unit}"]
        else:
            words = ["no direction is surely unstable" if unknown else "no unstable direction"]
        if unknown:
            words.append(unknown)
        sure = "" if self.is_significant else ", not larger than its error" if self._is_within_error else ", not sure"
        if np.isfinite(self.smallest_w2n):
            words.append(f"smallest W2n {self.smallest_w2n:.3g} at {self.smallest_alpha:.4g} degrees{sure}")
        return "; ".join(words)

    @property
    def _is_within_error(self) -> bool:
        return not abs(self.smallest_w2n) > self.smallest_error


def _opening(sectors: Sectors) -> float:
    return float(sum(last - first for first, last in sectors))


def _unknown_in_words(sectors: Sectors, unit: str) -> str:
    opening = _opening(sectors)
    if opening >= 360.0:
        return "unknown in all directions" if len(sectors) == 1 else f"unknown in {len(sectors)} sectors all around"
    if len(sectors) > MOST_SECTORS:
        return f"unknown in {len(sectors)} sectors, {opening:.4g} {unit} together"
    if not sectors:
        return ""
    return "unknown from " + ", ".join(f"{first:.4g} to {last:.4g}" for first, last in sectors) + f" {unit}"


def instability_cone(
    specimen: Specimen,
    directions: Directions | None = None,
    norm: float | None = None,
    n_steps: int | None = None,
    *,
    rate: float | None = None,
    settle: bool = True,
    check_rate: bool = False,
    kind: str = "strain",
    tolerance: float = 0.5,
    refine_smallest: bool = False,
    workers: int | None = None,
    progress: Progress = silent,
) -> Cone:
    """Directions in which the second-order work of a state is negative; the specimen is left as it was.

    1. The given directions are probed.
    2. Every edge, where the sign changes between directions whose signs are sure, is bisected until bracketed within the
       tolerance, or as closely as the error lets it be; the edges of one round are probed together.
    3. So are the gaps beside every minimum of W2n or W2 that continued slopes let be negative: a smooth cone that lies
       between two of the given directions is found. One with steep sides, much narrower than their distance, can be missed.
    4. A direction whose sign is not sure is unknown, which is not stable.

    Parameters
    ----------
    specimen : Specimen
        At rest.
    directions : Directions, optional
        Every 10 degrees by default.
    norm, rate, settle, check_rate, kind, workers, progress, n_steps
        As for `rd.probe`.
    tolerance : float
        Degrees.
    refine_smallest : bool
        Whether the direction of the smallest value is bracketed within the tolerance, too, for the sake of its number. The
        sectors do not need it.

    Returns
    -------
    Cone

    Raises
    ------
    InvalidInput
        If the directions leave a gap of more than 60 degrees.
    """
    probed = probe_to_edges(
        specimen, directions, None if norm is None else positive_number("norm", norm), rate=rate, settle=settle,
        check_rate=check_rate, kind=kind, tolerance=tolerance, refine_smallest=refine_smallest, workers=workers,
        progress=progress, n_steps=n_steps,
    )  # fmt: skip
    warn_of_doubts(probed)
    return cone_of(probed)


def probe_to_edges(
    specimen: Specimen,
    directions: Directions | None,
    norm: float | Sequence[float] | None,
    n_steps: int | None = None,
    *,
    rate: float | None = None,
    settle: bool = True,
    check_rate: bool = False,
    kind: str = "strain",
    tolerance: float = 0.5,
    refine_smallest: bool = False,
    workers: int | None = None,
    progress: Progress = silent,
) -> xr.Dataset:
    """Probes all around, with those that bracket every edge at every norm; see `instability_cone`.

    Returns
    -------
    xarray.Dataset
        As of `rd.probe`, sorted by direction.
    """
    import xarray as xr

    tolerance = max(positive_number("tolerance of a cone's edges", tolerance, "degrees"), FINEST)
    given = rendulic() if directions is None else as_directions(directions)
    if not isinstance(given, Directions):
        raise InvalidInput(
            f"a cone has its edges in the Rendulic plane: give rd.directions.rendulic(...), not {directions!r}; for "
            "the whole sphere see rd.probe and rd.figures.stereogram"
        )
    around = np.unique(np.array(given.alpha) % 360.0)
    _check_all_around(around)
    norms = norms_of(norm, kind)
    rate = rate_of(rate, n_steps, norms, kind, float(np.trace(specimen.stress)) / 3.0)
    probed, wanted = None, around
    while len(wanted):
        more = probes_of(
            specimen, axisymmetric(wanted), norm, rate=rate, settle=settle, check_rate=check_rate, kind=kind, workers=workers,
            progress=progress,
        )  # fmt: skip
        if probed is not None:
            more = xr.concat([probed, more], "alpha", data_vars="minimal", coords="minimal", compat="override")
        probed = more.sortby("alpha")
        w2n, size, error, sign = (
            np.atleast_2d(each.transpose(..., "alpha").values)
            for each in (probed.w2_normalised.variable, size_of(probed), error_of(probed), signs_of(probed))
        )
        error = np.maximum(error, ROUNDING)
        wanted = probes_wanted(probed.alpha.values, w2n, size, error, sign, tolerance, refine_smallest)
    assert probed is not None
    return probed.assign_attrs(edge_tolerance=tolerance)


def _check_all_around(alpha: np.ndarray) -> None:
    if largest_gap(alpha) > WIDEST:
        raise InvalidInput(
            f"the directions of a cone must go all around, at most {WIDEST:g} degrees apart; the widest gap is "
            f"{largest_gap(alpha):g} degrees: nothing is known of what lies in it"
        )


def cone_of(probes: xr.Dataset) -> Cone:
    """The cone that probes of the Rendulic plane show, its edges between the directions that there are.

    Parameters
    ----------
    probes : xarray.Dataset
        From `rd.probe`, directions all around, at one norm (`probes.sel(norm=...)` of a sweep).

    Raises
    ------
    InvalidInput
        If they are of several norms, not in the Rendulic plane, or leave a gap of more than 60 degrees.
    """
    if "alpha" not in probes.dims or "norm" in probes.dims:
        raise InvalidInput(
            "a cone needs probes in the Rendulic plane at one norm, got dimensions "
            f"{', '.join(map(str, probes.dims))}: select a norm with probes.sel(norm=...)"
        )
    probes = probes.sortby("alpha")
    alpha, w2n = probes.alpha.values, probes.w2_normalised.values
    _check_all_around(alpha)
    is_strain = probes.attrs["kind"] == "strain"
    d_eps = probes.d_eps.transpose("alpha", "component").values
    strain_alpha = alpha if is_strain else direction_of(d_eps)
    sign = signs_of(probes).values
    probes = probes.assign(
        strain_alpha=("alpha", strain_alpha, {"long_name": "direction of the strain increment", "units": "degree"}),
        w2_sign=("alpha", sign, {"long_name": "sign of the second-order work where it is sure, else 0"}),
    )
    turned = np.degrees(np.arcsin(share_of_drift(d_eps, probes.d_eps_null.values)))
    error = error_of(probes).values
    edges = find_edges(alpha, w2n, error, sign, strain_alpha, turned)
    pairs = sectors_of(edges)
    # all that is known is unstable, and the rest is read as such
    everywhere: Sectors = ((0.0, 360.0),) if (sign < 0).any() and not edges else ()
    edgeless: Sectors = ((float("nan"),) * 2,) * len(everywhere)
    sectors = tuple(between(first.alpha, last.alpha) for first, last in pairs) or everywhere
    uncertainty = tuple((first.uncertainty, last.uncertainty) for first, last in pairs) or edgeless
    responses = [_sector_of_responses(pair, strain_alpha) for pair in pairs]
    runs = unknown_between(alpha, sign, probes.attrs.get("edge_tolerance", 0.0))
    unknown = tuple(sector for _, sector in runs)
    worst = smallest_of(w2n, sign)
    drift_share = abs(probes["w2_drift"].variable) / size_of(probes)
    gaps = (np.roll(alpha, -1) - alpha) % 360.0
    ends = [k for edge in edges if not is_unknown(edge.uncertainty) for k in (edge.before, edge.after - 1)]
    return Cone(
        sectors=sectors,
        tolerance=float(max((gaps[k] for k in ends), default=0.0)),
        smallest_w2n=float(w2n[worst]),
        smallest_alpha=float(alpha[worst]),
        is_significant=bool(sign[worst] < 0 or (sign[worst] > 0 and not unknown)),
        probes=probes,
        edge_uncertainty=uncertainty,
        smallest_error=float(error[worst]),
        drift_share=float(drift_share[worst]),
        kind=probes.attrs["kind"],
        strain_sectors=sectors if is_strain else tuple(sector for sector, _ in responses) or everywhere,
        strain_edge_uncertainty=uncertainty if is_strain else tuple(each for _, each in responses) or edgeless,
        unknown_sectors=unknown,
        strain_unknown_sectors=unknown if is_strain else tuple(_unknown_responses(run, strain_alpha) for run in runs),
    )


def _sector_of_responses(
    pair: tuple[Edge, Edge], response: np.ndarray
) -> tuple[tuple[float, float], tuple[float, float]]:
    """The sector that the responses run through from one edge to the other, and the uncertainty of its ends."""
    first, last = pair
    inside = [first.after + k for k in range((last.before - first.after) % len(response) + 1)]
    way = [first.response, *(response[k % len(response)] for k in inside), last.response]
    turned = float(wrap(np.diff(way)).sum())
    # a response can turn the plane over: then the responses run clockwise
    low, high = (first, last) if turned >= 0.0 else (last, first)
    start = low.response % 360.0
    return (start, start + abs(turned)), (low.response_uncertainty, high.response_uncertainty)


def _unknown_responses(run: tuple[tuple[int, int], tuple[float, float]], response: np.ndarray) -> tuple[float, float]:
    """The sector that the responses run through where the sign is unknown; those that are no numbers are left out."""
    (i, j), (first, last) = run
    if last - first >= 360.0:
        return 0.0, 360.0
    way = response[np.arange(i, i + (j - i) % len(response) + 1) % len(response)]
    way = way[np.isfinite(way)]
    turns = np.concatenate(([0.0], np.cumsum(wrap(np.diff(way)))))
    start = float(way[0] + turns.min()) % 360.0
    return start, start + min(float(np.ptp(turns)), 360.0)
