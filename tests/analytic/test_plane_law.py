"""One contact plane: its stiffness against SymPy, the numbers of Fig. 6, and the critical state."""

from __future__ import annotations

from math import log

import numpy as np
import pytest
import sympy as sp
from numpy.testing import assert_allclose
from scipy.optimize import brentq, minimize_scalar

from rendulic.chang_hicher import plane_law
from rendulic.chang_hicher.law.critical_state import (
    critical_pressure,
    critical_void_ratio,
    peak_friction,
    peak_friction_slopes,
)

TAN = 0.65
SEEDS = range(5)


def draw(seed, n=200):
    """Admissible planes at random: stiffnesses, hardening, slope and dilatancy with B > 0, and the obliquity."""
    rng = np.random.default_rng(seed)
    tan_phi, x = rng.uniform(0.3, 0.9, n), rng.uniform(0.01, 0.95, n)
    factor, plastic = rng.uniform(0.0, 3.0, n), rng.uniform(0.5, 2.0, n)
    k_n = 10.0 ** rng.uniform(3, 8, n)
    k_r = k_n * (plane_law.least_shear_ratio(plastic, factor, tan_phi) + rng.uniform(0.05, 1.0, n))
    eta = x * tan_phi
    modulus = plane_law.hardening_modulus(plastic * k_n, x)
    slope = plane_law.loading_slope(eta, tan_phi, rng.uniform(0.0, 1.0, n))
    return k_n, k_r, modulus, slope, plane_law.dilatancy(factor, tan_phi, eta)


def matrices(entries):
    """(n, 2, 2) matrices of the four entries."""
    return np.stack(np.broadcast_arrays(*entries), axis=-1).reshape(-1, 2, 2)


@pytest.mark.parametrize("seed", SEEDS)
def test_stiffness_times_compliance_is_unity(seed):
    """Eqs. 37-40 and their inverse: unity to the rounding that the condition of K admits."""
    plane = draw(seed)
    k, c = matrices(plane_law.stiffness(*plane)), matrices(plane_law.compliance(*plane))
    error = np.abs(k @ c - np.eye(2)).max(axis=(1, 2))
    condition = np.linalg.norm(k, axis=(1, 2)) * np.linalg.norm(c, axis=(1, 2))
    assert (error <= 1e-14 * condition).all()


@pytest.mark.parametrize("seed", SEEDS)
def test_determinant(seed):
    """`det K = k_n k_r H / B`, to the rounding of the two products that it is the difference of."""
    plane = draw(seed)
    k_nn, k_nr, k_rn, k_rr = plane_law.stiffness(*plane)
    size = np.abs(k_nn * k_rr) + np.abs(k_nr * k_rn)
    assert (np.abs(k_nn * k_rr - k_nr * k_rn - plane_law.determinant(*plane)) <= 1e-13 * size).all()


@pytest.mark.parametrize("seed", SEEDS)
def test_positiveness_is_that_of_the_symmetric_part(seed):
    """`is_positive` says what the eigenvalues of the symmetric part say; both answers occur."""
    entries = plane_law.stiffness(*draw(seed))
    k = matrices(entries)
    least = np.linalg.eigvalsh(0.5 * (k + k.swapaxes(1, 2)))[:, 0] / np.linalg.norm(k, axis=(1, 2))
    clear = np.abs(least) > 1e-12
    said = plane_law.is_positive(*entries)
    assert_allclose(said[clear], least[clear] > 0.0)
    assert 10 < said.sum() < 190


# --- Fig. 6: theory, section 5 -------------------------------------------------------------------------


def printed(x, factor=1.0, plastic=1.0, shear=0.5, k_n0=15.0):
    """K of Eqs. 37-40 to the letter (a = eta, beta with phi_p), in N/mm, constant tan(phi) = 0.65."""
    eta = x * TAN
    modulus = plane_law.hardening_modulus(plastic * k_n0, x)
    return plane_law.stiffness(k_n0, shear * k_n0, modulus, eta, plane_law.dilatancy(factor, TAN, eta))


