"""The elasto-plastic law of one contact plane, in closed form (paper, Eqs. 26-41).

Every function takes numbers or arrays and is the definition: the compiled kernels call these very
functions. Stresses on the plane are normal `sigma` and shear `tau`, both positive in compression and
along the shear; `eta = tau / sigma` is the obliquity, `x = eta / tan(phi_p)` its normalised form. The
stiffnesses `k_n, k_r, k_p` and moduli may be those of a contact (N/m, forces) or of a plane (Pa,
stresses): the law is the same.
"""

from __future__ import annotations

from typing import Any

__all__ = [
    "FORMULATIONS",
    "compliance",
    "determinant",
    "dilatancy",
    "hardening_modulus",
    "is_positive",
    "least_shear_ratio",
    "loading_slope",
    "mobilised_friction",
    "sliding",
    "stiffness",
    "stiffness_denominator",
]

# `printed`: Eqs. 37-41 to the letter. `eq32`: dilatancy with phi_0, as Eq. 32 says. `consistent`: the
# surface of Eqs. 29 and 31 differentiated in full, so that it is obeyed along any path.
FORMULATIONS = ("printed", "eq32", "consistent")

Number = Any  # a float, or an array of any shape


def hardening_modulus(k_p: Number, x: Number) -> Number:
    """`H = k_p (1 - x)^2`, the derivative of Eq. 31 along plastic sliding times the normal stress.

    >>> hardening_modulus(2.0, 0.5)
    0.5
    """
    return k_p * (1.0 - x) ** 2


def mobilised_friction(sliding: Number, sigma: Number, k_p: Number, tan_phi_p: Number) -> Number:
    """`kappa`, the hyperbola of Eq. 31: 0 without sliding, `tan_phi_p` after very much of it."""
    return k_p * tan_phi_p * sliding / (sigma * tan_phi_p + k_p * sliding)


def sliding(kappa: Number, sigma: Number, k_p: Number, tan_phi_p: Number) -> Number:
    """The accumulated plastic sliding that mobilises `kappa`: the inverse of `mobilised_friction`.

    >>> round(mobilised_friction(sliding(0.3, 1e5, 5e7, 0.65), 1e5, 5e7, 0.65), 12)
    0.3
    """
    return sigma * kappa / (k_p * (1.0 - kappa / tan_phi_p))


def dilatancy(factor: Number, tan_phi: Number, eta: Number) -> Number:
    """`beta`, plastic normal over plastic shear displacement, positive in contraction (Eq. 32).

    `tan_phi` is that of phi_0; Eqs. 37-41 as printed have phi_p in its place.
    """
    return factor * (tan_phi - eta)


def loading_slope(eta: Number, tan_phi_p: Number, exponent: Number) -> Number:
    """`a = -dF/d sigma` of the surface of Eqs. 29 and 31 at constant sliding.

    `exponent` is that of the stiffness, `k_p ~ sigma^exponent`; with 1 it is `eta`, which Eqs. 37-41
    have for any exponent.

    >>> loading_slope(0.4, 0.6, 1.0)
    0.4
    """
    return eta * (eta * (1.0 - exponent) + exponent * tan_phi_p) / tan_phi_p


def stiffness_denominator(k_n: Number, k_r: Number, modulus: Number, a: Number, beta: Number) -> Number:
    """`B = H + k_r - a beta k_n` (Eq. 41); where it is not positive, displacement control fails."""
    return modulus + k_r - a * beta * k_n


def stiffness(k_n: Number, k_r: Number, modulus: Number, a: Number, beta: Number) -> tuple[Number, ...]:
    """`K_nn, K_nr, K_rn, K_rr` in plastic loading (Eqs. 37-40).

    Parameters
    ----------
    k_n, k_r : float or array
        Elastic stiffnesses.
    modulus : float or array
        `H`, from `hardening_modulus`.
    a, beta : float or array
        From `loading_slope` and `dilatancy`.
    """
    b = stiffness_denominator(k_n, k_r, modulus, a, beta)
    return k_n + k_n**2 * a * beta / b, -k_n * beta * k_r / b, k_n * k_r * a / b, k_r - k_r**2 / b


def compliance(k_n: Number, k_r: Number, modulus: Number, a: Number, beta: Number) -> tuple[Number, ...]:
    """The inverse of `stiffness`, `C_nn, C_nr, C_rn, C_rr`; needs `H > 0`."""
    return 1.0 / k_n - a * beta / modulus, beta / modulus, -a / modulus, 1.0 / k_r + 1.0 / modulus


def determinant(k_n: Number, k_r: Number, modulus: Number, a: Number, beta: Number) -> Number:
    """`det K = k_n k_r H / B`: zero at the plastic limit (mode 1)."""
    return k_n * k_r * modulus / stiffness_denominator(k_n, k_r, modulus, a, beta)


def is_positive(k_nn: Number, k_nr: Number, k_rn: Number, k_rr: Number) -> Number:
    """Whether `W2 > 0` for every increment of the plane (no mode 2).

    That is `det K > ((K_rn - K_nr) / 2)^2` with a positive diagonal; it is lost before `K_rr = 0`.
    """
    return (k_nn > 0.0) & (k_rr > 0.0) & (k_nn * k_rr > (0.5 * (k_nr + k_rn)) ** 2)


def least_shear_ratio(plastic_ratio: Number, dilatancy_factor: Number, tan_phi: Number) -> Number:
    """The bound on `k_rR` above which `B > 0` at every obliquity, for `a = eta` and phi_p = phi_0.

    `D^2 t^4 / (4 (k_pR + D t^2))`: the least of a parabola in `1 - x`.
    """
    square = dilatancy_factor * tan_phi**2
    return square**2 / (4.0 * (plastic_ratio + square))
