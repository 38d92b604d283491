"""Second-order work along a path: elastic and parabolic paths in closed form, the peak of the model, noise."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import rendulic as rd
from rendulic.foundation.errors import InvalidInput

YOUNG, POISSON = 80e6, 0.2


def curve_of(eps_1, eps_3, sigma_1, sigma_3):
    columns = {"eps_1": eps_1, "eps_3": eps_3, "sigma_1": sigma_1, "sigma_3": sigma_3}
    return xr.Dataset({name: ("record", values + 0.0 * eps_1) for name, values in columns.items()})


def test_elastic_drained():
    """Only sigma_1 changes, so W2 per squared axial strain is Young's modulus, everywhere, to rounding: parabolas fit exactly."""
    eps_1 = np.linspace(0.0, 0.02, 81)
    found = rd.w2_along(curve_of(eps_1, -POISSON * eps_1, 2e5 + YOUNG * eps_1, 2e5))
    assert_allclose(found.w2, YOUNG, rtol=1e-12)
    assert_allclose(found.w2_normalised, 1.0 / np.sqrt(1.0 + 2.0 * POISSON**2), rtol=1e-12)
    assert np.isnan(found.instability_q)
    assert "does not turn negative" in found.attrs["verdict"]


def test_elastic_undrained():
    """At constant volume W2 is dq d_eps_1, and dq / d_eps_1 = 3G; stress and strain increments are parallel."""
    shear = YOUNG / (2.0 + 2.0 * POISSON)
    eps_1 = np.linspace(0.0, 0.02, 81)
    found = rd.w2_along(curve_of(eps_1, -eps_1 / 2, 2e5 + 2 * shear * eps_1, 2e5 - shear * eps_1))
    assert_allclose(found.w2, 3.0 * shear, rtol=1e-12)
    assert_allclose(found.w2_normalised, 1.0, rtol=1e-12)


def test_it_is_that_of_p_and_q():
    """`dp d_eps_v + dq d_eps_q` with `eps_q = 2/3 (eps_1 - eps_3)`, on parabolas, which the fit follows exactly."""
    s = np.linspace(0.0, 0.03, 121)
    p, q, eps_v = 3e5 - 2e6 * s + 3e7 * s**2, 9e6 * s - 2e8 * s**2, 0.4 * s - 8.0 * s**2
    d_p, d_q, d_eps_v = -2e6 + 6e7 * s, 9e6 - 4e8 * s, 0.4 - 16.0 * s
    expected = d_p * d_eps_v + d_q * (1.0 - d_eps_v / 3.0)
    found = rd.w2_along(curve_of(s, (eps_v - s) / 2, p + 2 * q / 3, p - q / 3))
    whole = (s > 0.00249) & (s < 0.02751)
    assert_allclose(found.eps_1, s[whole], rtol=1e-13)
    assert_allclose(found.w2, expected[whole], rtol=0, atol=1e-12 * expected[0])
    assert_allclose(found.q, q[whole], rtol=1e-12)


@pytest.mark.parametrize("path", ["drained", "undrained"])
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_instability_begins_at_the_peak_of_q(path, sense):
    """Drained (lateral stress constant, any volume change) and undrained, in compression and in extension."""
    s = np.linspace(0.0, 0.06, 241)
    q = sense * 2e5 * (1.0 - (s / 0.02 - 1.0) ** 2)
    eps_3 = -sense * (s / 2 if path == "undrained" else 0.3 * s + 4.0 * s**2)
    sigma_3 = 1e5 + (2e6 * s if path == "undrained" else 0.0)
    found = rd.w2_along(curve_of(sense * s, eps_3, sigma_3 + q, sigma_3))
    assert float(found.instability_eps_1) == pytest.approx(sense * 0.02, abs=1e-13)
    assert float(found.instability_q) == pytest.approx(sense * 2e5, rel=1e-12)
    before = np.abs(found.eps_1) < 0.02 - 1e-9
    assert (found.w2[before] > 0.0).all()
    assert (found.w2[np.abs(found.eps_1) > 0.02 + 1e-9] < 0.0).all()


