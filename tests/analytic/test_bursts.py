"""Bursts: what settles, what fails, the balance of energy, Eq. 1, and loss of controllability in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rendulic as rd
from rendulic.dem.measure.energy import damping_forces, whole_step_kinetic_energy
from rendulic.foundation.errors import InvalidInput
from rendulic.probing.burst import agreement, distance_to_edge
from rendulic.tensors.rendulic_plane import increment_along


def eq_1(sample, drive, n_steps):
    """Change of kinetic energy over a window, and the right-hand side of Eq. 1 with the first-order work."""
    before, energy = sample.snapshot(), whole_step_kinetic_energy(sample)
    sample.advance(n_steps, drive)
    after = sample.snapshot()
    work = rd.second_order_work(before, after)
    first = (before.resultant[: len(sample)] * (after.position - before.position)).sum()
    right = first + 0.5 * (work.boundary - work.contacts) * before.volume
    return whole_step_kinetic_energy(sample) - energy, right


def test_eq_1_is_exact_over_one_step(sheared, straining):
    """Over one step without damping the change of kinetic energy is that of Eq. 1, to rounding."""
    sheared.damping = 0.0
    drive = straining((3.0, -1.0, -1.0))
    kinetic, right = np.array([eq_1(sheared, drive, 1) for _ in range(40)]).T
    assert np.abs(kinetic - right).max() < 1e-11 * np.abs(kinetic).max()


def test_eq_1_is_of_third_order_in_the_window(sheared, straining):
    """From rest, the change of kinetic energy over a window T is (B2 - W2)/2, with an error of order T^3.

    At rest the work of first order vanishes. The motion starts with a jump of the walls' velocity, which
    resultants on the grains follow linearly; the time step is small, so that windows are many steps.
    """
    state = sheared.save()
    sheared.damping = 0.0
    drive = straining((3.0, -1.0, -1.0))
    errors, kinetic = [], []
    for n_steps in (40, 80, 160):
        sheared.restore(state)
        sheared.damping = 0.0
        sheared.grains.velocity[:] = 0.0
        sheared.grains.angular_velocity[:] = 0.0
        sheared.time_step = state.attributes["time_step"] / 400
        sheared.advance(400, drive)  # forces have begun to grow
        energy, right = eq_1(sheared, drive, n_steps)
        errors.append(abs(energy - right))
        kinetic.append(abs(energy))
    slopes = np.diff(np.log(errors)) / np.log(2.0)
    assert_allclose(slopes, 3.0, atol=0.25)
    assert errors[-1] < 0.05 * kinetic[-1]


def test_damping_is_accounted_for(sheared, straining):
    """With damping, the work that it takes closes Eq. 1 over one step just as well."""
    sheared.damping = 0.3
    drive = straining((3.0, -1.0, -1.0))
    sheared.advance(50, drive)
    taken, position = damping_forces(sheared), sheared.grains.position.copy()
    kinetic, right = eq_1(sheared, drive, 1)
    lost = 0.5 * ((sheared.grains.position - position) * (taken + damping_forces(sheared))).sum()
    assert lost > 1e-3 * abs(right)
    assert abs(kinetic + lost - right) < 1e-11 * max(abs(kinetic), abs(right))


@pytest.mark.parametrize("disturbance", ["push", "kick"])
def test_a_stable_state_settles(dense_state, disturbance):
    """A dense packing under isotropic pressure: it comes back, and the energies balance to 1e-6 of the work.

    After a kick the walls do next to nothing; its own energy, 1e-7 of what is stored, is the measure, and the
    bumping of loose grains is seen.
    """
    sample = rd.dem.Assembly.from_state(dense_state)
    curve = rd.burst(sample, 60.0, 1e-5, 2000, disturbance=disturbance, kick=1e-7)
    assert curve.attrs["verdict"] == "settles"
    assert abs(curve.attrs["travelled"]) < 1e-2  # of the push, when all of it has been taken back
    assert curve.attrs["balance_error"] < (1e-6 if disturbance == "push" else 1e-5)
    assert curve.attrs["equation_1_residual"] < 1e-8
    # the load is back where it was, as near as what is left of the motion lets the servo hold it
    assert float(curve["load"][-1]) == pytest.approx(float(curve["load"][0]), abs=1e-6 * sample.pressure)
    # the specimen given was left alone
    assert sample.save().checksum == dense_state.checksum


@pytest.fixture(scope="module")
def sand():
    """Loose Hostun sand, drained, inside its unstable range."""
    point = rd.ChangHicher.preset("hostun_loose").at(300e3, 0.9)
    point.load(rd.paths.drained_triaxial(until_eta=1.0))
    return point


def test_controllability_is_lost_in_the_cone(sand):
    """On the model, failing directions are those of the closed-form cone: its edges to 0.01 degrees."""
    ((first, last),) = rd.chang_hicher.closed_form_cone(sand)
    found = [
        (alpha, rd.burst(sand, alpha, 1e-10).attrs["verdict"])
        for edge in (first, last)
        for alpha in (edge - 0.01, edge + 0.01)
    ]
    assert [verdict for _, verdict in found] == ["settles", "fails", "fails", "settles"]


def test_prediction_and_observation_on_the_model(sand):
    """All directions half a degree from the edges agree, at a stable and at an unstable state; R = 1 is isochoric."""
    around = rd.directions.rendulic(step=5)
    table = rd.bursts(sand, around, 1e-6, 1)
    agreeing, counted = agreement(table, margin=0.5)
    assert agreeing == counted >= 60
    assert 3 < int(table.observed.sum()) < 10
    # d_eps_1 = sin(alpha), sqrt(2) d_eps_3 = cos(alpha), and R = -d_eps_1 / (2 d_eps_3)
    assert float(table.ratio.sel(alpha=125)) == pytest.approx(-np.tan(np.radians(125.0)) / np.sqrt(2.0), rel=1e-12)
    virgin = rd.ChangHicher.preset("hostun_loose").at(300e3, 0.9)
    calm = rd.bursts(virgin, around, 1e-6, 1)
    assert not calm.observed.any()
    assert agreement(calm) == (72, 72)


def test_three_dimensional_directions(sand):
    """A direction may be three principal strains of any length; off the Rendulic plane it has no R."""
    u = increment_along(130.0, 1.0)
    assert rd.burst(sand, 7.0 * u, 1e-6).attrs["verdict"] == "fails"
    other = rd.burst(sand, [1.0, -1.0, 0.0], 1e-6)
    assert "ratio" not in other.attrs


def test_distance_to_edges_wraps_around():
    """An edge between 350 and 10 degrees is near to both."""
    alpha, w2n = np.arange(10.0, 370.0, 20.0), np.ones(18)
    w2n[-1] = -1.0
    apart = distance_to_edge(alpha, w2n)
    assert_allclose(apart[[0, -1, -2]], 10.0)
    assert apart.max() <= 180.0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"alpha": [0.0, 0.0, 0.0]}, "must not be zero"),
        ({"alpha": [1.0, 2.0]}, "alpha"),
        ({"alpha": 90.0, "norm": -1.0}, "norm"),
        ({"alpha": 90.0, "disturbance": "shove"}, "disturbance 'shove'"),
        ({"alpha": 90.0, "kick": 0.0}, "kick"),
        ({"alpha": 90.0, "n_steps": 0}, "n_steps"),
    ],
)
def test_bursts_refuse(packed, arguments, words):
    """Before anything is computed, in one sentence."""
    with pytest.raises(InvalidInput, match=words):
        rd.burst(packed, **arguments)


def test_a_specimen_that_cannot_burst():
    """The missing method is named."""
    with pytest.raises(InvalidInput, match="method 'burst'"):
        rd.burst(object(), 90.0)
