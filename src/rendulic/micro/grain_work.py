"""Second-order work of each grain."""

from __future__ import annotations

import numpy as np

from rendulic.micro.contact_work import ContactWork
from rendulic.specimen.snapshot import Snapshot, as_snapshot

__all__ = ["grain_work"]


def grain_work(before: Snapshot, after: Snapshot, pairs: ContactWork) -> np.ndarray:
    """Second-order work of each grain: half of its pairs with grains, its pairs with walls, its inertial term.

    Parameters
    ----------
    before, after : Snapshot
        Of one specimen.
    pairs : ContactWork
        Of these two.

    Returns
    -------
    (n,) array
        In J. Their sum is the second-order work of the walls, exactly (theory, Eq. 17).
    """
    before, after = as_snapshot(before), as_snapshot(after)
    n = before.n_grains
    between = pairs.second < n
    own = np.bincount(pairs.first, np.where(between, 0.5, 1.0) * pairs.work, n)
    own += np.bincount(pairs.second[between], 0.5 * pairs.work[between], n)
    d_force = after.resultant[:n] - before.resultant[:n]
    return own + (d_force * (after.position - before.position)).sum(axis=1)
