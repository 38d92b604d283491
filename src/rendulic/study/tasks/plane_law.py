"""[[plane_law]]: the shear stiffness of one contact plane against obliquity, for several parameters (Fig. 6)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from pydantic import Field, field_validator, model_validator

from rendulic.chang_hicher import Parameters, material
from rendulic.chang_hicher.law import plane_law
from rendulic.foundation.errors import one_of
from rendulic.foundation.validation import Positive
from rendulic.study.task import How, Parts
from rendulic.study.tasks.measurement import Measurement

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["PlaneLawSet", "shear_stiffness"]

POINTS = 501


class PlaneLawSet(Measurement):
    """K_rr of a contact plane, Eq. 40 as printed, at the reference force: one parameter after the other is varied."""

    table: ClassVar[str] = "plane_law"
    work: ClassVar[str] = "plane law"
    order: ClassVar[int] = 60

    preset: str | None = Field(None, description="hostun_loose or fig6_base; values in material replace the preset's")
    material: Parameters = Field(Parameters(), description="values of its own, instead of the preset's")
    vary: dict[str, tuple[Positive, ...]] = Field(
        min_length=1, description="for each name of a parameter the values that it takes, as { k_pR = [0.5, 1, 2] }"
    )

    @model_validator(mode="before")
    @classmethod
    def _from_preset(cls, table: Any) -> Any:
        if (
            isinstance(table, dict)
            and isinstance(table.get("preset"), str)
            and isinstance(table.get("material", {}), dict)
        ):
            return {**table, "material": {**material(table["preset"]).model_dump(), **table.get("material", {})}}
        return table

    @field_validator("vary")
    @classmethod
    def _are_parameters(cls, vary: dict[str, tuple[float, ...]]) -> dict[str, tuple[float, ...]]:
        for name in vary:
            one_of(name, Parameters.model_fields, "parameter to vary")
        return vary

    def run(self, needs: Mapping[str, Parts], how: How) -> Parts:
        import xarray as xr

        x = np.linspace(0.0, 1.0, POINTS)
        cases = [(name, value) for name, values in self.vary.items() for value in values]
        curves = [shear_stiffness(self.material.model_copy(update={name: value}), x) for name, value in cases]
        about = {"long_name": "shear stiffness K_rr of a contact plane", "units": "N/m"}
        table: xr.Dataset = xr.Dataset(
            {"shear_stiffness": (("case", "x"), np.array(curves), about)},
            {
                "x": ("x", x, {"long_name": "obliquity over its peak", "units": "1"}),
                "parameter": ("case", np.array([name for name, _ in cases])),
                "value": ("case", np.array([value for _, value in cases])),
            },
        )
        return {"plane_law": table}


def shear_stiffness(parameters: Parameters, x: np.ndarray) -> np.ndarray:
    """`K_rr` in N/m at normalised obliquities x, Eq. 40 as printed, at f_n = f_ref (Fig. 6)."""
    tan_phi, k_n = parameters.tan_phi_mu, parameters.k_n0
    modulus = plane_law.hardening_modulus(parameters.k_pR * k_n, x)
    eta = x * tan_phi
    beta = plane_law.dilatancy(parameters.dilatancy, tan_phi, eta)
    return plane_law.stiffness(k_n, parameters.k_rR * k_n, modulus, eta, beta)[3]
