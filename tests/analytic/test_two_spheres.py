"""Closed forms of one contact: collision, normal force, shear, sliding, rolling, rigid rotation."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rendulic as rd
from rendulic.dem.kernels.compiled import kernels_for
from rendulic.dem.kernels.layout import SPENT

BOX = [0.0, 1.0] * 3
K = 1e8
RULES = ["mean_diameter", "harmonic"]


def stiffness(rule, r1, r2):
    return K * (r1 + r2) if rule == "mean_diameter" else 4.0 * K * r1 * r2 / (r1 + r2)


def pair(r1, r2, overlap, rule="mean_diameter", friction=0.5, modulus=K, **options):
    """Two spheres along a skew direction; returns the assembly and the normal from 1 to 2."""
    normal = np.array([2.0, -1.0, 2.0]) / 3.0
    position = np.array([[0.5, 0.5, 0.5], [0.5, 0.5, 0.5] + (r1 + r2 - overlap) * normal])
    law = rd.dem.LinearFrictional(modulus, 0.42, friction, rule)
    return rd.dem.Assembly(position, [r1, r2], BOX, law=law, damping=0.0, **options), normal


def mass(radius, density=2600.0):
    return density * 4.0 / 3.0 * pi * radius**3


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("radii", [(0.01, 0.01), (0.01, 0.03)])
def test_collision_lasts_half_a_period_and_gives_all_back(rule, radii, straining):
    """Head-on without damping: contact for `pi sqrt(m_eff / k_n)`, relative velocity reversed.

    Steps are a thousandth of the half period or so: the duration is known to two steps, and the
    last step of the contact leaves an error of the velocity of that size squared.
    """
    sample, normal = pair(*radii, -1e-9, rule, time_step_fraction=0.003)
    speed = 0.2
    sample.grains.velocity[0], sample.grains.velocity[1] = 0.5 * speed * normal, -0.5 * speed * normal
    m1, m2 = mass(radii[0]), mass(radii[1])
    half_period = pi * sqrt(m1 * m2 / (m1 + m2) / stiffness(rule, *radii))
    touching = 0
    while sample.time < 1.5 * half_period:
        sample.advance(1, straining())
        touching += sample.n_contacts
    assert half_period / sample.time_step > 300
    assert_allclose(touching * sample.time_step, half_period, rtol=0, atol=2 * sample.time_step)
    relative = sample.grains.velocity[1] - sample.grains.velocity[0]
    assert_allclose(relative, speed * normal, rtol=0, atol=1e-4 * speed)


def test_collision_with_a_wall(straining):
    """A grain leaves a fixed wall after `pi sqrt(m / 2 K R)`, as fast as it came."""
    law = rd.dem.LinearFrictional(K)
    sample = rd.dem.Assembly(
        [[0.5, 0.01 + 1e-9, 0.5]],
        [0.01],
        BOX,
        law=law,
        damping=0.0,
        velocity=[[0.0, -0.3, 0.0]],
        time_step_fraction=0.003,
    )
    half_period = pi * sqrt(mass(0.01) / (2 * K * 0.01))
    touching = 0
    while sample.time < 1.5 * half_period:
        sample.advance(1, straining())
        touching += sample.n_contacts
    assert_allclose(touching * sample.time_step, half_period, rtol=0, atol=2 * sample.time_step)
    assert_allclose(sample.grains.velocity[0], [0.0, 0.3, 0.0], rtol=0, atol=3e-5)


def test_damping_takes_its_share_of_the_velocity(straining):
    """With `lambda` against the motion while loading and for it while unloading, restitution^2 is (1-l)/(1+l).

    Loading, the repulsion opposes the motion and is enhanced by 1 + lambda; unloading, it is reduced
    by 1 - lambda. From `v^2 = (1 + l) k u^2 / m` in and `(1 - l) k u^2 / m` out.
    """
    damping = 0.3
    # along an axis, since damping acts by component
    sample = rd.dem.Assembly(
        [[0.5, 0.5, 0.5], [0.52 + 1e-9, 0.5, 0.5]], [0.01, 0.01], BOX, law=rd.dem.LinearFrictional(K), damping=damping,
        velocity=[[0.1, 0, 0], [-0.1, 0, 0]], time_step_fraction=0.002,
    )  # fmt: skip
    while sample.grains.velocity[0, 0] > 0 or sample.n_contacts:
        sample.advance(1, straining())
    expected = 0.1 * sqrt((1 - damping) / (1 + damping))
    # steps of 1 / 1500 of the contact's life: the last one of it errs by that size squared, here and at the turn
    assert_allclose(sample.grains.velocity[:, 0], [-expected, expected], rtol=2e-5)


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("radii", [(0.01, 0.01), (0.004, 0.02)])
@pytest.mark.parametrize("overlap", [1e-7, 1e-5, 1e-3])
def test_normal_force(rule, radii, overlap):
    """`f_n = k_n u_n` along the line of centres, both rules; coordinates of 0.5 m leave 1e-16 m of overlap."""
    sample, normal = pair(*radii, overlap, rule)
    k_n = stiffness(rule, *radii)
    snapshot = sample.snapshot()
    atol = 4e-16 * k_n
    assert_allclose(snapshot.force_n, [k_n * overlap], rtol=1e-14, atol=atol)
    assert_allclose(snapshot.normal[0], normal, rtol=0, atol=1e-13)
    assert_allclose(sample.grains.force, [-k_n * overlap * normal, k_n * overlap * normal], rtol=1e-12, atol=atol)
    assert not snapshot.force_t.any()
    assert not sample.grains.torque.any()


def test_equal_spheres_know_no_difference_between_the_rules():
    """`k_n = 2 K R` by both rules for equal radii."""
    for rule in RULES:
        law = rd.dem.LinearFrictional(K, 0.42, 0.5, rule)
        assert_allclose(law.stiffness(0.01, 0.01, law.parameters), [2 * K * 0.01, 0.42 * 2 * K * 0.01], rtol=1e-15)


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("wall", range(6))
def test_wall_force(rule, wall):
    """`f_n = 2 K R u_n` on each wall, inward on the grain, none tangential."""
    overlap, radius = 2e-5, 0.012
    position = np.full((1, 3), 0.5)
    sign = 1.0 if wall % 2 == 0 else -1.0
    position[0, wall // 2] = wall % 2 + sign * (radius - overlap)
    law = rd.dem.LinearFrictional(K, stiffness_rule=rule)
    sample = rd.dem.Assembly(position, [radius], BOX, law=law, velocity=[[0.3, 0.4, 0.5]])
    expected = np.zeros(6)
    expected[wall] = 2 * K * radius * overlap
    # overlaps of 2e-5 m between coordinates of up to 1 m, rounded by 1e-16 m
    assert_allclose(sample.walls.force, expected, rtol=1e-11)
    inward = np.zeros(3)
    inward[wall // 2] = sign * expected[wall]
    assert_allclose(sample.grains.force[0], inward, rtol=1e-11)
    assert_allclose(sample.snapshot().resultant[0], inward, rtol=1e-11)


def test_open_contact_forgets():
    """A contact that opened carries nothing when it closes again, and no tension while open."""
    sample, normal = pair(0.01, 0.01, 1e-5)
    sample.contacts.force_t[0] = np.cross(normal, [0.0, 0.0, 20.0])
    kernels = kernels_for(sample.law)
    start = sample.grains.position[1].copy()
    for away in (2.1e-5, 0.0):
        sample.grains.position[1] = start + away * normal
        sample.grains.force[:] = 0.0
        kernels.contact_forces(sample.grains, sample.contacts, 0.0, sample.law.parameters, sample.spent)
        held = sample.contacts.force[0]
        assert_allclose(held[0], max(K * 0.02 * (1e-5 - away), 0.0), rtol=1e-9)
        assert not held[1:].any()


def shear(sample, direction, speed, n_steps, dt):
    """Forces of the kernel while sphere 2 slides at `speed` without changing the overlap."""
    kernels = kernels_for(sample.law)
    sample.grains.velocity[1] = speed * direction
    history = []
    for _ in range(n_steps):
        sample.grains.force[:] = 0.0
        sample.grains.torque[:] = 0.0
        kernels.contact_forces(sample.grains, sample.contacts, dt, sample.law.parameters, sample.spent)
        history.append(sample.contacts.force[0].copy())
    return np.array(history)


@pytest.mark.parametrize("rule", RULES)
def test_shear_is_elastic_then_slides_at_exactly_mu_fn(rule):
    """`f_t = -k_t s` until `mu f_n`, then exactly that; friction takes `mu f_n` times the sliding.

    Sliding begins with a step, so that no step is split and the work is known to rounding.
    """
    radii, overlap, friction = (0.008, 0.012), 1e-5, 0.5
    sample, normal = pair(*radii, overlap, rule, friction)
    direction = np.cross(normal, [0.0, 0.0, 1.0])
    direction /= np.linalg.norm(direction)
    k_n = stiffness(rule, *radii)
    k_t, limit = 0.42 * k_n, friction * k_n * overlap
    slip = 0.02 * limit / k_t  # fifty steps to the limit
    history = shear(sample, direction, slip / 1e-6, 80, 1e-6)
    distance = slip * np.arange(1, 81)
    assert_allclose(history[:49, 1:], -k_t * distance[:49, None] * direction, rtol=0, atol=1e-13 * limit)
    assert_allclose(np.linalg.norm(history[51:, 1:], axis=1), friction * history[51:, 0], rtol=1e-14)
    assert_allclose(history[51:, 1:], -np.outer(friction * history[51:, 0], direction), rtol=0, atol=1e-13 * limit)
    assert_allclose(
        sample.spent[SPENT.friction], limit * (distance[-1] - limit / k_t), rtol=0, atol=1e-8 * limit * slip
    )
    # torques of the tangential force at the contact point, both in the same sense
    arms = np.array(radii) - overlap / 2
    assert_allclose(sample.grains.torque, -arms[:, None] * np.cross(normal, history[-1, 1:]), rtol=1e-13)


def test_shear_reversed_unloads_elastically():
    """After sliding, reversal follows `k_t` at once: friction has no memory but the force."""
    sample, normal = pair(0.01, 0.01, 1e-5)
    direction = np.cross(normal, [1.0, 0.0, 0.0]) / np.linalg.norm(np.cross(normal, [1.0, 0.0, 0.0]))
    forward = shear(sample, direction, 10.0, 100, 1e-6)
    taken = sample.spent[SPENT.friction]
    back = shear(sample, direction, -1.0, 3, 1e-6)
    k_t = 0.42 * K * 0.02
    assert_allclose(np.linalg.norm(forward[-1, 1:]), 0.5 * forward[-1, 0], rtol=1e-14)
    assert_allclose((back[:, 1:] - forward[-1, 1:]) @ direction, k_t * 1e-6 * np.arange(1, 4), rtol=1e-12)
    assert sample.spent[SPENT.friction] == taken


def test_gears_do_not_slip():
    """Spheres that roll on each other like gears shear nothing; turning alike they slip at the sum."""
    k_t = 0.42 * K * 0.03
    for sense, slip in ((-1.0, 0.0), (1.0, 4.0)):
        sample, normal = pair(0.01, 0.02, 1e-5, friction=1e6)
        axis = np.cross(normal, [0.0, 1.0, 0.0]) / np.linalg.norm(np.cross(normal, [0.0, 1.0, 0.0]))
        arms = np.array([0.01, 0.02]) - 0.5e-5
        spin = 2.0 / arms  # contact points at 2 m/s
        sample.grains.angular_velocity[0], sample.grains.angular_velocity[1] = spin[0] * axis, sense * spin[1] * axis
        kernels = kernels_for(sample.law)
        kernels.contact_forces(sample.grains, sample.contacts, 1e-7, sample.law.parameters, sample.spent)
        expected = k_t * slip * 1e-7 * np.cross(axis, normal)
        assert_allclose(sample.contacts.force_t[0], expected, rtol=1e-12, atol=1e-12)


def rotated_force(axis, force, angle, n_steps):
    """Tangential force after the pair turned rigidly by `angle`, in steps, the spheres spinning along."""
    # soft: chords and normals of different instants slip by the angle squared, which is not the claim
    sample, normal = pair(0.01, 0.015, 1e-5, friction=1e9, modulus=1e3)
    centre, start = sample.grains.position.mean(axis=0), sample.grains.position - sample.grains.position.mean(axis=0)
    sample.contacts.force_t[0] = force(normal)
    kernels = kernels_for(sample.law)
    axis = axis(normal)
    dt, rate = 1e-6, angle / n_steps / 1e-6
    for k in range(1, n_steps + 1):
        turned = centre + turn(start, axis, k * angle / n_steps)
        sample.grains.velocity[:] = (turned - sample.grains.position) / dt
        sample.grains.position[:] = turned
        sample.grains.angular_velocity[:] = rate * axis
        kernels.contact_forces(sample.grains, sample.contacts, dt, sample.law.parameters, sample.spent)
    return sample.contacts.force_t[0].copy(), turn(force(normal)[None], axis, angle)[0]


def turn(vectors, axis, angle):
    """Rodrigues' rotation."""
    return (
        vectors * np.cos(angle) + np.cross(axis, vectors) * np.sin(angle)
        + np.outer(vectors @ axis, axis) * (1 - np.cos(angle))
    )  # fmt: skip


