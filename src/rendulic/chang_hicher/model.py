"""The Chang-Hicher model of a sand: parameters, planes, formulation; it makes material points."""

from __future__ import annotations

from typing import Any

import numpy as np

from rendulic.chang_hicher.drive.batch import load_many
from rendulic.chang_hicher.drive.virgin import VOID_RATIO, virgin_state
from rendulic.chang_hicher.law.parameters import material, shows_parameters
from rendulic.chang_hicher.law.plane_model import DEFAULT_FORMULATION, PlaneModel
from rendulic.chang_hicher.point import MaterialPoint
from rendulic.tensors.sphere_rules import SphereRule

__all__ = ["ChangHicher"]


class ChangHicher(PlaneModel):
    """A sand as a collection of contact planes (C. S. Chang and P.-Y. Hicher, IJSS 42 (2005) 4258-4277).

    Parameters
    ----------
    rule : SphereRule, optional
        The planes; the 295 of `lebedev(41)` by default, `bazant_oh_37()` for those of the paper.
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

    @shows_parameters(are_defaults=True)
    def __init__(
        self,
        *,
        rule: SphereRule | None = None,
        fabric: np.ndarray | None = None,
        formulation: str = DEFAULT_FORMULATION,
        **parameters: Any,
    ) -> None:
        super().__init__(rule, fabric, formulation, parameters)

    @classmethod
    @shows_parameters(are_defaults=False)
    def preset(
        cls,
        name: str,
        *,
        rule: SphereRule | None = None,
        fabric: np.ndarray | None = None,
        formulation: str = DEFAULT_FORMULATION,
        **parameters: Any,
    ) -> ChangHicher:
        """The model with a published set of parameters, see `parameters.PRESETS`; those given replace its values."""
        return cls(rule=rule, fabric=fabric, formulation=formulation, **{**material(name), **parameters})

    def at(
        self, pressure: float | None = None, void_ratio: float = VOID_RATIO, *, stress: np.ndarray | None = None
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
        state = virgin_state(self, pressure, void_ratio, stress)
        return MaterialPoint(self, state.void_ratio_0, **state.arrays())

    load_many = staticmethod(load_many)