def shear_stiffness(x, **case):
    return printed(x, **case)[3]


def symmetric_determinant(x, **case):
    """Determinant of the symmetric part of K: W2 is positive as long as it is (K_nn is, throughout)."""
    k_nn, k_nr, k_rn, k_rr = printed(x, **case)
    return k_nn * k_rr - (0.5 * (k_nr + k_rn)) ** 2


FIGURE_6 = [
    ({}, 0.7030, -0.502, 0.852, 0.679),
    ({"factor": 2.0}, 0.5420, -1.800, 0.771, 0.527),
    ({"factor": 3.0}, 0.4410, -4.115, 0.721, 0.340),
    ({"plastic": 0.5}, 0.5420, -0.803, 0.771, 0.541),
    ({"plastic": 2.0}, 0.8256, -0.287, 0.913, 0.776),
    ({"shear": 0.1}, 0.7030, -0.686, 0.852, 0.686),
    ({"shear": 1.0}, 0.7030, -0.486, 0.852, 0.677),
    ({"k_n0": 10.0}, 0.7030, -0.335, 0.852, 0.679),
    ({"k_n0": 20.0}, 0.7030, -0.669, 0.852, 0.679),
]


@pytest.mark.parametrize(("case", "zero", "least", "at", "lost"), FIGURE_6, ids=lambda value: str(value))
def test_figure_6(case, zero, least, at, lost):
    """Zero and minimum of K_rr, and where W2 is lost first, to the digits of the theory's table."""
    found = brentq(shear_stiffness_of(case), 0.05, 0.98, xtol=1e-12)
    assert_allclose(found, zero, rtol=0, atol=5.1e-5)
    d_t2 = case.get("factor", 1.0) * TAN**2
    plastic = case.get("plastic", 1.0)
    assert_allclose(found, plastic / (plastic + d_t2), rtol=1e-10)
    minimum = minimize_scalar(shear_stiffness_of(case), bounds=(found, 1.0), options={"xatol": 1e-8})
    # one unit of the last digit: the table has -1.800 for -1.7995
    assert_allclose(minimum.fun, least, rtol=0, atol=6e-4)
    assert_allclose(minimum.x, at, rtol=0, atol=5.1e-4)
    # positive up to the first root of the determinant, not beyond
    x = np.linspace(0.0, 1.0, 20001)[1:-1]
    is_positive = plane_law.is_positive(*printed(x, **case))
    first = x[np.argmin(is_positive)]
    assert is_positive[: np.argmin(is_positive)].all()
    assert_allclose(first, lost, rtol=0, atol=5.6e-4)
    assert abs(brentq(lambda x: symmetric_determinant(x, **case), first - 1e-3, first + 1e-3) - first) < 1e-4


def shear_stiffness_of(case):
    return lambda x: shear_stiffness(x, **case)


@pytest.mark.parametrize("case", [case for case, *_ in FIGURE_6], ids=str)
def test_shear_stiffness_in_closed_form(case):
    """`K_rr / k_n0` is the fraction in x of the theory, at every x and for every case of Fig. 6."""
    x = np.linspace(0.0, 0.999, 300)
    p, r = case.get("plastic", 1.0), case.get("shear", 0.5)
    d_t2 = case.get("factor", 1.0) * TAN**2
    expected = r * (1 - x) * (p * (1 - x) - d_t2 * x) / (p * (1 - x) ** 2 + r - d_t2 * x * (1 - x))
    # K_rr is the difference of two numbers of the size of k_r
    assert_allclose(shear_stiffness(x, **case) / case.get("k_n0", 15.0), expected, rtol=0, atol=1e-14)


