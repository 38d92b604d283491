"""The contact planes of a packing and the static hypothesis on them (paper, Eqs. 18-25)."""

from __future__ import annotations

from itertools import product
from typing import Final, NamedTuple

import numpy as np

from rendulic.foundation.checks import finite_array
from rendulic.foundation.errors import InvalidInput
from rendulic.tensors.mandel import to_mandel, to_tensor
from rendulic.tensors.sphere_rules import SphereRule

__all__ = [
    "AXISYMMETRIC", "EXCHANGE", "GENERAL", "MIRRORS", "ORTHOTROPIC", "Orbits", "PlaneGeometry", "Planes", "contact_density",
    "fabric_of",
]  # fmt: skip

LEAST_DEGREE = 5
# symmetries that a state and all that happens to it may have: none; the coordinate planes are mirrors; and the lateral
# axes are interchangeable, too
GENERAL: Final = 0
ORTHOTROPIC: Final = 1
AXISYMMETRIC: Final = 2
MIRRORS = (np.diag([-1.0, 1.0, 1.0]), np.diag([1.0, -1.0, 1.0]), np.diag([1.0, 1.0, -1.0]))
EXCHANGE = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])  # of the lateral axes


class Planes(NamedTuple):
    """The contact planes and the static hypothesis on them, as arrays."""

    normal: np.ndarray  # (n, 3)
    branch: np.ndarray  # (n, 3) m = F^-1 n / 3: the traction of a plane is sigma . m
    weight3: np.ndarray  # (n,) three times the weights
    elastic: np.ndarray  # (n, 6, 6) compliance of a plane of unit normal stiffness, weighted
    normal_mandel: np.ndarray  # (n, 6) of sym(m x n)
    symmetry: int = GENERAL  # other than GENERAL: each plane stands for all that the symmetry maps it onto


class Orbits(NamedTuple):
    """Which planes a symmetry maps onto each other, and so respond alike."""

    first: np.ndarray  # (r,) a plane of each orbit, that of the least number
    of_plane: np.ndarray  # (n,) the orbit of each plane
    turn: np.ndarray  # (n, 3, 3) what makes of a vector on the first plane of its orbit that on each plane

    def every(self, values: np.ndarray) -> np.ndarray:
        """What numbers of the first planes, (..., r), are on every plane, (..., n)."""
        return values.take(self.of_plane, axis=-1)

    def every_vector(self, vectors: np.ndarray) -> np.ndarray:
        """What vectors on the first planes, (r, 3), are on every plane, (n, 3)."""
        return np.einsum("aij,aj->ai", self.turn, vectors[self.of_plane])


def fabric_of(rule: SphereRule, density: np.ndarray | None = None) -> np.ndarray:
    """`F = <n n>` (3, 3) of trace 1; isotropic: a third of unity.

    `density` (n,) is the relative number of contacts in each direction; None means the same in all.
    """
    weights = rule.weights if density is None else rule.weights * density
    return np.einsum("a,ai,aj->ij", weights / weights.sum(), rule.normals, rule.normals)


def contact_density(rule: SphereRule, fabric: np.ndarray | None) -> np.ndarray:
    """Contacts per direction, second-order: `1 + 15/2 (F' : n n)` for the deviator F' of the fabric.

    Raises
    ------
    InvalidInput
        If the fabric is not a symmetric tensor of trace 1, or so anisotropic that some direction would
        have less than no contacts.
    """
    if fabric is None:
        return np.ones(len(rule))
    tensor = finite_array("fabric", fabric, (3, 3))
    if np.abs(tensor - tensor.T).max() > 1e-12 or abs(np.trace(tensor) - 1.0) > 1e-9:
        raise InvalidInput(f"the fabric must be a symmetric tensor of trace 1, got {tensor.tolist()}")
    density = 1.0 + 7.5 * np.einsum("ai,ij,aj->a", rule.normals, tensor - np.eye(3) / 3.0, rule.normals)
    if density.min() <= 0.0:
        raise InvalidInput(
            f"the fabric {tensor.tolist()} is too anisotropic: the density of contacts would be "
            f"{density.min():.3g} in the poorest direction, it must be positive"
        )
    return density


