"""Audits: what is right passes, also in motion and in cells; what is left out or altered fails, and is said first."""

from __future__ import annotations

import json
import subprocess
import sys
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_stress_and_identity import random_snapshot

import corruptions
import rendulic as rd
from conftest import FAST
from rendulic.micro.overlapping import unlisted_overlaps
from rendulic.specimen.recorded import Recorded, Springs

COMMAND = Path(sys.executable).with_name("rendulic")
STRAIN = np.array([1e-4, -5e-5, -5e-5])


@pytest.fixture(scope="module")
def states(sheared_state):
    """A state at rest, and after a strain probe."""
    sample = rd.dem.Assembly.from_state(sheared_state)
    before = sample.snapshot()
    sample.probe(STRAIN, 2000)
    return before, sample.snapshot()


def with_contacts(snapshot, kept):
    """The same state with some of its contacts."""
    return replace(
        snapshot,
        first=snapshot.first[kept],
        second=snapshot.second[kept],
        normal=snapshot.normal[kept],
        force_n=snapshot.force_n[kept],
        force_t=snapshot.force_t[kept],
        image=None if snapshot.image is None else snapshot.image[kept],
    )


def bare(snapshot):
    """What a file without a word of the engine's tells."""
    return replace(snapshot, recorded=None)


@pytest.mark.parametrize("told", [lambda snapshot: snapshot, bare], ids=["own", "bare"])
def test_clean_states_pass(states, told):
    """Every audit that the data allow passes, and the others are named with the reason, never passed."""
    found = rd.second_order_work(*map(told, states)).audits
    assert found.failed == {}
    assert found.warnings == []
    assert {"equilibrium", "missing_contacts", "law", "coulomb", "normals", "strain_of_grains"} <= set(found)
    assert not set(found) & set(found.not_possible)
    assert all(found.not_possible.values())
    assert ("engine_walls" in found) == (told is not bare)
    assert found["sums_of_the_code"].catches == "a fault in the code; nothing about the data"


@pytest.mark.parametrize("n_steps", [20, 200])
def test_motion_is_not_taken_for_missing_contacts(sheared, n_steps):
    """A probe that is far too fast is out of equilibrium, and that is what is said: no contact is missing."""
    before = sheared.snapshot()
    sheared.probe(STRAIN, n_steps)
    after = sheared.snapshot()
    found = rd.second_order_work(before, after).audits
    assert found["equilibrium"].passed == (after.unbalanced_force <= 1e-2)
    assert set(found.failed) <= {"equilibrium", "love_weber", "opposite_walls"}


def test_half_of_the_contacts_left_out_of_both_states(states):
    """The identity cannot see it; equilibrium, overlaps, the walls' own forces and Love-Weber can."""
    kept = np.arange(len(states[0].first)) % 2 == 0
    pairs = {(i, j) for i, j, one in zip(states[0].first, states[0].second, kept, strict=True) if one}
    also = np.array([(i, j) in pairs for i, j in zip(states[1].first, states[1].second, strict=True)])
    halves = with_contacts(states[0], kept), with_contacts(states[1], also)
    work = rd.second_order_work(*halves)
    assert work.identity_residual < 1e-12
    assert work.audits["sums_of_the_code"].passed
    for told in (lambda snapshot: snapshot, bare):
        failed = rd.second_order_work(*map(told, halves)).audits.failed
        assert {"equilibrium", "missing_contacts", "balance_of_grains", "love_weber"} <= set(failed)
        assert failed["equilibrium"].where == "before and after"
    assert "engine_walls" in work.audits.failed
    assert work.audits.warnings[0].startswith("Far from equilibrium, or contacts are missing")


def test_one_contact_left_out_is_found_wherever_it_is(states):
    """Each of fifty contacts, of any force: the overlap is not listed, and two grains are out of balance."""
    snapshot = states[0]
    for left_out in np.random.default_rng(1).permutation(len(snapshot.first))[:50]:
        found = rd.audits(with_contacts(snapshot, np.arange(len(snapshot.first)) != left_out))
        assert "balance_of_grains" in found.failed
        assert ("missing_contacts" in found.failed) == (found["missing_contacts"].residual > 1e-3)


def test_nothing_is_passed_for_lack_of_data():
    """A box with no contact at all: no audit of forces is made, and equilibrium fails."""
    box = rd.Snapshot(
        position=np.full((1, 3), 0.5), radius=np.array([0.1]), wall_position=np.array([0.0, 1.0] * 3),
        first=np.zeros(0, dtype=int), second=np.zeros(0, dtype=int), normal=np.zeros((0, 3)), force_n=np.zeros(0),
        force_t=np.zeros((0, 3)),
    )  # fmt: skip
    found = rd.audits(box)
    assert list(found.failed) == ["equilibrium", "volume"]
    assert {"balance_of_grains", "law", "normals", "love_weber", "signs", "coulomb"} <= set(found.not_possible)


