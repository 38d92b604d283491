"""Parameters of the Chang-Hicher model: what each does, its unit, its range, and published sets."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple, TypeVar

import numpy as np
from pydantic import Field

from rendulic.chang_hicher.law import plane_law
from rendulic.foundation.errors import InvalidInput, one_of
from rendulic.foundation.validation import Positive, Section, validated

__all__ = ["PRESETS", "MaterialConstants", "Parameters", "check_denominator", "material", "shows_parameters"]

F = TypeVar("F", bound=Callable)


class Parameters(Section):
    """The material. SI units; symbols as in the paper, section 5.

    A mapping too: `ChangHicher(**hostun_loose)`.
    """

    k_n0: Positive = Field(15e3, description="normal stiffness of a contact at the force f_ref, N/m")
    f_ref: Positive = Field(0.0174, description="normal force at which the stiffness is k_n0, N (G_g l^2 in Eq. 28)")
    exponent: float = Field(
        0.5, strict=True, ge=0, lt=1, description="n of k_n = k_n0 (f_n / f_ref)^n: 0 linear, 1/3 Hertz, 0.5 sands"
    )
    k_rR: Positive = Field(
        0.4, le=1.5, description="k_r / k_n, shear over normal stiffness; Poisson's ratio (1-r)/(2+3r)"
    )
    k_pR: Positive = Field(1.0, description="k_p / k_n, plastic over normal stiffness: how soon friction is mobilised")
    dilatancy: float = Field(
        1.0, strict=True, ge=0, le=10, description="D of Eq. 32: plastic contraction below phi_0 and dilation above it"
    )
    tan_phi_mu: Positive = Field(0.65, le=2, description="tangent of the angle of friction between grains")
    tan_phi_0: Positive | None = Field(
        None, description="tangent of the obliquity without dilatancy; that of phi_mu if not given"
    )
    e_ref: Positive = Field(1.0, description="critical void ratio at the mean stress p_ref")
    critical_slope: float = Field(
        0.2,
        strict=True,
        ge=0,
        allow_inf_nan=False,
        description="lambda: loss of critical void ratio per decade of mean stress",
    )
    p_ref: Positive = Field(10e3, description="mean stress of e_ref, Pa")
    interlocking: float = Field(1.0, strict=True, ge=0, le=10, description="m of tan(phi_p) = (e_c / e)^m tan(phi_mu)")
    branch_length: Positive = Field(0.36e-3, description="l: distance of touching grains' centres, m; about d50")

    @property
    def flow_friction(self) -> float:
        """`tan(phi_0)`."""
        return self.tan_phi_mu if self.tan_phi_0 is None else self.tan_phi_0

    def keys(self) -> Iterable[str]:
        """Names of the parameters, so that `**parameters` works."""
        return type(self).model_fields.keys()

    def __getitem__(self, name: str) -> Any:
        return getattr(self, name)


def shows_parameters(*, are_defaults: bool) -> Callable[[F], F]:
    """Let a function of `**parameters` show them by name in its signature.

    Those not given have the default of `Parameters`, or else (shown as `...`) another value, which its docstring says.
    """

    def shown(function: F) -> F:
        own = inspect.signature(function)
        kept = [p for p in own.parameters.values() if p.kind is not p.VAR_KEYWORD]
        named = [
            inspect.Parameter(
                name, inspect.Parameter.KEYWORD_ONLY, annotation=float,
                default=field.default if are_defaults else ...,
            )
            for name, field in Parameters.model_fields.items()
        ]  # fmt: skip
        function.__signature__ = own.replace(parameters=[*kept, *named])  # type: ignore[attr-defined]
        return function

    return shown


class MaterialConstants(NamedTuple):
    """The parameters, formulation and initial void ratio of a point as plain numbers; see `Parameters`."""

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
    formulation: int  # its place in `plane_law.FORMULATIONS`
    void_ratio_0: float  # at zero strain


def check_denominator(parameters: Parameters, formulation: str, tan_phi_p: float) -> None:
    """Raise `InvalidInput` unless `B > 0` at every obliquity up to the peak friction.

    Where `B` of Eq. 41 vanishes, a plane snaps back: its stiffness is infinite.
    """
    x = np.linspace(0.0, 1.0, 401)
    eta = x * tan_phi_p
    slope = plane_law.loading_slope(eta, tan_phi_p, parameters.exponent) if formulation == "consistent" else eta
    tan_flow = tan_phi_p if formulation == "printed" else parameters.flow_friction
    needed = slope * plane_law.dilatancy(parameters.dilatancy, tan_flow, eta)
    bound = float((needed - plane_law.hardening_modulus(parameters.k_pR, x)).max())
    if parameters.k_rR <= bound:
        simple = plane_law.least_shear_ratio(parameters.k_pR, parameters.dilatancy, tan_phi_p)
        raise InvalidInput(
            f"k_rR = {parameters.k_rR:g} is too small: B > 0 (Eq. 41) needs k_rR > {bound:.4g} with k_pR = "
            f"{parameters.k_pR:g}, D = {parameters.dilatancy:g}, t = tan(phi_p) = {tan_phi_p:.4g} in the formulation "
            f"'{formulation}' (with a = eta and phi_p = phi_0: k_rR > D^2 t^4 / (4 (k_pR + D t^2)) = {simple:.4g}); raise k_rR or k_pR, or "
            "lower D or the friction"
        )


HOSTUN_SOURCE = """Paper, section 5.3: e_ref, critical_slope, p_ref, interlocking, exponent, k_rR, k_pR (k_p0 = k_n).
The paper's Table 1 is lost; ours: tan_phi_mu (33 degrees), dilatancy, branch_length (d50), k_n0 from the
range of section 5.2, f_ref the mean contact force at 100 kPa and e = 0.9. k_n0, f_ref and branch_length
scale strains only; the undrained stress path does not depend on them."""

PRESETS: dict[str, tuple[dict[str, float], str]] = {
    "hostun_loose": ({}, HOSTUN_SOURCE),
    "fig6_base": (
        {"k_rR": 0.5, "exponent": 0.0},
        "Paper, section 5.2: k_pR = 1, k_rR = 0.5, D = 1, k_n0 = 15 N/mm, tan(phi) = 0.65, constant. "
        "The exponent does not matter there; the rest as for Hostun sand.",
    ),
}


def material(name: str) -> Parameters:
    """The published set of this name; its source is in `PRESETS`.

    >>> material("hostun_loose").k_rR
    0.4
    """
    values, _source = PRESETS[one_of(name, PRESETS, "material")]
    return validated(Parameters, values, f"material '{name}'")
