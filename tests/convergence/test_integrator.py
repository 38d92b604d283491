"""Order of the integrator in the time step, and of the second-order work in the probe's size."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rendulic as rd

K, R = 1e8, 0.01


def held_grain(overlap=1e-4):
    """A grain that both walls of axis 2 press, at the middle between them; free along 1 and 3."""
    walls = [0.0, 1.0, -(R - overlap), R - overlap, 0.0, 1.0]
    law = rd.dem.LinearFrictional(K)
    return rd.dem.Assembly([[0.5, 0.0, 0.5]], [R], walls, law=law, damping=0.0)


def slope(steps, errors):
    """Least-squares slope of log error against log step."""
    return np.polyfit(np.log(steps), np.log(errors), 1)[0]


def test_elastic_oscillation_is_of_second_order(straining):
    """Between two walls `x = (v0 / omega) sin(omega t)`, `omega = sqrt(2 k / m)`: slope 2 within 0.1.

    Both contacts stay closed, so nothing but the integrator errs. The velocity of a state belongs
    half a step before its position, and starts so.
    """
    omega = sqrt(2 * 2 * K * R / (2600.0 * 4 / 3 * pi * R**3))
    speed, duration = 0.3, 1.9 * 2 * pi / omega
    steps, errors = [], []
    for count in (60, 120, 240, 480):
        sample = held_grain()
        sample.set_time_step(duration / count)
        sample.grains.velocity[0, 1] = speed * np.cos(0.5 * omega * sample.time_step)
        assert speed / omega < 1e-4  # the amplitude is less than the overlap
        sample.advance(count, straining())
        steps.append(sample.time_step)
        errors.append(abs(sample.grains.position[0, 1] - speed / omega * np.sin(omega * duration)))
    assert slope(steps, errors) == pytest.approx(2.0, abs=0.1)
    assert errors[-1] < 1e-3 * speed / omega


def test_tangential_oscillation_is_of_second_order(straining):
    """Two spheres that spin against each other on their tangential spring: slope 2 within 0.1.

    Equal spheres held apart by walls along axis 1, no sliding, spun alike about axis 3. The contact
    point slips at `2 R' w`, the spring turns both back: `w = w0 cos(omega t)` with
    `omega^2 = 2 k_t R'^2 / I`; spins slide the spheres sideways too, by `2 k_t / m` in `omega^2`. The
    overlap is tiny, so that the normal force adds no stiffness when the pair tilts.
    """
    overlap = 1e-8
    walls = [0.5 - 2 * R + 1.5 * overlap, 0.5 + 2 * R - 1.5 * overlap, 0.0, 1.0, 0.0, 1.0]
    arm = R - overlap / 2
    position = [[0.5 - arm, 0.5, 0.5], [0.5 + arm, 0.5, 0.5]]
    law = rd.dem.LinearFrictional(K, 0.42, 1e9)
    mass = 2600.0 * 4 / 3 * pi * R**3
    omega = sqrt(2 * 0.42 * 2 * K * R * (1 / mass + arm**2 / (0.4 * mass * R**2)))
    start, duration = 1e-3, 0.7 * 2 * pi / omega
    steps, errors = [], []
    for count in (25, 50, 100, 200):
        sample = rd.dem.Assembly(position, [R, R], walls, law=law, damping=0.0)
        sample.set_time_step(duration / count)
        half = 0.5 * omega * sample.time_step
        # slip velocity 2 R' w - (v2 - v1) starts as s0 omega cos, half a step early; from spin alone
        share = arm**2 / (0.4 * R**2) / (1 + arm**2 / (0.4 * R**2))
        slip_rate = 2 * arm * start
        sample.grains.angular_velocity[:, 2] = start * (1 - share * (1 - np.cos(half)))
        sideways = 0.5 * slip_rate * (1 - share) * (1 - np.cos(half))
        sample.grains.velocity[0, 1], sample.grains.velocity[1, 1] = -sideways, sideways
        sample.advance(count, straining())
        expected = 0.42 * 2 * K * R * slip_rate / omega * np.sin(omega * duration)
        steps.append(sample.time_step)
        errors.append(abs(np.linalg.norm(sample.contacts.force_t[0]) - abs(expected)))
    assert slope(steps, errors) == pytest.approx(2.0, abs=0.1)


def elastic_lattice(n=3, overlap=2e-5):
    """A cubic lattice that cannot slide, under pressure."""
    pitch = 2 * R - overlap
    places = R - overlap + pitch * np.arange(n)
    position = np.stack(np.meshgrid(places, places, places, indexing="ij"), axis=-1).reshape(-1, 3)
    law = rd.dem.LinearFrictional(K, 0.42, 1e9)
    length = 2 * (R - overlap) + (n - 1) * pitch
    return rd.dem.Assembly(position, np.full(n**3, R), [0.0, length] * 3, law=law, damping=0.5)


def rested_work(sample, alpha, norm, straining):
    """Normalised second-order work of a probe that came to rest at its end."""
    clone = sample.clone()
    before = clone.snapshot()
    clone.probe(rd.directions.axisymmetric(alpha).increments(norm)[0], 500)
    clone.advance(3000, straining())
    return rd.second_order_work(before, clone.snapshot())


@pytest.mark.parametrize("alpha", [0.0, 35.26, 125.26, 200.0])
def test_work_of_an_elastic_specimen_does_not_depend_on_amplitude(alpha, straining):
    """W2n of springs is a number of the direction alone, up to geometry of first order in the strain.

    Norms 2e-7 to 2e-5 stay below the 1e-3 of strain that would open a contact; W2n changes by less
    than a thousandth of the norm, W2 itself scales with the norm squared within 1e-3.
    """
    sample = elastic_lattice()
    norms = np.array([2e-7, 2e-6, 2e-5])
    works = [rested_work(sample, alpha, norm, straining) for norm in norms]
    values = np.array([work.normalised for work in works])
    assert_allclose(values, values[0], rtol=0, atol=1e-3 * norms[-1])
    scaled = np.array([work.boundary for work in works]) / norms**2
    assert_allclose(scaled, scaled[0], rtol=1e-3)


def test_work_converges_in_amplitude_with_slope_one(straining):
    """The finite-strain share of `W2 / norm^2` is of first order in the norm: slope 1 within 0.1."""
    sample = elastic_lattice()
    norms = np.array([2e-5, 4e-5, 8e-5, 1.6e-4])
    scaled = [rested_work(sample, 90.0, norm, straining).eulerian / norm**2 for norm in norms]
    limit = rested_work(sample, 90.0, 1e-7, straining).eulerian / 1e-14
    assert slope(norms, np.abs(np.array(scaled) - limit)) == pytest.approx(1.0, abs=0.1)


def test_eulerian_and_lagrangian_forms_differ_by_stress_over_modulus(straining):
    """The two macroscopic forms part by `sigma / E`, one of few per cent here, and not by more.

    Isotropic: `d_sigma` has the share `2 sigma d_eps` from shrinking areas that `dPi` has not, against
    `E d_eps` of the springs: relative difference `2 sigma / E`.
    """
    sample = elastic_lattice()
    norm = 1e-6
    work = rested_work(sample, 35.26438968275465, norm, straining)
    modulus = work.d_sigma[0] / work.d_eps[0]
    ratio = 2 * sample.stress[0, 0] / modulus
    assert ratio > 1e-4
    assert_allclose((work.eulerian - work.lagrangian) / work.eulerian, ratio, rtol=0.02)
    # the same sum over walls, but for what is out of balance at rest
    assert_allclose(work.lagrangian, work.boundary, rtol=1e-9)
