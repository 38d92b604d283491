"""A contact law of the user's own: a small dataclass with the members of `ContactLaw`."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rendulic as rd
from naive import different_arrays
from rendulic.foundation.errors import InvalidInput

BOX = [0.0, 1.0] * 3


def hertz_stiffness(radius_1, radius_2, parameters):
    """`4/3 E* sqrt(R*)`, in N/m^1.5: the factor of Hertz's force; the tangential spring is linear."""
    return 4.0 / 3.0 * parameters[0] * (radius_1 * radius_2 / (radius_1 + radius_2)) ** 0.5, parameters[1]


def hertz_wall(radius, parameters):
    """A linear wall."""
    return parameters[1]


def hertz_force(overlap, k_n, k_t, force_x, force_y, force_z, slip_x, slip_y, slip_z, parameters):
    """Hertz's normal force; tangential spring without a limit."""
    return k_n * overlap**1.5, force_x - k_t * slip_x, force_y - k_t * slip_y, force_z - k_t * slip_z, 0.0


def hertz_energy(force_n, force_t, k_n, k_t):
    """`2/5 f u` of Hertz, and the tangential spring's."""
    return 0.4 * force_n * (force_n / k_n) ** (2.0 / 3.0) + 0.5 * force_t * force_t / k_t


@dataclass(frozen=True)
class Hertz:
    """Hertz's contact without friction limit."""

    modulus: float = 7e8
    tangential: float = 1e5
    friction: float = 1e9

    @property
    def parameters(self):
        return (self.modulus, self.tangential)

    stiffness = staticmethod(hertz_stiffness)
    wall_stiffness = staticmethod(hertz_wall)
    contact_force = staticmethod(hertz_force)
    elastic_energy = staticmethod(hertz_energy)


def pair(overlap, law, **options):
    return rd.dem.Assembly([[0.5, 0.5, 0.5], [0.53 - overlap, 0.5, 0.5]], [0.01, 0.02], BOX, law=law, **options)


@pytest.mark.parametrize("overlap", [1e-6, 1e-5, 1e-4])
def test_two_sphere_force_is_the_users(overlap):
    """`f = 4/3 E* sqrt(R*) u^1.5` through compiled kernels; coordinates of 0.5 m leave 1e-10 of the overlap."""
    expected = 4.0 / 3.0 * 7e8 * np.sqrt(0.01 * 0.02 / 0.03) * overlap**1.5
    snapshot = pair(overlap, Hertz()).snapshot()
    assert_allclose(snapshot.force_n, expected, rtol=3e-10)
    assert_allclose(pair(overlap, Hertz(modulus=1.4e9)).snapshot().force_n, 2 * expected, rtol=3e-10)


@dataclass(frozen=True)
class PlainHertz(Hertz):
    """The same with a function of plain numbers, as the protocol asks for."""

    @staticmethod
    def stiffness(radius_1, radius_2, parameters):
        """Hertz's factor with the square root of the standard library."""
        return 4.0 / 3.0 * parameters[0] * sqrt(radius_1 * radius_2 / (radius_1 + radius_2)), parameters[1]


def test_functions_of_plain_numbers_are_enough():
    """`ContactLaw` promises that functions of plain numbers will do; math.sqrt is one."""
    assert_allclose(pair(1e-5, PlainHertz()).snapshot().force_n, pair(1e-5, Hertz()).snapshot().force_n)


def test_it_steps_and_keeps_energy(straining):
    """A head-on collision under Hertz's law gives the velocity back, within 1e-6 at this step."""
    sample = pair(-1e-6, Hertz(), damping=0.0)
    sample.time_step /= 10
    sample.grains.velocity[0, 0] = 0.4
    kinetic = sample.energies()["kinetic"]
    touched, most = 0, 0.0
    for _ in range(1200):
        sample.advance(2, straining())
        touched += sample.n_contacts
        most = max(most, sample.energies()["elastic"] / kinetic)
    mass = sample.grains.mass
    share = mass[1] / mass.sum()  # of the kinetic energy that a head-on collision can store
    assert touched > 50
    # the turn is seen to a step of a thousandth of the contact's life: the energy there to the square of it
    assert_allclose(most, share, rtol=1e-4)
    assert_allclose(sample.energies()["kinetic"], kinetic, rtol=1e-6)
    assert_allclose(sample.grains.velocity[1, 0] - sample.grains.velocity[0, 0], 0.4, rtol=1e-6)


