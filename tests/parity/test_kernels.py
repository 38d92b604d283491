"""Compiled kernels equal their readable definition, and themselves without the compiler."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose

import naive
import rendulic as rd
from rendulic.dem.kernels.compiled import kernels_for
from rendulic.dem.kernels.layout import SPENT

MODULUS, RATIO = 3e7, 0.42


def agitated(seed, rule, friction, n=45):
    """A small overlapping crowd between walls with random velocities, spins and shear forces."""
    rng = np.random.default_rng(seed)
    side = 0.06
    radius = rng.uniform(0.005, 0.012, n)
    position = []
    while len(position) < n:
        r = radius[len(position)]
        trial = rng.uniform(0.93 * r, side - 0.93 * r, 3)
        if all(np.linalg.norm(trial - p) > 0.85 * (r + s) for p, s in zip(position, radius, strict=False)):
            position.append(trial)
        elif rng.random() < 1e-3:
            radius[len(position)] *= 0.7
    law = rd.dem.LinearFrictional(MODULUS, RATIO, friction, rule)
    sample = rd.dem.Assembly(
        np.array(position), radius, [0, side] * 3, law=law, damping=0.3,
        velocity=0.5 * rng.standard_normal((n, 3)), angular_velocity=50 * rng.standard_normal((n, 3)),
    )  # fmt: skip
    closed = sample.contacts.force_n > 0
    sample.contacts.force_t[closed] = 30.0 * rng.standard_normal((closed.sum(), 3))
    return sample


def tangential(sample):
    """Tangential forces of the closed contacts by pair."""
    rows = zip(sample.contacts.first.tolist(), sample.contacts.second.tolist(), sample.contacts.force, strict=True)
    return {(i, j): held[1:].copy() for i, j, held in rows if held[0] > 0}


def assert_forces_equal(sample, expected):
    force, torque, contacts, walls = expected
    size = max(f_n for f_n, _ in contacts.values())
    # overlaps are a hundredth of coordinates: eps times 100, and sums of a dozen terms
    close = {"rtol": 0, "atol": 1e-13 * size}
    assert set(tangential(sample)) == set(contacts)
    for i, j, held in zip(
        sample.contacts.first.tolist(), sample.contacts.second.tolist(), sample.contacts.force, strict=True
    ):
        f_n, f_t = contacts.get((i, j), (0.0, np.zeros(3)))
        assert_allclose(held, [f_n, *f_t], **close, err_msg=f"contact {i}, {j}")
    assert_allclose(sample.grains.force, force, rtol=0, atol=1e-12 * size)
    assert_allclose(sample.grains.torque, torque, rtol=0, atol=1e-12 * size * sample.grains.radius.max())
    assert_allclose(sample.walls.force, walls, rtol=0, atol=1e-12 * size)


@pytest.mark.parametrize("rule", ["mean_diameter", "harmonic"])
@pytest.mark.parametrize("friction", [0.0, 0.3, 1e6])
@pytest.mark.parametrize("seed", range(4))
def test_contact_forces_are_those_of_the_theory(rule, friction, seed):
    """Forces, torques and wall forces of a crowd in wild motion equal the vector form of section 2."""
    sample = agitated(seed, rule, friction)
    dt = sample.time_step
    expected = naive.forces(sample, dt, tangential(sample))
    kernels = kernels_for(sample.law)
    sample.grains.force[:] = 0.0
    sample.grains.torque[:] = 0.0
    kernels.contact_forces(sample.grains, sample.contacts, dt, sample.law.parameters, sample.spent)
    kernels.wall_forces(sample.grains, sample.walls, sample.wall_contacts, sample.law.parameters)
    assert len(expected[2]) > 40
    assert np.count_nonzero(expected[3]) >= 4
    assert_forces_equal(sample, expected)


def naive_step(sample, old, walls, rates, dt, damping):
    """One leapfrog step in NumPy: grains, walls, forces; returns what `naive.forces` returns."""
    grains = sample.grains
    grains.velocity[:] += (
        dt * naive.damped(grains.force, grains.velocity, grains.mass[:, None], dt, damping) / grains.mass[:, None]
    )
    spin, inertia = grains.angular_velocity, grains.inertia[:, None]
    spin[:] += dt * naive.damped(grains.torque, spin, inertia, dt, damping) / inertia
    grains.position[:] += dt * grains.velocity
    middle, half = 0.5 * (walls[1::2] + walls[0::2]), 0.5 * (walls[1::2] - walls[0::2]) * np.exp(-np.array(rates) * dt)
    walls[0::2], walls[1::2] = middle - half, middle + half
    sample.walls.position[:] = walls
    found = naive.forces(sample, dt, old)
    grains.force[:], grains.torque[:] = found[0], found[1]
    return found


@pytest.mark.parametrize("damping", [0.0, 0.3])
def test_steps_are_leapfrog_with_damping(straining, damping):
    """Thirty steps with moving walls equal the readable leapfrog with Cundall's damping.

    To 1e-11 of the motion: rounding differs by the order of sums and grows in collisions.
    """
    rates = (3.0, -2.0, 0.5)
    sample, reference = agitated(0, "harmonic", 0.3), agitated(0, "harmonic", 0.3)
    start = sample.grains.position.copy()
    old, walls = tangential(reference), reference.walls.position.copy()
    for _ in range(30):
        found = naive_step(reference, old, walls, rates, sample.time_step, damping)
        old = {pair: f_t for pair, (_, f_t) in found[2].items()}
    sample.advance(30, straining(rates), damping)
    moved = np.abs(sample.grains.position - start).max()
    assert moved > 1e-4
    assert_allclose(sample.grains.position, reference.grains.position, rtol=0, atol=1e-11 * moved)
    assert_allclose(sample.walls.position, walls, rtol=0, atol=1e-15)
    assert_allclose(sample.grains.velocity, reference.grains.velocity, rtol=0, atol=1e-10)
    assert_allclose(sample.grains.angular_velocity, reference.grains.angular_velocity, rtol=0, atol=1e-8)
    assert sample.spent[SPENT.boundary] != 0.0


SCRIPT = """
import sys
import numba
import numpy as np
import rendulic as rd
from rendulic.dem.kernels.arrays import Drive
from rendulic.dem.kernels.insertion import insert_spheres
from rendulic.dem.state.neighbours import find_contacts