def test_all_of_k_scales_with_k_n0():
    """Twice the stiffness of the contacts is twice K, entry by entry."""
    x = np.linspace(0.0, 0.99, 50)
    assert_allclose(np.array(printed(x, k_n0=20.0)), 2.0 * np.array(printed(x, k_n0=10.0)), rtol=1e-13)


# --- where Eqs. 37-41 come from ------------------------------------------------------------------------


def derived_stiffness(exponent):
    """K from Eqs. 26-33 with SymPy, with the symbols that it is a function of.

    Elastic displacements give the forces; plastic sliding flows with the dilatancy; the force stays on
    the surface `F = f_r - f_n kappa` whose hyperbola has `k_p = c f_n^exponent`.
    """
    k_n, k_r, t, eta, beta, f_n, c = sp.symbols("k_n k_r t eta beta f_n c", positive=True)
    d_n, d_r, slid, d_slid = sp.symbols("d_n d_r slid d_slid", positive=True)
    k_p = c * f_n**exponent
    kappa = k_p * t * slid / (f_n * t + k_p * slid)
    d_fn = k_n * (d_n - beta * d_slid)
    d_fr = k_r * (d_r - d_slid)
    resistance = f_n * kappa
    consistency = d_fr - sp.diff(resistance, f_n) * d_fn - sp.diff(resistance, slid) * d_slid
    flow = sp.solve(consistency, d_slid)[0]
    forces = (d_fn.subs(d_slid, flow), d_fr.subs(d_slid, flow))
    on_surface = sp.solve(sp.Eq(kappa, eta), slid)[0]
    entries = [sp.diff(force, d).subs(slid, on_surface) for force in forces for d in (d_n, d_r)]
    return entries, (k_n, k_r, k_p, t, eta, beta)


@pytest.mark.parametrize("exponent", [sp.Integer(0), sp.Rational(1, 3), sp.Rational(1, 2), sp.Integer(1)], ids=str)
def test_stiffness_follows_from_the_equations(exponent):
    """Elastic law, surface, hyperbola and flow rule give `plane_law.stiffness`; with exponent 1, a = eta."""
    derived, (k_n, k_r, k_p, t, eta, beta) = derived_stiffness(exponent)
    slope = plane_law.loading_slope(eta, t, exponent)
    ours = plane_law.stiffness(k_n, k_r, plane_law.hardening_modulus(k_p, eta / t), slope, beta)
    for from_equations, from_law in zip(derived, ours, strict=True):
        assert sp.simplify(sp.nsimplify(from_law) - from_equations) == 0
    assert (sp.simplify(sp.nsimplify(slope) - eta) == 0) == (exponent == 1)


def hyperbola():
    """`f_n kappa` with `k_p = c f_n^n`, its symbols, and the sliding that mobilises eta."""
    f_n, slid, t, c, n, eta = sp.symbols("f_n slid t c n eta", positive=True)
    k_p = c * f_n**n
    kappa = plane_law.mobilised_friction(slid, f_n, k_p, t)
    return f_n * kappa, (f_n, slid, t, n, eta, k_p), plane_law.sliding(eta, f_n, k_p, t)


def test_slope_and_modulus_are_the_hyperbolas():
    """For any n, `a` and `H` are the derivatives of `f_n kappa` by force and by sliding on the surface."""
    resistance, (f_n, slid, t, n, eta, k_p), on_surface = hyperbola()
    a = sp.diff(resistance, f_n).subs(slid, on_surface)
    assert sp.simplify(sp.nsimplify(plane_law.loading_slope(eta, t, n)) - a) == 0
    assert sp.simplify(plane_law.loading_slope(eta, t, n) - eta * (eta * (1 - n) + n * t) / t) == 0
    modulus = sp.diff(resistance, slid).subs(slid, on_surface)
    assert sp.simplify(sp.nsimplify(plane_law.hardening_modulus(k_p, eta / t)) - modulus) == 0


