"""Love-Weber stress: from contacts and branches."""

from __future__ import annotations

import numpy as np

from rendulic.specimen.snapshot import Snapshot, as_snapshot

__all__ = ["love_weber_stress"]


def love_weber_stress(snapshot: Snapshot) -> np.ndarray:
    """`sigma_ij = (1/V) sum_c f_i l_j` over all contacts, walls included (paper, Eq. 4).

    Returns
    -------
    (3, 3) array
        In Pa, compression positive. In equilibrium it equals the wall tractions
        (`Snapshot.wall_stress`); the difference measures what is unbalanced.
    """
    snapshot = as_snapshot(snapshot)
    return snapshot.force.T @ snapshot.branch / snapshot.volume
