"""Mean responses of specimens with a known law: values in closed form, intervals that cover, and what is told."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose, assert_array_equal
from scipy.optimize import brentq

import rendulic as rd
from rendulic.foundation.errors import InvalidInput
from rendulic.probing.bootstrap import bounds_of_mean
from rendulic.probing.ensemble_response import FEW
from rendulic.probing.mean_cone import negative_sectors
from rendulic.probing.second_order_work import normalised
from synthetic import ALPHA, UNIT, Gaussian, RareCollapses, around, probes_of, specimens

QUICK = {"n_resamples": 1000}


# -- values --------------------------------------------------------------------------------------


def test_the_mean_response_is_the_mean_of_stresses_at_the_same_strain():
    """W2 of it is the mean W2; W2n of it is not the mean W2n."""
    own = specimens(Gaussian(), 9, 0)
    found = rd.ensemble_response(own, **QUICK)
    sigma = np.mean([one.d_sigma.values for one in own], axis=0)
    assert_allclose(found.d_sigma, sigma, rtol=1e-13)
    assert_allclose(found.w2_macro, np.mean([one.w2_macro.values for one in own], axis=0), rtol=1e-9)
    assert_allclose(found.w2_normalised, normalised(sigma, own[0].d_eps.values), rtol=1e-12)
    assert abs(found.w2_normalised - np.mean([one.w2_normalised.values for one in own], axis=0)).max() > 1e-3
    assert_allclose(found.w2_normalised_of[3], own[3].w2_normalised)
    middle = np.median([one.w2_normalised.values for one in own], axis=0)
    assert_allclose(found.w2_normalised_quantiles.sel(quantile=0.5), middle)


def test_shares_have_the_intervals_of_wilson():
    """(k + z^2/2)/(n + z^2) +- z/(n + z^2) sqrt(k (n - k)/n + z^2/4), Wilson 1927."""
    own = specimens(RareCollapses(), 16, 3)
    found = rd.ensemble_response(own, **QUICK)
    k, n, z = np.sum([one.w2_macro.values < 0.0 for one in own], axis=0), 16, 1.959963984540054
    assert 0 < k.max() < n
    half = z / (n + z**2) * np.sqrt(k * (n - k) / n + z**2 / 4.0)
    assert_allclose(found.negative_share, k / n)
    assert_allclose(found.negative_share_lower, (k + z**2 / 2.0) / (n + z**2) - half, atol=1e-12)
    assert_allclose(found.negative_share_upper, (k + z**2 / 2.0) / (n + z**2) + half, atol=1e-12)
    assert float(found.negative_somewhere_share) == np.mean([(one.w2_macro.values < 0.0).any() for one in own])


def test_specimens_that_are_alike_leave_no_interval():
    """No spread is none; and that they are the same is told."""
    found = rd.ensemble_response([probes_of(Gaussian().mean_response(ALPHA))] * 8, **QUICK)
    assert_allclose(found.w2_macro_lower, found.w2_macro, rtol=1e-14)
    assert_allclose(found.w2_macro_upper, found.w2_macro, rtol=1e-14)
    assert "0, 1, 2, 3 and 4 more give the same response in all directions" in found.told_of_all


def test_the_error_within_specimens_widens_the_interval_by_its_mean():
    """Errors of specimens may have one cause: their mean counts, not their mean over the root of n."""
    own = specimens(Gaussian(), 12, 1)
    error = 0.02 * UNIT * 1e-8
    plain = rd.ensemble_response(own, **QUICK)
    wider = rd.ensemble_response(
        [one.assign(w2_error=("alpha", np.full(len(ALPHA), k * error / 5.5))) for k, one in enumerate(own)], **QUICK
    )
    inside = (plain.w2_macro_lower > error) | (plain.w2_macro_upper < -error)  # of one sign, whatever the error
    assert inside.sum() > 20
    assert_allclose((wider.w2_macro_upper - plain.w2_macro_upper).values[inside], error, rtol=1e-9)
    assert_allclose((plain.w2_macro_lower - wider.w2_macro_lower).values[inside], error, rtol=1e-9)
    length = np.linalg.norm(plain.d_sigma, axis=1) * np.linalg.norm(plain.d_eps, axis=1)
    low, high = wider.w2_normalised_lower > -0.99, wider.w2_normalised_upper < 0.99
    grown = (wider.w2_normalised_upper - plain.w2_normalised_upper).values
    assert_allclose(grown[inside & low & high], (error / length)[inside & low & high], rtol=1e-9)
    assert "only the drift" in plain.told_of_all
    assert "only the drift" not in wider.told_of_all


def test_errors_without_a_common_cause_count_less():
    """Unbalanced forces as their root sum of squares over n; what a little more strain would change not at all."""
    own = specimens(Gaussian(0.5), 16, 1)
    parts = {"error_drift": 1e-3, "error_imbalance": 4e-3, "error_size": 0.5}
    each = {name: ("alpha", np.full(len(ALPHA), value)) for name, value in parts.items()}
    total = ("alpha", np.full(len(ALPHA), sum(parts.values())))
    found = rd.ensemble_response([one.assign(w2_error=total, **each) for one in own], **QUICK)
    assert_allclose(found.w2_error, 1e-3 + 4e-3 / np.sqrt(16))


# -- intervals cover -----------------------------------------------------------------------------


DIRECTIONS = np.array([0.0, 60.0, 90.0, 120.0, 130.0, 160.0])
TRIALS = 200


def coverage(law, count, alpha=DIRECTIONS):
    """In which trials each direction's intervals of W2 and W2n hold the closed form; and those that lie below it."""
    unit, true = around(alpha), law.mean_response(alpha)
    values = (true * unit).sum(axis=1), normalised(true, unit)
    covered, below = np.zeros((2, TRIALS, len(alpha)), dtype=bool), np.zeros((TRIALS, len(alpha)), dtype=bool)
    for trial in range(TRIALS):
        generator = np.random.default_rng([7, count, trial])
        answers = np.stack([law.responses(generator, alpha) for _ in range(count)])
        found = bounds_of_mean(unit, answers, np.zeros(len(alpha)), 0.95, 1000, trial)
        for k, (low, high) in enumerate((found.work, found.work_normalised)):
            covered[k, trial] = (low <= values[k]) & (values[k] <= high)
        below[trial] = found.work[1] < values[0]
    return covered, below


