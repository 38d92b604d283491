"""Invariants of stress and strain, compression positive, axis 1 axial (theory, section 1)."""

from __future__ import annotations

import numpy as np

__all__ = ["deviatoric_stress", "mean_stress", "stress_ratio", "volumetric_strain"]


def mean_stress(sigma: np.ndarray) -> np.ndarray:
    """`p = tr(sigma) / 3` of (..., 3, 3) stresses, in their unit."""
    return np.trace(sigma, axis1=-2, axis2=-1) / 3.0


def deviatoric_stress(sigma: np.ndarray) -> np.ndarray:
    """`q = sigma_1 - (sigma_2 + sigma_3) / 2` of (..., 3, 3) stresses, axis 1 axial.

    >>> float(deviatoric_stress(np.diag([300.0, 200.0, 100.0])))
    150.0
    """
    return sigma[..., 0, 0] - 0.5 * (sigma[..., 1, 1] + sigma[..., 2, 2])


def stress_ratio(sigma: np.ndarray) -> np.ndarray:
    """`eta = q / p` of (..., 3, 3) stresses; NaN where p is zero."""
    p = mean_stress(sigma)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(p != 0.0, deviatoric_stress(sigma) / p, np.nan)


def volumetric_strain(eps: np.ndarray) -> np.ndarray:
    """`eps_v = tr(eps)` of (..., 3, 3) strains, contraction positive."""
    return np.trace(eps, axis1=-2, axis2=-1)
