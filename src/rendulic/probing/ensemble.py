"""Cones of several specimens of one kind: what is common to them, and what is chance."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rendulic.foundation.errors import InvalidInput
from rendulic.loading.directions import Directions
from rendulic.probing.cone import instability_cone
from rendulic.probing.cone_table import cone_table, with_spread
from rendulic.specimen.protocol import Specimen

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["cone_ensemble"]


def cone_ensemble(
    specimens: Iterable[Specimen],
    directions: Directions | None = None,
    norm: float | None = None,
    n_steps: int | None = None,
    *,
    labels: Sequence[Any] | None = None,
    **options: Any,
) -> xr.Dataset:
    """Cones of several specimens, e.g. of one recipe and many seeds, with median and spread.

    One loose packing does not settle where a cone opens: it moves in avalanches, and a state just before one is
    unstable, one just after it is not. The specimens are left as they were, and taken one after the other, so
    that a generator may make each when it is its turn.

    Parameters
    ----------
    specimens : iterable of Specimen
        At rest.
    directions, norm, n_steps, options
        As for `rd.instability_cone`.
    labels : sequence, optional
        One for each specimen, e.g. the seeds; numbered from 0 by default.

    Returns
    -------
    xarray.Dataset
        Dimensions `specimen` and `sector` (widest first): `smallest_w2n`, `smallest_alpha`, `drift_share`, `opening`,
        `is_significant`, `is_unstable`, the edges and their uncertainties; all directions are those of strain. Over the
        specimens, dimension `statistic` ("smallest", "lower_quartile", "median", "upper_quartile", "largest"):
        `smallest_w2n_summary`, `smallest_alpha_summary`, `opening_summary`, and of the widest sectors of those with a
        cone `edge_from_summary`, `edge_to_summary`; directions are circular. `unstable_share`, `stable_share` and
        `unknown_share` are the shares of specimens that are so: surely negative in some direction, surely positive in all, or
        neither.

    Raises
    ------
    InvalidInput
        If there is no specimen, or not one label for each.

    Examples
    --------
    >>> import rendulic as rd
    >>> sands = (rd.ChangHicher(tan_phi_mu=t).at(pressure=300e3, void_ratio=0.9) for t in (0.6, 0.65, 0.7))
    >>> table = rd.cone_ensemble(sands, norm=1e-7)
    >>> table.sizes["specimen"], float(table.unstable_share)
    (3, 0.0)
    """
    found = [instability_cone(specimen, directions, norm, n_steps, **options) for specimen in specimens]
    labels = list(range(len(found)) if labels is None else labels)
    if not found or len(labels) != len(found):
        raise InvalidInput(
            f"an ensemble needs specimens, and one label for each: got {len(found)} and {len(labels)} labels"
        )
    cones = np.empty(len(found), dtype=object)
    cones[:] = found
    table = with_spread(cone_table(cones, {"specimen": labels}))
    return table.assign_attrs(norm=float(found[0].probes.norm), rate=found[0].probes.attrs["rate"], kind=found[0].kind)