@pytest.mark.parametrize("count", [8, 16, 64])
def test_intervals_of_gaussian_specimens_cover(count):
    """In 95 of 100 trials, less three standard errors of what is measured: at every direction, and at all together.

    W2n too where the response across the increment is larger than its noise: at 60 and 160 degrees.
    """
    covered, below = coverage(Gaussian(-0.1), count)
    assert covered[0].mean(axis=0).min() > 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / TRIALS)
    # nine numbers of a tangent vary, so that six directions are nearly as many independent looks
    assert covered[0].mean() > 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / (3 * TRIALS))
    assert covered[1, :, [0, 1, 2, 5]].mean() > 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / (3 * TRIALS))
    assert below.mean() < 0.025 + 3.0 * np.sqrt(0.025 / (3 * TRIALS))


@pytest.mark.parametrize("count", [8, 16, 64])
def test_intervals_of_collapses_cover(count):
    """Three of ten specimens collapse, by sizes of their own: in the sector of collapses."""
    covered, below = coverage(RareCollapses(), count, np.array([110.0, 120.0, 130.0]))
    assert covered.mean(axis=1).min() > 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / TRIALS)
    assert below.mean() < 0.025 + 3.0 * np.sqrt(0.025 / TRIALS)


def test_what_no_specimen_has_shown_is_in_no_interval():
    """One of 16 collapses: half of the ensembles of eight have none, and miss the mean; the others cover it."""
    law = RareCollapses()
    law.share, law.typical = 1.0 / 16.0, 8.0
    covered, below = coverage(law, 8, np.array([120.0]))
    collapsed = np.zeros(TRIALS, dtype=bool)
    for trial in range(TRIALS):
        generator = np.random.default_rng([7, 8, trial])
        answers = [law.responses(generator, np.array([120.0])) for _ in range(8)]
        collapsed[trial] = min((answer * around([120.0])).sum() for answer in answers) < 0.0
    assert 0.3 < collapsed.mean() < 0.5
    assert covered[0, collapsed, 0].mean() > 0.9
    assert covered[0, ~collapsed, 0].mean() < 0.1
    assert below.mean() < 0.05  # what is missed is instability, it is not claimed
    assert law.share < 1.0 - 0.05 ** (1.0 / 8.0)  # as `unseen_share` says


