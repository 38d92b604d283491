"""States that are whole and wrong: refused by field and row before a kernel sees them, whoever signed them."""

from __future__ import annotations

import resource
from dataclasses import replace

import numpy as np
import pytest

import rendulic as rd
from rendulic.cli.specimens import read_specimen
from rendulic.dem.state.checking import ARRAYS, NUMBERS
from rendulic.foundation.errors import CorruptFile, InvalidInput, RendulicError
from rendulic.specimen.registry import specimen_of

NAN, INF = float("nan"), float("inf")


def changed(state, name, row, value):
    """A copy of a state with another number in one row of an array."""
    array = state.arrays[name].copy()
    array[row] = value
    return replace(state, arrays=state.arrays | {name: array})


def said(state, **attributes):
    """A copy of a state with other attributes."""
    return replace(state, attributes=state.attributes | attributes)


def without(state, name):
    return replace(state, arrays={own: array for own, array in state.arrays.items() if own != name})


WRONG = [
    (lambda s: changed(s, "contacts/second", 7, 10**6), "contacts/second, row 7: expected a grain, 0 to 199, found 1000000"),
    (lambda s: changed(s, "contacts/first", 3, -1), "contacts/first, row 3: expected a grain, 0 to 199, found -1"),
    (lambda s: changed(s, "contacts/second", 0, 0), "contacts/second, row 0: expected a grain after the first"),
    (lambda s: changed(s, "contacts/force", (2, 1), NAN), "contacts/force, row 2: expected a finite number"),
    (lambda s: changed(s, "wall_contacts/grain", 4, 200), "wall_contacts/grain, row 4: expected a grain, 0 to 199"),
    (lambda s: changed(s, "wall_contacts/wall", 1, 6), "wall_contacts/wall, row 1: expected a wall, 0 to 5, found 6"),
    (lambda s: changed(s, "wall_contacts/wall", 0, 5), "wall_contacts/wall, row 1: expected contacts sorted by wall and grain"),
    (lambda s: changed(s, "grains/row", (5, 3), -1e-3), "grains/row, row 5: expected a positive radius"),
    (lambda s: changed(s, "grains/row", (5, 0), 10.0), "grains/row, row 5: expected the centre of a grain within the walls"),
    (lambda s: changed(s, "grains/row", (6, 9), INF), "grains/row, row 6: expected a finite number"),
    (lambda s: changed(s, "grains/mass", 9, 0.0), "grains/mass, row 9: expected a positive number, found 0.0"),
    (lambda s: changed(s, "grains/inertia", 9, -1.0), "grains/inertia, row 9: expected a positive number"),
    (lambda s: changed(s, "walls/position", 1, -1.0), "walls/position, row 0: expected each upper wall above its lower"),
    (lambda s: changed(s, "walls/stiffness", 2, -1.0), "walls/stiffness, row 2: expected zero or more"),
    (lambda s: changed(s, "list_origin", 8, 10.0), "list_origin, row 8: expected the centre of a grain within the walls"),
    (lambda s: changed(s, "strain_origin", 1, 0.0), "strain_origin, row 1: expected a positive number"),
    (lambda s: replace(s, arrays=s.arrays | {"spent": np.zeros(2)}), r"spent must have the shape \(3\), found \(2,\)"),
    (lambda s: replace(s, arrays=s.arrays | {"spent": np.zeros(3, ">f8")}), "spent must be of float64, found >f8"),
    (lambda s: replace(s, arrays=s.arrays | {"grains/mass": np.ones(3)}), r"grains/mass must have the shape \(200\)"),
    (lambda s: replace(s, arrays=s.arrays | {"contacts/first": np.zeros(2)}), "contacts/first must be of int32"),
    (lambda s: replace(s, arrays=s.arrays | {"own": np.zeros(2)}), "has an unknown array 'own'"),
    (lambda s: without(s, "spent"), "lacks the array 'spent'"),
    (lambda s: said(s, damping=-0.1), "damping must be a number at least 0 and below 1, found '-0.1'"),
    (lambda s: said(s, damping=1.0), "damping must be a number at least 0 and below 1"),
    (lambda s: said(s, density="2600"), "density must be a number above 0, found '2600'"),
    (lambda s: said(s, density=NAN), "density must be a number above 0, found 'nan'"),
    (lambda s: said(s, density=True), "density must be a number above 0, found 'True'"),
    (lambda s: said(s, time_step=0), "time_step must be a number above 0"),
    (lambda s: said(s, time_step=10**400), "time_step must be a number above 0"),
    (lambda s: said(s, time_step_fraction=0.6), "time_step_fraction must be a number above 0 and below 0.58"),
    (lambda s: said(s, margin=1e9), "margin must be a number above 0 and below"),
    (lambda s: said(s, n_steps=2.5), "n_steps must be a whole number, zero or more, found '2.5'"),
    (lambda s: said(s, has_fixed_time_step=1), "has_fixed_time_step must be true or false"),
    (lambda s: said(s, law=["LinearFrictional"]), "must name its contact law"),
    (lambda s: said(s, law_fields={"modulus": -1.0}), "a law that cannot be"),
    (lambda s: said(s, law_fields={"color": 1.0}), "a law that cannot be"),
    (lambda s: said(s, other=1), "has an unknown number 'other'"),
    (lambda s: replace(s, attributes={"law": "LinearFrictional"}), "lacks the number"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "words"), WRONG)
