"""The virgin states of a sand: where every loading begins."""

from __future__ import annotations

import numpy as np

from rendulic.chang_hicher.law.critical_state import critical_void_ratio, peak_friction
from rendulic.chang_hicher.law.parameters import check_denominator
from rendulic.chang_hicher.law.plane_model import PlaneModel
from rendulic.chang_hicher.measure.planes import least_memory
from rendulic.chang_hicher.state import PointState
from rendulic.foundation.checks import finite_array, positive_number
from rendulic.foundation.errors import InvalidInput
from rendulic.tensors.mandel import to_mandel

__all__ = ["VOID_RATIO", "virgin_state"]

VOID_RATIO = 0.9  # if none is given: a loose sand
LARGEST_VOID_RATIO = 3.0


def virgin_state(
    model: PlaneModel, pressure: float | None = None, void_ratio: float = VOID_RATIO, stress: np.ndarray | None = None
) -> PointState:
    """The state whose planes have mobilised just what the stress needs, at zero strain; see `ChangHicher.at`."""
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
    own = model.parameters
    e_c = critical_void_ratio(p, own.e_ref, own.critical_slope, own.p_ref)
    if not e_c > 0.0:
        raise InvalidInput(
            f"at {p:g} Pa the critical void ratio e_ref - critical_slope log10(p/p_ref) is {e_c:.3g}, it must be "
            f"positive: lower the pressure below {own.p_ref * 10 ** (own.e_ref / own.critical_slope):.3g} Pa"
        )
    tan_peak = peak_friction(void_ratio, e_c, own.interlocking, own.tan_phi_mu)
    check_denominator(own, model.formulation, tan_peak)
    n = len(model.rule)
    state = PointState(model, void_ratio, to_mandel(sigma), np.zeros(6), np.zeros((n, 4)), np.zeros(n))
    state.memory = least_memory(state)
    return state