@pytest.mark.long
def test_intervals_of_edges_cover():
    """Of a Gaussian tangent with a cone: root of the closed form, one of the two opposite sectors."""
    law = Gaussian(-0.1)

    def true(alpha):
        return float(normalised(law.mean_response([alpha]), around([alpha]))[0])

    edges = brentq(true, 90.0, 125.0), brentq(true, 125.0, 160.0)
    hits, missing = np.zeros(2), 0
    for trial in range(100):
        found = rd.ensemble_response(specimens(law, 16, [9, trial]), seed=trial, **QUICK)
        inside = (found.sector_from < edges[1]) & (found.sector_to > edges[0])
        missing += not inside.any()
        if inside.any():
            one = found.isel(sector=int(inside.values.argmax()))
            for k, name in enumerate(("sector_from", "sector_to")):
                low, high = float(one[f"{name}_lower"]), float(one[f"{name}_upper"])
                hits[k] += not (edges[k] < low or edges[k] > high)  # NaN: no bound on that side
    assert missing == 0
    assert hits.min() >= 90  # 95 less about two standard errors


# -- the cone ------------------------------------------------------------------------------------


def test_sectors_are_linear_between_directions():
    """Edges in closed form, across 0 degrees, all around, none, and next to what is not known."""
    alpha = np.array([0.0, 90.0, 180.0, 270.0])
    assert negative_sectors(alpha, np.array([-1.0, 3.0, 1.0, 1.0])) == ((315.0, 382.5),)
    assert negative_sectors(alpha, -np.ones(4)) == ((0.0, 360.0),)
    assert negative_sectors(alpha, np.ones(4)) == ()
    assert negative_sectors(alpha, np.array([-1.0, np.nan, 1.0, 1.0])) == ((315.0, 360.0),)
    assert negative_sectors(alpha, np.array([1.0, -1.0, 1.0, -1.0])) == ((45.0, 135.0), (225.0, 315.0))


def test_what_is_sure_lies_within_the_cone_and_that_within_what_may_be():
    """Edges are between the last direction surely positive and the first surely negative."""
    found = rd.ensemble_response(specimens(Gaussian(-0.1), 32, 2), **QUICK)
    assert found.sure_opening < found.opening < found.possible_opening
    assert found.sizes["sector"] == 2
    assert bool(
        (found.sector_from_lower < found.sector_from).all() & (found.sector_from < found.sector_from_upper).all()
    )
    assert bool((found.sector_to_lower < found.sector_to).all() & (found.sector_to < found.sector_to_upper).all())
    assert_allclose(found.sector_from_upper, found.sure_from)
    assert_allclose(found.sector_share, 1.0)


def test_an_edge_that_some_resamples_do_not_have_is_said():
    """A mean barely negative: no direction is sure, the inner ends are none, and the share is below one."""
    found = rd.ensemble_response(specimens(Gaussian(-0.01), 8, 1), **QUICK)
    assert found.sizes["sector"] >= 1
    assert np.isnan(found.sector_from_upper[0])
    assert np.isnan(found.sure_from).all()
    assert 0.3 < float(found.sector_share[0]) < 1.0


# -- heavy tails, few specimens ------------------------------------------------------------------


def one_collapse(n):
    """Specimens of which one collapses so far that the mean is negative, too."""
    law = RareCollapses()
    law.share = 0.0
    stable = specimens(law, n - 1, 0)
    law.share, law.typical, law.spread = 1.0, 2.0 * n, 0.0
    return [*stable, *specimens(law, 1, 1)]


