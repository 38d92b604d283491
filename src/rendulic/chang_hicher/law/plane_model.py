"""A sand as a collection of contact planes: parameters, planes, formulation."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any, Final, Self

import numpy as np

from rendulic.chang_hicher.law.parameters import MaterialConstants, Parameters, check_denominator, shows_parameters
from rendulic.chang_hicher.law.plane_law import FORMULATIONS
from rendulic.chang_hicher.law.planes import GENERAL, PlaneGeometry, Planes
from rendulic.foundation.checks import finite_array
from rendulic.foundation.errors import InvalidInput, one_of
from rendulic.foundation.validation import validated
from rendulic.tensors.sphere_rules import DEFAULT_DEGREE, SphereRule, lebedev

__all__ = ["DEFAULT_FORMULATION", "PlaneModel"]

DEFAULT_FORMULATION: Final = "consistent"


class PlaneModel:
    """What all points of one sand share; `ChangHicher` makes it, and points of it.

    Parameters
    ----------
    rule, fabric, formulation
        As for `ChangHicher`.
    parameters : mapping
        As in `Parameters`.

    Raises
    ------
    InvalidInput
        For a parameter that is unknown or out of its range, or a set that violates `B > 0`.
    """

    def __init__(
        self, rule: SphereRule | None, fabric: np.ndarray | None, formulation: str, parameters: Mapping[str, Any]
    ) -> None:
        self.parameters = _checked(parameters)
        self.formulation = one_of(formulation, FORMULATIONS, "formulation")
        if not isinstance(rule, SphereRule | None):
            raise InvalidInput(f"rule must be a SphereRule, as bazant_oh_37() or lebedev(29), got {rule!r}")
        check_denominator(self.parameters, self.formulation, self.parameters.tan_phi_mu)
        self.rule = lebedev(DEFAULT_DEGREE) if rule is None else rule
        self.fabric = None if fabric is None else finite_array("fabric", fabric, (3, 3))
        self.geometry = (
            _default_geometry() if rule is None and fabric is None else PlaneGeometry(self.rule, self.fabric)
        )
        self.planes = self.geometry.planes(self.parameters.k_rR)

    def __repr__(self) -> str:
        given = ", ".join(
            f"{name}={value!r}" for name, value in self.parameters.model_dump(exclude_defaults=True).items()
        )
        # as the call that makes it
        return f"ChangHicher(rule={self.rule.name!r}, formulation={self.formulation!r}{', ' if given else ''}{given})"

    def planes_under(self, symmetry: int) -> Planes:
        """The planes that a test of this symmetry needs: one of those that respond alike."""
        return self.planes if symmetry == GENERAL else self.geometry.planes(self.parameters.k_rR, symmetry)

    @shows_parameters(are_defaults=False)
    def with_parameters(self, **parameters: Any) -> Self:
        """The same planes and formulation with other parameters; those not given are kept.

        `B > 0` is checked where a state is made of it.
        """
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__)
        other.parameters = _checked({**self.parameters, **parameters})
        other.planes = self.geometry.planes(other.parameters.k_rR)
        return other

    def constants_at(self, void_ratio: float) -> MaterialConstants:
        """The numbers that the kernels take, for a point of this void ratio at zero strain."""
        own = self.parameters
        return MaterialConstants(
            own.k_n0, own.f_ref, own.exponent, own.k_rR, own.k_pR, own.dilatancy, own.tan_phi_mu, own.flow_friction,
            own.e_ref, own.critical_slope, own.p_ref, own.interlocking, own.branch_length,
            FORMULATIONS.index(self.formulation), void_ratio,
        )  # fmt: skip

    def save(self) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        """All that makes the model, as attributes and arrays of a `State`."""
        attributes = {
            "parameters": self.parameters.model_dump(),
            "formulation": self.formulation,
            "rule": self.rule.name,
            "rule_degree": self.rule.degree,
        }
        arrays = {"plane_normals": self.rule.normals.copy(), "plane_weights": self.rule.weights.copy()}
        return attributes, arrays if self.fabric is None else arrays | {"fabric": self.fabric.copy()}

    @staticmethod
    def from_saved(attributes: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> PlaneModel:
        """The model that `save` told; raises `InvalidInput` if it is none."""
        n = len(arrays["plane_normals"])
        normals = finite_array("plane_normals of a state", arrays["plane_normals"], (n, 3))
        rule = SphereRule(attributes["rule"], normals, arrays["plane_weights"], attributes["rule_degree"])
        # the constructor normalises; a restored model must be the saved one to the bit
        object.__setattr__(rule, "normals", normals)
        object.__setattr__(rule, "weights", arrays["plane_weights"].copy())
        return PlaneModel(rule, arrays.get("fabric"), attributes["formulation"], attributes["parameters"])


@cache
def _default_geometry() -> PlaneGeometry:
    """That of the default rule and an isotropic fabric: made once."""
    return PlaneGeometry(lebedev(DEFAULT_DEGREE), None)


def _checked(parameters: Mapping[str, Any]) -> Parameters:
    return validated(Parameters, dict(parameters), "parameters of the Chang-Hicher model")