expected, state, out = sys.argv[1:]
assert numba.config.DISABLE_JIT == int(expected)
sample = rd.dem.Assembly.from_state(rd.State.from_file(state))
no = np.zeros(3)
stress = Drive(np.eye(3), np.eye(3), np.array([False, True, True]), np.array([5.0, 0, 0]),
               np.array([0, 2e5, 2e5]), no.copy(), np.array([1.0]))
sample.advance(8, stress, 0.3)
sample.margin *= 0.9
sample.contacts, sample.wall_contacts = find_contacts(sample.grains, sample.walls, sample.contacts, sample.margin)
sample.advance(4, stress, 0.0)
placed, count = insert_spheres(np.linspace(0.2, 0.05, 15), 1.0, 4, 1000)
np.savez(out, row=sample.grains.row, walls=sample.walls.position, force=sample.contacts.force,
         first=sample.contacts.first, second=sample.contacts.second, spent=sample.spent, placed=placed)
"""


def test_kernels_without_the_compiler(sheared_state, tmp_path):
    """Steps, servo, lists and insertion as plain Python give what the compiled code gives.

    Compiled code may fuse multiplications with additions. A force is a stiffness times a difference of
    coordinates, so 7e6 N/m x 0.1 m x 1e-16 is 1e-12 of the largest force; the servo and a dozen
    steps amplify that, up to a hundred times. Positions are held to 1e-14.
    """
    state = sheared_state.to_file(tmp_path / "state.h5")
    results = []
    for disabled in ("0", "1"):
        out = tmp_path / f"out_{disabled}.npz"
        environment = os.environ | {"NUMBA_DISABLE_JIT": disabled}
        subprocess.run([sys.executable, "-c", SCRIPT, disabled, state, out], env=environment, check=True, timeout=300)
        with np.load(out) as archive:
            results.append({name: archive[name] for name in archive.files})
    compiled, plain = results
    for name in ("first", "second"):
        np.testing.assert_array_equal(plain[name], compiled[name])
    assert_allclose(plain["placed"], compiled["placed"], rtol=0, atol=4e-16)
    for name in ("row", "force"):
        scale = np.abs(compiled[name]).max(axis=0)
        assert scale.min() > 0
        assert (np.abs(plain[name] - compiled[name]) / scale).max() < 1e-10, name
    assert_allclose(plain["row"][:, :3], compiled["row"][:, :3], rtol=1e-14)
    assert_allclose(plain["walls"], compiled["walls"], rtol=1e-14)
    assert_allclose(plain["spent"], compiled["spent"], rtol=1e-12)


@pytest.mark.parametrize(
    "stresses", [np.eye(3), [[1, -0.5, -0.5], [1 / 3] * 3, [0, 1, -1]]], ids=["identity", "p and q"]
)
def test_kernels_get_arrays_in_c_order_only(sheared_state, stresses):
    """One memory layout, one compiled signature: a transposed basis once reached code compiled for the other order."""
    from rendulic.dem.drive.servo import drive_for

    sample = rd.dem.Assembly.from_state(sheared_state)
    control = rd.Control.of_stresses(stresses, ("strain", "stress", "stress"))
    drive = drive_for(sample, control, (None,) * 3, np.zeros(3), 1.0)
    for group in (drive, sample.grains, sample.contacts, sample.walls, sample.wall_contacts):
        for name, array in group._asdict().items():
            assert array.flags.c_contiguous, f"{type(group).__name__}.{name}"
