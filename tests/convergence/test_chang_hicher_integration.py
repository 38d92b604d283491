"""Orders and errors of the Chang-Hicher model: steps, tangents, and rules over the sphere."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial.legendre import Legendre
from numpy.testing import assert_allclose

import rendulic as rd
from rendulic.chang_hicher import load_many, tangent
from rendulic.chang_hicher.drive.equations import control_of
from rendulic.chang_hicher.drive.integration import Integration
from rendulic.tensors.sphere_rules import bazant_oh_37, between, lebedev

P = 300e3
FORMULATIONS = ["printed", "eq32", "consistent"]


def slope(sizes, errors):
    """Least-squares slope of log error against log size."""
    return np.polyfit(np.log(sizes), np.log(errors), 1)[0]


def peak_of_q(curve):
    """The first peak of q, as located."""
    return float(curve.event_q.values[curve.event_kind.values == "q_peak"][0])


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_tolerance_is_small_enough(formulation):
    """Half the tolerance, the same peak of q: to ten times the tolerance of a step, and ever closer."""
    peaks = []
    for tolerance in (1e-6, 1e-8, 5e-9, 1e-12):
        point = rd.ChangHicher(rule=bazant_oh_37(), formulation=formulation).at(P, 0.9)
        curve = point.load(rd.paths.constant_volume(0.03), tolerance=tolerance, least_records=1)
        peaks.append(peak_of_q(curve))
    errors = np.abs(np.array(peaks[:3]) / peaks[3] - 1.0)
    assert abs(peaks[2] / peaks[1] - 1.0) < 1e-7
    assert errors[1] < 1e-7
    # looser is worse: the tolerance decides
    assert errors[0] > 5.0 * errors[1]


@pytest.mark.parametrize("least_records", [1, 50, 1000])
def test_records_do_not_decide_the_result(least_records):
    """The end of an undrained test is the same however often it is recorded, to the tolerance of the steps."""
    reference = rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.9).load(rd.paths.constant_volume(0.03), tolerance=1e-12)
    curve = (
        rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.9).load(rd.paths.constant_volume(0.03), least_records=least_records)
    )
    assert curve.sizes["record"] > least_records
    assert_allclose([curve.q[-1], curve.p[-1]], [reference.q[-1], reference.p[-1]], rtol=1e-7)


def followed(point, path, n_steps, tolerance):
    """Stress after about `n_steps` equal steps; with an endless tolerance nothing else shortens them."""
    own = point.clone()
    strain = np.array([1.0, -0.5, -0.5]) if path == "undrained" else np.array([1.0, 0.0, 0.0])
    by_stress = np.diag([0.0, 1.0, 1.0]) if path == "drained" else np.zeros((3, 3))
    by_strain = np.diag([1.0, 0.0, 0.0]) if path == "drained" else np.eye(3)
    control = control_of(own, by_stress, by_strain, 0.008 * strain)
    # the first step, too, is as long as the largest
    integration = Integration(own, control, tolerance, 1.0 / n_steps, first_step=1e9)
    assert integration.to_end() == "target"
    return own.sigma, len(integration.record) - 1


@pytest.mark.parametrize("path", ["undrained", "drained"])
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_integrator_is_of_fifth_order(formulation, path):
    """Fixed steps from 0.2 % of strain on 0.8 % further, no plane changing sides: slope 5 within 0.3.

    The reference is the same integrator at a tolerance of 1e-14, where rounding ends it.
    """
    point = rd.ChangHicher(rule=bazant_oh_37(), formulation=formulation).at(P, 0.9)
    point.load(rd.paths.constant_volume(0.002), tolerance=1e-12)
    expected, _n = followed(point, path, 1, 1e-14)
    steps, errors = [], []
    for count in (12, 16, 20, 24):
        sigma, n = followed(point, path, count, 1e30)
        assert abs(n - count) <= 1
        steps.append(1.0 / count)
        errors.append(np.abs(sigma - expected).max() / P)
    assert slope(steps, errors) == pytest.approx(5.0, abs=0.3)
    assert errors[0] < 1e-8


# --- the tangent against the driver --------------------------------------------------------------------


def response(point, increment):
    """Principal stress increments (3,) of a strain probe."""
    own = point.clone()
    own.probe(increment)
    return np.diag(own.stress - point.stress)


def differences(point, direction, changes, size=1e-7):
    """Central differences of the driver's answers to strain increments about one direction, column by column.

    The answer to a tiny increment is linear within the sector of the same loading planes; the error of
    first order in its size is removed with one of half the size.
    """

    def at(length):
        columns = []
        for change in changes:
            plus, minus = (response(point, length * (direction + sign * 0.02 * change)) for sign in (1, -1))
            columns.append((plus - minus) / (0.04 * length))
        return np.stack(columns, axis=1)

    return 2.0 * at(0.5 * size) - at(size)


def compare(point, direction, changes):
    """The tangent's stiffness in these changes of the direction equals the driver's differences to 3e-8."""
    own = tangent(point, direction)
    for change in changes:
        for sign in (1, -1):
            np.testing.assert_array_equal(tangent(point, direction + sign * 0.02 * change).is_loading, own.is_loading)
    expected = own.stiffness[:3, :3] @ np.stack(changes, axis=1)
    # 1e-7 of strain is 1e-5 of that of the stress: its square is left, and rounding of 3e-11 Pa in 10 Pa
    assert_allclose(differences(point, direction, changes), expected, rtol=0, atol=3e-8 * np.abs(expected).max())
    return own


@pytest.mark.parametrize("alpha", [90.0, 125.0, 140.0, 210.0, 320.0])
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_tangent_is_the_derivative_of_the_driver(formulation, alpha):
    """After drained compression, in the Rendulic plane, loading and unloading.

    Only there: planes along the axis carry no shear, and would slide at the least lateral difference.
    """
    point = rd.ChangHicher(rule=bazant_oh_37(), formulation=formulation).at(P, 0.9)
    point.load(rd.paths.drained_triaxial(0.3, until_eta=0.8), tolerance=1e-12)
    direction = rd.directions.axisymmetric(alpha).increments(1.0)[0]
    compare(point, direction, [np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 1.0])])


@pytest.mark.parametrize("direction", [(1.0, -0.2, -0.7), (1.0, 0.4, -0.3), (-1.0, 0.2, 0.7), (-0.3, 1.0, 0.1)])
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_tangent_at_three_different_stresses(formulation, direction):
    """In a virgin state with three principal stresses, all changes of the principal strains."""
    point = rd.ChangHicher(rule=bazant_oh_37(), formulation=formulation).at(
        stress=np.diag([450e3, 330e3, 250e3]), void_ratio=0.85
    )
    own = compare(point, np.array(direction), list(np.eye(3)))
    assert own.at_yield.sum() > 30


def test_loading_is_softer_than_unloading():
    """What the differences above compare: tangents that differ by far more than the tolerance."""
    point = rd.ChangHicher(rule=bazant_oh_37()).at(P, 0.9)
    point.load(rd.paths.drained_triaxial(0.3, until_eta=0.8))
    loading, unloading = (tangent(point, sign * np.array([1.0, -0.5, -0.5])).stiffness for sign in (1, -1))
    assert loading[0, 0] < 0.8 * unloading[0, 0]


# --- rules over the sphere -----------------------------------------------------------------------------


def errors_by_degree(rule, degrees):
    """Largest |mean of P_k(n . u)| over many directions u; zero for a rule that is exact to degree k.

    By the addition theorem the functions P_k(n . u) span all harmonics of degree k. Odd ones mean
    nothing: the rules keep one of each pair of opposite points.
    """
    directions = np.random.default_rng(4).standard_normal((200, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    cosines = rule.normals @ directions.T
    return np.array([np.abs(rule.mean(Legendre.basis(k)(cosines))).max() for k in degrees])


RULES = [bazant_oh_37(), *(lebedev(degree) for degree in (3, 5, 7, 11, 17, 23, 29, 41))]


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.name)
def test_rules_are_exact_to_their_degree_and_not_beyond(rule):
    """Every even harmonic up to the degree averages to nothing; some of the next does not.

    1e-12: points of the 37 are tabulated to twelve digits.
    """
    within = errors_by_degree(rule, range(2, rule.degree + 1, 2))
    assert_allclose(within, 0.0, atol=1e-12)
    beyond = errors_by_degree(rule, [rule.degree + 1])
    assert beyond[0] > 1e-2
    assert_allclose(rule.mean(np.ones(len(rule))), 1.0, rtol=1e-15)


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.name)
def test_rules_hold_one_of_each_opposite_pair(rule):
    """Unit normals, no two of them along one line, positive weights; a turned rule is as exact."""
    assert_allclose(np.linalg.norm(rule.normals, axis=1), 1.0, rtol=1e-14)
    cosines = np.abs(rule.normals @ rule.normals.T) - np.eye(len(rule))
    assert cosines.max() < 1.0 - 1e-6
    assert (rule.weights > 0.0).all()
    angle = 0.7
    turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    assert_allclose(errors_by_degree(rule.rotated(turn), range(2, rule.degree + 1, 2)), 0.0, atol=1e-12)


def test_numbers_of_points():
    """Half of the published numbers: 37 of 74, and Lebedev's 26, 50, 110, 302, 5810."""
    assert len(bazant_oh_37()) == 37
    assert [2 * len(lebedev(degree)) for degree in (7, 11, 17, 29, 131)] == [26, 50, 110, 302, 5810]


