"""How contacts are oriented: the fabric tensor and its anisotropy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rendulic.foundation.checks import finite_array

__all__ = ["Fabric", "fabric"]


@dataclass(frozen=True)
class Fabric:
    """Second-order fabric of a set of contacts.

    Parameters
    ----------
    tensor : (3, 3) array
        `F_ij = < n_i n_j >` over the contacts, trace 1; a third of the identity if isotropic. NaN without contacts.
    """

    tensor: np.ndarray

    @property
    def density(self) -> np.ndarray:
        """(3, 3) tensor a of the density of normals, `E(n) = (1 + n.a.n) / (4 pi)`: 15/2 of the deviator of F."""
        return 7.5 * (self.tensor - np.trace(self.tensor) * np.eye(3) / 3.0)

    @property
    def anisotropy(self) -> float:
        """`sqrt(3/2 a : a)`, with the sign of `a_11`: positive if contacts point along axis 1 (after Guo and Zhao 2013)."""
        size = np.sqrt(1.5 * (self.density**2).sum())
        return float(np.copysign(size, self.density[0, 0]))


def fabric(normals) -> Fabric:
    """Fabric of contacts with these unit normals; their sign does not matter.

    Parameters
    ----------
    normals : (n, 3) array
        E.g. `snapshot.normal[~snapshot.is_wall]`: walls point along the axes and are better left out.

    Examples
    --------
    >>> import numpy as np
    >>> round(fabric(np.eye(3)).anisotropy, 12)
    0.0
    """
    normals = finite_array("contact normals", normals, (None, 3))
    if not len(normals):
        return Fabric(np.full((3, 3), np.nan))
    return Fabric(normals.T @ normals / len(normals))
