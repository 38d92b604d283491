"""How far grains are from equilibrium."""

from __future__ import annotations

import numpy as np

__all__ = ["unbalanced_ratio"]


def unbalanced_ratio(resultant: np.ndarray, total_force: float, n_contacts: int) -> float:
    """Mean |resultant on a grain| over mean |contact force|; infinite without contact forces.

    Parameters
    ----------
    resultant : (n, 3) array
        On every grain, in N.
    total_force : float
        Sum of |force| over the contacts, in N.
    n_contacts : int
        That many.
    """
    if total_force == 0.0:
        return float("inf")
    return float(np.linalg.norm(resultant, axis=1).mean() * n_contacts / total_force)
