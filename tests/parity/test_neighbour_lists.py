"""Neighbour lists equal looking at every pair, and never miss a contact."""

from __future__ import annotations

import numpy as np
import pytest

import rendulic as rd
from naive import near_pairs, near_walls
from rendulic.dem.kernels.arrays import Contacts, Walls
from rendulic.dem.state.grains import make_grains
from rendulic.dem.state.neighbours import find_contacts
from rendulic.foundation.errors import UnstableTimeStep

BOX = np.array([-0.2, 0.3, 1.0, 1.4, -3.0, -2.1])


def scattered(seed, ratio, n):
    """Grains anywhere between the walls, also over and on them; sizes log-uniform over `ratio`."""
    rng = np.random.default_rng(seed)
    low, high = BOX[0::2], BOX[1::2]
    position = low + (high - low) * rng.uniform(0, 1, (n, 3))
    position[0], position[1] = low, high
    position[2, 0], position[3, 2] = low[0], high[2]
    largest = 0.06 * ratio**0.3
    radius = largest * ratio ** -rng.uniform(0, 1, n)
    radius[-2:] = largest, largest / ratio
    return make_grains(position, radius, 2600.0), Walls(BOX.copy(), np.zeros(6), np.zeros(6))


@pytest.mark.parametrize("ratio", [1.0, 9.0, 100.0])
@pytest.mark.parametrize("margin", [0.0, 0.002, 0.05])
def test_lists_equal_brute_force(ratio, margin):
    """Same pairs and same grain-wall pairs as the O(N^2) definition, sorted, for 25 seeds each."""
    total = 0
    for seed in range(25):
        grains, walls = scattered(seed, ratio, 40 + 13 * seed)
        contacts, wall_contacts = find_contacts(grains, walls, None, margin)
        pairs = list(zip(contacts.first.tolist(), contacts.second.tolist(), strict=True))
        total += len(pairs)
        assert pairs == sorted(near_pairs(grains.position, grains.radius, margin)), f"seed {seed}"
        found = list(zip(wall_contacts.grain.tolist(), wall_contacts.wall.tolist(), strict=True))
        assert len(found) == len(set(found))
        assert set(found) == near_walls(grains.position, grains.radius, BOX, margin), f"seed {seed}"
    assert total > 1000


def test_one_giant_among_dust():
    """One grain a hundred times larger than 2 000 others sees all it touches."""
    rng = np.random.default_rng(0)
    position = np.concatenate(([[0.5, 0.5, 0.5]], rng.uniform(0, 1, (2000, 3))))
    grains = make_grains(position, np.array([0.4] + [0.004] * 2000), 2600.0)
    contacts, _ = find_contacts(grains, Walls(np.array([0.0, 1.0] * 3), np.zeros(6), np.zeros(6)), None, 1e-3)
    expected = near_pairs(position, grains.radius, 1e-3)
    assert set(zip(contacts.first.tolist(), contacts.second.tolist(), strict=True)) == expected
    assert len(contacts.first) > 400


def test_history_follows_its_pair(packed):
    """Forces of closed contacts find their pair in a new list of any margin, to the bit."""
    old = packed.contacts
    closed = old.force_n > 0
    for margin in (1e-4, 5e-3):
        new, _ = find_contacts(packed.grains, packed.walls, old, margin)
        assert len(new.first) != len(old.first)
        kept = new.force_n > 0
        np.testing.assert_array_equal(new.first[kept], old.first[closed])
        np.testing.assert_array_equal(new.second[kept], old.second[closed])
        np.testing.assert_array_equal(new.force[kept], old.force[closed])
        assert not new.force[~kept].any()


def test_a_lost_contact_is_an_error(packed):
    """A closed contact whose grains are suddenly far apart is reported, not dropped."""
    far = np.array([[0, len(packed) - 1]], dtype=np.int32)
    assert np.linalg.norm(packed.grains.position[0] - packed.grains.position[-1]) > 0.05
    torn = Contacts(far[:, 0].copy(), far[:, 1].copy(), np.array([[5.0, 0.0, 0.0, 0.0]]))
    with pytest.raises(UnstableTimeStep, match="1 closed contacts were torn apart"):
        find_contacts(packed.grains, packed.walls, torn, 1e-4)


def bullet(packed_state):
    """The packing with one grain flying through it at 8 m/s, another spinning off at 3 m/s."""
    sample = rd.dem.Assembly.from_state(packed_state)
    middle = np.argsort(np.linalg.norm(sample.grains.position - sample.grains.position.mean(axis=0), axis=1))
    sample.grains.velocity[middle[0]] = 8.0, 3.0, -2.0
    sample.grains.velocity[middle[50]] = 0.0, -3.0, 1.0
    return sample


def with_new_lists(sample):
    """Find all pairs that may touch anew, with the present margin."""
    sample.contacts, sample.wall_contacts = find_contacts(sample.grains, sample.walls, sample.contacts, sample.margin)


def exhaustive(sample):
    """Let the list hold every pair, so that it can miss none."""
    sample.margin = 10.0
    with_new_lists(sample)
    assert len(sample.contacts.first) == len(sample) * (len(sample) - 1) // 2
    assert len(sample.wall_contacts.grain) == 6 * len(sample)


def test_a_bullet_misses_nothing(packed_state, straining):
    """A grain expelled at 8 m/s, walls closing: to the bit the motion with a list of all pairs.

    Bitwise, since open candidates add nothing to any sum, and the order of closed ones is the same.
    """
    drive = straining((1.0, -1.0, 0.5))
    sample, reference = bullet(packed_state), bullet(packed_state)
    exhaustive(reference)
    start = sample.n_rebuilds
    for _ in range(5):
        sample.advance(300, drive)
        reference.advance(300, drive)
        np.testing.assert_array_equal(sample.grains.row, reference.grains.row)
        np.testing.assert_array_equal(sample.walls.force, reference.walls.force)
    assert sample.n_rebuilds - start >= 5
    assert reference.n_rebuilds == start


def test_a_bullet_misses_nothing_when_lists_are_rebuilt_every_step(packed_state, straining):
    """The same motion with a new list before every step, to the bit."""
    drive = straining((1.0, -1.0, 0.5))
    sample, reference = bullet(packed_state), bullet(packed_state)
    sample.advance(300, drive)
    for _ in range(300):
        with_new_lists(reference)
        reference.advance(1, drive)
    np.testing.assert_array_equal(sample.grains.row, reference.grains.row)


def test_a_list_that_is_trusted_too_long_is_noticed(packed_state, straining):
    """Control of the tests above: with a list believed valid for ever the bullet does miss contacts."""
    drive = straining((1.0, -1.0, 0.5))
    sample, reference = bullet(packed_state), bullet(packed_state)
    exhaustive(reference)
    sample.margin = 10.0  # the list was built with a smaller one
    sample.advance(1500, drive)
    reference.advance(1500, drive)
    assert np.abs(sample.grains.position - reference.grains.position).max() > 1e-5
