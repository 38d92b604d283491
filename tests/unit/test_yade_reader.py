"""The reader of Yade's states: what it needs, what it refuses, and how it orders axes and bodies."""

from __future__ import annotations

import io
import zipfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import rendulic as rd
from rendulic.foundation.errors import CorruptFile, InvalidInput, RendulicError


def fields():
    """Two spheres of ids 10 and 12 stacked along y between walls 0 to 5, as Yade writes them."""
    radius, overlap = 0.01, 1e-5
    pos = np.array([[0.02, 0.01 - overlap, 0.02], [0.02, 0.03 - 2 * overlap, 0.02]])
    top = 0.04 - 3 * overlap
    k = 712e6 * radius
    normal = [0.0, 1.0, 0.0]
    shear = [3.0, 0.0, 4.0]
    contacts = np.array(
        [
            [10, 12, k, 0.42 * k, 0, k * overlap, 0, *shear, *normal, 0, 0, 0],
            [2, 10, k, 0, 0, k * overlap, 0, 0, 0, 0, *normal, 0, 0, 0],
            [3, 12, k, 0, 0, -k * overlap, 0, 0, 0, 0, 0.0, -1.0, 0.0, 0, 0, 0],
        ]
    )
    walls = np.zeros((6, 3))
    walls[1, 0], walls[3, 1], walls[5, 2] = 0.05, top, 0.06
    return {
        "ids": np.array([10, 12]), "pos": pos, "rad": np.full(2, radius), "vel": np.array([[1.0, 2, 3], [4, 5, 6]]),
        "angvel": np.array([[0.1, 0.2, 0.3], [0.0, 0.0, 0.0]]), "mass": np.full(2, 2600 * 4 / 3 * np.pi * radius**3),
        "wallids": np.arange(6), "wallpos": walls, "contacts": contacts, "dt": np.array(1e-7),
    }  # fmt: skip


@pytest.fixture
def write(tmp_path):
    """Write the fields with some changed (None: left out) and return the path."""

    def do(**changes):
        path = tmp_path / "state.npz"
        np.savez(path, **{name: value for name, value in (fields() | changes).items() if value is not None})
        return path

    return do


def test_axes_and_signs(write):
    """y, x, z become 1, 2, 3; spins are pseudovectors and change sign; walls are second in every pair."""
    path, filed = write(), fields()
    snapshot = rd.io.yade.read_snapshot(path)
    assert_allclose(snapshot.position, filed["pos"][:, [1, 0, 2]])
    assert_allclose(snapshot.wall_position, [0.0, 0.04 - 3e-5, 0.0, 0.05, 0.0, 0.06])
    assert sorted(zip(snapshot.first.tolist(), snapshot.second.tolist(), strict=True)) == [(0, 1), (0, 2), (1, 3)]
    assert_allclose(snapshot.force_n, 712e6 * 0.01 * 1e-5, rtol=1e-12)
    assert_allclose(snapshot.resultant[:2], [[0, -3, -4], [0, 3, 4]], atol=1e-9)
    outward = {int(b): tuple(n) for b, n in zip(snapshot.second, snapshot.normal, strict=True) if b >= 2}
    assert outward == {2: (-1, 0, 0), 3: (1, 0, 0)}
    sample = rd.io.yade.read(path)
    assert_allclose(sample.grains.velocity, filed["vel"][:, [1, 0, 2]])
    assert_allclose(sample.grains.angular_velocity, -filed["angvel"][:, [1, 0, 2]])
    assert sample.time_step == 1e-7
    assert_allclose(sample.density, 2600, rtol=1e-12)
    assert_allclose(np.diag(sample.stress)[0], 712e6 * 0.01 * 1e-5 / (0.05 * 0.06), rtol=1e-11)


def test_shear_force_survives(write):
    """The tangential force is the file's, turned by one step of motion at most (here velocities make it move 1e-6)."""
    still = write(vel=np.zeros((2, 3)), angvel=np.zeros((2, 3)))
    held = rd.io.yade.read(still).snapshot()
    assert_allclose(held.force_t[~held.is_wall], [[0.0, 3.0, 4.0]], rtol=1e-9, atol=1e-9)


def test_swapped_bodies_mean_the_same(write):
    """A contact written from 12 to 10 with all signs turned gives the same snapshot."""
    contacts = fields()["contacts"].copy()
    contacts[0, :2] = 12, 10
    contacts[0, 4:13] *= -1
    one, other = rd.io.yade.read_snapshot(write()), rd.io.yade.read_snapshot(write(contacts=contacts))
    assert_allclose(other.resultant, one.resultant, atol=1e-12)
    assert_allclose(other.force_t, one.force_t)
    np.testing.assert_array_equal(other.first, one.first)