# --- a sand of the Chang-Hicher model, written as a laboratory would --------------------------------------


@pytest.fixture(scope="module")
def undrained():
    """Loose sand at constant volume, beyond its peak."""
    point = rd.ChangHicher.preset("hostun_loose").at(pressure=300e3, void_ratio=0.9)
    return point.load(rd.paths.constant_volume(0.05))


def peak_of(curve):
    at = int(np.flatnonzero(curve.event_kind.values == "q_peak")[0])
    return {name: float(curve[f"event_{name}"][at]) for name in ("eps_1", "p", "q")}


def measured(curve, path, noise=0.0, seed=0, n=300):
    """Readings of a curve at even strains, in % and kPa to so many digits as a data logger gives."""
    rng = np.random.default_rng(seed)
    eps_1 = np.linspace(0.0, 0.045, n)
    q, p = (np.interp(eps_1, curve.eps_1, curve[name]) / 1e3 for name in ("q", "p"))
    q, u = q + rng.normal(0.0, noise, n), 500.0 - (p - q / 3.0) + rng.normal(0.0, noise, n)
    rows = [f"{100 * e:.5f},{a:.3f},{b:.3f}" for e, a, b in zip(1.0 - np.exp(-eps_1), q, u, strict=True)]
    path.write_text("\n".join(["Axial strain,q,Pore pressure", *rows]))
    return rd.io.read_triaxial(
        path,
        {"eps_1": "Axial strain", "q": "q", "pore_pressure": "Pore pressure"},
        {"eps_1": "%", "q": "kPa", "pore_pressure": "kPa", "cell_pressure": "kPa"},
        drainage="undrained",
        constants={"cell_pressure": 500.0},
    )


def test_the_peak_of_the_model_is_found_in_its_readings(undrained, tmp_path):
    """Within the half window that is claimed; the bias of the smoothing falls as the square of the window."""
    peak, readings = peak_of(undrained), measured(undrained, tmp_path / "sand.csv")
    late = {}
    for window in (0.005, 0.01):
        found = rd.w2_along(readings, window)
        late[window] = float(found.instability_eps_1) - peak["eps_1"]
        assert 0.0 < late[window] < 0.5 * window
    assert 3.4 < late[0.01] / late[0.005] < 4.6
    found = rd.w2_along(readings)
    assert float(found.instability_q) == pytest.approx(peak["q"], rel=1e-3)
    assert float(found.instability_p) == pytest.approx(peak["p"], rel=0.01)


def test_w2_is_that_of_the_model(undrained, tmp_path):
    """All along the path, but for what the smoothing takes off where the curve bends most."""
    found = rd.w2_along(measured(undrained, tmp_path / "sand.csv"))
    expected = np.interp(found.eps_1, undrained.eps_1, undrained.w2)
    normalised = np.interp(found.eps_1, undrained.eps_1, undrained.w2_normalised)
    assert float(np.abs(found.w2 - expected).max()) < 0.03 * float(expected.max())
    assert float(np.abs(found.w2_normalised - normalised).max()) < 0.03


def test_noise_moves_the_point_less_than_is_claimed(undrained, tmp_path):
    """Readings that scatter by 0.5 kPa: the point is there in all of 30 tests, and W2 scatters as `w2_error` says."""
    peak = peak_of(undrained)
    found = [rd.w2_along(measured(undrained, tmp_path / "sand.csv", 0.5, seed)) for seed in range(30)]
    at = np.array([float(one.instability_eps_1) for one in found])
    assert np.abs(at - peak["eps_1"]).max() < 0.0025
    assert at.std() < 1e-4
    scatter = np.std([one.w2.values for one in found], axis=0, ddof=1)
    said = np.mean([one.w2_error.values for one in found], axis=0)
    # a standard deviation from 30 values is known to 13 %; the mean along the curve of some twenty windows, to 3 %
    assert float((scatter / said).mean()) == pytest.approx(1.0, abs=0.1)


