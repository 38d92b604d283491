"""The Chang-Hicher model of a sand: parameters, planes, formulation; it makes material points."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from rendulic.chang_hicher.kernels.arrays import Material, to_mandel
from rendulic.chang_hicher.law.critical_state import critical_void_ratio, peak_friction
from rendulic.chang_hicher.law.parameters import Parameters, check_denominator, material
from rendulic.chang_hicher.law.plane_law import FORMULATIONS
from rendulic.chang_hicher.law.planes import PlaneGeometry
from rendulic.foundation.checks import finite_array, positive_number
from rendulic.foundation.errors import InvalidInput, one_of
from rendulic.foundation.validation import validated
from rendulic.loading.paths import Path
from rendulic.tensors.sphere_rules import SphereRule, bazant_oh_37

if TYPE_CHECKING:
    import xarray as xr

    from rendulic.chang_hicher.point import MaterialPoint

__all__ = ["ChangHicher"]

LARGEST_VOID_RATIO = 3.0


class ChangHicher:
    """A sand as a collection of contact planes (C. S. Chang and P.-Y. Hicher, IJSS 42 (2005) 4258-4277).

    Parameters
    ----------
    rule : SphereRule, optional
        The planes; the 37 of Bazant and Oh by default, `lebedev(degree)` for more.
    fabric : (3, 3) array, optional
        `<n n>` of the contacts, of trace 1; isotropic by default.
    formulation : {"consistent", "eq32", "printed"}
        See `plane_law.FORMULATIONS` and theory, section 5. Beyond the limit of a plane only
        `consistent` is defined.
    **parameters
        As in `Parameters`; what is not given has the value of loose Hostun sand.

    Raises
    ------
    InvalidInput
        For a parameter that is unknown or out of its range, or a set that violates `B > 0`.

    Examples
    --------
    >>> sand = ChangHicher(k_pR=0.8)
    >>> point = sand.at(pressure=300e3, void_ratio=0.9)
    >>> bool(abs(point.stress[0, 0] - 300e3) < 1e-6)
    True
    """

    def __init__(
        self,
        *,
        rule: SphereRule | None = None,
        fabric: np.ndarray | None = None,
        formulation: str = "consistent",
        **parameters: Any,
    ) -> None:
        self.parameters = validated(Parameters, parameters, "parameters of the Chang-Hicher model")
        self.formulation = one_of(formulation, FORMULATIONS, "formulation")
        if not isinstance(rule, SphereRule | None):
            raise InvalidInput(f"rule must be a SphereRule, as bazant_oh_37() or lebedev(29), got {rule!r}")
        check_denominator(self.parameters, self.formulation, self.parameters.tan_phi_mu)
        self.rule = bazant_oh_37() if rule is None else rule
        self.fabric = None if fabric is None else finite_array("fabric", fabric, (3, 3))
        self.geometry = PlaneGeometry(self.rule, self.fabric)
        self.planes = self.geometry.planes(self.parameters.k_rR)

    @classmethod
    def preset(cls, name: str, **options: Any) -> ChangHicher:
        """The model with a published set of parameters, see `parameters.PRESETS`; `options` as for the class."""
        return cls(**{**material(name), **options})

    def __repr__(self) -> str:
        given = ", ".join(
            f"{name}={value!r}" for name, value in self.parameters.model_dump(exclude_defaults=True).items()
        )
        return f"ChangHicher(rule={self.rule.name!r}, formulation={self.formulation!r}{', ' if given else ''}{given})"

    def at(
        self, pressure: float | None = None, void_ratio: float = 0.9, *, stress: np.ndarray | None = None
    ) -> MaterialPoint:
        """A material point in this virgin state, at zero strain.

        Parameters
        ----------
        pressure : float
            Isotropic stress in Pa; or
        stress : (3, 3) array
            Any stress that the planes can carry. Each plane has mobilised just what it needs.
        void_ratio : float
            e, positive.

        Raises
        ------
        InvalidInput
            If the pressure is not positive, the void ratio out of range, the state one that the
            parameters do not admit, or the stress one that some plane cannot carry.
        """
        from rendulic.chang_hicher.point import MaterialPoint

        if (pressure is None) == (stress is None):
            raise InvalidInput("a state needs a pressure or a stress, one of the two")
        if stress is None:
            sigma = positive_number("pressure", pressure, "Pa") * np.eye(3)
        else:
            sigma = finite_array("stress", stress, (3, 3))
            if np.abs(sigma - sigma.T).max() > 1e-9 * np.abs(sigma).max():
                raise InvalidInput(f"stress must be symmetric, got {sigma.tolist()}")
        void_ratio = positive_number("void_ratio", void_ratio)
        if void_ratio > LARGEST_VOID_RATIO:
            raise InvalidInput(
                f"void_ratio must be between 0 and {LARGEST_VOID_RATIO:g}, got {void_ratio:g}: it is volume of "
                "voids over volume of grains, about 0.5 to 1.1 in sands"
            )
        p = float(np.trace(sigma)) / 3.0
        if not p > 0.0:
            raise InvalidInput(f"the mean stress must be compressive (positive), got {p:g} Pa")
        own = self.parameters
        e_c = critical_void_ratio(p, own.e_ref, own.critical_slope, own.p_ref)
        if not e_c > 0.0:
            raise InvalidInput(
                f"at {p:g} Pa the critical void ratio e_ref - critical_slope log10(p/p_ref) is {e_c:.3g}, it must be "
                f"positive: lower the pressure below {own.p_ref * 10 ** (own.e_ref / own.critical_slope):.3g} Pa"
            )
        tan_peak = peak_friction(void_ratio, e_c, own.interlocking, own.tan_phi_mu)
        check_denominator(own, self.formulation, tan_peak)
        return MaterialPoint.virgin(self, to_mandel(sigma), void_ratio)

    def with_parameters(self, **parameters: Any) -> ChangHicher:
        """The same planes and formulation with other parameters; those not given are kept."""
        other = object.__new__(ChangHicher)
        other.__dict__.update(self.__dict__)
        values = {**self.parameters, **parameters}
        other.parameters = validated(Parameters, values, "parameters of the Chang-Hicher model")
        other.planes = self.geometry.planes(other.parameters.k_rR)
        return other

    @classmethod
    def load_many(cls, parameters: Mapping[str, Any], path: Path, **options: Any) -> xr.Dataset:
        """One test with many sets of parameters, on all cores: see `rendulic.chang_hicher.drive.batch.load_many`."""
        from rendulic.chang_hicher.drive.batch import load_many

        return load_many(parameters, path, **options)

    def material_at(self, void_ratio: float) -> Material:
        """The numbers that the kernels take, for a point of this void ratio at zero strain."""
        own = self.parameters
        return Material(
            own.k_n0, own.f_ref, own.exponent, own.k_rR, own.k_pR, own.dilatancy, own.tan_phi_mu, own.flow_friction,
            own.e_ref, own.critical_slope, own.p_ref, own.interlocking, own.branch_length,
            FORMULATIONS.index(self.formulation), void_ratio,
        )  # fmt: skip
