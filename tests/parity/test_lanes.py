"""Probes in lanes are the probes of the scalar stepper, to the bit, and no lane sees its neighbours."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import rendulic as rd
from rendulic.dem.drive.lanes import Lanes, batches, probe_in_lanes
from rendulic.dem.drive.loading import probe_alone
from rendulic.dem.drive.servo import drive_for, hold
from rendulic.dem.state.neighbours import find_contacts
from rendulic.foundation.errors import UnstableTimeStep

RATES = np.array(
    [
        [0.3, 0.0, 0.0],
        [-0.3, 0.2, 0.1],
        [0.0, 0.0, 0.0],
        [0.1, -0.2, -0.2],
        [-0.1, -0.1, 0.3],
        [0.0, 0.4, 0.0],
        [0.2] * 3,
    ]
)


def scalar_after(state, rate, n_steps):
    """The scalar stepper's answer."""
    one = rd.dem.Assembly.from_state(state)
    one.advance(n_steps, drive_for(one, hold("strain"), (None,) * 3, rate, 0.1))
    return one


@pytest.mark.parametrize("width", [8, 4])
@pytest.mark.parametrize("name", ["packed_state", "sheared_state", "dense_state"])
def test_every_lane_is_the_scalar_stepper(request, name, width):
    """Positions, velocities, forces and walls after 200 steps, loading and unloading, opening and sliding contacts."""
    state = request.getfixturevalue(name)
    lanes = Lanes(rd.dem.Assembly.from_state(state), RATES[:width], width)
    lanes.advance(200)
    for lane in range(lanes.n_used):
        one, other = scalar_after(state, RATES[lane], 200), lanes.assembly(lane)
        for own, alone in ((other.grains.row, one.grains.row), (other.stress, one.stress)):
            assert_array_equal(own, alone)
        assert_array_equal(other.walls.position, one.walls.position)
        assert other.n_contacts == one.n_contacts
        assert (other.n_steps, other.time) == (one.n_steps, pytest.approx(one.time, rel=1e-12))


def test_contacts_open_close_and_slide_in_these_tests(sheared_state):
    """The states that the parity test compares go through what it claims."""
    before, after = rd.dem.Assembly.from_state(sheared_state), scalar_after(sheared_state, RATES[0], 200)
    pairs = [{*zip(s.first.tolist(), s.second.tolist(), strict=True)} for s in (before.snapshot(), after.snapshot())]
    assert pairs[0] - pairs[1]
    assert pairs[1] - pairs[0]
    shot = after.snapshot()
    assert (np.linalg.norm(shot.force_t, axis=1) > 0.999 * shot.friction * shot.force_n).sum() > 5


def test_a_lane_does_not_see_its_neighbours(sheared_state):
    """The same rate in another lane, beside other rates: the same to the bit."""
    base = rd.dem.Assembly.from_state(sheared_state)
    one, other = Lanes(base, RATES, 8), Lanes(base, RATES[::-1], 8)
    for lanes in (one, other):
        lanes.advance(300)
    a, b = one.assembly(1), other.assembly(len(RATES) - 2)
    assert_array_equal(a.grains.row, b.grains.row)
    assert_array_equal(a.walls.force, b.walls.force)


def test_the_width_changes_nothing(sheared_state):
    """Four lanes to a row or eight: the same to the bit, as no sum runs over lanes and nothing is contracted."""
    base = rd.dem.Assembly.from_state(sheared_state)
    narrow, wide = Lanes(base, RATES[:4], 4), Lanes(base, RATES, 8)
    for lanes in (narrow, wide):
        lanes.advance(300)
    for lane in range(4):
        assert_array_equal(narrow.assembly(lane).grains.row, wide.assembly(lane).grains.row)


def test_lanes_find_new_pairs_when_they_have_to(sheared_state):
    """With a margin that is soon used up, pairs are found anew, and the answer is the scalar stepper's."""
    base = rd.dem.Assembly.from_state(sheared_state)
    base.margin = 1e-5
    base.contacts, base.wall_contacts = find_contacts(base.grains, base.walls, base.contacts, base.margin)
    narrow = base.save()
    fast = 10 * RATES
    lanes = Lanes(base, fast, 8)
    lanes.advance(200)
    assert lanes.n_rebuilds > 0
    for lane in (0, 1):
        one, other = scalar_after(narrow, fast[lane], 200), lanes.assembly(lane)
        assert_array_equal(other.grains.row, one.grains.row)
        assert other.n_contacts == one.n_contacts


