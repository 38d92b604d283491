"""Where second-order work comes from: sums that must close, statistics with known answers."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

import rendulic as rd
from rendulic.foundation.errors import InvalidInput
from rendulic.micro import clustering, contact_work, fabric, grain_work
from rendulic.micro.clustering import moran
from rendulic.probing.anatomy import carriers, summary
from rendulic.tensors.rendulic_plane import increment_along


@pytest.fixture(scope="module")
def probed(sheared_state):
    """Snapshots of a sheared packing before and after a probe large enough to open and close contacts."""
    sample = rd.dem.Assembly.from_state(sheared_state)
    before = sample.snapshot()
    sample.probe(increment_along(130.0, 5e-4), 1000)
    return before, sample.snapshot()


@pytest.fixture(scope="module")
def found(probed):
    return rd.anatomy(*probed)


def test_grains_hold_the_work_of_the_walls_exactly(probed, found):
    work = rd.second_order_work(*probed)
    scale = np.abs(found.grain_w2.values).sum()
    assert abs(float(found.grain_w2.sum()) - work.boundary * probed[0].volume) < 1e-14 * scale
    assert np.array_equal(found.grain_w2, grain_work(*probed, contact_work(*probed)))


def test_every_way_to_part_the_work_has_the_same_sum(found):
    contacts = float(found.w2.sum()) / found.volume
    scale = float(np.abs(found.w2).sum()) / found.volume
    for parted in ("w2_by_class", "w2_by_network"):
        assert float(found[parted].sum()) == pytest.approx(contacts, abs=1e-14 * scale)
    assert float(found.w2_negative + found.w2_positive) == pytest.approx(contacts, abs=1e-14 * scale)
    assert float(found.w2_by_class.sum() + found.w2_inertial) == pytest.approx(
        float(found.w2_boundary), abs=1e-14 * scale
    )
    without_walls = float(found.w2_by_class.sum() - found.w2_by_class.sel(contact_class="wall"))
    assert float(found.w2_by_polar.sum()) == pytest.approx(without_walls, abs=1e-14 * scale)
    assert int(found.contacts_by_network.sum()) == found.sizes["pair"]
    assert int(found.negative_by_network.sum()) == int((found.w2 < 0).sum())
    assert (found.w2_by_class != 0).sum() == 5, "the probe should meet every class"


def test_pairs_are_described_by_the_state_they_touch_in(probed, found):
    before, after = probed
    created = found.class_of_pair.values == 3
    was = ~np.isin(found.class_of_pair.values, [3, 4])
    assert created.any()
    assert not found.relative_force.values[created].any()
    one = int(np.flatnonzero(was)[0])
    pair = {int(found["first"][one]), int(found["second"][one])}
    at = next(k for k in range(len(before.first)) if {int(before.first[k]), int(before.second[k])} == pair)
    assert abs(found.normal.values[one] @ before.normal[at]) == pytest.approx(1.0, abs=1e-12)
    assert float(found.relative_force[one]) == pytest.approx(before.force_n[at] / before.force_n.mean(), rel=1e-12)
    # a contact's normal points from its first to its second body, and its point lies between them
    first, second, normal = found["first"].values, found["second"].values, found.normal.values
    between = second < before.n_grains
    for snapshot, here in ((before, between & ~created), (after, between & created)):
        branch = snapshot.position[second[here]] - snapshot.position[first[here]]
        length = np.linalg.norm(branch, axis=1)
        assert np.allclose(branch, length[:, None] * normal[here], rtol=0, atol=1e-14 * length.max())
        toward = found.position.values[here] - snapshot.position[first[here]]
        assert (np.linalg.norm(toward, axis=1) < length).all()


def test_the_order_of_grains_and_the_ends_of_contacts_do_not_matter(probed, found):
    before, after = probed
    turned = [
        type(one)(
            one.position, one.radius, one.wall_position,
            np.where(one.is_wall, one.first, one.second), np.where(one.is_wall, one.second, one.first),
            np.where(one.is_wall[:, None], 1.0, -1.0) * one.normal, one.force_n,
            np.where(one.is_wall[:, None], 1.0, -1.0) * one.force_t, one.friction,
        )
        for one in (before, after)
    ]  # fmt: skip
    again = rd.anatomy(*turned)
    for name in ("w2", "normal", "position", "relative_force", "grain_w2"):
        assert np.allclose(again[name], found[name], rtol=0, atol=1e-13 * float(np.abs(found[name]).max())), name


def test_probes_keep_the_summary_of_every_direction(sheared):
    directions, norm = rd.directions.rendulic(90), 2e-4
    probes = rd.probe(sheared, directions, [1e-4, norm], rate=5e-7, settle=False, anatomy=True)
    after = sheared.clone()
    # the same way as probes go: to the largest norm at constant rate
    after.probe(increment_along(180.0, norm), 400)
    alone = summary(rd.anatomy(sheared.snapshot(), after.snapshot()))
    here = probes.sel(alpha=180.0, norm=norm)
    for name in alone.data_vars:
        assert np.array_equal(here[name].values, alone[name].values, equal_nan=True), name
    assert probes.cluster_index.dims == ("norm", "alpha", "which")
    plain = rd.probe(sheared, directions, [1e-4, norm], rate=5e-7, settle=False)
    assert plain.equals(probes[list(plain.data_vars)])


def test_an_anatomy_needs_grains():
    sand = rd.ChangHicher().at(pressure=300e3, void_ratio=0.9)
    with pytest.raises(InvalidInput, match="needs a specimen with grains"):
        rd.probe(sand, rd.directions.rendulic(90), 1e-6, anatomy=True)


def chain(n):
    """A chain of contacts: each is a neighbour of two others."""
    return np.arange(n), np.arange(n) + 1, n + 1


def network(n_grains=60, n_contacts=200, seed=3):
    """Random contacts, no pair twice, some of them with walls."""
    random = np.random.default_rng(seed)
    pairs = np.array([(i, j) for i in range(n_grains) for j in range(i + 1, n_grains + 6) if i < n_grains])
    chosen = random.permutation(len(pairs))[:n_contacts]
    return pairs[chosen, 0], pairs[chosen, 1], n_grains


def neighbours_of(first, second, n_grains):
    """The matrix of contacts that share a grain, by brute force."""
    sets = [{int(i)} | ({int(j)} if j < n_grains else set()) for i, j in zip(first, second, strict=True)]
    return np.array(
        [[float(a != b and bool(one & other)) for b, other in enumerate(sets)] for a, one in enumerate(sets)]
    )


def test_moran_index_is_that_of_the_matrix():
    first, second, n_grains = network()
    values = np.random.default_rng(0).normal(size=len(first)) ** 3
    weights, centred = neighbours_of(first, second, n_grains), values - values.mean()
    expected = len(values) / weights.sum() * (centred @ weights @ centred) / (centred @ centred)
    assert moran(first, second, n_grains, values)[0] == pytest.approx(expected, rel=1e-12)


def test_moments_of_moran_index_are_those_over_all_permutations():
    first, second, n_grains = np.array([0, 1, 1, 3, 3, 0]), np.array([1, 2, 3, 4, 9, 8]), 5
    values = np.array([1.0, -0.3, 0.2, 4.0, 0.0, 0.7])
    every = [moran(first, second, n_grains, np.array(one))[0] for one in permutations(values)]
    index, score, deviation = moran(first, second, n_grains, values)
    assert deviation == pytest.approx(np.std(every), rel=1e-12)
    assert score == pytest.approx((index - np.mean(every)) / np.std(every), rel=1e-12)


def test_scores_of_random_labels_are_standard_normal():
    first, second, n_grains = network(400, 900)
    random = np.random.default_rng(1)
    scores = [moran(first, second, n_grains, (random.random(900) < 0.3).astype(float))[1] for _ in range(600)]
    # four standard errors of mean and of standard deviation
    assert abs(np.mean(scores)) < 4 / np.sqrt(600)
    assert abs(np.std(scores) - 1.0) < 4 / np.sqrt(1200)


def test_block_is_clustered_and_alternation_dispersed():
    first, second, n_grains = chain(200)
    block = clustering(first, second, n_grains, np.arange(200) < 60)
    assert block.verdict == "clustered"
    assert block.largest == 1.0
    assert block.largest_at_random < 0.3
    alternating = clustering(first, second, n_grains, np.arange(200) % 2 == 0)
    assert alternating.verdict == "dispersed"
    # each of the 2 x 199 neighbours has the opposite value, of the same size
    assert alternating.index == pytest.approx(-1.0, rel=1e-12)
    assert alternating.largest == pytest.approx(1 / 100)
    random = clustering(first, second, n_grains, np.random.default_rng(5).random(200) < 0.5)
    assert random.verdict == "diffuse"


def test_walls_do_not_make_neighbours():
    grains, walls = np.arange(50), np.full(50, 50)
    found = clustering(grains, walls, 50, grains < 25)
    assert np.isnan(found.index)
    assert found.verdict == "undetermined"
    assert found.largest == pytest.approx(1 / 25)


def test_sets_without_contrast_have_no_index():
    first, second, n_grains = chain(20)
    for chosen in (np.zeros(20, dtype=bool), np.ones(20, dtype=bool)):
        found = clustering(first, second, n_grains, chosen)
        assert np.isnan(found.index)
        assert found.verdict == "undetermined"
    with pytest.raises(InvalidInput, match="same contacts"):
        clustering(first, second, n_grains, np.ones(3, dtype=bool))


def test_carriers_carry_half_with_the_fewest():
    work = np.random.default_rng(2).normal(size=500) ** 3
    chosen = carriers(work)
    negative = work[work < 0].sum()
    assert work[chosen].sum() <= 0.5 * negative < np.sort(work)[: chosen.sum() - 1].sum()
    assert work[chosen].max() <= work[~chosen].min()
    assert not carriers(np.array([1.0, 0.0])).any()


def test_fabric_of_known_distributions():
    # a density (1 + n.a.n) / (4 pi) with a = c (1, -1/2, -1/2) has anisotropy 3/2 c
    nodes, weights = np.polynomial.legendre.leggauss(8)
    cosine = np.concatenate([np.full(16, x) for x in nodes])
    turn = np.tile(np.arange(16) * 2 * np.pi / 16, 8)
    sine = np.sqrt(1 - cosine**2)
    normals = np.stack((cosine, sine * np.cos(turn), sine * np.sin(turn)), axis=1)
    amount = 0.4
    density = 1 + amount * (cosine**2 - 0.5 * sine**2)
    counts = np.round(1e6 * np.repeat(weights, 16) * density).astype(int)
    tensor = (normals * counts[:, None]).T @ normals / counts.sum()
    found = type(fabric(normals))(tensor)
    # counts of 1e5 are rounded to whole ones
    assert found.anisotropy == pytest.approx(1.5 * amount, abs=1e-5)
    along = fabric([[1.0, 0.0, 0.0]])
    assert np.allclose(along.density, np.diag([5.0, -2.5, -2.5]), rtol=0, atol=1e-14)
    assert along.anisotropy == pytest.approx(7.5)
    across = fabric(np.eye(3)[1:])
    assert across.anisotropy == pytest.approx(-3.75)
    assert np.isnan(fabric(np.zeros((0, 3))).anisotropy)
