"""The reader of Yade's states: what it needs, what it refuses, and how it orders axes and bodies."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rendulic as rd
from rendulic.errors import CorruptFile, InvalidInput


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
    path, given = write(), fields()
    snapshot = rd.io.yade.read_snapshot(path)
    assert_allclose(snapshot.position, given["pos"][:, [1, 0, 2]])
    assert_allclose(snapshot.wall_position, [0.0, 0.04 - 3e-5, 0.0, 0.05, 0.0, 0.06])
    assert sorted(zip(snapshot.first.tolist(), snapshot.second.tolist(), strict=True)) == [(0, 1), (0, 2), (1, 3)]
    assert_allclose(snapshot.force_n, 712e6 * 0.01 * 1e-5, rtol=1e-12)
    assert_allclose(snapshot.resultant[:2], [[0, -3, -4], [0, 3, 4]], atol=1e-9)
    outward = {int(b): tuple(n) for b, n in zip(snapshot.second, snapshot.normal, strict=True) if b >= 2}
    assert outward == {2: (-1, 0, 0), 3: (1, 0, 0)}
    sample = rd.io.yade.read(path)
    assert_allclose(sample.grains.velocity, given["vel"][:, [1, 0, 2]])
    assert_allclose(sample.grains.angular_velocity, -given["angvel"][:, [1, 0, 2]])
    assert sample.time_step == 1e-7
    assert_allclose(sample.density, 2600, rtol=1e-12)
    assert_allclose(np.diag(sample.stress)[0], 712e6 * 0.01 * 1e-5 / (0.05 * 0.06), rtol=1e-9)


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
    with pytest.raises(CorruptFile, match="bare array"):
        rd.io.yade.read(tmp_path / "array.npy")


def test_a_missing_state_is_wrong_input(tmp_path):
    """A missing file is told from a corrupt one."""
    with pytest.raises(InvalidInput, match="no Yade state at"):
        rd.io.yade.read(tmp_path / "none.npz")
