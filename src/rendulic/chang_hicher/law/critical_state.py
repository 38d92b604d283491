"""Critical state: how the peak friction of the planes follows void ratio and pressure (Eqs. 33, 34).

As in `plane_law`, numbers or arrays; the compiled kernels call these very functions.
"""

from __future__ import annotations

from math import log, log10
from typing import Any

__all__ = ["critical_pressure", "critical_void_ratio", "peak_friction", "peak_friction_slopes"]

Number = Any
LN10 = log(10.0)


def critical_void_ratio(p: float, e_ref: float, critical_slope: float, p_ref: float) -> float:
    """`e_c = e_ref - lambda log10(p / p_ref)`, base 10 (Eq. 34).

    >>> round(critical_void_ratio(300e3, 1.0, 0.2, 10e3), 3)
    0.705
    """
    return e_ref - critical_slope * log10(p / p_ref)


def critical_pressure(void_ratio: Number, e_ref: Number, critical_slope: Number, p_ref: Number) -> Number:
    """The mean stress at which this void ratio is critical, in the unit of `p_ref`; the slope must not be 0."""
    return p_ref * 10.0 ** ((e_ref - void_ratio) / critical_slope)


def peak_friction(void_ratio: Number, e_c: Number, interlocking: Number, tan_phi_mu: Number) -> Number:
    """`tan(phi_p) = (e_c / e)^m tan(phi_mu)` (Eq. 33)."""
    return (e_c / void_ratio) ** interlocking * tan_phi_mu


def peak_friction_slopes(
    p: Number, void_ratio: Number, e_c: Number, tan_phi_p: Number, interlocking: Number, critical_slope: Number
) -> tuple[Number, Number]:
    """Derivatives of `tan(phi_p)` by mean stress and by void ratio."""
    by_pressure = -tan_phi_p * interlocking * critical_slope / (LN10 * e_c * p)
    return by_pressure, -tan_phi_p * interlocking / void_ratio
