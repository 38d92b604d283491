"""How many threads step an assembly changes no bit of it."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import rendulic as rd
from rendulic.dem.drive import team
from rendulic.dem.drive.servo import drive_for, hold
from rendulic.foundation.cores import cores
from rendulic.foundation.errors import InvalidInput


@pytest.fixture
def threads():
    """`use_threads` without the smallest size that would use them; as it was afterwards."""
    before, team.GRAINS_PER_THREAD = team.GRAINS_PER_THREAD, 1
    yield rd.dem.use_threads
    team.GRAINS_PER_THREAD = before
    rd.dem.use_threads(None)


def arrays_of(assembly):
    """All that a saved state holds."""
    return assembly.save().arrays


def all_equal(one, other):
    """Names of what differs."""
    return [name for name in one if not np.array_equal(one[name], other[name])]


@pytest.mark.parametrize("n", [2, 3, 5])
def test_strain_and_stress_control(sheared_state, threads, n):
    """Fast loading through many new lists, held strains and held stresses: positions, history, walls, energies."""
    found = []
    for count in (1, n):
        threads(count)
        one = rd.dem.Assembly.from_state(sheared_state)
        one.advance(150, drive_for(one, hold("strain"), (None,) * 3, np.array([2.0, -0.5, -0.5]), 0.1))
        one.advance(150, drive_for(one, hold("stress"), (220e3, 200e3, 190e3), np.zeros(3), 0.5))
        found.append(one)
    assert found[0].n_rebuilds > 3
    assert all_equal(*map(arrays_of, found)) == []
    assert found[0].spent.all()


def test_a_packing(threads):
    """Growth, with radii that change between steps, ends at the same packing."""
    found = []
    for count in (1, 2):
        threads(count)
        found.append(arrays_of(rd.dem.pack(n_grains=60, radius=(5e-3, 10e-3), pressure=100e3, seed=3)))
    assert all_equal(*found) == []


def test_more_threads_than_blocks(packed_state, threads):
    """Ranks without a grain wait with the others and change nothing."""
    threads(16)
    many = rd.dem.Assembly.from_state(packed_state)
    drive = drive_for(many, hold("strain"), (None,) * 3, np.array([0.1, 0.0, 0.0]), 0.1)
    many.advance(50, drive)
    threads(1)
    alone = rd.dem.Assembly.from_state(packed_state)
    alone.advance(50, drive_for(alone, hold("strain"), (None,) * 3, np.array([0.1, 0.0, 0.0]), 0.1))
    assert_array_equal(many.grains.row, alone.grains.row)


def test_only_the_main_thread_has_a_team(threads):
    """Studies that run specimens in threads of their own are not slowed down by threads of threads."""
    threads(4)
    assert team.threads_for(10_000) == 4
    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(team.threads_for, 10_000).result() == 1


def test_small_packings_are_stepped_alone():
    """Waiting for each other would cost more than it saves."""
    rd.dem.use_threads(8)
    assert team.threads_for(1999) == 1
    assert team.threads_for(6100) == 3
    rd.dem.use_threads(None)
    assert team.threads_for(10**6) == min(cores(), 10**6 // team.GRAINS_PER_THREAD)


@pytest.mark.parametrize("bad", [0, -1, 1.5, "two"])
def test_bad_numbers_of_threads(bad):
    """Zero threads, or half a thread."""
    with pytest.raises(InvalidInput, match="number of threads"):
        rd.dem.use_threads(bad)