def test_one_specimen_that_makes_the_mean_is_said_and_nothing_is_sure():
    """Its share, the sign without it, the skewness; and that no bound can be given on the side of the tail."""
    found = rd.ensemble_response(one_collapse(16), **QUICK)
    at = found.sel(alpha=120.0)
    assert at.w2_normalised < 0.0
    assert at.largest_share > 0.7
    assert bool(at.is_ruled_by_one)
    assert at.without_one_upper > 0.5
    assert at.skewness < -3.0
    assert not bool(at.is_significant)
    assert "directions the mean changes its sign without one of the specimens" in found.told_of_all
    calm = found.sel(alpha=300.0)
    assert not bool(calm.is_ruled_by_one)
    assert calm.largest_share < 0.1


def test_with_few_specimens_no_sign_is_sure():
    """Seven that agree are too few, eight are enough; one is chance."""
    own = specimens(Gaussian(0.5), FEW, 0)
    assert bool(rd.ensemble_response(own, **QUICK).is_significant.all())
    few = rd.ensemble_response(own[1:], **QUICK)
    assert not bool(few.is_significant.any())
    assert f"With {FEW - 1} specimens (fewer than {FEW}) no sign is called sure" in few.told_of_all
    alone = rd.ensemble_response(own[:1], **QUICK)
    assert bool(alone.w2_macro_lower.isnull().all())
    assert alone.told_of_all.startswith("One specimen shows chance")
    assert alone.sure_opening == 0.0
    assert alone.possible_opening == 360.0


def test_means_of_fast_probes_are_not_sure():
    """A quarter of them is let pass, more are not, and it is told where; the cone of the mean stays, the sure one goes."""
    own = specimens(Gaussian(-0.3), 12, 1)
    for count, is_sure in ((3, True), (4, False)):
        fast = [one.assign(is_too_fast=("alpha", np.full(len(ALPHA), k < count))) for k, one in enumerate(own)]
        found = rd.ensemble_response(fast, **QUICK)
        assert bool(found.is_significant.any()) == is_sure
        assert bool(found.sure_opening > 0.0) == is_sure
        assert ("no sign is called sure: probe more slowly" in found.told_of_all) != is_sure
        assert found.opening > 0.0


def test_what_nobody_showed_may_still_be():
    """(1 - p)^n = 5 %: the largest share of collapses that n specimens can all have missed."""
    found = rd.ensemble_response(specimens(Gaussian(), 16, 0), **QUICK)
    assert_allclose((1.0 - found.attrs["unseen_share"]) ** 16, 0.05)
    assert "may still be done by up to 17 % of all" in found.told_of_all


# -- what is told --------------------------------------------------------------------------------


def test_specimens_that_are_missing_or_different_are_told_and_counted():
    """None, a reason, NaN, other directions, unsettled, too fast: each by its name or number."""
    own = dict(zip("abcdefghijkl", specimens(Gaussian(), 12, 0), strict=True))
    own["a"] = None
    own["b"] = "failed: eta = 0.6 was not reached"
    own["c"] = own["c"].isel(alpha=slice(0, 30))
    own["d"] = own["d"].assign(w2_macro=own["d"].w2_macro * np.nan, d_sigma=own["d"].d_sigma * np.nan)
    own["e"] = own["e"].assign(is_settled=("alpha", ALPHA < 350.0), is_too_fast=("alpha", ALPHA < 15.0))
    found = rd.ensemble_response(own, **QUICK)
    told = dict(zip(found.specimen.values.tolist(), found.told.values.tolist(), strict=True))
    assert told["a"] == "missing"
    assert told["b"] == "failed: eta = 0.6 was not reached"
    assert "it lacks 6 of 36 probes" in told["c"]
    assert told["f"] == ""
    assert_array_equal(found.n_specimens, np.where(ALPHA < 300.0, 9, 8))
    assert int(found.n_unsettled.sum()) == 1
    assert int(found.n_too_fast.sum()) == 2
    for words in (
        "a: missing.", "b: failed: eta = 0.6 was not reached.", "1 of 318 probes did not come to rest",
        "2 of 318 probes were too fast", "Some directions have 8 of 9 specimens.", "d: none of its probes has a number.",
    ):  # fmt: skip
        assert words in found.told_of_all
    others = [own[name].d_sigma.values for name in "efghijkl"]
    assert_allclose(found.d_sigma.sel(alpha=350.0), np.mean(others, axis=0)[-1])