def test_grains_are_refused_by_field_and_row(sheared, sheared_state, change, words):
    """Also by an assembly that is there, which stays as it is."""
    before = sheared.save().checksum
    state = change(sheared_state)
    with pytest.raises(CorruptFile, match=words):
        rd.dem.Assembly.from_state(state)
    with pytest.raises(CorruptFile, match=words):
        sheared.restore(state)
    assert sheared.save().checksum == before


def test_a_wrong_state_in_a_file_is_refused(sheared_state, tmp_path):
    """A checksum says that a file is whole, not that it is right."""
    path = changed(sheared_state, "contacts/second", 7, 10**6).to_file(tmp_path / "wrong.h5")
    for read in (rd.io.read, rd.io.read_assembly, read_specimen):
        with pytest.raises(CorruptFile, match=r"wrong.h5: .*contacts/second, row 7"):
            read(path)
    with pytest.raises(CorruptFile, match="contacts/second, row 7"):
        specimen_of(rd.State.from_file(path))


def test_all_that_is_saved_is_checked(sheared_state):
    """A new array or number of the state needs its line in the checks."""
    assert sheared_state.arrays.keys() == ARRAYS.keys()
    assert sheared_state.attributes.keys() == set(NUMBERS)
    assert {name: array.dtype for name, array in sheared_state.arrays.items()} == {
        name: np.dtype(dtype) for name, (dtype, _) in ARRAYS.items()
    }


VALUES = (0, -1, 1, 5, 6, 199, 200, 10**6, -(2**31), 2**31 - 1, 1e-300, 1e300, -1e-3, NAN, INF, -INF)


def tampered(state, rng):
    """One to three changes that an adversary would make: numbers, lengths, types, whole arrays, attributes."""
    for _ in range(rng.integers(1, 4)):
        name = rng.choice(sorted(state.arrays))
        array = state.arrays[name].copy()
        kind = rng.integers(7)
        if kind < 3 and array.size:
            with np.errstate(all="ignore"):
                value = np.asarray(rng.choice(VALUES)).astype(array.dtype)
            array.reshape(-1)[rng.integers(array.size)] = value
            state = replace(state, arrays=state.arrays | {name: array})
        elif kind == 3:
            state = replace(state, arrays=state.arrays | {name: array[: rng.integers(len(array) + 1)]})
        elif kind == 4:
            state = replace(state, arrays=state.arrays | {name: np.roll(array, 1, axis=0)})
        elif kind == 5:
            state = replace(state, arrays=state.arrays | {name: array.astype(rng.choice(["f4", "i8", ">f8", "S3"]))})
        else:
            name = rng.choice(sorted(state.attributes))
            value = [*VALUES, None, "", True, [], {}][rng.integers(len(VALUES) + 5)]
            state = said(state, **{name: value})
    return state


@pytest.mark.parametrize("seed", range(8))
def test_tampered_grains_are_refused_or_step(sheared_state, seed):
    """Whatever was changed: an error of rendulic, or an assembly that steps, with numbers that are numbers."""
    rng = np.random.default_rng(seed)
    refused = []
    for _ in range(40):
        state = tampered(sheared_state, rng)
        try:
            sample = rd.dem.Assembly.from_state(state)
            sample.snapshot()
            sample.probe(np.array([1e-7, 0.0, 0.0]), 5)
        except RendulicError as error:
            refused.append(str(error))
        else:
            assert np.isfinite(sample.stress).all()
    assert len(refused) > 20
    assert not [words for words in refused if "\n" in words]


@pytest.mark.parametrize("seed", range(4))
def test_tampered_points_are_refused_or_go_on(seed):
    """The same of the model."""
    rng = np.random.default_rng(seed)
    good = rd.ChangHicher().at(pressure=200e3, void_ratio=0.8)
    good.load(rd.paths.constant_volume(2e-3))
    good, refused = good.save(), []
    for _ in range(40):
        state = tampered(good, rng)
        try:
            point = rd.chang_hicher.MaterialPoint.from_state(state)
            point.probe(np.array([1e-6, 0.0, 0.0]))
        except RendulicError as error:
            refused.append(str(error))
        else:
            assert np.isfinite(point.stress).all()
    assert len(refused) > 20
    assert not [words for words in refused if "\n" in words]


def test_a_box_of_any_length_takes_no_more_room(sheared_state):
    """A wall two million kilometres away would have 900 MB of empty cells."""
    sample = rd.dem.Assembly.from_state(changed(sheared_state, "walls/position", 5, 2.0**31))
    near = rd.dem.Assembly.from_state(sheared_state)
    near.tighten_list()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    sample.tighten_list()
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000  # kB
    for name in ("first", "second"):
        np.testing.assert_array_equal(getattr(sample.contacts, name), getattr(near.contacts, name))


def test_states_of_other_kinds_are_wrong_input(sheared_state):
    with pytest.raises(InvalidInput, match="expected the state of a specimen of kind 'Assembly'"):
        rd.dem.Assembly.from_state(replace(sheared_state, kind="Clay"))