class PlaneGeometry:
    """Planes and static hypothesis, for any ratio of shear to normal stiffness.

    1. The weights are those of the rule times the density of contacts that has this fabric.
    2. The force of a plane follows from the stress by the inverse fabric, `f_j = V sigma_ij A^-1_ik l_k`;
       as a traction, `t = sigma . m` with `m = F^-1 n / 3`. In an isotropic packing m is n.
    3. The strain is `3 < sym(m x d) > / l`: what makes the work of stress and strain equal to the
       planes' (Eq. 21), and Eq. 45 exact.
    """

    def __init__(self, rule: SphereRule, fabric: np.ndarray | None) -> None:
        if rule.degree < LEAST_DEGREE:
            raise InvalidInput(
                f"the rule '{rule.name}' is exact to degree {rule.degree}: elastic stiffness and fabric need {LEAST_DEGREE}"
            )
        density = contact_density(rule, fabric)
        weights = rule.weights * density / (rule.weights @ density)
        self.normal = np.ascontiguousarray(rule.normals)
        if fabric is None:
            self.branch = self.normal.copy()
        else:
            self.branch = np.ascontiguousarray(np.linalg.solve(fabric_of(rule, density), self.normal.T).T / 3.0)
        self.weight3 = 3.0 * weights
        self.normal_mandel = np.ascontiguousarray(to_mandel(_symmetric(self.branch, self.normal)))
        # stress -> sym(m x (sigma m)), column by column
        tractions = [np.einsum("ij,aj->ai", to_tensor(unit), self.branch) for unit in np.eye(6)]
        spread = np.stack([to_mandel(_symmetric(self.branch, traction)) for traction in tractions], axis=-1)
        self._images: dict[bytes, np.ndarray | None] = {}
        self._orbits: dict[int, Orbits] = {}
        spread = self.weight3[:, None, None] * spread
        normal_part = self.weight3[:, None, None] * _outer(self.normal_mandel, self.normal_mandel)
        self._elastic_parts = {GENERAL: (self.weight3, normal_part, spread)}

    def image(self, operation: np.ndarray) -> np.ndarray | None:
        """The plane onto which an orthogonal `operation` (3, 3) maps each plane; None if it is not a symmetry."""
        key = operation.tobytes()
        if key not in self._images:
            self._images[key] = self._find_image(operation)
        return self._images[key]

    def _find_image(self, operation: np.ndarray) -> np.ndarray | None:
        turned, carried = self.normal @ operation.T, self.branch @ operation.T
        cosines = turned @ self.normal.T
        image = np.abs(cosines).argmax(axis=1)
        sign = np.sign(cosines[np.arange(len(image)), image])[:, None]
        fits = (
            np.abs(sign * self.normal[image] - turned).max() < 1e-9
            and np.abs(sign * self.branch[image] - carried).max() < 1e-9
            and np.abs(self.weight3[image] - self.weight3).max() < 1e-9
        )
        return image if fits else None

    def orbits(self, symmetry: int) -> Orbits:
        """The orbits of the planes under a symmetry that they have."""
        if symmetry not in self._orbits:
            self._orbits[symmetry] = self._find_orbits(symmetry)
        return self._orbits[symmetry]

    def _find_orbits(self, symmetry: int) -> Orbits:
        mirrors = [np.diag(signs) for signs in product((1.0, -1.0), repeat=3)]
        operations = [*mirrors, *(EXCHANGE @ one for one in mirrors)] if symmetry == AXISYMMETRIC else mirrors
        n = len(self.weight3)
        first: list[int] = []
        of_plane, turn = np.full(n, -1), np.empty((n, 3, 3))
        for a in range(n):
            if of_plane[a] >= 0:
                continue
            for operation in operations:
                image = self.image(operation)
                assert image is not None, "the planes do not have this symmetry"
                b = image[a]
                if of_plane[b] < 0:
                    of_plane[b] = len(first)
                    turn[b] = np.sign(self.normal[b] @ operation @ self.normal[a]) * operation
            first.append(a)
        return Orbits(np.array(first), of_plane, turn)

    def planes(self, shear_ratio: float, symmetry: int = GENERAL) -> Planes:
        """What the kernels take, for `k_r / k_n = shear_ratio`; with a symmetry, the first plane of each orbit for all of it."""
        if symmetry not in self._elastic_parts:
            own, n_orbits = self.orbits(symmetry), len(self.orbits(symmetry).first)
            sums = [np.zeros((n_orbits, *part.shape[1:])) for part in self._elastic_parts[GENERAL]]
            for total, part in zip(sums, self._elastic_parts[GENERAL], strict=True):
                np.add.at(total, own.of_plane, part)
            self._elastic_parts[symmetry] = (sums[0], sums[1], sums[2])
        weight3, normal_part, spread = self._elastic_parts[symmetry]
        elastic = normal_part * (1.0 - 1.0 / shear_ratio) + spread / shear_ratio
        if symmetry == GENERAL:
            return Planes(self.normal, self.branch, weight3, elastic, self.normal_mandel)
        first = self.orbits(symmetry).first
        return Planes(self.normal[first], self.branch[first], weight3, elastic, self.normal_mandel[first], symmetry)


def _symmetric(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return 0.5 * (_outer(a, b) + _outer(b, a))


def _outer(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("ai,aj->aij", a, b)
