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
from rendulic.loading.directions import Directions, axisymmetric, rendulic
from rendulic.probing.edges import (
    Edge,
    between,
    find_edges,
    give_or_take,
    largest_gap,
    probes_wanted,
    sectors_of,
    share_of_drift,
    wrap,
)
from rendulic.probing.probe import probe
from rendulic.specimen.protocol import Specimen
from rendulic.tensors.rendulic_plane import direction_of

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Cone", "cone_of", "instability_cone", "probe_to_edges"]

FINEST = 1e-9  # degrees to which an edge can be bracketed
WIDEST = 60.0  # degrees between the directions that are probed first

Sectors = tuple[tuple[float, float], ...]


@dataclass(frozen=True, eq=False)
class Cone(Shown):
    """Sectors of the Rendulic plane in which the second-order work is negative.

    Parameters
    ----------
    sectors : tuple of (from, to)
        Directions in degrees, counter-clockwise, `from` in [0, 360), `to` beyond it; (0, 360) if W2 is
        negative all around. Directions are those of what was imposed: strain, or stress for stress probes.
    tolerance : float
        Width in degrees within which each edge was bracketed; the edge is in its middle.
    smallest_w2n : float
        Smallest normalised second-order work found, and
    smallest_alpha : float
        its direction in degrees.
    is_significant : bool
        Whether that value exceeds the share of the null probe's drift in it.
    probes : xarray.Dataset
        Every direction that was probed, sorted; see `rd.probe`. Also `strain_alpha`: the direction in degrees of the
        strain, of stress probes that of the response.
    edge_uncertainty : tuple of (of from, of to)
        Degrees either way, for each edge of `sectors`: half its bracket plus the shift that the null probe's drift can
        cause (see Notes). 180 if the drift alone could make the edge, NaN for a sector without edges.
    drift_share : float
        `|w2_drift|` over the norms of stress and strain: what the drift has in `smallest_w2n`.
    kind : {"strain", "stress"}
        What was imposed.
    strain_sectors, strain_edge_uncertainty : tuples
        The sectors in directions of strain, and their uncertainty: for strain probes the same, for stress probes those
        that the strains of the responses within each sector span. Only so do cones of both kinds compare.

    Notes
    -----
    In the band around an edge where |W2n| is less than `|d_sigma_0| / |d_sigma| + |d_eps_0| / |d_eps|`, with the
    increments of the null probe marked 0, its drift can make the sign (Cauchy and Schwarz). The farther end of this
    band, linear between probes, is the shift; no slope of W2n is needed. Where the strain drifts, edges in directions
    of strain also have the angle `asin(|d_eps_0| / |d_eps|)` by which it turns the response. What other realisations of
    the same state would give is not in it: see `rd.cone_ensemble`.
    """

    sectors: Sectors
    tolerance: float
    smallest_w2n: float
    smallest_alpha: float
    is_significant: bool
    probes: xr.Dataset = field(repr=False)
    edge_uncertainty: Sectors
    drift_share: float
    kind: str
    strain_sectors: Sectors
    strain_edge_uncertainty: Sectors

    @property
    def is_empty(self) -> bool:
        """Whether no unstable direction was found."""
        return not self.sectors

    @property
    def opening(self) -> float:
        """Angle of all sectors together, in degrees."""
        return float(sum(last - first for first, last in self.sectors))

    @property
    def strain_opening(self) -> float:
        """Angle of all `strain_sectors` together, in degrees."""
        return float(sum(last - first for first, last in self.strain_sectors))

    @property
    def smallest_strain_alpha(self) -> float:
        """Direction in degrees of the strain with the smallest value; for strain probes `smallest_alpha`."""
        return float(self.probes.strain_alpha.sel(alpha=self.smallest_alpha))

    def _facts(self) -> dict[str, object]:
        return {
            "second-order work": str(self),
            "imposed": self.kind,
            "directions probed": self.probes.sizes["alpha"],
            "opening": f"{self.opening:.4g} degrees",
            "edges bracketed within": f"{self.tolerance:.2g} degrees",
            "drift's share in the smallest W2n": f"{self.drift_share:.1e}",
        }

    def __str__(self) -> str:
        if self.is_empty:
            words = "no unstable direction"
        elif self.opening == 360.0:
            words = "unstable in all directions"
        else:
            words = "unstable from " + ", ".join(
                f"{first:.4g} +- {give_or_take(low)} to {last:.4g} +- {give_or_take(high)}"
                for (first, last), (low, high) in zip(self.sectors, self.edge_uncertainty, strict=True)
            )
            words += " degrees" + (" of stress" if self.kind == "stress" else "")
        sure = "" if self.is_significant else ", not larger than the drift"
        return f"{words}; smallest W2n {self.smallest_w2n:.3g} at {self.smallest_alpha:.4g} degrees{sure}"


