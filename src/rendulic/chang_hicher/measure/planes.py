"""The planes of a state: what each carries, and what it needs to carry it."""

from __future__ import annotations

import numpy as np

from rendulic.chang_hicher.kernels.arrays import CONSISTENT, Scratch, new_scratch
from rendulic.chang_hicher.kernels.columns import PLANE, SHARED
from rendulic.chang_hicher.kernels.rates import local_state, sliding
from rendulic.chang_hicher.state import PointState
from rendulic.foundation.errors import InvalidInput

__all__ = ["least_memory", "plane_stresses", "reference_scales", "state_of_planes"]


def state_of_planes(point: PointState, active: np.ndarray | None = None) -> Scratch:
    """What the kernels find at every plane; raises `InvalidInput` if the state is not admissible."""
    n = len(point.memory)
    active = np.zeros(n, dtype=bool) if active is None else active
    scratch = new_scratch(n)
    if not local_state(point.material, point.model.planes, point.sigma, point.eps, point.memory, active, scratch):
        raise InvalidInput(
            f"the stress {np.round(point.sigma[:3] / 1e3, 3).tolist()} kPa puts a contact plane in tension or beyond "
            f"its peak friction (void ratio {point.void_ratio:.4g}): choose a stress nearer to isotropic compression"
        )
    return scratch


def plane_stresses(point: PointState) -> dict[str, np.ndarray]:
    """`sigma`, `tau` (Pa) and normalised obliquity `x` of every plane, (n,) each."""
    seen = state_of_planes(point)
    sigma, tau = seen.plane[:, PLANE.sigma].copy(), seen.plane[:, PLANE.tau].copy()
    return {"sigma": sigma, "tau": tau, "x": tau / sigma / seen.shared[SHARED.tan_peak]}


def least_memory(point: PointState) -> np.ndarray:
    """The hardening that every plane needs to carry the present stress."""
    seen = state_of_planes(point, np.ones(len(point.memory), dtype=bool))
    sigma, kappa, modulus = (seen.plane[:, column] for column in (PLANE.sigma, PLANE.kappa, PLANE.modulus))
    if point.material.formulation != CONSISTENT:
        return kappa.copy()
    return sliding(kappa, sigma, point.material.k_pR * modulus, seen.shared[SHARED.tan_peak])


def reference_scales(point: PointState, seen: Scratch) -> tuple[float, float]:
    """Mean stress and normal stiffness of a plane under it, Pa."""
    p = float(point.sigma[:3].sum()) / 3.0
    return p, float(seen.shared[SHARED.stiffness] * p**point.material.exponent)