@pytest.mark.parametrize("in_both", [False, True], ids=["after", "both"])
@pytest.mark.parametrize("what", corruptions.CORRUPTIONS)
def test_every_fault_in_own_states_is_noticed(states, what, in_both, tmp_path):
    """Thirteen faults, in one state or alike in both: the engine's own forces and springs are known, so none can hide."""
    found = corruptions.outcome(states, corruptions.own, corruptions.CORRUPTIONS[what], in_both, tmp_path / "files")
    assert corruptions.is_caught(found)
    # the algebra never notices: that is why it is no audit of the data
    assert found == "refused" or found["sums_of_the_code"].passed


def test_grains_of_one_size_under_other_numbers_are_noticed():
    """Two neighbours of equal radius exchange their numbers in one state, consistently: all of that state is right."""
    sample = rd.dem.pack(radius=np.full(60, 0.01), pressure=200e3, seed=2, speed=FAST)
    before = sample.snapshot()
    sample.probe(STRAIN, 500)
    after = sample.snapshot()
    one, other = int(after.first[3]), int(after.second[3])
    number = np.arange(after.n_grains + 6)
    number[[one, other]] = other, one
    renumbered = replace(
        after,
        recorded=None,
        position=after.position[number[:60]],
        first=number[after.first],
        second=number[after.second],
    )
    assert rd.audits(renumbered).failed == {}
    assert set(rd.second_order_work(before, renumbered).audits.failed) >= {"grains_moved"}
    assert "grains_moved" not in rd.second_order_work(before, after).audits.failed


def test_strain_without_a_change_of_forces_is_noticed(states):
    """The contacts of one state in both, of grains of which nothing else is known."""
    before = replace(states[0], recorded=Recorded(are_spheres=False))
    stale = corruptions.contacts_of_the_other(states[1], states[0])
    found = rd.second_order_work(before, replace(stale, recorded=before.recorded)).audits
    assert list(found.failed) == ["forces_change"]


def test_states_in_the_wrong_order_are_noticed(states):
    assert list(rd.second_order_work(states[1], states[0]).audits.failed) == ["order_of_steps"]


def test_numbers_that_are_not_finite_are_said(states):
    """Nothing else is asked of them, and nothing is passed."""
    position = states[1].position.copy()
    position[7, 1] = np.nan
    found = rd.audits(states[0], replace(states[1], position=position))
    assert list(found) == list(found.failed) == ["finite"]
    assert found["finite"].where == "after"
    assert {"equilibrium", "law", "grains_moved"} <= set(found.not_possible)


def test_radii_that_do_not_belong_to_the_positions_end_soon(states):
    """Grains that all overlap each other: no table of all their pairs is made."""
    many = np.random.default_rng(1).random((20_000, 3))
    box = replace(
        with_contacts(states[0], np.zeros(0, dtype=int)), recorded=Recorded(are_spheres=True), position=many,
        radius=np.full(len(many), 1.0), wall_position=np.array([0.0, 1.0] * 3),
    )  # fmt: skip
    assert "the radii do not belong" in rd.audits(box).not_possible["missing_contacts"]


@pytest.mark.parametrize("seed", range(40))
def test_numbers_that_obey_no_mechanics_give_audits(seed):
    """Random contacts between random places, with and without what an engine says, in cells, all at one place: no warning."""
    rng = np.random.default_rng(seed)
    n, scale = int(rng.integers(2, 30)), 10.0 ** int(rng.integers(-6, 6))
    pair = (
        random_snapshot(rng, n, int(rng.integers(0, 60)), 1.0),
        random_snapshot(rng, n, int(rng.integers(0, 60)), scale),
    )
    if seed % 4 == 1:
        pair = [
            replace(one, image=np.where(one.is_wall[:, None], 0, rng.integers(-1, 2, (len(one.first), 3))))
            for one in pair
        ]
    elif seed % 4 == 2:
        pair = pair[0], replace(pair[1], force_n=0.0 * pair[1].force_n, force_t=0.0 * pair[1].force_t)
    elif seed % 4 == 3:
        pair = [replace(pair[0], position=np.repeat(pair[0].position[:1], n, axis=0))] * 2
    if seed % 3 == 0:
        said = Recorded(are_spheres=True, springs=Springs(1e6), wall_force=np.zeros(6), stress=np.zeros((3, 3)))
        pair = [replace(one, recorded=said) for one in pair]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = rd.second_order_work(*pair).audits
    assert not set(found) & set(found.not_possible)
    assert found["sums_of_the_code"].passed


