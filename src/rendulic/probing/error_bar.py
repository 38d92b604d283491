"""How far the second-order work of a probe may be from that of a slow probe between two states at rest."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

__all__ = ["COLLAPSE", "LAST", "PARTS", "TOO_FAST", "error_of", "imbalance", "meets_collapse", "rounding"]

# largest unbalanced force on the smooth parts of a probe that is slow enough; `docs/convergence.md` shows why
TOO_FAST = 1e-3
# an unbalanced force on the way, over that of its smooth parts, that only a collapse makes
COLLAPSE = 10.0
# share of the increment over which its second-order work should stay
LAST = 0.2
PARTS = {
    "error_drift": "part of w2_error: drift of the null probe",
    "error_inertia": "part of w2_error: walls' work that is not the contacts'",
    "error_imbalance": "part of w2_error: unbalanced force at the end",
    "error_size": "part of w2_error: change over the last fifth of the increment",
    "error_rate": "part of w2_error: change at half the rate",
    "error_sphere_rule": "part of w2_error: change with other contact planes",
    "error_rounding": "part of w2_error: last digits of the stress",
}


def imbalance(unbalanced_force: np.ndarray, sigma: np.ndarray, d_sigma: np.ndarray, d_eps: np.ndarray) -> np.ndarray:
    """Second-order work in J/m3 that stresses would add if the unbalanced share of the contact forces were still to change.

    Parameters
    ----------
    unbalanced_force : (...) array
        Mean resultant over mean contact force; counted as 1 at most. Without contacts it is infinite, and nothing is left to change.
    sigma : (3,) array
        Principal stresses before, Pa.
    d_sigma, d_eps : (..., 3) arrays
        The increments.
    """
    size = np.maximum(np.linalg.norm(sigma), np.linalg.norm(sigma + d_sigma, axis=-1))
    return (
        np.where(np.isfinite(unbalanced_force), np.minimum(unbalanced_force, 1.0), 0.0)
        * size
        * np.linalg.norm(d_eps, axis=-1)
    )


def rounding(sigma: np.ndarray, d_eps: np.ndarray) -> np.ndarray:
    """Second-order work in J/m3 that the last digits of stresses (3,) in Pa make with strains (..., 3)."""
    return 8.0 * np.finfo(float).eps * np.linalg.norm(sigma) * np.linalg.norm(d_eps, axis=-1)


def meets_collapse(smooth: np.ndarray, largest: np.ndarray) -> np.ndarray:
    """Whether the largest unbalanced force on the way of a probe stands out from that of its smooth parts: grains broke loose."""
    return np.asarray(largest) > COLLAPSE * np.maximum(smooth, 1e-4)


def error_of(parts: Mapping[str, np.ndarray]) -> np.ndarray:
    """The parts together: their sum, as nothing says that they would cancel."""
    return np.sum(list(parts.values()), axis=0)
