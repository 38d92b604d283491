"""What the inertia of small grains changes: the number of steps, and next to nothing else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import rendulic as rd

STRAINS = np.linspace(2e-4, 4e-3, 20)


@pytest.fixture(scope="module")
def wide_state(shared):
    """A dense packing with a size ratio of five. (Loose ones advance in avalanches, which any change sets off.)"""

    def make(path):
        speed = rd.dem.QuasiStatic(inertial_number=1e-4, max_rest_steps=100_000)
        made = rd.dem.pack(n_grains=200, radius=(3e-3, 15e-3), seed=3, speed=speed, growth_friction=0.0)
        made.save().to_file(path)

    return rd.State.from_file(shared("wide.h5", make))


def response(state, mass_scaling):
    """Deviatoric stress at STRAINS in Pa of drained compression, and the steps it took."""
    sample = rd.dem.Assembly.from_state(state)
    speed = replace(rd.dem.QuasiStatic(inertial_number=1e-4), mass_scaling=mass_scaling)
    before = sample.n_steps
    curve = sample.load(rd.paths.drained_triaxial(until_strain=STRAINS[-1]), speed=speed)
    np.testing.assert_array_equal(sample.grains.mass, rd.dem.Assembly.from_state(state).grains.mass)
    return np.interp(STRAINS, curve.eps_1.values, curve.q.values), sample.n_steps - before


def test_the_response_is_that_of_the_true_masses(wide_state):
    """Less than half the steps; stresses within 1 % of the largest, as between two loading rates."""
    (true, n_true), (scaled, n_scaled) = response(wide_state, 0.0), response(wide_state, 1.0)
    assert n_scaled < 0.5 * n_true
    assert np.abs(scaled - true).max() < 0.01 * true.max()
    assert (scaled != true).any()


def test_less_inertia_less_error(wide_state):
    """Grains of three mean radii are heavier than needed: fewer steps, and no longer the same response."""
    true, heavy = response(wide_state, 0.0)[0], response(wide_state, 3.0)[0]
    scaled = response(wide_state, 1.0)[0]
    assert np.abs(scaled - true).max() < np.abs(heavy - true).max()
