"""The six equations of a control: what the kernels solve at every state of a path."""

from __future__ import annotations

import numpy as np

from rendulic.chang_hicher.kernels.arrays import ControlArrays
from rendulic.chang_hicher.kernels.rates import homogenise
from rendulic.chang_hicher.law.planes import AXISYMMETRIC, EXCHANGE, GENERAL, MIRRORS, ORTHOTROPIC
from rendulic.chang_hicher.measure.planes import reference_scales, state_of_planes
from rendulic.chang_hicher.state import PointState

__all__ = ["control_of", "is_symmetric", "six_equations", "symmetry_of"]


def control_of(
    point: PointState, stress_rows: np.ndarray, strain_rows: np.ndarray, target: np.ndarray
) -> ControlArrays:
    """The kernels' control from three principal equations; strain equations are multiplied by a stiffness."""
    stress_six, strain_six, goal = six_equations(point, stress_rows, strain_rows, target)
    seen = state_of_planes(point)
    p, stiffness = reference_scales(point, seen)
    goal = np.where(np.abs(strain_six).max(axis=1) > 0.0, goal * stiffness, goal)
    strain_six *= stiffness
    homogenise(point.material, point.model.planes, np.zeros(len(point.memory), dtype=bool), seen)
    sign = float(np.sign(np.linalg.det(stress_six + strain_six @ seen.compliance)))
    return ControlArrays(stress_six, strain_six, goal, sign, p, p / stiffness)


def six_equations(
    point: PointState, stress_rows: np.ndarray, strain_rows: np.ndarray, target: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Equations (6, 6), (6, 6), (6,) of stress and strain rates from three principal ones.

    Shear strains are held, or shear stresses if only stresses are controlled. Where planes, memory and
    stress do not tell the signs of the axes apart, shear stresses are held in any case, and where the
    lateral axes are interchangeable, the difference of the lateral stresses is held in place of that of
    the strains. By symmetry that is the same test; but the planes can lose all resistance to a difference
    of lateral strains, and then imposing it exactly would make rounding errors grow without bound.
    """
    by_strain = np.abs(strain_rows).max(axis=1) > 0.0
    strains, imposed = strain_rows[by_strain], target[by_strain]
    stresses, held = stress_rows[~by_strain], target[~by_strain]
    lateral = np.array([0.0, 1.0, -1.0]) / np.sqrt(2.0)
    stress = point.stress
    if len(strains):
        rate = np.linalg.pinv(strains) @ imposed
        spanned = np.linalg.matrix_rank(np.vstack((strains, lateral))) == len(strains)
        if spanned and abs(rate @ lateral) <= 1e-14 * np.abs(rate).max() and is_symmetric(point, EXCHANGE, stress):
            # a basis of the controlled strains without their lateral difference
            _, size, basis = np.linalg.svd(strains - np.outer(strains @ lateral, lateral))
            strains = basis[: int((size > 1e-9).sum())]
            imposed = strains @ rate
            stresses, held = np.vstack((stresses, lateral)), np.append(held, 0.0)
    six, k = np.zeros((2, 6, 6)), len(stresses)
    six[0, :k, :3], six[1, k:3, :3] = stresses, strains
    free = not len(strains) or all(is_symmetric(point, mirror, stress) for mirror in MIRRORS)
    six[0 if free else 1, 3:, 3:] = np.eye(3)
    return six[0], six[1], np.concatenate((held, imposed, np.zeros(3)))


def is_symmetric(point: PointState, operation: np.ndarray, stress: np.ndarray) -> bool:
    """Whether planes, memory and `stress` are the same after an orthogonal operation (3, 3) on the axes."""
    image = point.model.geometry.image(operation)
    return (
        image is not None
        and bool(np.abs(operation @ stress @ operation.T - stress).max() <= 1e-9 * np.abs(stress).max())
        and bool(np.abs(point.memory[image] - point.memory).max() <= 1e-6 * np.abs(point.memory).max())
    )


def symmetry_of(point: PointState, control: ControlArrays) -> int:
    """The symmetry that a point has and keeps under a control: one of those of `law.planes`.

    Planes that it maps onto each other then respond alike, and one of them is enough.
    """
    shears = control.stress_rows[3:, 3:]
    stress = point.stress
    if not (shears == np.eye(3)).all() or control.target[3:].any():
        return GENERAL
    if not all(is_symmetric(point, one, stress) and _keeps_strains(point, one) for one in MIRRORS):
        return GENERAL
    if not (is_symmetric(point, EXCHANGE, stress) and _keeps_strains(point, EXCHANGE)):
        return ORTHOTROPIC
    # the three principal equations, all terms of one size: are they the same when the lateral axes are exchanged?
    scale = control.strain_scale / control.stress_scale
    size = max(float(np.abs(control.target[:3]).max()), 1e-300)
    own = np.column_stack((control.stress_rows[:3, :3], control.strain_rows[:3, :3] * scale, control.target[:3] / size))
    basis = np.linalg.qr(own.T)[0]
    exchanged = own[:, [0, 2, 1, 3, 5, 4, 6]].T
    left = exchanged - basis @ (basis.T @ exchanged)
    return AXISYMMETRIC if np.abs(left).max() <= 1e-12 else ORTHOTROPIC


def _keeps_strains(point: PointState, operation: np.ndarray) -> bool:
    """Whether the strains of the planes are the same after an operation that maps planes onto planes."""
    geometry = point.model.geometry
    image, strain = geometry.image(operation), point.plane_strain
    assert image is not None
    sense = np.sign(np.einsum("ai,ij,aj->a", geometry.normal[image], operation, geometry.normal))
    turned = sense[:, None] * (strain[:, 1:] @ operation.T)
    limit = 1e-9 * np.abs(strain).max()
    return bool(
        np.abs(strain[image, 0] - strain[:, 0]).max() <= limit and np.abs(strain[image, 1:] - turned).max() <= limit
    )
