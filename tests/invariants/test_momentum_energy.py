"""What mechanics conserves: momentum without walls, energy with everything counted."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rendulic as rd


@pytest.fixture
def cluster():
    """Sixty overlapping grains that fly, spin and rub in a box too large to touch."""
    rng = np.random.default_rng(7)
    position = 0.5 + 0.045 * rng.uniform(-1, 1, (400, 3))
    kept = [0]
    for i in range(1, len(position)):
        if np.linalg.norm(position[kept] - position[i], axis=1).min() > 0.0195:
            kept.append(i)
    position = position[kept]
    n = len(position)
    return rd.dem.Assembly(
        position,
        np.full(n, 0.01),
        [0, 1, 0, 1, 0, 1],
        damping=0.0,
        time_step_fraction=0.2,
        velocity=0.5 * rng.standard_normal((n, 3)),
        angular_velocity=20.0 * rng.standard_normal((n, 3)),
    )


def linear_momentum(assembly):
    return assembly.grains.mass @ assembly.grains.velocity


def angular_momentum(assembly):
    grains = assembly.grains
    orbital = np.cross(grains.position, grains.mass[:, None] * grains.velocity).sum(axis=0)
    return orbital + grains.inertia @ grains.angular_velocity


def test_momentum_is_conserved(cluster, straining):
    """Without walls and damping, linear and angular momentum stay, to the rounding of 400 steps.

    Both are exact for the scheme: contact forces are opposite, lever arms add up to the branch, and
    positions move along velocities.
    """
    grains = cluster.grains
    speed = np.linalg.norm(grains.velocity, axis=1)
    size = grains.mass @ speed
    before = linear_momentum(cluster), angular_momentum(cluster)
    kinetic = cluster.energies()["kinetic"]
    cluster.advance(400, straining())
    assert_allclose(linear_momentum(cluster), before[0], rtol=0, atol=1e-15 * size)
    assert_allclose(angular_momentum(cluster), before[1], rtol=0, atol=1e-13 * size)
    # they collided indeed, and rubbed
    assert cluster.energies()["friction"] > 0.01 * kinetic


def balance_error(sample, drive, steps, damping):
    """|boundary - kinetic - elastic - friction - damping| over the boundary work, all in differences."""
    before = sample.energies()
    sample.advance(steps, drive, damping)
    change = {name: value - before[name] for name, value in sample.energies().items()}
    missing = change["boundary"] - sum(change[name] for name in ("kinetic", "elastic", "friction", "damping"))
    assert min(change["kinetic"], change["elastic"], change["friction"]) > 0.05 * change["boundary"]
    return abs(missing) / change["boundary"]


@pytest.mark.parametrize("damping", [0.0, 0.05, 0.3])
def test_energy_balance_closes_with_the_time_step(sheared, straining, damping):
    """Over 1 % of violent shear the balance closes, and what is missing is of first order in the step.

    First order, since kinetic energy belongs to half steps. The shear takes 0.3 ms, short enough
    that trajectories of different steps do not part; slope 1 within 0.1 then.
    """
    state = sheared.save()
    errors = []
    for divisor in (1, 8, 32):
        sheared.restore(state)
        sheared.time_step = state.attributes["time_step"] / divisor
        steps = divisor * round(0.01 / 30.0 / state.attributes["time_step"])
        errors.append(balance_error(sheared, straining((30.0, -9.0, -6.0)), steps, damping))
    assert errors[0] < 0.01
    assert np.log(errors[1] / errors[2]) / np.log(4.0) == pytest.approx(1.0, abs=0.1)


def test_energy_balance_of_quasi_static_loading(sheared, fast):
    """Energies add up over a loading by the servo with scaled masses, within 0.1 % of the boundary work.

    What is missing is of first order in the step: kinetic energy belongs to half steps, and avalanches have some.
    """
    before = sheared.energies()
    sheared.load(rd.paths.drained_triaxial(until_strain=2e-3), speed=fast)
    change = {name: value - before[name] for name, value in sheared.energies().items()}
    missing = change["boundary"] - sum(change[name] for name in ("kinetic", "elastic", "friction", "damping"))
    assert change["boundary"] > 0
    assert abs(missing) < 1e-3 * change["boundary"]


@pytest.mark.parametrize(
    "path",
    [rd.paths.drained_triaxial(until_strain=1e-3), rd.paths.isotropic(220e3), rd.paths.oedometric(until_strain=1e-3)],
    ids=lambda path: path.name,
)
def test_the_books_of_quasi_static_loading(dense_state, path):
    """A dense packing, which moves without avalanches, loaded at I = 2e-5: 1e-6 of the boundary work."""
    sample = rd.dem.Assembly.from_state(dense_state)
    before = sample.energies()
    sample.load(path)
    change = {name: value - before[name] for name, value in sample.energies().items()}
    missing = change["boundary"] - sum(change[name] for name in ("kinetic", "elastic", "friction", "damping"))
    assert change["boundary"] > 0
    assert abs(missing) < 1e-6 * change["boundary"]


def test_damping_only_takes_energy(packed, straining):
    """Damping and friction never give energy back, step by step."""
    spent = []
    for _ in range(50):
        packed.advance(1, straining((1.0, 0.0, 0.0)), 0.3)
        spent.append(packed.spent.copy())
    steps = np.diff(np.array(spent), axis=0)
    assert steps[:, 1].min() > 0
    # a contact that closes with a history of zero may round below zero
    assert steps[:, 0].min() > -1e-12 * steps[:, 1].max()