@pytest.mark.parametrize("name", ["pos", "rad", "mass", "vel", "angvel", "ids", "wallids", "wallpos", "contacts"])
def test_missing_fields_are_named(write, name):
    """Every field that reading needs is asked for by name."""
    with pytest.raises(CorruptFile, match=rf"lacks the field\(s\) {name}; it has"):
        rd.io.yade.read(write(**{name: None}))


def unknown_body():
    contacts = fields()["contacts"].copy()
    contacts[0, 1] = 99
    return contacts


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"contacts": unknown_body()}, "a contact names body 99, which is neither in ids nor in wallids"),
        ({"contacts": np.zeros((2, 9))}, "field contacts has 9 columns, at least 13 are needed"),
        ({"pos": np.full((2, 3), np.nan)}, "field pos must be finite everywhere; 6 entries"),
        ({"contacts": np.full((3, 16), np.nan)}, "field contacts must be finite"),
        ({"rad": np.ones(3)}, "field rad has 3 rows, ids has 2"),
        ({"pos": np.ones((2, 2))}, r"field pos must have shape \(n, 3\), got \(2, 2\)"),
        ({"wallids": np.arange(5)}, r"field wallids must have shape \(6\), got \(5,\)"),
        ({"ids": np.array([10, 10])}, "field ids names a grain twice"),
        ({"mass": np.array([1.0, 2.0])}, "the masses are not those of spheres of one density"),
        ({"ids": np.array([{}, {}])}, "not a readable .npz archive"),
    ],
)
def test_wrong_fields_are_refused(write, changes, words):
    """Naming the file, the field, what was expected and what came; pickled objects are never loaded."""
    path = write(**changes)
    with pytest.raises(CorruptFile, match=words) as caught:
        rd.io.yade.read(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.95])
def test_truncated_archives_are_refused(write, share):
    """An archive cut anywhere is corrupt, for both readers."""
    path = write()
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    for read in (rd.io.yade.read, rd.io.yade.read_snapshot):
        with pytest.raises(CorruptFile, match=r"not a readable \.npz archive"):
            read(path)


def test_a_bare_array_is_no_state(tmp_path):
    """A .npy file is told from an archive."""
    np.save(tmp_path / "array.npy", np.ones(3))
    with pytest.raises(CorruptFile, match="not a readable"):
        rd.io.yade.read(tmp_path / "array.npy")


def test_a_missing_state_is_wrong_input(tmp_path):
    """A missing file is told from a corrupt one."""
    with pytest.raises(InvalidInput, match="no Yade state at"):
        rd.io.yade.read(tmp_path / "none.npz")


# --- what the exporter writes beside -------------------------------------------------------------------


def test_any_axis_can_be_axial(write):
    """Axis 1 is the axis named; the order of the others keeps the identity of the state."""
    for axial, order, handed in (("x", [0, 1, 2], 1), ("y", [1, 0, 2], -1), ("z", [2, 0, 1], 1)):
        path = write(axial=np.array(axial))
        snapshot, filed = rd.io.yade.read_snapshot(path), fields()
        assert_allclose(snapshot.position, filed["pos"][:, order])
        edges = np.array([[0.0, 0.05], [0.0, 0.04 - 3e-5], [0.0, 0.06]])
        assert_allclose(snapshot.wall_position, edges[order].ravel())
        pressed = int(np.argmax(np.diag(snapshot.wall_stress)))
        assert order[pressed] == 1  # the column stands along Yade's y
        assert_allclose(rd.io.yade.read(path).grains.angular_velocity, handed * filed["angvel"][:, order])


def test_the_law_is_that_of_the_file(write):
    """Stiffnesses and friction of the contacts give the law; a state whose contacts differ tells none."""
    law = rd.io.yade.read(write(friction=np.array([0.5, 0.0, 0.0]))).law
    assert_allclose([law.modulus, law.tangential_ratio, law.friction], [356e6, 0.42, 0.5], rtol=1e-12)
    assert rd.io.yade.read_snapshot(write(friction=np.array([0.5, 0.0, 0.0]))).friction == 0.5
    assert rd.io.yade.read_snapshot(write(), friction=None).friction is None
    with pytest.raises(InvalidInput, match=r"walls with friction 0\.3, and those of rendulic are smooth"):
        rd.io.yade.read(write(friction=np.array([0.5, 0.3, 0.3])))
    alone = fields()["contacts"][1:]
    with pytest.raises(InvalidInput, match="does not tell one stiffness and friction of all its contacts: give law="):
        rd.io.yade.read(write(contacts=alone))
    given = rd.dem.LinearFrictional(1e6, 0.1, 0.2)
    assert rd.io.yade.read(write(contacts=alone), law=given).law == given


