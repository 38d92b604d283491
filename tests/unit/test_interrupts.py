"""Ctrl-C while a specimen is loaded, and threads that load the same one: what is left is whole."""

from __future__ import annotations

import random
import signal
import threading
import time
from contextlib import suppress

import numpy as np
import pytest

import rendulic as rd
from rendulic.dem.drive.stepping import compute_forces
from rendulic.dem.state.grains import sphere_masses
from rendulic.foundation import whole_change
from rendulic.foundation.errors import InvalidInput

INTERRUPTS = 200
LOADING = rd.paths.drained_triaxial(until_strain=0.05)


def interrupted(action, seconds):
    """Whether `action` was ended by Ctrl-C, pressed once after so many seconds."""
    thread = threading.Timer(seconds, signal.raise_signal, [signal.SIGINT])
    ended = False
    try:
        thread.start()
        action()
    except KeyboardInterrupt:
        ended = True
    # one that came after the end of the action
    with suppress(KeyboardInterrupt):
        thread.join()
        time.sleep(1e-3)
    return ended


def expect_whole(sample):
    """Forces are those of the positions, masses those of the radii, and what is saved can be restored."""
    twin = sample.clone()
    compute_forces(twin)
    scale = np.abs(sample.contacts.force).max()
    for name in ("force", "torque"):
        found, expected = getattr(sample.grains, name), getattr(twin.grains, name)
        length = 1.0 if name == "force" else sample.grains.radius.max()
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * scale * length, err_msg=name)
    np.testing.assert_allclose(
        sample.walls.force, twin.walls.force, rtol=0, atol=1e-12 * np.abs(twin.walls.force).max()
    )
    mass, inertia = sphere_masses(sample.grains.radius.copy(), sample.density, 0.0)
    np.testing.assert_array_equal(sample.grains.mass, mass)
    np.testing.assert_array_equal(sample.grains.inertia, inertia)
    rd.dem.Assembly.from_state(sample.save())


def test_interrupts_while_loading_leave_whole_specimens(sheared_state):
    """At random moments of a test, of probes and of bringing to rest."""
    draw = random.Random(1)
    sample = rd.dem.Assembly.from_state(sheared_state)
    actions = [
        lambda: sample.load(LOADING),
        lambda: rd.dem.bring_to_rest(sample, speed=rd.dem.QuasiStatic(tolerance=1e-14, max_rest_steps=10**7)),
        lambda: sample.probe((1e-3, -5e-4, -5e-4), 10**6),
    ]
    sample.clone().load(rd.paths.drained_triaxial(until_strain=1e-4))  # compiled
    count = 0
    for k in range(INTERRUPTS):
        sample.restore(sheared_state)
        count += interrupted(actions[k % 3], draw.uniform(0.0, 0.03))
        expect_whole(sample)
    assert count > 0.9 * INTERRUPTS


def test_an_interrupted_specimen_is_that_of_the_steps_made(sheared_state, straining):
    """To the bit, with its time and counts."""
    draw = random.Random(2)
    drive = straining((5.0, -5.0, 0.0))
    seen = set()
    for _ in range(20):
        sample = rd.dem.Assembly.from_state(sheared_state)
        before = sample.n_steps
        assert interrupted(lambda sample=sample: sample.advance(10**8, drive), draw.uniform(0.0, 0.05))
        made = sample.n_steps - before
        seen.add(made)
        assert 0 <= made < 10**8
        straight = rd.dem.Assembly.from_state(sheared_state)
        straight.advance(made, drive)
        assert sample.save().checksum == straight.save().checksum
    assert len(seen) > 5


def test_an_interrupted_point_is_whole():
    """Of the Chang-Hicher model: as it was, or where the path had led it."""
    draw = random.Random(3)
    model = rd.ChangHicher.preset("hostun_loose")
    for _ in range(10):
        point = model.at(300e3, 0.9)
        interrupted(
            lambda point=point: point.load(rd.paths.drained_triaxial(until_strain=0.05)), draw.uniform(0.0, 0.05)
        )
        again = type(point).from_state(point.save())
        assert again.save().checksum == point.save().checksum
        again.load(rd.paths.drained_triaxial(until_strain=1e-3))


def test_a_second_press_acts_at_once():
    """So that a callback that never ends can be stopped."""
    seen = []

    @whole_change.whole_change
    def change(_thing):
        try:
            signal.raise_signal(signal.SIGINT)
            seen.append("once")
            signal.raise_signal(signal.SIGINT)
            seen.append("twice")
        finally:
            seen.append("left")

    with pytest.raises(KeyboardInterrupt):
        change([])
    assert seen == ["once", "left"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_other_handlers_are_called_and_stay(sheared_state, straining):
    """One that raises nothing: all steps are made."""
    pressed = []
    before = signal.signal(signal.SIGINT, lambda *about: pressed.append(about))
    try:
        own = signal.getsignal(signal.SIGINT)
        sample = rd.dem.Assembly.from_state(sheared_state)
        start = sample.n_steps
        assert not interrupted(lambda: sample.advance(3000, straining((5.0, -5.0, 0.0))), 0.005)
        assert len(pressed) == 1
        assert sample.n_steps == start + 3000
        assert signal.getsignal(signal.SIGINT) is own
    finally:
        signal.signal(signal.SIGINT, before)


def test_two_threads_cannot_change_one_specimen(sheared_state, straining):
    """The second is refused, whatever it wants to change; the first goes on as if alone."""
    drive = straining((5.0, -5.0, 0.0))
    sample, alone = (rd.dem.Assembly.from_state(sheared_state) for _ in range(2))
    begun, told = threading.Event(), []

    def second():
        begun.wait()
        for change in (
            lambda: sample.advance(10, drive),
            lambda: sample.load(LOADING),
            lambda: rd.dem.bring_to_rest(sample),
            lambda: sample.restore(sheared_state),
            lambda: sample.scale_radii(1.01),
        ):
            try:
                change()
                told.append("changed")
            except InvalidInput as error:
                told.append(str(error))

    thread = threading.Thread(target=second)
    thread.start()

    def wait(*_):
        begun.set()
        thread.join()

    path = rd.paths.drained_triaxial(until_strain=1e-4)
    sample.load(path, progress=wait)
    assert (
        told
        == ["another thread is changing this specimen at the moment: give each thread a copy of its own, from clone()"]
        * 5
    )
    alone.load(path)
    assert sample.save().checksum == alone.save().checksum
    sample.advance(1, drive)
    assert not whole_change._changed_by
