"""Which linear combinations of stress and of strain are controlled.

In principal axes a loading of an axisymmetric or cubical test has three components. Any three
independent combinations of the strains, `e = T eps`, have conjugate stresses `s = T^-T sigma`, so
that `s . de = sigma : d_eps` and the second-order work is `ds . de`. One of each pair is controlled.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rendulic.foundation.checks import finite_array
from rendulic.foundation.errors import InvalidInput, one_of

__all__ = ["Control"]


@dataclass(frozen=True)
class Control:
    """Three generalised components, each controlled in strain or in stress.

    Parameters
    ----------
    strain_basis : (3, 3) array
        `T`; row k gives component k of the strain from the principal strains.
    controlled : tuple of {"strain", "stress"}
        What is imposed for each component.

    Raises
    ------
    InvalidInput
        If the combinations are not independent, or a word is unknown.

    Examples
    --------
    The proportional path `d_eps_1 + 2 R d_eps_3 = 0` has the conjugate stress `sigma_1 - sigma_3 / R`:

    >>> control = Control.of_strains([[1, 0, 0], [1, 2, 2], [0, 1, -1]], ("stress", "strain", "strain"))
    >>> control.stress_basis[0].tolist()
    [1.0, -0.25, -0.25]

    (R = 2 here, with `sigma_2 = sigma_3`.)
    """

    strain_basis: tuple[tuple[float, ...], ...]
    controlled: tuple[str, str, str]

    def __post_init__(self) -> None:
        basis = finite_array("a control basis", self.strain_basis, (3, 3))
        if abs(np.linalg.det(basis)) <= 1e-12 * np.linalg.norm(basis) ** 3:
            raise InvalidInput(f"the three controlled combinations must be independent, got {basis.tolist()}")
        if len(self.controlled) != 3:
            raise InvalidInput(f"three components must be controlled, got {len(self.controlled)}")
        for word in self.controlled:
            one_of(word, ("strain", "stress"), "controlled quantity")

    @classmethod
    def of_strains(cls, strain_basis, controlled) -> Control:
        """From combinations of strain; the stresses are their conjugates."""
        basis = finite_array("a control basis", strain_basis, (3, 3))
        return cls(tuple(map(tuple, basis.tolist())), tuple(controlled))

    @classmethod
    def of_stresses(cls, stress_basis, controlled) -> Control:
        """From combinations of stress; the strains are their conjugates."""
        basis = finite_array("a control basis", stress_basis, (3, 3))
        if abs(np.linalg.det(basis)) <= 1e-12 * np.linalg.norm(basis) ** 3:
            raise InvalidInput(f"the three stress combinations must be independent, got {basis.tolist()}")
        return cls.of_strains(np.linalg.inv(basis).T, controlled)

    @property
    def stress_basis(self) -> np.ndarray:
        """(3, 3) rows that give the conjugate stresses from the principal stresses."""
        return np.ascontiguousarray(np.linalg.inv(np.asarray(self.strain_basis)).T)

    @property
    def is_stress(self) -> np.ndarray:
        """(3,) bool: components controlled in stress."""
        return np.array([word == "stress" for word in self.controlled])
