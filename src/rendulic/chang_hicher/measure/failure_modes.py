"""Failure of planes and of the assembly: plastic limit (mode 1), loss of positiveness (mode 2), cones.

Paper, section 5.2. All of it follows from the tangent of the present state; nothing is integrated.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from rendulic.chang_hicher.kernels.arrays import ControlArrays, Scratch
from rendulic.chang_hicher.kernels.columns import PLANE, SHARED, STATE_ENTRIES, width
from rendulic.chang_hicher.kernels.integrate import find_at_yield
from rendulic.chang_hicher.kernels.rates import VALID, find_loading_planes, void_ratio_effect
from rendulic.chang_hicher.law import plane_law
from rendulic.chang_hicher.law.plane_law import Number
from rendulic.chang_hicher.measure.planes import reference_scales, state_of_planes
from rendulic.chang_hicher.state import PointState
from rendulic.foundation.checks import finite_array
from rendulic.foundation.errors import DidNotConverge, InvalidInput
from rendulic.tensors.mandel import to_mandel, to_tensor
from rendulic.tensors.rendulic_plane import increment_along

__all__ = ["Stability", "Tangent", "closed_form_cone", "plane_stiffness", "stability", "tangent"]

MERGE = 1e-7  # degrees between which two directions are one
INSIDE = 1e-5  # degrees: a zone is at least as wide


@dataclass(frozen=True, eq=False)
class Tangent:
    """The linear response of a state to strain increments near one direction.

    Planes that have no shear yet, and get none in that direction, are elastic in it; a direction that shears
    them has another tangent. In axisymmetric states those are the planes along and across the axis.

    Parameters
    ----------
    stiffness : (6, 6) array
        `d_sigma = L d_eps` in Pa, Mandel components (11, 22, 33, sqrt(2) 23, 13, 12).
    compliance : (6, 6) array
        Its inverse.
    is_loading : (n,) bool array
        Planes in plastic loading.
    measure : (n, 6) array
        Row a times `d_eps` is the loading measure of plane a at yield: positive where it loads.
    at_yield : (n,) bool array
        Planes whose stress lies on their surface.
    """

    stiffness: np.ndarray
    compliance: np.ndarray
    is_loading: np.ndarray
    measure: np.ndarray = field(repr=False)
    at_yield: np.ndarray = field(repr=False)


def tangent(point: PointState, d_eps: np.ndarray) -> Tangent:
    """The tangent of the present state in the direction of a strain increment.

    The response is linear within the sector of directions in which the same planes load. In a state
    without shear (isotropic) it is linear only along rays, and this is the response along `d_eps`.

    Parameters
    ----------
    point : MaterialPoint
        Unchanged.
    d_eps : (3, 3) or principal (3,) array
        Direction, of any length.

    Raises
    ------
    InvalidInput
        If it is zero, or not a symmetric tensor.
    DidNotConverge
        If no set of loading planes is consistent with this increment: the response is not unique.
    """
    direction = _direction(d_eps)
    seen = state_of_planes(point)
    n = len(point.memory)
    p, stiffness = reference_scales(point, seen)
    control = ControlArrays(np.zeros((6, 6)), stiffness * np.eye(6), stiffness * direction, 1.0, p, p / stiffness)
    at_yield, active, rate = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool), np.zeros(width(STATE_ENTRIES))
    find_at_yield(seen, active, at_yield)
    status = find_loading_planes(
        point.material, point.model.planes, control, point.sigma, point.eps, point.memory, at_yield, active, seen, rate
    )
    if status != VALID:
        raise DidNotConverge(
            f"no set of loading planes is consistent with the strain increment {direction.round(4).tolist()} at "
            f"{point!r}: the response is not unique there"
        )
    compliance = seen.compliance.copy()
    own = np.linalg.inv(compliance)
    return Tangent(own, compliance, active, _measures(point, seen, own), at_yield)


def _direction(d_eps: np.ndarray) -> np.ndarray:
    tensor = np.asarray(d_eps, dtype=float)
    tensor = np.diag(finite_array("d_eps", d_eps, (3,))) if tensor.ndim == 1 else finite_array("d_eps", d_eps, (3, 3))
    size = float(np.linalg.norm(tensor))
    if size == 0.0 or np.abs(tensor - tensor.T).max() > 1e-9 * size:
        raise InvalidInput(f"a strain direction must be a symmetric tensor other than zero, got {tensor.tolist()}")
    return to_mandel(tensor / size)


def _measures(point: PointState, seen: Scratch, stiffness: np.ndarray) -> np.ndarray:
    """Loading measures `s . d_tau - a d_sigma_n - (change of resistance)` as linear forms of `d_eps`."""
    planes, shared, own = point.model.planes, seen.shared, seen.plane
    shear = to_mandel(
        0.5 * (np.einsum("ai,aj->aij", planes.branch, seen.flow) + np.einsum("ai,aj->aij", seen.flow, planes.branch))
    )
    trace = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    by_stress = shear - own[:, PLANE.slope, None] * planes.normal_mandel
    by_stress = by_stress - np.outer(own[:, PLANE.softening] * shared[SHARED.by_pressure] / 3.0, trace)
    by_void = np.array(
        [void_ratio_effect(row, shared[SHARED.by_void_ratio], shared[SHARED.density], point.material) for row in own]
    )
    return by_stress @ stiffness + np.outer((1.0 + shared[SHARED.void_ratio]) * by_void, trace)


def plane_stiffness(point: PointState) -> dict[str, Number]:
    """`K_nn, K_nr, K_rn, K_rr` of every plane in loading (Pa), its determinant, and the two modes.

    Returns
    -------
    dict of (n,) arrays
        `K_nn` ... `K_rr`, `determinant` (Pa^2); `mode_1`: at the plastic limit; `mode_2`: W2 is
        negative in some direction. As in Eqs. 36-41 for constant peak friction.
    """
    seen = state_of_planes(point)
    own, k_n = seen.plane, seen.plane[:, PLANE.modulus]
    arguments = (k_n, point.material.k_rR * k_n, own[:, PLANE.hardening], own[:, PLANE.slope], own[:, PLANE.beta])
    k = plane_law.stiffness(*arguments)
    determinant = plane_law.determinant(*arguments)
    return dict(zip(("K_nn", "K_nr", "K_rn", "K_rr"), k, strict=True)) | {
        "determinant": determinant,
        "mode_1": determinant <= 1e-9 * k_n**2,
        "mode_2": ~plane_law.is_positive(*k),
    }


@dataclass(frozen=True, eq=False)
class Stability:
    """What the tangent of a state says about its stability.

    Parameters
    ----------
    hill : float
        Smallest eigenvalue of the symmetric part of the tangent stiffness, Pa; not positive: mode 2, W2
        is negative in the direction `weakest` (Hill's condition is lost).
    weakest : (3, 3) array
        The eigenvector, of norm 1 and either sign. It is an unstable direction of the state only if the
        same planes load in it as in the direction that the tangent was taken in; see `closed_form_cone`.
    determinant : float
        Of the tangent over that of the elastic stiffness; zero: mode 1.
    least_plane_determinant : float
        Smallest `det K / (k_n k_r)` of the planes, zero at the plastic limit.
    unstable_planes : (m,) array of int
        Planes that can lose work (mode 2).
    """

    hill: float
    weakest: np.ndarray
    determinant: float
    least_plane_determinant: float
    unstable_planes: np.ndarray

    @property
    def is_stable(self) -> bool:
        """Whether W2 is positive in every direction in which these planes load (enough, not necessary)."""
        return self.hill > 0.0


def stability(point: PointState, d_eps: np.ndarray) -> Stability:
    """Hill's condition and the determinants for the tangent in the direction `d_eps`; see `tangent`."""
    own = tangent(point, d_eps)
    values, vectors = np.linalg.eigh(0.5 * (own.stiffness + own.stiffness.T))
    k_n = state_of_planes(point).plane[:, PLANE.modulus]
    elastic = np.einsum("aij,a->ij", point.model.planes.elastic, 1.0 / k_n)
    planes = plane_stiffness(point)
    return Stability(
        hill=float(values[0]),
        weakest=to_tensor(vectors[:, 0]),
        determinant=float(np.linalg.det(own.stiffness @ elastic)),
        least_plane_determinant=float((planes["determinant"] / (point.material.k_rR * k_n**2)).min()),
        unstable_planes=np.flatnonzero(planes["mode_2"]),
    )


def closed_form_cone(point: PointState) -> list[tuple[float, float]]:
    """Sectors of the Rendulic plane with negative second-order work, from the tangents alone.

    1. From one direction on, the next one at which a plane at yield begins or ceases to load is a root
       of a linear form in (cos, sin): the edge of a tensorial zone, in which the tangent is constant.
    2. In a zone `W2 = d_eps . L . d_eps` is a quadratic form in (cos, sin); its roots are the edges.

    Returns
    -------
    list of (from, to)
        Directions of strain in degrees, counter-clockwise, `0 <= from < 360`, `from < to`; empty if W2 is
        nowhere negative. [(0, 360)] if it is so everywhere.

    Raises
    ------
    DidNotConverge
        If the response is not unique in some direction.
    """
    frame = to_mandel(np.stack([np.diag(increment_along(alpha)) for alpha in (0.0, 90.0)]))  # cos, sin
    start = _first_edge(point, frame)
    edges: list[tuple[float, float]] = []
    alpha = start
    zones: list[tuple[float, float, Tangent]] = []
    while alpha < start + 360.0 - INSIDE:
        # the zone's tangent, from its middle: near its edge the plane that changes sides there is hardly seen
        inside = alpha + INSIDE
        own, end = tangent(point, np.diag(increment_along(inside))), alpha
        for _ in range(20):
            now = tangent(point, np.diag(increment_along(inside)))
            same = end > alpha and bool((now.is_loading == own.is_loading).all())
            own, end = now, min(_next_edge(now, frame, alpha + INSIDE), start + 360.0)
            if same:
                break
            inside = 0.5 * (alpha + end)
        zones.append((alpha, end, own))
        alpha = end
    for first, last, own in zones:
        form = frame @ own.stiffness @ frame.T
        a, b, c = form[1, 1], form[0, 1] + form[1, 0], form[0, 0]  # of sin^2, sin cos, cos^2
        # W2 = m + r cos(2 alpha - phase)
        mean, size, phase = 0.5 * (a + c), 0.5 * np.hypot(c - a, b), np.degrees(np.arctan2(b, c - a))
        cuts = [first]
        if abs(mean) < size:
            half = np.degrees(np.arccos(-mean / size))
            cuts += sorted(
                first + ((0.5 * (phase + s * half) + turn - first) % 360.0) for s in (-1, 1) for turn in (0, 180)
            )
        cuts = [*(cut for cut in cuts if cut < last), last]
        for low, high in pairwise(cuts):
            middle = np.radians(low + high)  # twice the middle
            if high > low and mean + size * np.cos(middle - np.radians(phase)) < 0.0:
                edges.append((float(low), float(high)))
    return _merged(edges)


def _roots(own: Tangent, frame: np.ndarray) -> np.ndarray:
    """Directions modulo a half turn at which a plane at yield neither loads nor unloads."""
    forms = own.measure[own.at_yield] @ frame.T
    # without planes that neither load nor could
    forms = forms[np.abs(forms).max(axis=1) > 1e-9 * np.abs(own.stiffness).max()]
    return np.degrees(np.arctan2(-forms[:, 0], forms[:, 1])) % 180.0


def _next_edge(own: Tangent, frame: np.ndarray, alpha: float) -> float:
    """The next direction after `alpha` at which a plane changes sides under this tangent."""
    return alpha + float(((_roots(own, frame) - alpha) % 180.0).min(initial=180.0))


def _first_edge(point: PointState, frame: np.ndarray) -> float:
    """A direction at which some plane changes sides, to begin the round with; 0 if there is none."""
    return float(_roots(tangent(point, np.diag(increment_along(0.0))), frame).min(initial=180.0))


def _merged(sectors: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Neighbouring sectors joined, also across the end of the round."""
    joined: list[tuple[float, float]] = []
    for low, high in sectors:
        if joined and low - joined[-1][1] <= MERGE:
            joined[-1] = (joined[-1][0], high)
        else:
            joined.append((low, high))
    if len(joined) > 1 and joined[0][0] + 360.0 - joined[-1][1] <= MERGE:
        first = joined.pop(0)
        joined[-1] = (joined[-1][0], first[1] + 360.0)
    if len(joined) == 1 and joined[0][1] - joined[0][0] >= 360.0 - MERGE:
        return [(0.0, 360.0)]
    return sorted((low % 360.0, low % 360.0 + high - low) for low, high in joined)