def instability_cone(
    specimen: Specimen,
    directions: Directions | None = None,
    norm: float = 5e-5,
    n_steps: int = 5000,
    *,
    kind: str = "strain",
    tolerance: float = 0.5,
    refine_smallest: bool = False,
    workers: int | None = None,
    progress: Progress = silent,
) -> Cone:
    """Directions in which the second-order work of a state is negative; the specimen is left as it was.

    1. The given directions are probed; a sector narrower than their distance can be missed.
    2. Every edge, where the sign changes between neighbours, is bisected until bracketed within the
       tolerance; the edges of one round are probed together.

    Parameters
    ----------
    specimen : Specimen
        At rest.
    directions : Directions, optional
        Every 10 degrees by default.
    norm, n_steps, kind, workers, progress
        As for `rd.probe`.
    tolerance : float
        Degrees.
    refine_smallest : bool
        Whether the direction of the smallest value is bracketed within the tolerance, too: a cone that has just
        opened is narrower than the directions are apart.

    Returns
    -------
    Cone

    Raises
    ------
    InvalidInput
        If the directions leave a gap of more than 60 degrees.
    """
    probed = probe_to_edges(
        specimen, directions, positive_number("norm", norm), n_steps, kind=kind, tolerance=tolerance,
        refine_smallest=refine_smallest, workers=workers, progress=progress,
    )  # fmt: skip
    return cone_of(probed)


def probe_to_edges(
    specimen: Specimen,
    directions: Directions | None,
    norm: float | Sequence[float],
    n_steps: int,
    *,
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
    if directions is not None and not isinstance(directions, Directions):
        raise InvalidInput(
            f"a cone has its edges in the Rendulic plane: give rd.directions.rendulic(...), not {directions!r}; for "
            "the whole sphere see rd.probe and rd.figures.stereogram"
        )
    around = np.unique(np.array((directions or rendulic()).alpha) % 360.0)
    _check_all_around(around)
    probed, wanted = None, around
    while len(wanted):
        more = probe(specimen, axisymmetric(wanted), norm, n_steps, kind=kind, workers=workers, progress=progress)
        if probed is not None:
            more = xr.concat([probed, more], "alpha", data_vars="minimal", coords="minimal", compat="override")
        probed = more.sortby("alpha")
        w2n = np.atleast_2d(probed.w2_normalised.transpose(..., "alpha").values)
        wanted = probes_wanted(probed.alpha.values, w2n, tolerance, refine_smallest)
    assert probed is not None
    return probed


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
    d_sigma, d_eps = (probes[name].transpose("alpha", "component").values for name in ("d_sigma", "d_eps"))
    strain_alpha = alpha if is_strain else direction_of(d_eps)
    about = {"long_name": "direction of the strain increment", "units": "degree"}
    probes = probes.assign(strain_alpha=("alpha", strain_alpha, about))
    share = share_of_drift(d_eps, probes.d_eps_null.values)
    level = share_of_drift(d_sigma, probes.d_sigma_null.values) + share
    edges = find_edges(alpha, w2n, level, strain_alpha, np.degrees(np.arcsin(share)))
    pairs = sectors_of(edges)
    everywhere: Sectors = ((0.0, 360.0),) if (w2n < 0.0).all() else ()
    edgeless: Sectors = ((float("nan"),) * 2,) * len(everywhere)
    sectors = tuple(between(first.alpha, last.alpha) for first, last in pairs) or everywhere
    uncertainty = tuple((first.uncertainty, last.uncertainty) for first, last in pairs) or edgeless
    responses = [_sector_of_responses(pair, strain_alpha) for pair in pairs]
    worst = int(np.nanargmin(w2n)) if np.isfinite(w2n).any() else 0
    size = float(np.linalg.norm(d_sigma[worst]) * np.linalg.norm(d_eps[worst]))
    drift = float(abs(probes.w2_drift.values[worst]))
    gaps = (np.roll(alpha, -1) - alpha) % 360.0
    return Cone(
        sectors=sectors,
        tolerance=float(max((gaps[edge.before] for edge in edges), default=0.0)),
        smallest_w2n=float(w2n[worst]),
        smallest_alpha=float(alpha[worst]),
        is_significant=bool(probes.is_significant[worst]),
        probes=probes,
        edge_uncertainty=uncertainty,
        drift_share=drift / size if size > 0.0 else float("nan"),
        kind=probes.attrs["kind"],
        strain_sectors=sectors if is_strain else tuple(sector for sector, _ in responses) or everywhere,
        strain_edge_uncertainty=uncertainty if is_strain else tuple(each for _, each in responses) or edgeless,
    )


def _sector_of_responses(
    pair: tuple[Edge, Edge], response: np.ndarray
) -> tuple[tuple[float, float], tuple[float, float]]:
    """The sector that the responses run through from one edge to the other, and the uncertainty of its ends."""
    first, last = pair
    inside = [first.before + 1 + k for k in range((last.before - first.before) % len(response))]
    way = [first.response, *(response[k % len(response)] for k in inside), last.response]
    turned = float(wrap(np.diff(way)).sum())
    # a response can turn the plane over: then the responses run clockwise
    low, high = (first, last) if turned >= 0.0 else (last, first)
    start = low.response % 360.0
    return (start, start + abs(turned)), (low.response_uncertainty, high.response_uncertainty)
