"""A material point of the Chang-Hicher model: a `Specimen`."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from rendulic.chang_hicher.drive import controllability, following
from rendulic.chang_hicher.kernels.arrays import SIGMA, TAN_PEAK, TAU, to_tensor
from rendulic.chang_hicher.model import ChangHicher
from rendulic.foundation.checks import finite_array
from rendulic.foundation.errors import InvalidInput, one_of
from rendulic.foundation.progress import Progress, silent
from rendulic.loading.paths import Path
from rendulic.specimen.state import State
from rendulic.tensors.sphere_rules import SphereRule

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["MaterialPoint"]

KIND = "Chang-Hicher point"


class MaterialPoint:
    """One state of a sand, made by `ChangHicher.at`.

    Parameters
    ----------
    model : ChangHicher
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

    def __init__(
        self, model: ChangHicher, void_ratio_0: float, sigma: np.ndarray, eps: np.ndarray,
        plane_strain: np.ndarray, memory: np.ndarray,
    ) -> None:  # fmt: skip
        self.model = model
        self.material = model.material_at(void_ratio_0)
        self.sigma, self.eps, self.plane_strain, self.memory = sigma, eps, plane_strain, memory

    @classmethod
    def virgin(cls, model: ChangHicher, sigma: np.ndarray, void_ratio: float) -> MaterialPoint:
        """A point whose planes have mobilised just what this stress needs; see `ChangHicher.at`."""
        n = len(model.rule)
        point = cls(model, void_ratio, sigma, np.zeros(6), np.zeros((n, 4)), np.zeros(n))
        point.memory = following.least_memory(point)
        return point

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
        return float((1.0 + self.material.void_ratio_0) * np.exp(-self.eps[:3].sum()) - 1.0)

    def __repr__(self) -> str:
        stress = ", ".join(f"{value / 1e3:.1f}" for value in self.sigma[:3])
        return f"MaterialPoint(stress=({stress}) kPa, void_ratio={self.void_ratio:.4f}, {self.model!r})"

    def planes(self) -> dict[str, np.ndarray]:
        """Normal stress, shear stress (Pa) and normalised obliquity x of every plane, (n,) each."""
        work = following.look_at(self)
        sigma, tau = work.plane[:, SIGMA].copy(), work.plane[:, TAU].copy()
        return {"sigma": sigma, "tau": tau, "x": tau / sigma / work.scalar[TAN_PEAK]}

    def load(
        self,
        path: Path,
        *,
        tolerance: float = following.TOLERANCE,
        least_records: int = 200,
        progress: Progress = silent,
        on_record: Callable[[MaterialPoint], None] | None = None,
    ) -> xr.Dataset:
        """Follow a path, in place, with every event on the way.

        1. Stresses that the path holds at other values are brought there first, driven strains at rest.
        2. The driven strains advance; each step is as long as the tolerance admits, and ends where a
           plane begins or ceases to load.
        3. The path ends at its strain, stress ratio or peak, or where no quasi-static continuation
           exists: `stopped_by` then says "loss of controllability", "plastic limit" (only formulations
           that are not defined beyond), "no stress left" or "no voids left". The point stays there. The
           bound of strain (`Until`) holds for any axis while stresses are brought to their places.

        Parameters
        ----------
        path : Path
            E.g. `rd.paths.constant_volume(0.2)`.
        tolerance : float
            Error per step, relative to the stress, and to the elastic strain of that stress.
        least_records : int
            At least so many along the path; short steps add more.
        progress, on_record : callable, optional
            Called now and then.

        Returns
        -------
        xarray.Dataset
            Dimension `record` (two records at one strain where a plane changes sides): the curve (`rendulic.specimen.curve`), with `w2` per squared axial strain rate in
            Pa, determinants and Hill's eigenvalue; `plane`: local stresses, strains and W2; `event`: what
            happened where. See `following.dataset`.

        Raises
        ------
        InvalidInput
            If the control is impossible from the first step on, or an option is out of range.
        """
        return following.load(self, path, tolerance, least_records, progress, on_record)

    def probe(
        self,
        increment: np.ndarray,
        n_steps: int = 1,
        *,
        kind: str = "strain",
        marks: tuple[float, ...] = (1.0,),
        on_mark: Callable[[float], None] | None = None,
    ) -> None:
        """Impose a principal strain or stress increment (3,), in place.

        `n_steps` is of no account: the integration chooses its own. A stress increment that the point
        cannot carry is followed as far as it goes; the remaining marks are called there.
        """
        one_of(kind, ("strain", "stress"), "kind of probe")
        following.probe(self, finite_array("increment", increment, (3,)), kind, marks, on_mark)

    def burst(
        self, direction, norm: float, n_steps: int = 1, *, on_window: Callable[..., None] | None = None
    ) -> xr.Dataset:
        """Increase the load conjugate to a direction a little, in place. See `controllability.burst`.

        `n_steps` and `on_window` are of no account: there is no inertia.
        """
        return controllability.burst(self, direction, norm)

    def clone(self) -> MaterialPoint:
        """An independent point in the same state."""
        return MaterialPoint(
            self.model, self.material.void_ratio_0, self.sigma.copy(), self.eps.copy(), self.plane_strain.copy(),
            self.memory.copy(),
        )  # fmt: skip

    def save(self) -> State:
        """The whole state, exact to the bit, with the model."""
        model = self.model
        attributes: dict[str, Any] = {
            "parameters": model.parameters.model_dump(),
            "formulation": model.formulation,
            "rule": model.rule.name,
            "rule_degree": model.rule.degree,
            "void_ratio_0": self.material.void_ratio_0,
        }
        arrays = {
            "sigma": self.sigma.copy(),
            "eps": self.eps.copy(),
            "plane_strain": self.plane_strain.copy(),
            "memory": self.memory.copy(),
            "plane_normals": model.rule.normals.copy(),
            "plane_weights": model.rule.weights.copy(),
        }
        if model.fabric is not None:
            arrays["fabric"] = model.fabric.copy()
        return State(KIND, arrays, attributes)

    def restore(self, state: State) -> None:
        """Return to a saved state of this or of any other point, exactly."""
        other = MaterialPoint.from_state(state)
        self.__dict__.update(other.__dict__)

    @classmethod
    def from_state(cls, state: State) -> MaterialPoint:
        """The point that a state describes.

        Raises
        ------
        InvalidInput
            If it is not the state of such a point, or an incomplete one.
        """
        state.expect_kind(KIND)
        try:
            own, arrays = state.attributes, state.arrays
            n = len(arrays["plane_normals"])
            normals = finite_array("plane_normals of a state", arrays["plane_normals"], (n, 3))
            rule = SphereRule(own["rule"], normals, arrays["plane_weights"], own["rule_degree"])
            # the constructor normalises; a restored point must be the saved one to the bit
            object.__setattr__(rule, "normals", normals)
            object.__setattr__(rule, "weights", arrays["plane_weights"].copy())
            model = ChangHicher(
                rule=rule, fabric=arrays.get("fabric"), formulation=own["formulation"], **own["parameters"]
            )
            shapes = {"sigma": (6,), "eps": (6,), "plane_strain": (n, 4), "memory": (n,)}
            kept = [finite_array(f"{name} of a state", arrays[name], shape) for name, shape in shapes.items()]
            return cls(model, own["void_ratio_0"], *kept)
        except (KeyError, TypeError) as error:
            raise InvalidInput(f"the state of a Chang-Hicher point lacks {error}") from None
