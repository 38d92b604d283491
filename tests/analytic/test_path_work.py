"""Second-order work along a path: elastic and parabolic paths in closed form, the peak of the model, noise."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose
from scipy.signal import lfilter

import rendulic as rd
from rendulic.foundation.errors import InvalidInput
from rendulic.probing.path_fits import local_fits, noise_of, widths_of

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
    assert_allclose(found.eps_1, s, rtol=0, atol=1e-15)
    assert_allclose(found.w2, expected, rtol=0, atol=1e-11 * expected[0])
    assert_allclose(found.q, q, rtol=0, atol=1e-11 * q.max())


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
    """Within the error that is told; what a prescribed window puts it late by falls as its square."""
    peak, readings = peak_of(undrained), measured(undrained, tmp_path / "sand.csv")
    late = {}
    for window in (0.005, 0.01):
        found = rd.w2_along(readings, window)
        late[window] = float(found.instability_eps_1) - peak["eps_1"]
        assert 0.0 < late[window] < float(found.instability_within) < 0.25 * window
    assert 3.2 < late[0.01] / late[0.005] < 4.8
    found = rd.w2_along(readings)
    assert abs(float(found.instability_eps_1) - peak["eps_1"]) < float(found.instability_within) < 0.0005
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
    """Readings that scatter by 0.5 kPa: in all of 30 tests one edge, as far off as told, and W2 scatters as `w2_error` says."""
    peak = peak_of(undrained)
    found = [rd.w2_along(measured(undrained, tmp_path / "sand.csv", 0.5, seed)) for seed in range(30)]
    assert all(one.sizes["edge"] == 1 for one in found)
    off = np.array([abs(float(one.instability_eps_1) - peak["eps_1"]) for one in found])
    within = np.array([float(one.instability_within) for one in found])
    assert (off <= within).all()
    assert within.max() < 0.002
    true = np.interp(found[0].eps_1, undrained.eps_1, undrained.w2)
    told = np.mean([one.w2_error.values for one in found], axis=0)
    off = np.sqrt(np.mean([(one.w2.values - true) ** 2 for one in found], axis=0)) / told
    # an adaptive window errs by its bends here and by its noise there: the error is right in the middle, to a factor of 2
    assert 0.5 < np.median(off) < 2.0


def test_few_and_scattered_readings_get_a_wider_window():
    """A drained test of 200 readings over 12 %, scattered by 2 % of q: found in all of 30, where nine of ten errors say."""
    eps_1 = np.linspace(0.0, 0.12, 200)
    q = 2.4e7 * eps_1 / (1.0 + (eps_1 / 0.03) ** 2)  # its peak, 360 kPa, is at 0.03
    placed = []
    for seed in range(30):
        noisy = q + np.random.default_rng(seed).normal(0.0, 7e3, len(q))
        found = rd.w2_along(curve_of(eps_1, -0.4 * eps_1, 2e5 + noisy, 2e5))
        assert found.sizes["edge"] == 1
        assert found.attrs["window"] > 0.01
        placed.append(abs(float(found.instability_eps_1) - 0.03) < float(found.instability_within) < 0.025)
    assert sum(placed) >= 24  # of a binomial with nine of ten, fewer than 24 come once in 40 times


# --- all edges ------------------------------------------------------------------------------------------------


def wavy(s):
    """q in Pa: from 60 up to 80 kPa at 1 %, down to 60 at 2 %, and so on."""
    return 1e3 * (70.0 - 10.0 * np.cos(np.pi * s / 0.01))


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_every_edge_is_told(sense):
    """q = cos: peaks at 1, 3, 5 %, minima at 2 and 4 %, in compression and extension: three stretches, the last one open."""
    s = np.linspace(0.0, 0.056, 561)
    q = sense * wavy(s)
    found = rd.w2_along(curve_of(sense * s, -sense * s / 2, 1e5 + q, 1e5))
    assert_allclose(sense * found.from_eps_1, [0.01, 0.03, 0.05], atol=1e-5)
    assert_allclose(sense * found.to_eps_1, [0.02, 0.04, np.nan], atol=1e-5)
    assert (found.from_error < 5e-4).all()
    assert_allclose(sense * found.peak_q, 80e3, rtol=1e-5)
    # the end is not a place where a window was chosen for it
    assert_allclose(found.falls_by, [20e3, 20e3, 80e3 - wavy(0.056)], rtol=1e-3)
    # three waves alike are taken for slow noise in part, and their tops are smoothed by a per cent of them
    assert_allclose(found.w2, np.pi * 1e6 * np.sin(np.pi * s / 0.01), atol=0.015 * np.pi * 1e6)
    assert found.attrs["verdict"].count("turns negative") == 3
    assert found.attrs["verdict"].count("positive again") == 2


def test_negative_from_the_first_reading():
    """q that falls from the start: said so, with no error of a place that was not seen."""
    s = np.linspace(0.0, 0.05, 101)
    found = rd.w2_along(curve_of(s, -s / 2, 3e5 - 2e6 * s, 1e5))
    assert found.attrs["verdict"] == "W2 is negative from the first reading on"
    assert float(found.from_eps_1[0]) == 0.0
    assert np.isnan(found.from_error[0])
    assert np.isnan(found.to_eps_1[0])


def test_twenty_readings_and_readings_that_run_away():
    """A record by hand, and one whose last five readings go from 1 to 14 %: both get their answer."""
    strain = np.array([0, 2, 5, 9, 13, 18, 24, 31, 39, 47, 56, 68, 81, 95, 110, 126, 143, 161, 180, 200]) / 1e3
    q = 1e3 * np.array(
        [0, 88, 150, 205, 241, 268, 291, 307, 317, 320, 318, 312, 303, 294, 286, 279, 272, 266, 261, 258], dtype=float
    )
    found = rd.w2_along(curve_of(strain, -strain / 2, 1e5 + q, 1e5))
    assert found.sizes["edge"] == 1
    assert 0.04 < float(found.from_eps_1[0]) < 0.07
    strain = np.concatenate((np.linspace(0.0, 0.01, 60), [0.02, 0.05, 0.08, 0.11, 0.14]))
    q = 1e3 * np.concatenate((60.0 * np.sqrt(np.linspace(0.0, 1.0, 60)), [50.0, 30.0, 20.0, 15.0, 12.0]))
    found = rd.w2_along(curve_of(strain, -strain / 2, 1e5 + q, 1e5))
    assert found.sizes["edge"] == 1
    assert 0.009 < float(found.from_eps_1[0]) < 0.02
    assert np.isnan(found.to_eps_1[0])


def test_a_peak_in_the_first_readings():
    """25 readings up to a peak at 0.08 %, 300 after it: no window is cut off at the ends."""
    s = np.concatenate((np.linspace(0.0, 8e-4, 25), np.linspace(9e-4, 0.05, 300)))
    q = np.where(s < 8e-4, 55e3 * (1.0 - (s / 8e-4 - 1.0) ** 2), 55e3 * np.exp(-(s - 8e-4) / 0.02))
    found = rd.w2_along(curve_of(s, -s / 2, 1e5 + q, 1e5))
    assert abs(float(found.from_eps_1[0]) - 8e-4) <= float(found.from_error[0]) < 4e-4


def test_a_fall_that_noise_could_make_is_undecided():
    """q ends 2 % below its largest value, and scatters by 2 %: neither stable nor unstable."""
    s = np.linspace(0.0, 0.1, 200)
    q = 3e5 * (np.minimum(s / 0.02, 1.0) - 0.5 * np.maximum(s - 0.06, 0.0))
    found = rd.w2_along(curve_of(s, -s / 2, 1e5 + q + np.random.default_rng(3).normal(0.0, 6e3, 200), 1e5))
    assert found.sizes["edge"] == 0
    assert found.attrs["is_undecided"] == 1
    assert "undecided" in found.attrs["verdict"]


# --- noise ----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def trials():
    """The trials of `benchmarks/laboratory_noise.py`."""
    path = Path(__file__).parents[2] / "benchmarks" / "laboratory_noise.py"
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_correlated_noise_makes_no_instability(trials):
    """60 hardening tests, noise up to 3 % correlated over 1 to 50 readings: at most 5 % are said to turn negative."""
    draw = np.random.default_rng(1)
    false = [
        about
        for k in range(60)
        for about, found in [trials.trial(draw, trials.HARDENING, k % 2 == 0)]
        if found.sizes["edge"]
    ]
    # more than 6 of 60 at 5 % come once in 50 times; with independent noise assumed, it were 30
    assert len(false) <= 6, false


def test_a_fall_of_a_fifth_is_found_in_correlated_noise(trials):
    """30 tests with the same noise: all are found, and nine of ten places are within the error told."""
    draw, true = np.random.default_rng(2), {"early": 0.012, "middle": 0.05, "late": 0.1}
    within = []
    for k in range(30):
        about, found = trials.trial(draw, trials.peaks(0.2), k % 2 == 0)
        assert found.sizes["edge"] >= 1, about
        within.append(bool((np.abs(found.from_eps_1 - true[about["curve"]]) <= found.from_error).any()))
    assert sum(within) >= 24


@pytest.mark.parametrize("goes_on", ["rising", "level"])
@pytest.mark.parametrize("window", [None, 0.005])
def test_noise_makes_no_instability(goes_on, window):
    """Scatter that makes q fall between many readings is never called unstable, not even where q goes on level."""
    eps_1 = np.linspace(0.0, 0.06, 400)
    q = 2e5 * np.tanh(eps_1 / 0.01) if goes_on == "level" else 3e5 * eps_1 / (eps_1 + 0.01)
    for seed in range(25):
        noisy = q + np.random.default_rng(seed).normal(0.0, 1e3, len(q))
        assert (np.diff(noisy) < 0.0).sum() > 50
        assert rd.w2_along(curve_of(eps_1, -0.5 * eps_1, 2e5 + noisy, 2e5), window).sizes["edge"] == 0


def test_noise_is_measured_at_every_width():
    """White, and correlated over 20 readings: what is told is what fits of 40 records scatter by, or up to twice as much."""
    n = 1000
    s = np.linspace(0.0, 0.1, n)
    q = 3e5 * s / (0.02 + s)
    draw = np.random.default_rng(4)
    keeps = np.exp(-1.0 / 20.0)
    for correlated in (False, True):
        slopes, told = [], []
        for _ in range(40):
            noise = draw.normal(0.0, 1e3, n)
            if correlated:
                noise = lfilter([np.sqrt(1.0 - keeps**2)], [1.0, -keeps], noise)
            y = np.stack((1e5 + q + noise, s), axis=1)
            fits = [local_fits(s, y, count) for count in widths_of(n)]
            noise = noise_of(y, fits)
            at = [k for k, fit in enumerate(fits) if fit.count in (14, 57, 115)]
            slopes.append(np.array([fits[k].w2[500:900:80] for k in at]).T)
            told.append(noise.w2[at, 500:900:80].T)
        scatter, said = np.std(slopes, axis=0), np.sqrt(np.mean(np.square(told), axis=0))
        ratio = np.sqrt((said**2).mean(axis=0) / (scatter**2).mean(axis=0))
        # 40 records and 5 places: the scatter is known to 5 %; the wider windows are told with what the curve adds to them
        assert (ratio > 0.8).all()
        assert (ratio < 2.2).all()


STRAIN = np.linspace(0.0, 0.05, 101)
REFUSED = {
    "turns": (curve_of(np.abs(STRAIN - 0.02), -STRAIN, STRAIN, STRAIN), {}, "must go one way"),
    "lacks": (curve_of(STRAIN, STRAIN, STRAIN, STRAIN).drop_vars("sigma_3"), {}, "the curve lacks sigma_3"),
    "nan": (curve_of(STRAIN, np.where(STRAIN > 0.03, np.nan, 0), STRAIN, STRAIN), {}, "eps_3 of the curve must be finite"),
    "wide": (curve_of(STRAIN, STRAIN, STRAIN, STRAIN), {"window": 0.03}, "must be two windows long"),
    "short": (curve_of(STRAIN[:4], STRAIN[:4], STRAIN[:4], STRAIN[:4]), {}, "at least 5 different axial strains, the curve has 4"),
    "zero": (curve_of(STRAIN, STRAIN, STRAIN, STRAIN), {"window": 0.0}, "window must be a positive number"),
}  # fmt: skip


@pytest.mark.parametrize("why", REFUSED)
def test_refused(why):
    curve, options, words = REFUSED[why]
    with pytest.raises(InvalidInput, match=words):
        rd.w2_along(curve, **options)
