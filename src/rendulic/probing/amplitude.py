"""The cone against the size of the probes: where between drift and large steps it does not depend on it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rendulic.foundation.checks import finite_array, positive_number
from rendulic.foundation.errors import InvalidInput
from rendulic.foundation.progress import Progress, silent
from rendulic.loading.directions import Directions
from rendulic.probing.cone import cone_of, probe_to_edges
from rendulic.probing.cone_table import cone_table
from rendulic.probing.edges import signs_of
from rendulic.probing.probe import warn_of_doubts
from rendulic.specimen.protocol import Specimen

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["amplitude_table", "cones_by_amplitude", "plateau"]

LEAST_SPAN = 3.0  # largest over smallest norm of a plateau
LEAST_NORMS = 3


def cones_by_amplitude(
    specimen: Specimen,
    norms: Sequence[float],
    directions: Directions | None = None,
    n_steps: int | None = None,
    *,
    rate: float | None = None,
    settle: bool = True,
    check_rate: bool = False,
    kind: str = "strain",
    tolerance: float = 0.5,
    refine_smallest: bool = False,
    change: float = 0.05,
    workers: int | None = None,
    progress: Progress = silent,
) -> xr.Dataset:
    """Cones of one state at several probe sizes, and the range of sizes in which they agree.

    1. One sweep reads every direction at all norms (`rd.probe`); the edges of all norms are bisected together, and
       every probe serves all of them.
    2. The plateau is the widest range of successive norms, three at least and a factor of 3 or more, in which the
       smallest W2n always exceeds its error and changes by less than `change`.

    Parameters
    ----------
    specimen : Specimen
        At rest; left as it was.
    norms : increasing sequence of float
        Strains, or Pa for `kind="stress"`; a few per decade.
    directions, rate, settle, check_rate, kind, tolerance, refine_smallest, workers, progress, n_steps
        As for `rd.instability_cone`.
    change : float
        Of the smallest W2n, which lies in [-1, 1].

    Returns
    -------
    xarray.Dataset
        Dimension `norm`: `smallest_w2n`, `smallest_alpha`, `smallest_error`, `opening`, the edges and their uncertainties
        (dimension `sector`, directions of strain), the sectors of unknown sign (`unknown_sector`), `is_plateau`. `w2_normalised` of
        all probes and its sign where it is sure, `w2_sign`, dimensions `norm` and `alpha`. The attributes say `plateau_from` and `plateau_to` (NaN if there is none),
        `plateau_w2n`, the mean of the smallest W2n in it, `plateau_verdict` and `plateau_change`.

    Raises
    ------
    InvalidInput
        If the norms are not positive and increasing, or the directions leave a gap of more than 60 degrees.
    """
    sizes = finite_array("norms", norms, (None,))
    if len(sizes) < 2:
        raise InvalidInput(f"a dependence on amplitude needs two norms or more, got {norms!r}")
    change = positive_number("change of the smallest W2n within a plateau", change)
    probed = probe_to_edges(
        specimen, directions, sizes.tolist(), rate=rate, settle=settle, check_rate=check_rate, kind=kind, tolerance=tolerance,
        refine_smallest=refine_smallest, workers=workers, progress=progress, n_steps=n_steps,
    )  # fmt: skip
    warn_of_doubts(probed)
    return amplitude_table(probed, change)


def amplitude_table(probed: xr.Dataset, change: float = 0.05) -> xr.Dataset:
    """The cones in a sweep of probes, and the plateau; see `cones_by_amplitude`.

    Parameters
    ----------
    probed : xarray.Dataset
        From `rd.probe` with several norms, directions of the Rendulic plane all around.
    """
    sizes = probed.norm.values
    cones = np.empty(len(sizes), dtype=object)
    cones[:] = [cone_of(probed.isel(norm=k)) for k in range(len(sizes))]
    table = cone_table(cones, {"norm": probed.norm})
    for name in ("w2_normalised", "w2_drift", "w2_macro"):
        table[name] = probed[name]
    table["w2_sign"] = signs_of(probed)
    table["w2_sign"].attrs = {"long_name": "sign of the second-order work where it is sure, else 0"}
    found = plateau(sizes, table.smallest_w2n.values, table.is_significant.values, change)
    inside = np.zeros(len(sizes), dtype=bool)
    if found is not None:
        inside[slice(*found)] = True
        verdict = f"from {sizes[inside][0]:.3g} to {sizes[inside][-1]:.3g}"
    elif not table.is_significant.any():
        verdict = "none: no smallest W2n exceeds its error"
    else:
        verdict = f"none: nowhere does the smallest W2n change by less than {change:g} over a factor of {LEAST_SPAN:g}"
    table["is_plateau"] = ("norm", inside, {"long_name": "norm within the plateau of the smallest W2n"})
    nowhere = float("nan")
    return table.assign_attrs(
        kind=probed.attrs["kind"],
        rate=probed.attrs.get("rate", nowhere),
        plateau_from=float(sizes[inside][0]) if inside.any() else nowhere,
        plateau_to=float(sizes[inside][-1]) if inside.any() else nowhere,
        plateau_w2n=float(table.smallest_w2n.values[inside].mean()) if inside.any() else nowhere,
        plateau_verdict=verdict,
        plateau_change=change,
    )


def plateau(norms: np.ndarray, smallest: np.ndarray, is_sure: np.ndarray, change: float) -> tuple[int, int] | None:
    """The widest range of norms in which the smallest W2n hardly changes, as indices (first, beyond the last).

    Parameters
    ----------
    norms, smallest, is_sure : (n,) arrays
        Increasing norms, the smallest W2n of each, and whether its sign is sure.
    change : float
        Largest less smallest value within the range.

    Returns
    -------
    (int, int) or None
        None if no range of three norms and a factor of 3 is that even. Of equally wide ones the first.

    Examples
    --------
    >>> norms = np.array([1e-6, 1e-5, 1e-4, 1e-3])
    >>> plateau(norms, np.array([0.9, -0.2, -0.21, -0.22]), np.ones(4, dtype=bool), 0.05)
    (1, 4)
    """
    best, widest = None, LEAST_SPAN * (1.0 - 1e-9)
    for first in range(len(norms)):
        for beyond in range(first + LEAST_NORMS, len(norms) + 1):
            span = norms[beyond - 1] / norms[first]
            if is_sure[first:beyond].all() and np.ptp(smallest[first:beyond]) <= change and span > widest:
                best, widest = (first, beyond), span * (1.0 + 1e-9)
    return best
