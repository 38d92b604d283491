"""Love-Weber stress against walls, the micro-macro identity, and independence of numbering."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import rendulic as rd
from naive import different_arrays


def inertial_stress(snapshot):
    """`sum_p f_p x_p / V` about the centre of the box."""
    centre = 0.5 * (snapshot.wall_position[0::2] + snapshot.wall_position[1::2])
    n = snapshot.n_grains
    return (snapshot.resultant[:n] * (snapshot.position - centre)).sum(axis=0) / snapshot.volume


def test_love_weber_equals_wall_tractions_at_rest(sheared):
    """Within the unbalanced force, which is at most 1e-6 at rest; with the inertial term to rounding."""
    snapshot = sheared.snapshot()
    love_weber = np.diag(rd.micro.love_weber_stress(snapshot))
    assert sheared.equilibrium().reached
    assert_allclose(love_weber, np.diag(snapshot.wall_stress), rtol=1e-6)
    assert_allclose(love_weber - inertial_stress(snapshot), np.diag(snapshot.wall_stress), rtol=1e-14)
    np.testing.assert_array_equal(snapshot.wall_stress, sheared.stress)


def test_love_weber_differs_in_motion(sheared, straining):
    """Far from rest Love-Weber is not the wall stress, and the inertial term is the difference, to rounding."""
    sheared.advance(30, straining((5.0, -5.0, 0.0)))
    snapshot = sheared.snapshot()
    love_weber, walls = np.diag(rd.micro.love_weber_stress(snapshot)), np.diag(snapshot.wall_stress)
    assert np.abs(love_weber - walls).max() > 1e-3 * walls.max()
    assert_allclose(love_weber - inertial_stress(snapshot), walls, rtol=1e-13)


def random_snapshot(rng, n, contacts, scale):
    """Positions, walls, contacts and forces that obey no mechanics at all."""
    low = rng.uniform(-1, 0, 3)
    walls = np.stack((low, low + rng.uniform(0.5, 2, 3)), axis=1).ravel()
    bodies = [(i, j) for i in range(n) for j in range(i + 1, n + 6)]
    pairs = np.array([bodies[k] for k in rng.permutation(len(bodies))[:contacts]], dtype=int).reshape(-1, 2)
    flip = (rng.random(len(pairs)) < 0.5) & (pairs[:, 1] < n)
    pairs[flip] = pairs[flip][:, ::-1]
    normal = rng.standard_normal((len(pairs), 3))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    return rd.Snapshot(
        position=rng.uniform(-1, 1, (n, 3)),
        radius=np.full(n, 0.1),
        wall_position=walls,
        first=pairs[:, 0],
        second=pairs[:, 1],
        normal=normal,
        force_n=scale * rng.exponential(size=len(pairs)),
        force_t=scale * rng.standard_normal((len(pairs), 3)),
        friction=0.5,
    )


@settings(deadline=None, max_examples=80)
@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(2, 30),
    before=st.integers(0, 60),
    after=st.integers(0, 60),
    scale=st.sampled_from([1e-6, 1.0, 1e6]),
)
def test_identity_holds_for_any_increment(seed, n, before, after, scale):
    """Eq. 17 with all pairs is algebra: random forces, contacts and motions leave rounding only."""
    rng = np.random.default_rng(seed)
    work = rd.second_order_work(random_snapshot(rng, n, before, 1.0), random_snapshot(rng, n, after, scale))
    assert work.identity_residual < 1e-12
    assert_allclose(
        sum(work.by_class.values()), work.contacts, rtol=0, atol=1e-14 * np.abs(work.per_contact.work).sum() + 1e-300
    )


def test_identity_would_notice_one_missing_pair():
    """Leaving one pair out of a random increment is seen: the residual test can fail."""
    rng = np.random.default_rng(5)
    before, after = random_snapshot(rng, 10, 20, 1.0), random_snapshot(rng, 10, 20, 1.0)
    work = rd.second_order_work(before, after)
    without = work.contacts - work.per_contact.work[0] / before.volume
    assert work.identity_residual < 1e-13
    assert abs(work.boundary - without - work.grains) * before.volume > 1e-6


@pytest.mark.parametrize("kind", ["strain", "stress"])
def test_identity_of_real_probes(sheared, kind):
    """Every probe of a grain specimen closes the identity to rounding, and the classes add up."""
    norms = (1e-5, 1e-4) if kind == "strain" else (1e3, 1e4)
    probes = rd.probe(
        sheared, rd.directions.rendulic(step=60), norm=norms, rate=norms[0] / 100, settle=False, kind=kind
    )
    assert float(probes.identity_residual.max()) < 1e-12
    assert probes.identity_residual.shape == (2, 6)
    total = probes.w2_by_class.sum("contact_class")
    assert_allclose(total, probes.w2_contacts, rtol=0, atol=1e-13 * float(abs(probes.w2_by_class).max()))
    exact = probes.w2_contacts + probes.w2_grains
    assert_allclose(exact, probes.w2_boundary, rtol=0, atol=1e-12 * float(abs(probes.w2_by_class).max()))
    # something slid, opened or was created, otherwise the claim would be an elastic one
    assert float(abs(probes.w2_by_class.sel(contact_class=["sliding", "opened", "created"])).max()) > 0


def relabelled(snapshot, order, rng):
    """The same packing with grains renumbered, contacts shuffled and pairs turned around."""
    n = snapshot.n_grains
    place = np.concatenate((np.argsort(order), np.arange(n, n + 6)))
    first, second = place[snapshot.first], place[snapshot.second]
    flip = (rng.random(len(first)) < 0.5) & ~snapshot.is_wall
    first, second = np.where(flip, second, first), np.where(flip, first, second)
    sign = np.where(flip, -1.0, 1.0)[:, None]
    mix = rng.permutation(len(first))
    return replace(
        snapshot,
        position=snapshot.position[order],
        radius=snapshot.radius[order],
        first=first[mix],
        second=second[mix],
        normal=(sign * snapshot.normal)[mix],
        force_n=snapshot.force_n[mix],
        force_t=(sign * snapshot.force_t)[mix],
    )


def test_numbering_does_not_matter_to_the_analysis(sheared, straining):
    """Renumbered grains and turned pairs give the same stress and work, to the rounding of sums."""
    rng = np.random.default_rng(2)
    before = sheared.snapshot()
    sheared.advance(60, straining((0.5, -0.5, 0.0)))
    after = sheared.snapshot()
    order = rng.permutation(len(sheared))
    work = rd.second_order_work(before, after)
    other = rd.second_order_work(relabelled(before, order, rng), relabelled(after, order, rng))
    size = np.abs(work.per_contact.work).sum() / before.volume
    for name in ("boundary", "lagrangian", "eulerian", "contacts", "grains", "paper"):
        assert_allclose(getattr(other, name), getattr(work, name), rtol=0, atol=1e-12 * size, err_msg=name)
    assert other.by_class == pytest.approx(work.by_class, rel=0, abs=1e-14 * size)
    assert_allclose(
        rd.micro.love_weber_stress(relabelled(after, order, rng)), rd.micro.love_weber_stress(after), rtol=0, atol=1e-8
    )


def test_numbering_does_not_matter_to_the_motion(sheared, straining):
    """A renumbered assembly moves alike: after 100 steps stresses agree to 1e-11 (rounding, amplified a little)."""
    state = sheared.save()
    sheared.sort_grains()
    assert different_arrays(state, sheared.save())  # already in order would test nothing
    stresses = []
    for shuffle in (False, True):
        twin = rd.dem.Assembly.from_state(state)
        if shuffle:
            twin.sort_grains()
        twin.advance(100, straining((0.5, -0.5, 0.0)))
        stresses.append(np.diag(twin.stress))
    assert_allclose(stresses[1], stresses[0], rtol=1e-11)


def test_a_fresh_assembly_of_permuted_grains_moves_alike(packed, straining):
    """Positions handed over in another order give the same forces and stress, to rounding."""
    order = np.random.default_rng(1).permutation(len(packed))
    grains = packed.grains
    stresses = []
    for choice in (np.arange(len(packed)), order):
        twin = rd.dem.Assembly(grains.position[choice], grains.radius[choice], packed.walls.position)
        twin.advance(100, straining((0.5, -0.5, 0.0)))
        stresses.append(np.diag(twin.stress))
    assert_allclose(stresses[1], stresses[0], rtol=1e-11)


@pytest.mark.parametrize("force", [3.0, -3.0], ids=["pressed", "pulled"])
def test_walls_that_pull_are_in_tension(force):
    """A grain that sticks to two walls, and is pulled apart by them: the sign of Love and Weber's stress."""
    grain = rd.Snapshot(
        position=np.array([[0.5, 0.5, 0.5]]), radius=np.array([0.5]),
        wall_position=np.array([0.0, 1.0, 0.0, 2.0, 0.0, 1.0]), first=np.array([0, 0]), second=np.array([1, 2]),
        normal=np.array([[-1.0, 0, 0], [1.0, 0, 0]]), force_n=np.array([force, force]), force_t=np.zeros((2, 3)),
    )  # fmt: skip
    np.testing.assert_array_equal(grain.wall_stress, np.diag([force / 2.0, 0.0, 0.0]))
    assert_allclose(rd.micro.love_weber_stress(grain), grain.wall_stress, rtol=1e-15, atol=0)
