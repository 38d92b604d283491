"""The steps of docs/theory/second_order_work.md: what is exact, what needs an assumption, and how large what is left out is."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rendulic as rd
from rendulic.dem.measure.energy import kinetic_energy, whole_step_kinetic_energy
from rendulic.micro import love_weber_stress
from rendulic.tensors.rendulic_plane import increment_along

K, R = 1e8, 0.01


def along_the_way(sample, drive, n_steps):
    """Gain of kinetic energy of translation in J, and what the balance says that it is.

    `first_order` is the work of the forces at the start, `boundary` and `contacts` that of their growth along the way, `b2` and `w2`
    the products of whole increments. The work of all contacts is that of all bodies, with the other sign.
    """
    start = before = sample.snapshot()
    n, kinetic = start.n_grains, whole_step_kinetic_energy(sample)
    boundary = contacts = 0.0
    for _ in range(n_steps):
        sample.advance(1, drive)
        now = sample.snapshot()
        moved = now.body_position - before.body_position
        grown = 0.5 * (before.resultant + now.resultant) - start.resultant
        boundary -= (grown[n:] * moved[n:]).sum()
        contacts -= (grown * moved).sum()
        before = now
    work = rd.second_order_work(start, now)
    return SimpleNamespace(
        gain=whole_step_kinetic_energy(sample) - kinetic, boundary=boundary, contacts=contacts,
        first_order=(start.resultant[:n] * (now.position - start.position)).sum(),
        b2=work.boundary * start.volume, w2=work.contacts * start.volume,
    )  # fmt: skip


def row_of(n_grains, overlap=1e-5, velocity=None):
    """Equal grains in a row along axis 1, at rest between its walls and free along the others; all springs are equal."""
    length = 2.0 * R * n_grains - overlap * (n_grains + 1)
    position = [[R - overlap + k * (2.0 * R - overlap), 0.5, 0.5] for k in range(n_grains)]
    return rd.dem.Assembly(
        position, [R] * n_grains, [0.0, length, 0.0, 1.0, 0.0, 1.0], law=rd.dem.LinearFrictional(K), damping=0.0,
        time_step_fraction=0.002, velocity=velocity,
    )  # fmt: skip


def test_kinetic_energy_comes_from_forces_that_grow_along_the_way(sheared, straining):
    """Exact for any motion, at rest at the start or not; of translation only: rotation has moments for its source."""
    sheared.damping = 0.0
    found = along_the_way(sheared, straining([5.0, -2.5, -2.5]), 60)
    assert found.boundary - found.contacts + found.first_order == pytest.approx(found.gain, rel=1e-9)
    assert kinetic_energy(sheared)[1] > 0.01 * found.gain, "rotation should take a part that this balance does not hold"
    # half the product of whole increments is something else
    assert abs(0.5 * (found.b2 - found.w2) / found.gain - 1.0) > 0.05


def test_half_the_product_is_right_where_all_increments_grow_in_proportion(straining):
    """A grain between fixed walls is given a velocity: all forces grow with its way, by any law of time."""
    sample = row_of(1, velocity=[[1e-3, 0.0, 0.0]])
    found = along_the_way(sample, straining(), 150)
    assert found.b2 == 0.0
    assert -0.5 * found.w2 == pytest.approx(found.gain, rel=1e-7)


def test_from_rest_under_walls_that_move_evenly_half_the_product_is_a_third_too_small(straining):
    """The way of a grain grows with the cube of time, its velocity with the square.

    With `a = k v / m`: way `a t^3 / 6`, kinetic energy `m (a t^2 / 2)^2 / 2`, `B2 - W2 = k v t . a t^3 / 6`; hence `E = 3/2 (B2 - W2) / 2`.
    The next terms are of order `k t^2 / m`, here 0.01.
    """
    sample = row_of(2)
    omega = np.sqrt(2.0 * K * R / sample.grains.mass[0])
    n_steps = round(0.1 / (omega * sample.time_step))
    found = along_the_way(sample, straining([1e-3, 0.0, 0.0]), n_steps)
    assert n_steps > 20
    assert found.boundary - found.contacts == pytest.approx(found.gain, rel=1e-6)
    # steps of 1/20 to 1/50 of the way leave an error of their square
    assert found.gain / (0.5 * (found.b2 - found.w2)) == pytest.approx(1.5, rel=0.02)


def test_a_rigid_rotation_has_second_order_work(sheared):
    """All forces and branches of a stressed packing turned by `theta`: `-V (tr(sigma) |theta|^2 - theta . sigma . theta)`.

    So W2 is not objective: walls must not turn. The next terms are smaller by the square of the angle.
    """
    here = sheared.snapshot()
    theta = 1e-3 * np.array([0.3, -0.8, 0.5])
    angle = np.linalg.norm(theta)
    cross = np.array([[0, -theta[2], theta[1]], [theta[2], 0, -theta[0]], [-theta[1], theta[0], 0]]) / angle
    turn = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    d_force, d_branch = here.force @ (turn - np.eye(3)).T, here.branch @ (turn - np.eye(3)).T
    work = -(d_force * d_branch).sum()  # the branch of a snapshot points from the first body to the second
    sigma = love_weber_stress(here)
    expected = -here.volume * (np.trace(sigma) * angle**2 - theta @ sigma @ theta)
    assert work == pytest.approx(expected, rel=1e-6)
    assert work < 0.0


@pytest.mark.parametrize("alpha", [20.0, 125.0, 250.0])
def test_both_forms_differ_by_the_change_of_the_areas(sheared, alpha):
    """`w2_lagr - w2_eul = -sum_i sigma_i (d_eps_j + d_eps_k) d_eps_i`, up to terms of third order; walls move alike."""
    before = sheared.snapshot()
    sheared.probe(increment_along(alpha, 1e-5), 500)
    work = rd.second_order_work(before, sheared.snapshot())
    sigma, d_eps = np.diag(before.wall_stress), work.d_eps
    expected = -(sigma * (d_eps.sum() - d_eps) * d_eps).sum()
    # next: the change of stress times that of the areas, and times the difference of both measures of strain
    third = np.abs(work.d_sigma * d_eps).sum() * np.abs(d_eps).sum()
    assert third < 0.02 * abs(expected)
    assert_allclose(work.lagrangian - work.eulerian, expected, rtol=0, atol=third)
    assert_allclose(work.lagrangian, work.boundary, rtol=1e-9)