def across(normal):
    vector = np.cross(normal, [0.0, 0.0, 1.0])
    return vector / np.linalg.norm(vector)


AXES = {
    "about the normal": lambda n: n,
    "tilting the force": lambda n: np.cross(n, across(n)),
    "skew": lambda n: (n + across(n) + np.cross(n, across(n))) / sqrt(3.0),
}


@pytest.mark.parametrize("name", AXES)
def test_rigid_rotation_carries_the_shear_force(name):
    """A pair turned as one rigid body keeps its shear force, turned along: frame indifference.

    Projection and turning change `|f_t|` by half the square of the angle per step, so the error at
    the end of half a turn is of first order: slope 1 within 0.1, and `pi^2 / 2 n` in size.
    """
    errors = []
    for n_steps in (375, 750, 1500):
        force, expected = rotated_force(AXES[name], lambda n: 50.0 * across(n), pi, n_steps)
        errors.append(np.linalg.norm(force - expected) / 50.0)
        assert_allclose(np.linalg.norm(force), 50.0, rtol=1.1 * pi**2 / 2 / n_steps)
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    assert_allclose(slopes, 1.0, rtol=0, atol=0.1)


def test_rigid_rotation_about_the_force_changes_nothing():
    """Turned about the force itself the shear force stays, to rounding: no slip is along it."""
    force, _ = rotated_force(across, lambda n: 50.0 * across(n), pi, 1500)
    assert_allclose(force @ across(np.array([2.0, -1.0, 2.0]) / 3.0), 50.0, rtol=1e-13)
    assert_allclose(np.linalg.norm(force), 50.0, rtol=1e-13)
