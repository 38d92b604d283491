"""The same state on more contact planes: what the error of a sphere rule is measured with."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from rendulic.chang_hicher.kernels.arrays import CONSISTENT
from rendulic.chang_hicher.kernels.columns import PLANE, SHARED
from rendulic.chang_hicher.kernels.rates import sliding
from rendulic.chang_hicher.law.plane_model import PlaneModel
from rendulic.chang_hicher.measure.planes import state_of_planes
from rendulic.chang_hicher.state import PointState
from rendulic.tensors.mandel import to_mandel
from rendulic.tensors.sphere_rules import LEBEDEV_DEGREES, between, lebedev

__all__ = ["finer_degree", "refined"]

FINER = 2.5  # times as many planes, at least: the error of the finer rule is then small beside that of the own one
AT_YIELD = 1e-8  # friction that a plane has mobilised beyond its obliquity, below which it is at yield
FULL = 1.0 - 1e-6  # share of the peak friction that no plane may reach


def finer_degree(n_planes: int) -> int:
    """The least degree of a Lebedev rule with `FINER` times as many planes; the largest there is if none has so many."""
    # a rule of degree d has (d + 1)^2 / 6 planes, about
    enough = [degree for degree in LEBEDEV_DEGREES if (degree + 1) ** 2 / 6 >= FINER * n_planes]
    if enough:
        return enough[0]
    return LEBEDEV_DEGREES[-1] if (LEBEDEV_DEGREES[-1] + 1) ** 2 / 6 > n_planes else LEBEDEV_DEGREES[-2]


def refined(point: PointState) -> PointState:
    """The present state with a finer sphere rule; the point itself is left as it is.

    Stress, strain and void ratio are those of the point. A plane whose nearest own one is at yield has mobilised what its
    stress needs, exactly; others have mobilised more, by what is interpolated between the own planes, as are the strains
    of the planes. Where the finer planes could not carry the stress at all (one between the own ones is beyond its peak
    friction), its deviator is lowered until the most loaded plane is as near to its limit as that of the point is.
    """
    own = point.model
    fabric = None if own.fabric is None else own.fabric.tobytes()
    model = _finer_model(finer_degree(len(own.rule)), fabric, own.formulation).with_parameters(
        **own.parameters.model_dump()
    )
    nearest, corners, shares, signs = between(own.rule, model.rule)
    seen = state_of_planes(point)
    tan_peak = seen.shared[SHARED.tan_peak]
    excess = np.maximum(seen.plane[:, PLANE.kappa] - seen.plane[:, PLANE.tau] / seen.plane[:, PLANE.sigma], 0.0)
    excess[excess <= AT_YIELD] = 0.0
    more = np.where(excess[nearest] > 0.0, (shares * excess[corners]).sum(axis=1), 0.0)
    strain = np.empty((len(nearest), 4))
    strain[:, 0] = (shares * point.plane_strain[corners, 0]).sum(axis=1)
    # opposite normals have opposite shear
    strain[:, 1:] = ((shares * signs)[:, :, None] * point.plane_strain[corners, 1:]).sum(axis=1)
    fine = PointState(model, point.void_ratio_0, point.sigma.copy(), point.eps.copy(), strain, np.zeros(len(nearest)))
    largest = float((seen.plane[:, PLANE.tau] / seen.plane[:, PLANE.sigma]).max())
    mean = to_mandel(np.eye(3)) * point.sigma[:3].sum() / 3.0
    for _ in range(20):
        seen = state_of_planes(fine)
        obliquity = seen.plane[:, PLANE.tau] / seen.plane[:, PLANE.sigma]
        if obliquity.max() < FULL * tan_peak:
            break
        fine.sigma = mean + (fine.sigma - mean) * min(largest / obliquity.max(), 0.999)
    kappa = np.minimum(obliquity + more, np.maximum(obliquity, FULL * tan_peak))
    if point.material.formulation != CONSISTENT:
        fine.memory = kappa
    else:
        modulus = point.material.k_pR * seen.plane[:, PLANE.modulus]
        fine.memory = sliding(kappa, seen.plane[:, PLANE.sigma], modulus, tan_peak)
    return fine


@lru_cache(maxsize=8)
def _finer_model(degree: int, fabric: bytes | None, formulation: str) -> PlaneModel:
    """The planes, which take a while to make; parameters are put in later."""
    tensor = None if fabric is None else np.frombuffer(fabric).reshape(3, 3)
    return PlaneModel(lebedev(degree), tensor, formulation, {})
