"""What a search for cones finds, and what it leaves unknown: W2n is a known function of the direction, its error is known."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import rendulic as rd
from fakes import FRAME, Answering, constant, linear, of_matrix, single, working
from rendulic.probing import cone as cone_module
from rendulic.probing.cone_table import cone_table, with_spread
from rendulic.probing.edges import UNKNOWN, error_of, signs_of, wrap
from rendulic.tensors.rendulic_plane import direction_of, increment_along

NAN = float("nan")
SOME_WAY = 0.3125  # degrees: 10, halved until within 0.5


def cone_of(specimen, kind="strain", directions=None, **options):
    return rd.instability_cone(specimen, directions, norm=1.0, kind=kind, workers=1, **options)


def holds(sectors, alpha):
    """Whether a direction lies in one of the sectors."""
    return any((alpha - first) % 360.0 <= last - first for first, last in sectors)


def silent_between(specimen, first, last):
    """The same specimen without an answer between two directions, counter-clockwise; it answers no increment as before."""
    answer = specimen.answers["strain"]

    def part(increment):
        is_silent = np.any(increment) and (float(direction_of(increment)) - first) % 360.0 < (last - first) % 360.0
        return np.full(3, NAN) if is_silent else answer(increment)

    return Answering(part)


# --- narrow cones --------------------------------------------------------------------------------------


def test_cones_of_8_degrees_are_found_wherever_they_lie():
    """One hundred of them, at random between directions 10 degrees apart: all found, their edges within the uncertainty."""
    rng = np.random.default_rng(16)
    for middle in rng.uniform(0.0, 360.0, 100):
        cone = cone_of(single(middle, 4.0), tolerance=1.5)
        assert len(cone.sectors) == 1
        error = np.abs(wrap(np.array(cone.sectors[0]) - [middle - 4.0, middle + 4.0]))
        assert (error <= np.array(cone.edge_uncertainty[0]) + 1e-9).all()
        assert cone.probes.sizes["alpha"] <= 36 + 12
        assert cone.verdict == "unstable"


def test_what_is_narrower_than_the_tolerance_is_found_by_chance():
    """A cone half as wide as the gap at which the search ends lies about one of its directions in half of the cases.

    30 of 60, give or take three standard deviations of 4. Wider than the gap, it always does.
    """
    rng = np.random.default_rng(17)
    found = [
        sum(not cone_of(single(middle, 0.5 * width)).is_empty for middle in rng.uniform(0.0, 360.0, count))
        for width, count in ((0.5 * SOME_WAY, 60), (1.02 * SOME_WAY, 20))
    ]
    assert 18 <= found[0] <= 42
    assert found[1] == 20


@pytest.mark.parametrize("kind", ["strain", "stress"])
def test_both_of_two_narrow_opposite_sectors(kind):
    """A linear material has its sectors twice; those of 2 degrees lie between the directions that are probed first.

    For stress probes it is what lies between them that is narrow: stable slivers of 2 degrees.
    """
    cone = cone_of(linear(134.0, 1.0), kind, tolerance=0.1)
    assert len(cone.sectors) == len(cone.strain_sectors) == 2
    error = wrap(np.sort(np.ravel(cone.strain_sectors)) - [133.0, 135.0, 313.0, 315.0])
    assert (np.abs(error) <= 0.05 + 1e-6).all()
    assert cone.unknown_sectors == ()


def test_linear_tangents_against_their_eigenvalues():
    """Both sectors of 30 random tangents, `tan^2(half) = -lambda_1 / lambda_2` about the weakest direction, to 0.005 degrees."""
    rng = np.random.default_rng(18)
    seen = 0
    while seen < 30:
        matrix = rng.standard_normal((3, 3)) + 0.6 * np.eye(3)
        form = FRAME @ matrix @ FRAME.T
        (low, high), vectors = np.linalg.eigh(0.5 * (form + form.T))
        if low < 0.0 < high:
            seen += 1
            middle, half = np.degrees(np.arctan2(*vectors[::-1, 0])), np.degrees(np.arctan(np.sqrt(-low / high)))
            true = middle + np.array([-half, half, 180.0 - half, 180.0 + half])
            cone = cone_of(of_matrix(matrix), directions=rd.directions.rendulic(step=30), tolerance=0.01)
            assert_allclose(np.sort(np.ravel(cone.sectors) % 360.0), np.sort(true % 360.0), rtol=0, atol=0.005)
            assert cone.unknown_sectors == ()


def test_a_minimum_that_stays_positive_is_not_searched_for_ever():
    """A W2n that comes as near to zero as 0.001 costs a few probes, one far from zero none."""
    near, far = (cone_of(working(lambda a, d=d: 1.0 + d - np.cos(np.radians(a - 135.0)))) for d in (1e-3, 0.3))
    assert near.is_empty
    assert far.is_empty
    assert near.probes.sizes["alpha"] <= 36 + 4
    assert far.probes.sizes["alpha"] == 36


def test_the_smallest_value_is_refined_if_asked():
    """Its number, not the sectors: they are those that are found without."""
    made = single(133.3, 20.0)
    plain, refined = cone_of(made), cone_of(made, refine_smallest=True)
    assert abs(plain.smallest_alpha - 133.3) > 1.0
    assert abs(refined.smallest_alpha - 133.3) <= 0.5
    assert refined.smallest_w2n < plain.smallest_w2n
    assert refined.sectors == plain.sectors


# --- unknown directions --------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["strain", "stress"])
@pytest.mark.parametrize(
    "work",
    [lambda a: 0.0, lambda a: 1e-16 * np.sin(99.0 * a), lambda a: -3e-16, lambda a: NAN],
    ids=["zero", "rounding", "rounding below zero", "no number"],
)
def test_no_work_is_neither_stable_nor_unstable(work, kind):
    """W2 = 0, to rounding, or no number at all: unknown in all directions, without a sector, a bracket or further probes."""
    cone = cone_of(working(work), kind)
    assert cone.sectors == cone.strain_sectors == ()
    assert cone.unknown_sectors == cone.strain_unknown_sectors == ((0.0, 360.0),)
    assert cone.verdict == "unknown"
    assert not cone.is_empty
    assert not cone.is_significant
    assert cone.probes.sizes["alpha"] == 36
    assert "unknown in all directions" in str(cone)
    assert "no unstable direction" not in str(cone)


def test_drift_that_is_no_number_leaves_all_unknown():
    """What the null probe shows is part of every error."""
    cone = cone_of(constant(0.5, drift=[NAN] * 3))
    assert (cone.verdict, cone.unknown_opening) == ("unknown", 360.0)


@pytest.mark.parametrize(("first", "last"), [(203.0, 221.0), (357.0, 372.0), (344.0, 359.0)])
def test_a_stable_state_with_a_hole_is_not_stable(first, last):
    """Stable wherever it answers; across 0 degrees, too. The hole is unknown as far as the next known directions."""
    cone = cone_of(silent_between(constant(0.5), first, last))
    assert cone.sectors == ()
    ((low, high),) = cone.unknown_sectors
    assert low <= first < last <= high
    assert high - low < last - first + 20.0
    assert cone.verdict == "unknown"
    assert not cone.is_empty
    assert not cone.is_significant
    assert str(cone).startswith(
        f"no direction is surely unstable; unknown from {low:g} to {high:g} degrees; smallest W2n"
    )


def test_a_hole_at_an_edge():
    """The edge can be anywhere in it: the uncertainty of the edge reaches over the hole, which is named."""
    cone = cone_of(silent_between(single(130.0, 30.0), 92.0, 112.0))
    ((first, last),) = cone.sectors
    ((low, high),) = cone.unknown_sectors
    assert low <= 92.0 < 112.0 <= high
    assert high - low < 24.0
    assert_allclose([first, cone.edge_uncertainty[0][0]], [0.5 * (low + high), 0.5 * (high - low)], rtol=1e-12)
    assert_allclose(last, 160.0, rtol=0, atol=0.3)
    assert cone.edge_uncertainty[0][1] < 0.5
    assert cone.verdict == "unstable"
    assert "; unknown from " in str(cone)


def test_a_hole_within_a_cone_is_not_unstable():
    """The cone ends on both sides of it, at edges of which nothing is known; its outer edges are as sharp as ever."""
    cone = cone_of(silent_between(single(130.0, 30.0), 121.0, 139.0))
    (first, inner), (other, last) = cone.sectors
    assert_allclose([first, last], [100.0, 160.0], rtol=0, atol=0.3)
    # half-way between the last direction with an answer and the first without
    assert_allclose([inner, other], [125.0, 135.0], rtol=0, atol=1e-9)
    assert cone.edge_uncertainty[0][1] == cone.edge_uncertainty[1][0] == UNKNOWN
    assert max(cone.edge_uncertainty[0][0], cone.edge_uncertainty[1][1]) < 0.5
    assert cone.unknown_sectors == ((120.0, 140.0),)
    assert "+- ?" in str(cone)


def test_one_direction_known_among_unknown():
    """It is unstable, and nothing more is known: no cone all around."""
    cone = cone_of(silent_between(constant(-0.3), 125.0, 475.0))
    ((first, last),) = cone.sectors
    assert last - first <= 10.0
    assert holds(cone.sectors, 120.0)
    assert cone.edge_uncertainty == ((UNKNOWN, UNKNOWN),)
    assert cone.unknown_opening == 360.0
    assert cone.verdict == "unstable"


def test_each_direction_is_one_of_three():
    """Holes anywhere in a cone with two sectors: what is known is in its sector, what has no answer in an unknown one."""
    rng = np.random.default_rng(19)
    whole = linear(130.0, 25.0)
    for first, width in zip(rng.uniform(0.0, 360.0, 20), rng.uniform(11.0, 150.0, 20), strict=True):
        cone = cone_of(silent_between(whole, first, first + width))
        inside = (cone.probes.alpha.values - first) % 360.0 < width
        assert_array_equal(cone.probes.w2_sign == 0, inside | (np.abs(cone.probes.w2_normalised.values) < 1e-9))
        for alpha, sign in zip(cone.probes.alpha.values, cone.probes.w2_sign.values, strict=True):
            if sign:
                assert holds(cone.sectors, alpha) == (sign < 0)
            elif (alpha - first) % 360.0 < width:
                assert holds(cone.unknown_sectors, alpha)
        assert all(holds(cone.unknown_sectors, first + share * width) for share in (0.001, 0.5, 0.999))


def test_what_was_not_reached_is_unknown():
    """A stress that the state cannot carry, as `is_reached` tells it, says nothing of its direction."""
    probes = rd.probe(constant(0.5), rd.directions.rendulic(step=10), norm=1.0, kind="stress")
    assert rd.cone_of(probes).is_empty
    probes["is_reached"] = probes.is_reached & (probes.alpha != 130.0)
    assert rd.cone_of(probes).unknown_sectors == ((120.0, 140.0),)


# --- errors --------------------------------------------------------------------------------------------


def test_a_sector_that_the_drift_can_make_is_unknown():
    """Where W2 is positive but for the drift, nothing is surely negative, and what is not sure is unknown."""
    drift = -0.05 * increment_along(130.0)
    cone = cone_of(constant(0.02, drift=drift))
    assert (cone.sectors, cone.verdict) == ((), "unknown")
    ((low, high),) = cone.unknown_sectors
    assert low < 75.0 < 185.0 < high
    assert "not larger than its error" in str(cone)


def with_error(monkeypatch, error):
    """Probes as they come with an error of W2n that is known."""
    plain = cone_module.probes_of

    def probes_of(*arguments, **options):
        probes = plain(*arguments, **options)
        probes["w2_normalised_error"] = 0.0 * probes.w2_normalised + error
        probes["is_significant"] = abs(probes.w2_normalised) > error
        return probes

    monkeypatch.setattr(cone_module, "probes_of", probes_of)


def noisy(middle, half, size, rng):
    """W2n of a cone with normal noise, in each direction another one and always the same."""
    noise = {}

    def answer(increment):
        alpha = float(direction_of(increment)) % 360.0 if np.any(increment) else 0.0
        w2n = np.cos(np.radians(half)) - np.cos(np.radians(alpha - middle))
        w2n = np.clip(w2n + size * noise.setdefault(round(alpha, 9), rng.standard_normal()), -0.99, 0.99)
        across = np.sqrt(1.0 - w2n**2)
        return np.linalg.norm(increment) * (w2n * increment_along(alpha) + across * increment_along(alpha + 90.0))

    return Answering(answer)


@pytest.mark.parametrize("size", [0.003, 0.015])
def test_error_bars_of_edges_cover(monkeypatch, size):
    """Of W2n with normal noise, whose error is given as two standard deviations, 95 of 100 edges are within their bars.

    The bars are no wider than four times that error over the slope, and a bracket.
    """
    rng = np.random.default_rng(20)
    with_error(monkeypatch, 2.0 * size)
    inside, wide, split = [], [], 0
    for middle, half in zip(rng.uniform(0.0, 360.0, 60), rng.uniform(25.0, 60.0, 60), strict=True):
        cone = cone_of(noisy(middle, half, size, rng))
        edges, uncertainty = np.ravel(cone.sectors), np.ravel(cone.edge_uncertainty)
        reach = np.degrees(2.0 * size / np.sin(np.radians(half)))
        for true in (middle - half, middle + half):
            nearest = np.abs(wrap(edges - true)).argmin()
            inside.append(abs(wrap(edges[nearest] - true)) <= uncertainty[nearest])
            wide.append(uncertainty[nearest] > 4.0 * reach + 0.5)
        split += len(cone.sectors) > 1
    assert np.mean(inside) >= 0.95
    assert np.mean(wide) <= 0.05
    assert split <= 3


def test_an_edge_has_its_bracket_and_its_error(monkeypatch):
    """On a slope of known size: half the bracket and the error over the slope where all signs are sure.

    Where the error makes directions unknown, half their distance: the error over the slope, at most a third more, as the ends
    are sought no closer than an eighth of it.
    """
    made = working(
        lambda a: 0.01 * (1.0 - 2.0 * (40.0 < a % 360.0 < 220.0)) * min(abs(wrap(a - 40.0)), abs(wrap(a - 220.0)))
    )
    slope = 0.01
    with_error(monkeypatch, 1e-4)
    cone = cone_of(made, directions=rd.directions.axisymmetric(3.0 + 10.0 * np.arange(36)))
    ((low, high),) = cone.edge_uncertainty
    assert_allclose([low, high], 0.5 * cone.tolerance + 1e-4 / slope, rtol=0.01)
    assert cone.unknown_sectors == ()
    with_error(monkeypatch, 0.05)
    cone = cone_of(made)
    # W2n = w / sqrt(1 + w^2) is 0.05 where w is 0.05006
    reach = 0.05006 / slope
    assert all(reach <= one <= 4.0 / 3.0 * reach for one in cone.edge_uncertainty[0])
    assert len(cone.unknown_sectors) == 2
    assert_allclose(cone.smallest_error, 0.05)


def test_the_error_is_taken_from_the_probes():
    """Their own error if they have one, else the share of the drift; a sign needs both its error and its significance."""
    probes = rd.probe(constant(0.3, drift=[0.1, 0.0, 0.0]), rd.directions.rendulic(step=60), norm=1.0)
    size = np.linalg.norm(probes.d_sigma, axis=1) * np.linalg.norm(probes.d_eps, axis=1)
    assert_allclose(error_of(probes.drop_vars("w2_normalised_error")), np.abs(probes.w2_drift) / size, rtol=1e-12)
    probes["w2_normalised_error"] = ("alpha", [0.1, 0.2, 0.5, NAN, 0.0, 0.1])
    probes["is_significant"] = ("alpha", [True, True, True, True, True, False])
    assert_array_equal(error_of(probes), [0.1, 0.2, 0.5, NAN, 0.0, 0.1])
    expected = np.where(np.abs(probes.w2_normalised) > [0.1, 0.2, 0.5, NAN, 0.0, NAN], np.sign(probes.w2_normalised), 0)
    assert_array_equal(signs_of(probes), expected)


# --- counted -------------------------------------------------------------------------------------------


def test_tables_count_what_is_unknown():
    """Four states: unstable, stable, unknown in part, unknown all around; and one that is not there."""
    states = [single(130.0, 20.0), constant(0.3), silent_between(constant(0.3), 100.0, 115.0), constant(NAN)]
    cones = np.array([*map(cone_of, states), None], dtype=object)
    table = with_spread(cone_table(cones, {"specimen": list("abcde")}))
    assert table.is_unstable.values.tolist() == [True, False, False, False, False]
    assert table.is_stable.values.tolist() == [False, True, False, False, False]
    assert table.is_present.values.tolist() == [True, True, True, True, False]
    assert table.n_unknown_sectors.values.tolist() == [0, 0, 1, 1, 0]
    assert_allclose(table.unknown_opening[:4], [0.0, 0.0, *(cone.unknown_opening for cone in cones[2:4])])
    assert_allclose(table.unknown_from[2:4, 0], [cone.unknown_sectors[0][0] for cone in cones[2:4]])
    assert int(table.n_present) == 4
    assert [float(table[f"{name}_share"]) for name in ("unstable", "stable", "unknown")] == [0.25, 0.25, 0.5]
    assert not table.is_significant.values[2:].any()


def test_summaries_leave_unknown_edges_out():
    """A cone that ends where nothing is known does not say where it ends."""
    ended = silent_between(constant(-0.3), 150.0, 470.0)  # known from 110 to 150 degrees only
    table = rd.cone_ensemble([ended, single(130.0, 30.0)], norm=1.0, workers=1)
    assert table.edge_from_uncertainty[0, 0] == UNKNOWN
    assert_allclose(table.edge_from_summary, 100.0, rtol=0, atol=0.3)
    assert_allclose(table.unstable_share, 1.0)