def test_change_of_peak_friction_in_the_consistency_condition():
    """At constant sliding `f_n kappa` changes by `f_n (eta / t)^2` per change of tan(phi_p)."""
    resistance, (f_n, slid, t, _n, eta, _k_p), on_surface = hyperbola()
    assert sp.simplify(sp.diff(resistance, t).subs(slid, on_surface) - f_n * (eta / t) ** 2) == 0


@pytest.mark.parametrize("seed", SEEDS)
def test_sliding_is_the_inverse_of_the_hyperbola(seed):
    """The sliding of a mobilised friction mobilises just that; more sliding never mobilises the peak."""
    rng = np.random.default_rng(seed)
    tan_phi, sigma, k_p = rng.uniform(0.3, 0.9, 100), 10.0 ** rng.uniform(2, 6, 100), 10.0 ** rng.uniform(5, 9, 100)
    kappa = tan_phi * rng.uniform(0.0, 0.99, 100)
    slid = plane_law.sliding(kappa, sigma, k_p, tan_phi)
    # 1 - kappa / tan(phi) has lost two digits at 0.99
    assert_allclose(plane_law.mobilised_friction(slid, sigma, k_p, tan_phi), kappa, rtol=1e-13)
    assert (plane_law.mobilised_friction(1e3 * slid + 1.0, sigma, k_p, tan_phi) < tan_phi).all()


# --- stability of a plane ------------------------------------------------------------------------------


def test_without_dilatancy_the_law_is_not_associated():
    """D = 0: K is not symmetric and W2 is lost before the limit, although K_rr stays positive up to it."""
    x = np.linspace(0.0, 1.0, 1001)[1:-1]
    entries = printed(x, factor=0.0)
    assert (entries[2] > 0.0).all()
    assert_allclose(entries[1], 0.0, atol=0)
    assert (entries[3] > 0.0).all()
    lost = ~plane_law.is_positive(*entries)
    assert 0.5 < x[np.argmax(lost)] < 0.99


def test_association_needs_beta_to_be_minus_the_slope():
    """K is symmetric with `beta = -a`, and only then: the paper's `D = 0` is another thing."""
    eta, modulus = 0.3, 5.0
    for beta, is_symmetric in ((-eta, True), (0.0, False), (0.35, False)):
        _nn, k_nr, k_rn, _rr = plane_law.stiffness(15.0, 7.5, modulus, eta, beta)
        assert (abs(k_nr - k_rn) < 1e-12) == is_symmetric


def test_loss_of_shear_stiffness_is_sufficient_not_necessary():
    """Where K_rr <= 0, W2 can be negative; between 0.679 and 0.703 it can although K_rr > 0."""
    x = np.linspace(0.0, 1.0, 2001)[1:-1]
    entries = printed(x)
    is_positive = plane_law.is_positive(*entries)
    assert not is_positive[entries[3] <= 0.0].any()
    earlier = (x > 0.68) & (x < 0.703)
    assert (entries[3][earlier] > 0.0).all()
    assert not is_positive[earlier].any()
    # an increment that shows it
    k = np.reshape(printed(0.69), (2, 2))
    weakest = np.linalg.eigh(0.5 * (k + k.T))[1][:, 0]
    assert weakest @ k @ weakest < 0.0 < k[1, 1]


@pytest.mark.parametrize("factor", [0.5, 1.0, 3.0])
@pytest.mark.parametrize("plastic", [0.5, 2.0])
def test_least_shear_ratio_is_the_exact_bound(factor, plastic):
    """With a = eta and phi_p = phi_0, B touches zero at one obliquity for this k_rR; above it B > 0."""
    bound = plane_law.least_shear_ratio(plastic, factor, TAN)

    def denominator(x, shear):
        eta = x * TAN
        slope = plane_law.loading_slope(eta, TAN, 1.0)
        modulus = plane_law.hardening_modulus(plastic, x)
        return plane_law.stiffness_denominator(1.0, shear, modulus, slope, plane_law.dilatancy(factor, TAN, eta))

    least = minimize_scalar(denominator, bounds=(0.0, 1.0), args=(bound,), options={"xatol": 1e-9})
    assert 0.1 < least.x < 0.99
    assert_allclose(least.fun, 0.0, rtol=0, atol=1e-14)
    x = np.linspace(0.0, 1.0, 1001)
    assert (denominator(x, bound + 1e-6) > 0.0).all()
    assert denominator(least.x, bound - 1e-6) < 0.0


