"""The state of a material point: plain numbers and arrays, all of them named here."""

from __future__ import annotations

from dataclasses import dataclass, field, fields

import numpy as np

from rendulic.chang_hicher.law.parameters import MaterialConstants
from rendulic.chang_hicher.law.plane_model import PlaneModel
from rendulic.tensors.mandel import to_tensor

__all__ = ["ARRAYS", "N", "PointState"]

N = -1  # in a shape: the number of planes


@dataclass(eq=False, repr=False)
class PointState:
    """One state of a sand.

    Parameters
    ----------
    model : PlaneModel
        Parameters, planes and formulation.
    void_ratio_0 : float
        Void ratio at zero strain.
    sigma, eps : (6,) arrays
        Stress in Pa and strain, Mandel vectors.
    plane_strain : (n, 4) array
        Normal strain and shear strain vector of every plane.
    memory : (n,) array
        Hardening of every plane: plastic sliding (`consistent`) or mobilised friction.
    """

    model: PlaneModel
    void_ratio_0: float
    sigma: np.ndarray = field(metadata={"shape": (6,)})
    eps: np.ndarray = field(metadata={"shape": (6,)})
    plane_strain: np.ndarray = field(metadata={"shape": (N, 4)})
    memory: np.ndarray = field(metadata={"shape": (N,)})
    material: MaterialConstants = field(init=False)

    def __post_init__(self) -> None:
        self.material = self.model.constants_at(self.void_ratio_0)

    @property
    def stress(self) -> np.ndarray:
        """(3, 3) in Pa."""
        return to_tensor(self.sigma)

    @property
    def strain(self) -> np.ndarray:
        """(3, 3), logarithmic, zero where the point was made."""
        return to_tensor(self.eps)

    @property
    def void_ratio(self) -> float:
        """e, which follows the volumetric strain."""
        return float((1.0 + self.void_ratio_0) * np.exp(-self.eps[:3].sum()) - 1.0)

    def __repr__(self) -> str:
        stress = ", ".join(f"{value / 1e3:.1f}" for value in self.sigma[:3])
        return f"{type(self).__name__}(stress=({stress}) kPa, void_ratio={self.void_ratio:.4f}, {self.model!r})"

    def arrays(self) -> dict[str, np.ndarray]:
        """A copy of every array."""
        return {name: getattr(self, name).copy() for name in ARRAYS}


# to every array its shape; what is saved, restored and cloned follows from it
ARRAYS: dict[str, tuple[int, ...]] = {
    own.name: own.metadata["shape"] for own in fields(PointState) if "shape" in own.metadata
}