def test_planes_of_the_paper():
    """The six inclinations of the paper's planes, among those of the 37: 18.0, 28.3, 45, 54.7, 70.4, 72.0."""
    found = set(bazant_oh_37().inclination.round(1).tolist())
    assert {18.0, 28.3, 45.0, 54.7, 70.4, 72.0} <= found
    assert found - {18.0, 28.3, 45.0, 54.7, 70.4, 72.0} == {0.0, 90.0}


def test_peak_converges_with_the_rule():
    """The peak of q with more and more planes: errors fall with the square of the degree, slope -2 within 0.5.

    Not faster: the shear on a plane has a kink where it vanishes. The 37 planes are within 1 %.
    """
    degrees = np.array([11, 17, 23, 35, 47, 59])

    def peak(rule):
        return float(load_many({}, rd.paths.constant_volume(0.013), rule=rule).q_peak[0])

    best = peak(lebedev(131))
    errors = np.array([abs(peak(lebedev(int(degree))) / best - 1.0) for degree in degrees])
    assert (np.diff(errors) < 0.0).all()
    assert slope(degrees, errors) == pytest.approx(-2.0, abs=0.5)
    assert errors[-1] < 2e-4
    assert abs(peak(bazant_oh_37()) / best - 1.0) < 0.01


def test_values_carried_from_rule_to_rule():
    """What is linear on each octant is carried over to the size of a triangle; what is odd keeps its sense."""
    rule, other = lebedev(29), lebedev(47)
    _nearest, corners, shares, signs = between(rule, other)
    assert shares.min() >= 0.0
    assert_allclose(shares.sum(axis=1), 1.0, rtol=1e-14)
    even = (shares * (rule.normals[:, 0] ** 2)[corners]).sum(axis=1)
    assert_allclose(even, other.normals[:, 0] ** 2, rtol=0, atol=0.03)
    odd = ((shares * signs)[:, :, None] * rule.normals[corners]).sum(axis=1)
    # a chord instead of the sphere: shorter by half the square of half an edge
    assert_allclose(odd, other.normals, rtol=0, atol=0.02)