@pytest.mark.parametrize("periodic", [(), (0,), (0, 1, 2)])
def test_overlaps_are_those_of_all_pairs(periodic):
    """Sizes 1 to 30, places anywhere, some contacts listed: what is not listed is what a loop over all pairs finds."""
    rng = np.random.default_rng(len(periodic))
    n, faces = 300, np.array([-0.2, 1.0] * 3)
    position, radius = rng.uniform(faces[0], faces[1], (n, 3)), 0.006 * 30.0 ** rng.random(n)
    every = {}
    for i in range(n):
        for j in range(i + 1, n):
            apart = position[j] - position[i]
            cells = [-round(apart[k] / 1.2) if k in periodic else 0 for k in range(3)]
            overlap = radius[i] + radius[j] - np.linalg.norm(apart + 1.2 * np.array(cells))
            if overlap > 0.0:
                every[i, j] = overlap, cells
        for face in range(6):
            overlap = radius[i] - abs(position[i, face // 2] - faces[face])
            if overlap > 0.0 and face // 2 not in periodic:
                every[i, n + face] = overlap, [0, 0, 0]
    listed = list(every)[::3]
    if periodic:  # one contact across a face tells which axes are periodic
        listed += [pair for k in periodic for pair, (_, cells) in every.items() if cells[k]][:40]
    first, second = np.array(listed).T
    image = np.array([every[pair][1] for pair in listed])
    none = np.zeros((len(first), 3))
    snapshot = rd.Snapshot(
        position, radius, faces, first, second, none, none[:, 0], none, image=image if periodic else None
    )
    found = unlisted_overlaps(snapshot, np.array([k not in periodic for k in range(3)]))
    expected = {pair: overlap for pair, (overlap, _) in every.items() if pair not in set(listed)}
    assert len(expected) > 100
    assert dict(zip(zip(*map(np.ndarray.tolist, found[:2]), strict=True), found[2], strict=True)) == pytest.approx(
        expected, abs=1e-14
    )


def test_states_that_cannot_be_compared_are_refused(states):
    smaller = replace(states[1], position=states[1].position[1:], radius=states[1].radius[1:])
    with pytest.raises(rd.errors.InvalidInput, match="must hold the same grains"):
        rd.audits(states[0], smaller)


def analyzed(*arguments):
    return subprocess.run([COMMAND, "analyze", *arguments], capture_output=True, text=True)


def test_analyze_says_first_what_is_wrong(states, tmp_path):
    """Contacts missing: the sentence comes before the result, the table has the audits; --strict ends with 1."""
    for name, state in zip(("before", "after"), states, strict=True):
        rd.io.write_plain_text(state, tmp_path / name)
        rd.io.write_plain_text(with_contacts(state, np.arange(len(state.first)) % 2 == 0), tmp_path / f"half_{name}")
    half = [tmp_path / "half_before", tmp_path / "half_after"]
    done = analyzed(*half, "--report", tmp_path / "report")
    assert done.returncode == 0
    assert done.stdout.startswith("These data contradict themselves")
    said = done.stdout.splitlines()
    assert said[1].startswith("- Far from equilibrium, or contacts are missing")
    assert any(line.split()[:2] == ["equilibrium", "FAILED"] for line in said)
    told = json.loads((tmp_path / "report" / "second_order_work.json").read_text())
    assert told["audits"]["equilibrium"]["passed"] is False
    assert "tangential_forces" in told["audits_not_possible"]
    assert analyzed(*half, "--strict").returncode == 1
    clean = analyzed(tmp_path / "before", tmp_path / "after", "--strict")
    assert clean.returncode == 0
    assert "contradict" not in clean.stdout
    assert "FAILED" not in clean.stdout


def test_analyze_names_the_probes_that_fail(states, tmp_path):
    """A folder of probes: the one with contacts missing is named, and counted."""
    rd.io.write_snapshot(states[0], tmp_path / "before.h5")
    folder = tmp_path / "probes"
    folder.mkdir()
    broken = with_contacts(states[1], np.arange(len(states[1].first)) % 2 == 0)
    rd.io.write_snapshot(broken, folder / "broken.h5")
    (folder / "probes.csv").write_text("file\nbroken.h5\n")
    done = analyzed(tmp_path / "before.h5", folder, "--strict")
    assert done.returncode == 1
    assert done.stdout.splitlines()[1].startswith("- broken.h5: Far from equilibrium")