def test_it_saves_and_restores(tmp_path, straining):
    """The state names the law and wants it handed over; then it continues to the bit."""
    law = Hertz(modulus=9e8)
    sample = pair(1e-5, law)
    sample.advance(5, straining())
    state = rd.State.from_file(sample.save().to_file(tmp_path / "hertz.h5"))
    with pytest.raises(InvalidInput, match="saved with the contact law 'Hertz': pass that law"):
        rd.dem.Assembly.from_state(state)
    with pytest.raises(InvalidInput, match="'Hertz'"):
        rd.dem.Assembly.from_state(state, law=rd.dem.LinearFrictional())
    twin = rd.dem.Assembly.from_state(state, law=law)
    assert twin.law is law
    for one in (sample, twin, sample.clone()):
        one.advance(20, straining())
    assert different_arrays(sample.save(), twin.save()) == []


def test_a_law_with_other_numbers_is_not_the_saved_one(straining):
    """The state carries the law's fields; a law that differs in them continues another specimen."""
    state = pair(1e-5, Hertz(modulus=9e8)).save()
    with pytest.raises(InvalidInput, match="modulus"):
        rd.dem.Assembly.from_state(state, law=Hertz(modulus=1e8))


def test_two_laws_live_side_by_side(straining):
    """Kernels compiled for one law are not those of another; a thousandth of a step, f dt^2 / m, changes forces by 1e-6 or so."""
    for _ in range(2):
        hertz, linear = pair(1e-5, Hertz()), pair(1e-5, rd.dem.LinearFrictional())
        for sample in (hertz, linear):
            sample.time_step *= 1e-3
            sample.advance(1, straining())
        assert_allclose(linear.snapshot().force_n, 356e6 * 0.03 * 1e-5, rtol=1e-5)
        assert_allclose(hertz.snapshot().force_n, 4 / 3 * 7e8 * np.sqrt(0.02 / 3) * 1e-5**1.5, rtol=1e-5)


def amplified(factor):
    """A law whose force function captures a number."""

    def force(overlap, k_n, k_t, force_x, force_y, force_z, slip_x, slip_y, slip_z, parameters):
        return factor * k_n * overlap, force_x, force_y, force_z, 0.0

    @dataclass(frozen=True)
    class Amplified(Hertz):
        contact_force = staticmethod(force)

    return Amplified()


@pytest.mark.long
@pytest.mark.versions
def test_captured_numbers_are_those_of_the_law():
    """Two laws of one source that captured different numbers give different forces, or are refused."""
    forces = [pair(1e-5, amplified(factor)).snapshot().force_n[0] for factor in (1.0, 2.0)]
    assert_allclose(forces[1], 2 * forces[0], rtol=1e-12)


def test_a_users_law_gets_lanes():
    """Probes of an assembly with a user's law advance together, and as one by one; open pairs spoil nothing."""
    from rendulic.dem.drive.lanes import Lanes
    from rendulic.dem.drive.servo import drive_for, hold

    # the second pair is a candidate that does not touch: the law would be asked for a negative overlap to 1.5
    position = [[0.5, 0.5, 0.5], [0.5299, 0.5, 0.5], [0.5, 0.5302, 0.5]]
    sample = rd.dem.Assembly(position, [0.01, 0.02, 0.02], BOX, law=Hertz())
    rates = np.array([[0.5, 0.0, 0.0], [-0.5, 2.0, 0.0], [0.0, 5.0, 5.0]])
    lanes = Lanes(sample, rates, 4)
    lanes.advance(50)
    for lane, rate in enumerate(rates):
        one = sample.clone()
        one.advance(50, drive_for(one, hold("strain"), (None,) * 3, rate, 0.1))
        assert_allclose(lanes.assembly(lane).grains.position, one.grains.position, rtol=1e-13)
        assert np.isfinite(lanes.assembly(lane).grains.force).all()
