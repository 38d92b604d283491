"""What the kernels of the model take: numbers and arrays, grouped. All float64 unless said otherwise.

Stress and strain are Mandel vectors (6,): 11, 22, 33, then 23, 13, 12 times sqrt(2), so that the
product of two is the tensors' double contraction.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

__all__ = ["Control", "Log", "Material", "Planes", "Step", "Work", "to_mandel", "to_tensor", "work_for"]

ROOT2 = float(np.sqrt(2.0))
PAIRS = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))

# columns of `Work.plane`
SIGMA, TAU, MODULUS, X, HARDENING, SLOPE, BETA, SOFTENING, MULTIPLIER, W2, EXCESS, KAPPA, W2_NORMALISED = range(13)
N_COLUMNS = 13
# entries of `Work.scalar`
STIFFNESS, TAN_PEAK, BY_PRESSURE, BY_VOID_RATIO, DENSITY, VOID_RATIO, DETERMINANT = range(7)
# what ends a path: stress ratio and the side from which it is reached (0: none), drop of q (0: none), q at the start,
# largest change of q so far, bound on strain (0: none), axis it is of (-1: any), strain at the start, least plane stress
UNTIL_ETA, ETA_SIDE, DROP, Q_START, LARGEST_CHANGE, REACH, REACH_AXIS, EPS_START, FLOOR, N_UNTIL = (
    0,
    1,
    2,
    3,
    4,
    5,
    6,
    7,
    10,
    11,
)
# formulations, in the order of `plane_law.FORMULATIONS`
PRINTED, EQ32, CONSISTENT = range(3)


class Material(NamedTuple):
    """The parameters as numbers; see `parameters.Parameters`."""

    k_n0: float
    f_ref: float
    exponent: float
    k_rR: float
    k_pR: float
    dilatancy: float
    tan_phi_mu: float
    tan_phi_0: float
    e_ref: float
    critical_slope: float
    p_ref: float
    interlocking: float
    branch_length: float
    formulation: int
    void_ratio_0: float  # at zero strain


class Planes(NamedTuple):
    """The contact planes and the static hypothesis on them."""

    normal: np.ndarray  # (n, 3)
    branch: np.ndarray  # (n, 3) m = F^-1 n / 3: the traction of a plane is sigma . m
    weight3: np.ndarray  # (n,) three times the weights
    elastic: np.ndarray  # (n, 6, 6) compliance of a plane of unit normal stiffness, weighted
    normal_mandel: np.ndarray  # (n, 6) of sym(m x n)


class Control(NamedTuple):
    """Six linear equations per unit of the path's parameter: `S d_sigma + E d_eps = r d_lambda`."""

    stress_rows: np.ndarray  # (6, 6)
    strain_rows: np.ndarray  # (6, 6), times a reference stiffness
    target: np.ndarray  # (6,)
    sign: float  # of the determinant in the elastic state
    stress_scale: float
    strain_scale: float


class Work(NamedTuple):
    """Room for the kernels, and what they found at the last look."""

    plane: np.ndarray  # (n, N_COLUMNS)
    shear: np.ndarray  # (n, 3) tau
    flow: np.ndarray  # (n, 3) direction of plastic shear
    local_rate: np.ndarray  # (n, 4) of normal strain and of shear strain
    compliance: np.ndarray  # (6, 6)
    matrix: np.ndarray  # (6, 6)
    scalar: np.ndarray  # (7,)
    gather: np.ndarray  # (2, 6)
    shear_mandel: np.ndarray  # (n, 6)


class Step(NamedTuple):
    """Room for one step of the integration."""

    k: np.ndarray  # (7, 13) rates at the stages
    y: np.ndarray  # (13,) state at the end
    local: np.ndarray  # (n, 4) strains that the planes gained
    values: np.ndarray  # (2 + 2 n,) monitors


class Log(NamedTuple):
    """Room for what is recorded on the way; see `integrate.record` and `integrate.note` for the columns."""

    rows: np.ndarray  # (m, RECORD_COLUMNS)
    plane_rows: np.ndarray  # (m, n, PLANE_COLUMNS)
    compliances: np.ndarray  # (m, 6, 6)
    events: np.ndarray  # (k, 15) kind, plane, state
    counts: np.ndarray  # (2,) int64, records and events so far


def work_for(n_planes: int) -> Work:
    """Empty room for this many planes."""
    return Work(
        np.zeros((n_planes, N_COLUMNS)), np.zeros((n_planes, 3)), np.zeros((n_planes, 3)), np.zeros((n_planes, 4)),
        np.zeros((6, 6)), np.zeros((6, 6)), np.zeros(7), np.zeros((2, 6)), np.zeros((n_planes, 6)),
    )  # fmt: skip


def to_mandel(tensor: np.ndarray) -> np.ndarray:
    """Mandel vector (..., 6) of symmetric tensors (..., 3, 3)."""
    return np.stack([tensor[..., i, j] * (1.0 if i == j else ROOT2) for i, j in PAIRS], axis=-1)


def to_tensor(vector: np.ndarray) -> np.ndarray:
    """Symmetric tensors (..., 3, 3) of Mandel vectors (..., 6)."""
    vector = np.asarray(vector)
    tensor = np.empty((*vector.shape[:-1], 3, 3))
    for k, (i, j) in enumerate(PAIRS):
        tensor[..., i, j] = tensor[..., j, i] = vector[..., k] / (1.0 if i == j else ROOT2)
    return tensor
