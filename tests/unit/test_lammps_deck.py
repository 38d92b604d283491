"""The way out to LAMMPS: what a deck holds, how near its springs are, and what its first step makes of velocities."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rendulic as rd
from rendulic.foundation.errors import InvalidInput, NotEquilibrated
from rendulic.io.lammps.grain_types import sorted_into_types
from rendulic.io.lammps.history import velocities_for


@pytest.fixture(scope="module")
def snapshot(sheared_state):
    return rd.dem.Assembly.from_state(sheared_state).snapshot()


def test_a_deck_gives_the_grains_back(sheared_state, tmp_path):
    """Positions, radii, walls and density of a deck's data file are those of the packing, to the last bit but density."""
    sample = rd.dem.Assembly.from_state(sheared_state)
    rd.io.lammps.write_deck(sample, tmp_path)
    found = rd.io.lammps.read_data(tmp_path / "state.data")
    assert np.array_equal(found.grains.position, sample.grains.position)
    assert np.array_equal(found.grains.radius, sample.grains.radius)
    assert np.array_equal(found.walls.position, sample.walls.position)
    assert_allclose(found.grains.mass, sample.grains.mass, rtol=1e-14)
    assert np.abs(found.grains.velocity).max() < 1e-9


def test_what_no_deck_can_say_is_refused(sheared_state, tmp_path):
    sample = rd.dem.Assembly.from_state(sheared_state)
    with pytest.raises(InvalidInput, match="n_types must be a whole number of at least 1, got 0"):
        rd.io.lammps.write_deck(sample, tmp_path, n_types=0)
    (tmp_path / "file").write_text("")
    with pytest.raises(InvalidInput, match="cannot write"):
        rd.io.lammps.write_deck(sample, tmp_path / "file")
    sample.grains.velocity[:, 0] = 1.0
    with pytest.raises(NotEquilibrated, match=r"starts from standstill, and this packing moves \(NOT at rest"):
        rd.io.lammps.write_deck(sample, tmp_path)
    sample.law = object()
    with pytest.raises(InvalidInput, match="LAMMPS has the law LinearFrictional only, this packing has object"):
        rd.io.lammps.write_deck(sample, tmp_path)


@pytest.mark.parametrize("rule", ["mean_diameter", "harmonic"])
def test_types_are_as_near_as_their_classes_are_narrow(snapshot, rule):
    """No spring is farther off than two radii of a class can be apart; each pair of types carries its forces."""
    law = rd.dem.LinearFrictional(stiffness_rule=rule)
    ratio = snapshot.radius.max() / snapshot.radius.min()
    between = ~snapshot.is_wall
    first, second = snapshot.first[between], snapshot.second[between]
    exact = law.stiffness(snapshot.radius[first], snapshot.radius[second], law.parameters)[0]
    overlap = snapshot.radius[first] + snapshot.radius[second] - np.linalg.norm(snapshot.branch[between], axis=1)
    errors = []
    for n_types in (1, 3, 10, 30):
        types = sorted_into_types(snapshot, law, n_types)
        assert types.n_types == n_types
        width = ratio ** (1.0 / n_types)
        assert np.abs(types.error).max() < width - 1.0
        springs = types.k_n[types.of_grain[first], types.of_grain[second]]
        assert_allclose(springs / exact - 1.0, types.error, atol=1e-15)
        assert_allclose((springs * overlap).sum(), (exact * overlap).sum(), rtol=1e-12)
        errors.append(np.sqrt((types.error**2).mean()))
    assert all(after < 0.7 * before for before, after in pairwise(errors))
    assert np.abs(sorted_into_types(snapshot, law, 200).error).max() < 1e-14


def slip_forces(snapshot, k_t, velocity, spin):
    """What the slip of each contact in one second makes of its tangential force, contact by contact."""
    forces = []
    for c, stiffness in enumerate(k_t):
        i, j, n = snapshot.first[c], snapshot.second[c], snapshot.normal[c]
        slip = velocity[j] - velocity[i] - np.cross(snapshot.radius[i] * spin[i] + snapshot.radius[j] * spin[j], n)
        forces.append(-stiffness * (slip - (slip @ n) * n))
    return np.array(forces)


def test_a_packing_of_few_sizes_needs_few_types(fast, tmp_path):
    """Grains of one size keep it to the last bit while they grow: a type per size, and no approximation."""
    radii = np.random.default_rng(1).choice([6e-3, 7e-3, 9e-3], 60)
    found = rd.io.lammps.write_deck(rd.dem.pack(radius=radii, seed=1, speed=fast), tmp_path, n_types=3)
    assert found.n_types == 3
    assert found.stiffness_error_max < 1e-14


def test_slips_bring_about_the_tangential_forces(snapshot):
    k_t = np.linspace(1e6, 2e6, int((~snapshot.is_wall).sum()))
    velocity, spin, residual = velocities_for(snapshot, k_t)
    assert residual < 1e-10
    assert np.abs(snapshot.force_t).max() > 10.0
    wanted = snapshot.force_t[~snapshot.is_wall]
    assert_allclose(slip_forces(snapshot, k_t, velocity, spin), wanted, rtol=0, atol=1e-10 * np.linalg.norm(wanted))


def test_what_slips_cannot_bring_about_is_said():
    """Six contacts a grain are too many for six unknowns a grain: the residual is what is missing, and not small."""
    corner = np.stack(np.meshgrid(*[np.arange(6)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    position = 0.0141 * corner[corner.sum(axis=1) % 2 == 0]  # cubic, face-centred
    apart = np.linalg.norm(position[:, None] - position[None], axis=2)
    first, second = np.nonzero(np.triu((apart > 0.0) & (apart < 0.021)))
    normal = (position[second] - position[first]) / apart[first, second][:, None]
    force = np.cross(normal, np.random.default_rng(2).normal(size=normal.shape))
    n = len(position)
    assert 2 * len(first) > 6 * n
    snapshot = rd.Snapshot(
        position, np.full(n, 0.01), np.array([-0.01, 0.1] * 3), first, second, normal, np.ones(len(first)), force
    )
    k_t = np.ones(len(first))
    velocity, spin, residual = velocities_for(snapshot, k_t)
    missing = np.linalg.norm(slip_forces(snapshot, k_t, velocity, spin) - force) / np.linalg.norm(force)
    assert residual == pytest.approx(missing, rel=1e-9)
    assert residual > 0.1
