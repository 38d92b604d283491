"""The cone of unstable directions, its edges refined by bisection."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from rendulic.checks import positive_number
from rendulic.errors import InvalidInput
from rendulic.loading.directions import Directions, axisymmetric, rendulic
from rendulic.probing.probe import probe
from rendulic.progress import Progress, silent
from rendulic.specimen import Specimen

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Cone", "instability_cone"]

FINEST = 1e-9  # degrees to which an edge can be bracketed
WIDEST = 60.0  # degrees between the directions that are probed first


@dataclass(frozen=True, eq=False)
class Cone:
    """Sectors of the Rendulic plane in which the second-order work is negative.

    Parameters
    ----------
    sectors : tuple of (from, to)
        Directions in degrees, counter-clockwise, `from` in [0, 360), `to` beyond it; (0, 360) if W2 is
        negative all around.
    tolerance : float
        Width in degrees within which each edge was bracketed; the edge is in its middle.
    smallest_w2n : float
        Smallest normalised second-order work found, and
    smallest_alpha : float
        its direction in degrees.
    is_significant : bool
        Whether that value exceeds the share of the null probe's drift in it.
    probes : xarray.Dataset
        Every direction that was probed, sorted; see `rd.probe`.
    """

    sectors: tuple[tuple[float, float], ...]
    tolerance: float
    smallest_w2n: float
    smallest_alpha: float
    is_significant: bool
    probes: xr.Dataset = field(repr=False)

    @property
    def is_empty(self) -> bool:
        """Whether no unstable direction was found."""
        return not self.sectors

    @property
    def opening(self) -> float:
        """Angle of all sectors together, in degrees."""
        return float(sum(last - first for first, last in self.sectors))


def instability_cone(
    specimen: Specimen,
    directions: Directions | None = None,
    norm: float = 5e-5,
    n_steps: int = 5000,
    *,
    kind: str = "strain",
    tolerance: float = 0.5,
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

    Returns
    -------
    Cone

    Raises
    ------
    InvalidInput
        If the directions leave a gap of more than 60 degrees.
    """
    import xarray as xr

    tolerance = max(positive_number("tolerance of a cone's edges", tolerance, "degrees"), FINEST)
    norm = positive_number("norm", norm)
    if directions is not None and not isinstance(directions, Directions):
        raise InvalidInput(
            f"a cone has its edges in the Rendulic plane: give rd.directions.rendulic(...), not {directions!r}; for the "
            "whole sphere see rd.probe and rd.figures.stereogram"
        )
    around = axisymmetric(np.unique(np.array((directions or rendulic()).alpha) % 360.0))
    gaps = (np.roll(around.alpha, -1) - np.array(around.alpha)) % 360.0
    if len(around) < 2 or gaps.max() > WIDEST:
        raise InvalidInput(
            f"the directions of a cone must go all around, at most {WIDEST:g} degrees apart; the widest gap is "
            f"{gaps.max() if len(around) > 1 else 360:g} degrees: nothing is known of what lies in it"
        )
    probed = probe(
        specimen, around, norm, n_steps, kind=kind, workers=workers, progress=progress
    )  # fmt: skip
    while True:
        probed = probed.sortby("alpha")
        alpha = probed.alpha.values
        negative = probed.w2_normalised.values < 0.0
        gaps = (np.roll(alpha, -1) - alpha) % 360.0
        edges = np.flatnonzero(negative != np.roll(negative, -1))
        wide = edges[gaps[edges] > tolerance]
        if not len(wide):
            break
        middles = axisymmetric((alpha[wide] + 0.5 * gaps[wide]) % 360.0)
        more = probe(specimen, middles, norm, n_steps, kind=kind, workers=workers, progress=progress)
        probed = xr.concat([probed, more], "alpha", data_vars="minimal", coords="minimal", compat="override")
    worst = int(np.nanargmin(probed.w2_normalised.values))
    middles = alpha[edges] + 0.5 * gaps[edges]
    opens = [float(m) for m, edge in zip(middles, edges, strict=True) if not negative[edge]]
    closes = [float(m) for m, edge in zip(middles, edges, strict=True) if negative[edge]]
    if not opens:
        sectors: tuple[tuple[float, float], ...] = ((0.0, 360.0),) if negative.all() else ()
    else:
        sectors = tuple(sorted((a % 360.0, a % 360.0 + min((b - a) % 360.0 for b in closes)) for a in opens))
    return Cone(
        sectors=sectors,
        tolerance=float(gaps[edges].max()) if len(edges) else 0.0,
        smallest_w2n=float(probed.w2_normalised[worst]),
        smallest_alpha=float(alpha[worst]),
        is_significant=bool(probed.is_significant[worst]),
        probes=probed,
    )