def test_few_and_scattered_readings_get_a_wider_window():
    """A drained test of 200 readings over 12 %, scattered by 2 % of q: half of that window would find no such peak."""
    eps_1 = np.linspace(0.0, 0.12, 200)
    q = 2.4e7 * eps_1 / (1.0 + (eps_1 / 0.03) ** 2)  # its peak, 360 kPa, is at 0.03
    missed = 0
    for seed in range(30):
        noisy = q + np.random.default_rng(seed).normal(0.0, 7e3, len(q))
        curve = curve_of(eps_1, -0.4 * eps_1, 2e5 + noisy, 2e5)
        found = rd.w2_along(curve)
        assert found.attrs["window"] == pytest.approx(0.02)
        assert abs(float(found.instability_eps_1) - 0.03) < float(found.instability_within) < 0.02
        narrow = rd.w2_along(curve, 0.005)
        missed += not abs(float(narrow.instability_eps_1) - 0.03) < 0.0025
    assert missed > 15


def test_a_flat_peak_in_noise_is_said_to_be_unsure():
    """With a window that is too narrow the point is off by more than half of it, and `instability_within` says so."""
    s = np.linspace(0.0, 0.1, 400)
    q = 2e5 * (1.0 - (s / 0.05 - 1.0) ** 2)
    off, within = np.transpose(
        [
            (abs(float(found.instability_eps_1) - 0.05), float(found.instability_within))
            for seed in range(100)
            for found in [rd.w2_along(curve_of(s, -s / 2, 1e5 + q + np.random.default_rng(seed).normal(0, 2e3, 400), 1e5), 0.005)]
        ]
    )  # fmt: skip
    known = np.isfinite(off)
    assert (off[known] > 0.0025).mean() > 0.2
    assert (off[known] < within[known]).all()


@pytest.mark.parametrize("goes_on", ["rising", "level"])
def test_noise_makes_no_instability(goes_on):
    """Scatter that makes q fall between many readings is never called unstable, not even where q goes on level."""
    window = None if goes_on == "rising" else 0.005  # which alone would be too narrow: the errors must tell
    eps_1 = np.linspace(0.0, 0.06, 400)
    q = 2e5 * np.tanh(eps_1 / 0.01) if goes_on == "level" else 3e5 * eps_1 / (eps_1 + 0.01)
    for seed in range(100):
        noisy = q + np.random.default_rng(seed).normal(0.0, 1e3, len(q))
        assert (np.diff(noisy) < 0.0).sum() > 50
        assert np.isnan(rd.w2_along(curve_of(eps_1, -0.5 * eps_1, 2e5 + noisy, 2e5), window).instability_eps_1)


STRAIN = np.linspace(0.0, 0.05, 101)
REFUSED = {
    "turns": (curve_of(np.abs(STRAIN - 0.02), -STRAIN, STRAIN, STRAIN), {}, "must go one way"),
    "lacks": (curve_of(STRAIN, STRAIN, STRAIN, STRAIN).drop_vars("sigma_3"), {}, "the curve lacks sigma_3"),
    "nan": (curve_of(STRAIN, np.where(STRAIN > 0.03, np.nan, 0), STRAIN, STRAIN), {}, "eps_3 of the curve must be finite"),
    "narrow": (curve_of(STRAIN, STRAIN, STRAIN, STRAIN), {"window": 0.002}, "must hold 7 different axial strains"),
    "wide": (curve_of(STRAIN, STRAIN, STRAIN, STRAIN), {"window": 0.03}, "must be two windows long"),
    "short": (curve_of(STRAIN[:5], STRAIN[:5], STRAIN[:5], STRAIN[:5]), {}, "must be two windows long"),
    "zero": (curve_of(STRAIN, STRAIN, STRAIN, STRAIN), {"window": 0.0}, "window must be a positive number"),
}  # fmt: skip


@pytest.mark.parametrize("why", REFUSED)
def test_refused(why):
    curve, options, words = REFUSED[why]
    with pytest.raises(InvalidInput, match=words):
        rd.w2_along(curve, **options)