def test_a_lane_goes_on_as_an_assembly(sheared_state):
    """What is taken out of a lane is whole: stepping on with it is stepping on in the lane."""
    base = rd.dem.Assembly.from_state(sheared_state)
    lanes = Lanes(base, RATES, 8)
    lanes.advance(100)
    out = lanes.assembly(0)
    out.advance(100, drive_for(out, hold("strain"), (None,) * 3, RATES[0], 0.1))
    lanes.advance(100)
    assert_array_equal(out.grains.row, lanes.assembly(0).grains.row)


def test_marks_and_workers_do_not_change_a_probe(sheared):
    """Reading on the way, more workers and other directions beside change no bit of a probe."""
    around = rd.directions.rendulic(step=60)
    one = rd.probe(sheared, around, norm=[1e-5, 3e-5], rate=1e-5 / 60, settle=False, workers=1)
    two = rd.probe(sheared, around, norm=[1e-5, 3e-5], rate=1e-5 / 60, settle=False, workers=3)
    alone = rd.probe(sheared, rd.directions.axisymmetric([120.0]), norm=[1e-5, 3e-5], rate=1e-5 / 60, settle=False)
    for name in one.data_vars:
        assert_array_equal(one[name].values, two[name].values)
    assert_array_equal(alone.d_sigma.values[:, 0], one.d_sigma.sel(alpha=120.0).values)


@pytest.mark.parametrize("settling_steps", [0, 1500])
def test_probes_in_lanes_are_probes_one_by_one(sheared, settling_steps):
    """Probes of a sweep in lanes, and each alone with the scalar stepper: read while moving, and with walls held.

    Some of them come to rest within the steps that are allowed and others do not, and rattlers are stopped on the way.
    """
    increments = np.concatenate((np.zeros((1, 3)), rd.directions.rendulic(step=45).increments(5e-5)))
    sheared.damping = 0.3

    def read(now, way):
        return now.grains.row.copy(), now.stress, way

    marks = (0.4, 1.0)
    together = probe_in_lanes(sheared, increments, 200, marks, settling_steps, read, 2, lambda _more: None)
    ways = []
    for increment, in_lanes in zip(increments, together, strict=True):
        alone = probe_alone(sheared, increment, 200, "strain", marks, settling_steps, read, 0.1)
        for one, other in zip(in_lanes, alone, strict=True):
            assert_array_equal(one[0], other[0])
            assert_array_equal(one[1], other[1])
            assert one[2] == other[2]
            ways.append(one[2])
    assert len({way.settling_steps for way in ways}) > (3 if settling_steps else 0)


def test_a_norm_gives_the_same_alone_and_in_a_sweep(sheared):
    """The rate is the same for every norm, and what is held before it is read is a copy: to the rounding of the strain."""
    around = rd.directions.rendulic(step=90)
    alone = rd.probe(sheared, around, norm=2e-5, rate=1e-6)
    sweep = rd.probe(sheared, around, norm=[2e-5, 4e-5], rate=1e-6).sel(norm=2e-5)
    for name in ("d_sigma", "w2_macro", "settling_steps"):
        np.testing.assert_allclose(alone[name], sweep[name], rtol=1e-6, err_msg=name)


def test_divergence_is_told(packed):
    """A lane that diverges ends in an error, not in numbers."""
    packed.grains.velocity[:] = 1e4
    with pytest.raises(UnstableTimeStep):
        Lanes(packed, RATES, 8).advance(2000)


def test_the_plan_of_batches_holds_all():
    """Batches follow each other without a gap and are as even as can be, whatever the numbers."""
    for count in range(1, 40):
        for workers in (1, 2, 3, 64):
            plan = batches(count, workers)
            assert [lane for batch in plan for lane in batch] == list(range(count))
            assert max(len(batch) for batch in plan) <= 8
            assert len(plan) <= workers + count // 8


def test_without_the_compiler():
    """The kernels are plain Python: a small packing in lanes with the compiler off."""
    code = (
        "import numpy as np, rendulic as rd\n"
        "from rendulic.dem.drive.lanes import Lanes\n"
        "from rendulic.dem.drive.servo import drive_for, hold\n"
        "x = np.array([[0.0101, 0.01, 0.01], [0.0298, 0.011, 0.0102]])\n"
        "a = rd.dem.Assembly(x, np.array([0.01, 0.01]), [0.0, 0.04, 0.0, 0.04, 0.0, 0.04])\n"
        "rate = np.array([[2.0, -1.0, 0.5]])\n"
        "lanes = Lanes(a, rate, 4)\n"
        "lanes.advance(20)\n"
        "b = a.clone()\n"
        "b.advance(20, drive_for(b, hold('strain'), (None,) * 3, rate[0], 0.1))\n"
        "assert np.abs(lanes.assembly(0).grains.position - b.grains.position).max() < 1e-15\n"
        "assert np.abs(b.grains.force).max() > 1.0\n"
    )
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stderr