@pytest.mark.parametrize("exponent", [0.0, 0.3, 0.5, 0.99])
def test_least_shear_ratio_is_enough_for_any_exponent(exponent):
    """A smaller exponent makes the slope smaller: the bound of a = eta admits it, with room to spare."""
    x = np.linspace(0.0, 1.0, 1001)
    eta = x * TAN
    slope = plane_law.loading_slope(eta, TAN, exponent)
    b = plane_law.stiffness_denominator(
        1.0, plane_law.least_shear_ratio(1.0, 2.0, TAN), plane_law.hardening_modulus(1.0, x), slope,
        plane_law.dilatancy(2.0, TAN, eta),
    )  # fmt: skip
    assert (b > 0.0).all()


# --- critical state ------------------------------------------------------------------------------------


@pytest.mark.parametrize(("pressure", "expected"), [(10e3, 1.0), (100e3, 0.800), (200e3, 0.740), (300e3, 0.705)])
def test_critical_void_ratio(pressure, expected):
    """Base 10, to the three digits of the theory; the pressure comes back."""
    e_c = critical_void_ratio(pressure, 1.0, 0.2, 10e3)
    assert_allclose(e_c, expected, rtol=0, atol=5e-4)
    assert_allclose(critical_pressure(e_c, 1.0, 0.2, 10e3), pressure, rtol=1e-12)


def test_the_logarithm_is_not_natural():
    """With the natural one the critical void ratio at 300 kPa would be 0.32, which no sand has."""
    natural = 1.0 - 0.2 * log(300e3 / 10e3)
    assert_allclose(natural, 0.32, rtol=0, atol=5e-4)
    assert critical_void_ratio(300e3, 1.0, 0.2, 10e3) > natural + 0.38


def test_peak_friction():
    """That of the grains at the critical void ratio, larger below it and smaller above; Eq. 33 with m."""
    assert peak_friction(0.8, 0.8, 1.7, TAN) == TAN
    assert_allclose(peak_friction(0.9, 0.7, 2.0, TAN), (7 / 9) ** 2 * TAN, rtol=1e-14)
    assert peak_friction(0.6, 0.7, 1.0, TAN) > TAN > peak_friction(0.9, 0.7, 1.0, TAN)
    assert peak_friction(0.6, 0.7, 0.0, TAN) == TAN


@pytest.mark.parametrize("interlocking", [0.0, 1.0, 2.5])
def test_slopes_of_peak_friction(interlocking):
    """Derivatives by pressure and void ratio, against central differences of Eqs. 33 and 34."""

    def friction(p, e):
        return peak_friction(e, critical_void_ratio(p, 1.0, 0.2, 10e3), interlocking, TAN)

    p, e, h = 230e3, 0.87, 1e-5
    e_c = critical_void_ratio(p, 1.0, 0.2, 10e3)
    by_pressure, by_void_ratio = peak_friction_slopes(p, e, e_c, friction(p, e), interlocking, 0.2)
    # relative steps of 1e-5: truncation 1e-10, rounding 1e-11
    assert_allclose(by_pressure, (friction(p * (1 + h), e) - friction(p * (1 - h), e)) / (2 * h * p), rtol=1e-9, atol=0)
    assert_allclose(
        by_void_ratio, (friction(p, e * (1 + h)) - friction(p, e * (1 - h))) / (2 * h * e), rtol=1e-9, atol=0
    )
