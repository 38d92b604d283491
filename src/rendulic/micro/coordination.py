"""How many contacts the grains have."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rendulic.specimen.snapshot import Snapshot, as_snapshot

__all__ = ["Coordination", "coordination"]


@dataclass(frozen=True)
class Coordination:
    """Coordination numbers.

    Parameters
    ----------
    mean : float
        Grain-grain contacts counted from both sides, per grain.
    mechanical : float
        The same over the grains with at least two contacts (walls counted for that).
    rattlers : float
        Share of grains with fewer than two contacts.
    """

    mean: float
    mechanical: float
    rattlers: float


def coordination(snapshot: Snapshot) -> Coordination:
    """Coordination with and without rattlers."""
    snapshot = as_snapshot(snapshot)
    n = snapshot.n_grains
    between = ~snapshot.is_wall
    own = np.bincount(snapshot.first[between], minlength=n) + np.bincount(snapshot.second[between], minlength=n)
    all_contacts = own + np.bincount(snapshot.first[~between], minlength=n)
    bearing = all_contacts >= 2
    mechanical = float(own[bearing].mean()) if bearing.any() else 0.0
    return Coordination(float(own.mean()), mechanical, float(1.0 - bearing.mean()))