def in_a_cell(**changes):
    """The two spheres in a periodic cell; they touch across its faces, and twice inside, as clumps do."""
    contacts = fields()["contacts"][[0, 0, 0]]
    contacts[1, 4:7] = [0.0, 100.0, 0.0]
    contacts[1, 7:10] = 0.0
    contacts[2, :2] = 12, 10
    cell = {"cell": np.array([0.05, 0.04 - 3e-5, 0.06]), "contacts": contacts, "wallids": None, "wallpos": None}
    return cell | {"celldist": np.array([[0, 0, 0], [0, 0, 0], [0, 1, 0]])} | changes


def test_a_cell_is_periodic_and_clumps_touch_once(write):
    """Two contacts of one pair are one with the summed force; the image of a swapped pair changes sign."""
    snapshot = rd.io.read(write(**in_a_cell()))
    assert snapshot.is_periodic
    assert snapshot.first.tolist() == [0, 0]
    assert snapshot.second.tolist() == [1, 1]
    assert sorted(snapshot.image.tolist()) == [[-1, 0, 0], [0, 0, 0]]
    inside = np.flatnonzero((snapshot.image == 0).all(axis=1))[0]
    assert_allclose(snapshot.force[inside], [712e6 * 0.01 * 1e-5 + 100.0, 3.0, 4.0])
    assert_allclose(np.abs(snapshot.branch[:, 0]), [0.02 - 2e-5, 0.02 - 1e-5])
    with pytest.raises(InvalidInput, match="is periodic, and only specimens between walls step on"):
        rd.io.yade.read(write(**in_a_cell()))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"axial": np.array("w")}, "field axial must be 'x', 'y' or 'z', found 'w'"),
        ({"friction": np.ones(2)}, "field friction has 2 rows, contacts has 3"),
        ({"friction": np.array(["a", "b", "c"])}, "field friction must be of numbers"),
        ({"is_sphere": np.ones(3, dtype=bool)}, "field is_sphere has 3 rows, ids has 2"),
        ({"wallids": np.array([10, 1, 2, 3, 4, 5])}, "field wallids must name six bodies that are no grains"),
        (in_a_cell(celldist=None), "a periodic state needs the field celldist with one row per contact"),
        (in_a_cell(celldist=np.zeros((2, 3))), "a periodic state needs the field celldist with one row per contact"),
        (in_a_cell(cell=np.array([0.05, -0.04, 0.06])), r"faces of the box must be 1- < 1\+"),
    ],
)
def test_wrong_additions_are_refused(write, changes, words):
    """Naming the field, what was expected and what came."""
    with pytest.raises(CorruptFile, match=words):
        rd.io.yade.read_snapshot(write(**changes))


def test_other_grains_are_for_analysis_only(write):
    """Clumps can be analysed; stepping them on as spheres is refused."""
    path = write(is_sphere=np.array([True, False]))
    assert rd.io.yade.read_snapshot(path).n_grains == 2
    with pytest.raises(InvalidInput, match="grains that are not spheres, and only spheres step on"):
        rd.io.yade.read(path)


@given(st.data())
@settings(max_examples=150, deadline=None)
def test_a_spoilt_state_is_read_or_refused(tmp_path_factory, data):
    """Whatever one field of a valid file is replaced with, it is read as a consistent snapshot, or refused by name."""
    base = {**fields(), **in_a_cell()} if data.draw(st.booleans()) else fields() | {"friction": np.full(3, 0.5)}
    base = {name: value for name, value in base.items() if value is not None}
    name = data.draw(st.sampled_from(sorted(base)))
    how = data.draw(st.sampled_from(["number", "shape", "kind", "empty"]))
    value = np.array(base[name], dtype=float)
    if how == "number" and value.size:
        place = data.draw(st.integers(0, value.size - 1))
        value.flat[place] = data.draw(st.sampled_from([np.nan, np.inf, -1.0, 0.0, 1e300, 7.5, 11.0, -1e-300]))
    elif how == "shape":
        value = value.reshape(-1)[: data.draw(st.integers(0, value.size))]
    elif how == "kind":
        value = np.array(["text"] * max(value.size, 1)).reshape(value.shape or (1,))
    elif how == "empty":
        value = np.zeros((0, *value.shape[1:]))
    path = tmp_path_factory.mktemp("spoilt") / "state.npz"
    np.savez(path, **{**base, name: value})
    for read in (rd.io.yade.read_snapshot, rd.io.yade.read):
        refusal, state = "", None
        try:
            state = read(path)
        except RendulicError as error:
            refusal = str(error)
        if state is None:
            assert str(path) in refusal or name in refusal
        else:
            assert np.isfinite(state.stress if hasattr(state, "stress") else state.wall_stress).all()


def test_a_field_that_claims_too_much_is_refused(write):
    """A header of 1e13 rows over a few bytes takes no memory, and is named as corrupt."""
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (10**13, 3)})
    path = write(pos=None)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("pos.npy", header.getvalue() + bytes(100))
    with pytest.raises(CorruptFile, match=r"is not a readable \.npz archive: Unable to allocate"):
        rd.io.yade.read(path)