def test_directions_in_another_order_are_the_same():
    """Sorted, and a sweep's norms with them."""
    own = specimens(Gaussian(), 8, 0)
    mixed = [one.isel(alpha=slice(None, None, -1)) if k % 2 else one for k, one in enumerate(own)]
    assert_array_equal(rd.ensemble_response(mixed, **QUICK).w2_macro, rd.ensemble_response(own, **QUICK).w2_macro)


def test_every_norm_has_its_own_cone():
    """A sweep is taken norm by norm, and each is what it is alone."""
    small, large = specimens(Gaussian(0.5), 10, 0), specimens(Gaussian(-0.3), 10, 1)
    sweep = [
        xr.concat(
            [one.drop_vars("norm"), other.drop_vars("norm")], xr.DataArray([1e-4, 2e-4], dims="norm", name="norm")
        )
        for one, other in zip(small, large, strict=True)
    ]
    found = rd.ensemble_response(sweep, **QUICK)
    assert found.w2_macro.dims == ("norm", "alpha")
    assert_array_equal(found.sure_opening > 0.0, [False, True])
    alone = rd.ensemble_response(large, **QUICK)
    assert_allclose(found.w2_macro_upper.isel(norm=1), alone.w2_macro_upper)
    assert_allclose(found.opening.isel(norm=1), alone.opening)


def test_both_intervals_agree_about_the_sign():
    """Where one has zero inside, so has the other."""
    for seed in range(20):
        found = rd.ensemble_response(specimens(RareCollapses(), 10, seed), **QUICK)
        assert_array_equal(found.w2_macro_lower > 0.0, found.w2_normalised_lower > 0.0)
        assert_array_equal(found.w2_macro_upper < 0.0, found.w2_normalised_upper < 0.0)
        assert bool((found.w2_normalised_lower <= found.w2_normalised + 1e-12).all())
        assert bool((found.w2_normalised <= found.w2_normalised_upper + 1e-12).all())


def test_probes_of_a_model_and_of_stress_make_an_ensemble_too():
    """Sands that differ a little: stress probes average the strain."""
    sands = [rd.ChangHicher().at(pressure=p, void_ratio=0.9) for p in np.linspace(290e3, 310e3, 8)]
    probes = [rd.probe(sand, rd.directions.rendulic(30), 10.0, kind="stress") for sand in sands]
    found = rd.ensemble_response(probes, **QUICK)
    assert found.attrs["kind"] == "stress"
    assert_allclose(found.d_eps, np.mean([one.d_eps.values for one in probes], axis=0))
    assert bool((found.is_significant & (found.w2_macro > 0.0)).all())
    sphere = [rd.probe(sand, rd.directions.sphere(20), 1e-6) for sand in sands]
    around_it = rd.ensemble_response(sphere, **QUICK)
    assert around_it.w2_macro.dims == ("direction",)
    assert "sure_opening" not in around_it


def test_what_is_no_ensemble_is_refused():
    """Nothing, nothing but missing ones, both kinds, no probes, a confidence that is none."""
    (one,) = specimens(Gaussian(), 1, 0)
    with pytest.raises(InvalidInput, match="got 0 specimens without any"):
        rd.ensemble_response([])
    with pytest.raises(InvalidInput, match="got 2 specimens without any: missing; did not converge"):
        rd.ensemble_response([None, "did not converge"])
    with pytest.raises(InvalidInput, match="got both"):
        rd.ensemble_response([one, one.assign_attrs(kind="stress")])
    with pytest.raises(InvalidInput, match="that of '1' has no d_sigma, w2_drift"):
        rd.ensemble_response([one, one.drop_vars(["d_sigma", "w2_drift"])])
    with pytest.raises(InvalidInput, match="confidence"):
        rd.ensemble_response([one], confidence=95)
