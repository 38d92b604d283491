"""Controls, paths and directions: conjugacy, and what they refuse."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import rendulic as rd
from rendulic.foundation.errors import InvalidInput
from rendulic.loading.paths import Until

WORDS = ("strain", "stress", "stress")


@given(seed=st.integers(0, 2**32 - 1), size=st.sampled_from([1e-3, 1.0, 1e6]))
def test_conjugate_pairs_do_the_work(seed, size):
    """`s . e = sigma : eps` for any basis, to the rounding of its inverse."""
    rng = np.random.default_rng(seed)
    basis, sigma, eps = size * rng.standard_normal((3, 3)), rng.standard_normal(3), rng.standard_normal(3)
    condition = np.linalg.cond(basis)
    assume(condition < 1e4)
    for control in (rd.Control.of_strains(basis, WORDS), rd.Control.of_stresses(basis, WORDS)):
        e, s = np.asarray(control.strain_basis) @ eps, control.stress_basis @ sigma
        assert_allclose(
            s @ e, sigma @ eps, rtol=0, atol=1e-14 * condition * np.linalg.norm(sigma) * np.linalg.norm(eps)
        )
    assert_allclose(rd.Control.of_stresses(basis, WORDS).stress_basis, basis, rtol=0, atol=1e-13 * condition * size)


def test_conjugate_of_the_proportional_path():
    """`d_eps_1 + 2 R d_eps_3` has the conjugate `s = sigma_1 - sigma_3 / R` (theory, section 4)."""
    for ratio in (0.5, 1.0, 2.0):
        control = rd.Control.of_strains([[1, 0, 0], [1, ratio, ratio], [0, 1, -1]], ("stress", "strain", "strain"))
        s = control.stress_basis @ np.array([300.0, 200.0, 200.0])
        assert_allclose(s[0], 300.0 - 200.0 / ratio, rtol=1e-13)
        assert control.is_stress.tolist() == [True, False, False]


@pytest.mark.parametrize(
    ("basis", "words", "message"),
    [
        ([[1, 0, 0], [2, 0, 0], [0, 0, 1]], WORDS, "must be independent"),
        ([[1, 1, 1], [1, 0, 0], [0, 1, 1]], WORDS, "must be independent"),
        ([[1, 0], [0, 1]], WORDS, r"a control basis must have shape \(3, 3\), got \(2, 2\)"),
        (np.full((3, 3), np.nan), WORDS, "a control basis must be finite"),
        (np.eye(3), ("strain", "stres", "stress"), "unknown controlled quantity 'stres': did you mean 'stress'"),
        (np.eye(3), ("strain", "stress"), "three components must be controlled, got 2"),
    ],
)
def test_control_refuses(basis, words, message):
    """Singular and ill-shaped bases, and unknown words."""
    with pytest.raises(InvalidInput, match=message):
        rd.Control.of_strains(basis, words)


@pytest.mark.parametrize("make", [rd.Control.of_strains, rd.Control.of_stresses])
def test_control_refuses_nothing_at_all(make):
    """A basis of zeros is singular, too."""
    with pytest.raises(InvalidInput, match="must be independent"):
        make(np.zeros((3, 3)), WORDS)


def test_singular_stress_combinations_are_refused():
    """Dependent combinations of stress have no conjugates."""
    with pytest.raises(InvalidInput, match="stress combinations must be independent"):
        rd.Control.of_stresses([[1, 1, 1], [1, 0, 0], [0, 1, 1]], WORDS)


@pytest.mark.parametrize(
    ("make", "arguments", "message"),
    [
        (rd.paths.isotropic, {"pressure": -1.0}, "pressure must be a positive number in Pa, got -1.0"),
        (rd.paths.isotropic, {"pressure": np.inf}, "pressure must be a positive number"),
        (rd.paths.drained_triaxial, {"until_strain": 0.0}, "positive axial strain, got 0.0"),
        (rd.paths.drained_triaxial, {"until_eta": np.nan}, "until_eta must be a number"),
        (rd.paths.constant_volume, {"until_strain": np.nan}, "positive axial strain"),
        (rd.paths.proportional, {"ratio": 0.0}, "a number other than 0, got 0.0"),
        (rd.paths.proportional, {"ratio": np.inf}, "a number other than 0"),
        (Until, {"peak_drop": 1.0}, "peak_drop must be in"),
        pytest.param(rd.paths.drained_triaxial, {"lateral_stress": np.nan}, "lateral_stress"),
        pytest.param(rd.paths.drained_triaxial, {"lateral_stress": -5.0}, "lateral_stress"),
    ],
)  # fmt: skip
def test_paths_refuse(make, arguments, message):
    """Targets without meaning, when the path is made and not when it is followed."""
    with pytest.raises(InvalidInput, match=message):
        make(**arguments)


@pytest.mark.parametrize(
    ("step", "message"),
    [(7.0, "must divide 360 degrees, got 7.0"), (0.0, r"in \(0, 180\]"), (-10.0, r"in \(0, 180\]"),
     (np.nan, r"in \(0, 180\]"), (200.0, r"in \(0, 180\]")],
)  # fmt: skip
def test_steps_between_directions_must_divide_the_circle(step, message):
    """Otherwise the last gap would differ from the others."""
    with pytest.raises(InvalidInput, match=message):
        rd.directions.rendulic(step=step)


@pytest.mark.parametrize(("step", "count"), [(10, 36), (7.5, 48), (180, 2), (360 / 7, 7)])
def test_directions_close_the_circle(step, count):
    """Equal gaps all around, also for steps that are no whole number."""
    alpha = np.array(rd.directions.rendulic(step=step).alpha)
    assert len(alpha) == count
    assert_allclose(np.diff(np.append(alpha, 360.0)), step, rtol=1e-12)


@pytest.mark.parametrize("alpha", [[], [np.nan], [[1.0, 2.0]]])
def test_given_directions_are_checked(alpha):
    """A list of finite angles, at least one."""
    with pytest.raises(InvalidInput, match="list of finite angles"):
        rd.directions.axisymmetric(alpha)


@pytest.mark.parametrize(
    ("path", "fixed"),
    [
        (rd.paths.drained_triaxial(until_strain=1e-3), lambda d_eps, stress: stress[1:] / 200e3 - 1),
        (rd.paths.constant_volume(until_strain=1e-3), lambda d_eps, stress: d_eps.sum() / 1e-5),
        (rd.paths.proportional(2.0, until_strain=1e-3), lambda d_eps, stress: (d_eps[0] + 4 * d_eps[1:]) / 1e-5),
        (rd.paths.constant_p(until_strain=1e-3), lambda d_eps, stress: stress.mean() / 200e3 - 1),
        (rd.paths.drained_triaxial(until_strain=1e-3, extension=True), lambda d_eps, stress: stress[1:] / 200e3 - 1),
    ],
    ids=["drained", "constant volume", "proportional", "constant p", "extension"],
)
@pytest.mark.parametrize("packing", ["packed_state", "dense_state"])
def test_paths_hold_what_they_say(request, packing, fast, path, fixed):
    """What a path fixes stays fixed: kinematics within 0.1 % of the strain, stresses by the servo within 3 %.

    An imposed axial strain ends where it was told to; at constant p it also follows the servo.
    """
    packed = rd.dem.Assembly.from_state(request.getfixturevalue(packing))
    before = np.diag(packed.strain)
    curve = packed.load(path, speed=fast)
    assert curve.attrs["stopped_by"] == "strain"
    d_eps = np.diag(packed.strain) - before
    overshoot = 0.1 if path.name == "constant p" else 1e-3
    assert 0.999e-3 <= abs(d_eps[0]) <= (1 + overshoot) * 1e-3
    assert np.abs(fixed(d_eps, np.diag(packed.stress))).max() < 0.03
    assert curve.eps_1.attrs["units"] == "1"
    assert np.sign(d_eps[0]) == np.sign(path.strain_rate[0])


def test_isotropic_path_reaches_its_pressure(packed, fast):
    """All three stresses end at the pressure, at rest, within what the servo holds there."""
    packed.load(rd.paths.isotropic(300e3), speed=fast)
    assert_allclose(np.diag(packed.stress), 300e3, rtol=1e-6)
    assert packed.equilibrium().reached


def test_a_stress_ratio_is_reached_at_rest(packed, fast):
    """`until_eta` stops at a ratio that stands when the test is paused, within 0.01."""
    curve = packed.load(rd.paths.drained_triaxial(until_strain=0.05, until_eta=0.2), speed=fast)
    assert curve.attrs["stopped_by"] == "eta"
    assert_allclose(packed.eta, 0.2, rtol=0, atol=0.01)
    assert packed.equilibrium().reached
