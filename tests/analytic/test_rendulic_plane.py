"""Landmarks of the Rendulic plane, invariants, and the normalised second-order work."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import rendulic as rd
from rendulic.probing.second_order_work import normalised
from rendulic.tensors import invariants, rendulic_plane


@pytest.mark.parametrize(
    ("increment", "alpha"),
    [
        ((1, 1, 1), 35.26438968275465),  # atan(1 / sqrt 2): isotropic compression
        ((1, 0, 0), 90.0),  # axial compression at constant radius
        ((1, -0.5, -0.5), 125.26438968275465),  # isochoric compression
        ((-1, -1, -1), 215.26438968275465),
        ((-1, 0.5, 0.5), 305.26438968275465),
        ((0, 1, 1), 0.0),
    ],
)
def test_landmarks(increment, alpha):
    """Directions of increments whose angle follows from `atan2(d_1, sqrt(2) d_3)`, to rounding."""
    assert_allclose(rendulic_plane.direction_of(increment), alpha, rtol=0, atol=1e-12)
    along = rendulic_plane.increment_along(alpha, np.linalg.norm(increment))
    assert_allclose(along, increment, rtol=0, atol=1e-14)


def test_named_landmarks():
    """The constants are the angles of the theory's section 1."""
    assert_allclose(rendulic_plane.ISOTROPIC_COMPRESSION, 35.26, atol=0.005)
    assert_allclose(rendulic_plane.ISOCHORIC_COMPRESSION, 125.26, atol=0.005)
    assert rendulic_plane.AXIAL_COMPRESSION == 90.0


@given(alpha=st.floats(0, 359.99), norm=st.floats(1e-9, 1e9))
def test_directions_round_trip(alpha, norm):
    """Angle to increment and back, norm kept; at right angles rounding may pass 360."""
    increment = rendulic_plane.increment_along(alpha, norm)
    assert_allclose(np.linalg.norm(increment), norm, rtol=1e-14)
    difference = (rendulic_plane.direction_of(increment) - alpha + 180.0) % 360.0 - 180.0
    assert_allclose(difference, 0.0, atol=1e-11)


def test_invariants():
    """p, q, eta and eps_v of a stress and strain written down by hand."""
    sigma = np.array([[300.0, 7.0, 0.0], [7.0, 200.0, 0.0], [0.0, 0.0, 160.0]])
    assert invariants.mean_stress(sigma) == 220.0
    assert invariants.deviatoric_stress(sigma) == 120.0
    assert_allclose(invariants.stress_ratio(sigma), 120.0 / 220.0, rtol=1e-15)
    assert_allclose(invariants.volumetric_strain(np.diag([0.03, -0.01, -0.005])), 0.015, rtol=1e-14)
    assert np.isnan(invariants.stress_ratio(np.zeros((3, 3))))
    assert_allclose(invariants.mean_stress(np.stack([sigma, 2 * sigma])), [220.0, 440.0])


def test_normalised_work_of_linear_elasticity():
    """For isotropic elasticity W2n depends on direction in closed form.

    With `d_sigma = lambda tr(d_eps) + 2 G d_eps`: 1 for isotropic and isochoric increments.
    """
    lame, shear = 2.0e8, 1.0e8
    for alpha, expected in (
        (rendulic_plane.ISOTROPIC_COMPRESSION, 1.0),
        (rendulic_plane.ISOCHORIC_COMPRESSION, 1.0),
        (90.0, (lame + 2 * shear) / np.sqrt((lame + 2 * shear) ** 2 + 2 * lame**2)),
    ):
        d_eps = rendulic_plane.increment_along(alpha, 1e-5)
        d_sigma = lame * d_eps.sum() + 2 * shear * d_eps
        assert_allclose(normalised(d_sigma, d_eps), expected, rtol=1e-14)


@given(seed=st.integers(0, 2**32 - 1), factor=st.floats(1e-6, 1e6))
def test_normalised_work_is_bounded_and_free_of_scale(seed, factor):
    """In [-1, 1], even in sign, and independent of the size of either increment."""
    d_sigma, d_eps = np.random.default_rng(seed).standard_normal((2, 5, 3))
    value = normalised(d_sigma, d_eps)
    assert np.abs(value).max() <= 1.0 + 1e-15
    assert_allclose(normalised(factor * d_sigma, -d_eps / factor), -value, rtol=0, atol=1e-14)


def test_normalised_work_of_nothing_is_not_a_number():
    """A zero increment has no direction: NaN instead of a number without meaning."""
    assert np.isnan(normalised(np.zeros(3), np.ones(3)))
    assert np.isnan(normalised(np.ones(3), np.zeros(3)))


def test_directions_cover_the_plane():
    """36 directions of 10 degrees, unit increments, opposite ones opposite."""
    directions = rd.directions.rendulic(step=10)
    increments = directions.increments(5e-5)
    assert len(directions) == 36
    assert_allclose(np.linalg.norm(increments, axis=1), 5e-5, rtol=1e-14)
    assert_allclose(increments[:18], -increments[18:], rtol=0, atol=1e-19)
    assert_allclose(rendulic_plane.direction_of(increments[1:]), directions.alpha[1:], rtol=1e-12)
