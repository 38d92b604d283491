"""Files of LAMMPS: what is read from them, and what is said of spoilt, foreign and mixed-up ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import rendulic as rd
from rendulic.foundation.errors import CorruptFile, InvalidInput, RendulicError

FACES = " ".join(f"v_wall{k}" for k in range(1, 7))
FIXES = " ".join(f"f_{axis}walls[{k}]" for axis in "xyz" for k in range(1, 8))
FORCES = " ".join(f"c_force[{k}]" for k in range(1, 7))


def rows(table):
    return "\n".join(" ".join(f"{value:.17g}" for value in row) for row in table)


def head(kind, count, box, flags="ff ff ff", step=1000):
    bounds = rows(np.reshape(box, (3, 2)))
    return f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF {kind}\n{count}\nITEM: BOX BOUNDS {flags}\n{bounds}\n"


def write(snapshot, folder, walls="faces", name="state", seed=0, **header):
    """A snapshot as LAMMPS would dump it: rows in any order, ids with gaps, pairs in either order."""
    rng = np.random.default_rng(seed)
    n, wall = snapshot.n_grains, snapshot.is_wall
    ids = rng.permutation(3 * n)[:n] + 1
    order = rng.permutation(n)
    grain, face, force = snapshot.first[wall], snapshot.second[wall] - n, -snapshot.force[wall]
    if walls == "faces":
        names, columns = FACES, np.zeros((n, 6))
        columns[grain, face] = snapshot.force_n[wall]
    elif walls == "fixes":
        names, columns = FIXES, np.zeros((n, 21))
        for i, k, pushed in zip(grain, face, force, strict=True):
            point = snapshot.position[i].copy()
            point[k // 2] = snapshot.wall_position[k]
            columns[i, 7 * (k // 2) : 7 * (k // 2) + 7] = [1.0, *pushed, *point]
    else:
        names, columns = "", np.zeros((n, 0))
    box = snapshot.wall_position + (np.tile([-0.01, 0.01], 3) if walls == "fixes" else 0.0)
    table = np.column_stack((ids, snapshot.position, snapshot.radius, columns))[order]
    path = folder / f"{name}.dump"
    path.write_text(head("ATOMS", n, box, **header) + f"ITEM: ATOMS id x y z radius {names}\n" + rows(table) + "\n")
    pair = np.column_stack((ids[snapshot.first[~wall]], ids[snapshot.second[~wall]]))
    on_first = -np.hstack((snapshot.force_n[~wall, None] * snapshot.normal[~wall], snapshot.force_t[~wall]))
    swap = rng.random(len(pair)) < 0.5
    pair[swap], on_first[swap] = pair[swap][:, ::-1], -on_first[swap]
    text = head("ENTRIES", len(pair), box, **header) + f"ITEM: ENTRIES c_ids[1] c_ids[2] {FORCES}\n"
    path.with_suffix(".contacts").write_text(text + rows(np.hstack((pair, on_first))) + "\n")
    return path, np.argsort(np.argsort(ids))


@pytest.fixture(scope="module")
def snapshot(sheared_state):
    return rd.dem.Assembly.from_state(sheared_state).snapshot()


@pytest.mark.parametrize("walls", ["faces", "fixes"])
def test_a_state_comes_back(snapshot, tmp_path, walls):
    """Grains in the order of their ids, forces on either body of a pair, walls where the contacts or faces are."""
    path, row = write(snapshot, tmp_path, walls)
    found = rd.io.read(path)
    assert np.array_equal(found.position[row], snapshot.position)
    assert np.array_equal(found.radius[row], snapshot.radius)
    assert_allclose(found.wall_position, snapshot.wall_position, rtol=0, atol=1e-15)
    assert len(found.first) == len(snapshot.first)
    resultant = np.concatenate((found.resultant[row], found.resultant[-6:]))
    assert_allclose(resultant, snapshot.resultant, rtol=0, atol=1e-13 * np.abs(snapshot.force).max())
    assert_allclose(found.force_t.T @ found.force_t, snapshot.force_t.T @ snapshot.force_t, rtol=1e-9, atol=1e-6)
    assert_allclose(rd.micro.love_weber_stress(found), rd.micro.love_weber_stress(snapshot), rtol=0, atol=1e-14 * 2e5)
    assert found.friction is None
    assert rd.io.lammps.read_snapshot(path, friction=0.7).friction == 0.7


def test_diameters_and_unwrapped_positions_are_read(snapshot, tmp_path):
    path, _ = write(snapshot, tmp_path)
    expected = rd.io.read(path)
    heading, table = path.read_text().split(" id x y z radius ")
    names, *lines = table.splitlines()
    doubled = [line.split() for line in lines]
    for words in doubled:
        words[4] = f"{2 * float(words[4]):.17g}"
    text = f"{heading} id xu yu zu diameter {names}\n" + "\n".join(map(" ".join, doubled)) + "\n"
    path.write_text(text)
    found = rd.io.read(path)
    assert np.array_equal(found.position, expected.position)
    assert np.array_equal(found.radius, expected.radius)


def pair_across_a_face(shift=0.0):
    """Two grains that touch through the faces of a cell of 0.05 m, periodic along x."""
    position = np.array([[0.001 + shift, 0.02, 0.02], [0.0321, 0.02, 0.02]])
    return rd.Snapshot(
        position, np.array([0.01, 0.01]), np.array([0.0, 0.05] * 3), np.array([0]), np.array([1]),
        np.array([[-1.0, 0.0, 0.0]]), np.array([5.0]), np.array([[0.0, 1.0, 0.0]]), None, np.array([[-1, 0, 0]]),
    )  # fmt: skip


@pytest.mark.parametrize("flags", ["pp ff ff", "pp pp pp"])
@pytest.mark.parametrize("shift", [0.0, 0.05])
def test_contacts_through_periodic_faces(tmp_path, flags, shift):
    """The images are the nearest; grains that are written outside of the cell are put back."""
    snapshot = pair_across_a_face(shift)
    path, row = write(snapshot, tmp_path, flags=flags)
    found = rd.io.read(path)
    assert found.is_periodic
    sign = 1.0 if row[0] == found.first[0] else -1.0
    assert_allclose(sign * found.branch, [[-0.0189, 0.0, 0.0]], atol=1e-15)
    assert_allclose(sign * found.force, [[-5.0, 1.0, 0.0]], atol=1e-15)
    assert_allclose(found.wall_stress[0, 0], 5.0 / 0.05**2, rtol=1e-12)
    assert_allclose(found.position[row], [[0.001, 0.02, 0.02], [0.0321, 0.02, 0.02]], rtol=0, atol=1e-15)


def cell(number, column, word):
    """Change one word of a row of the table, counted from its heading."""

    def change(text):
        lines = text.splitlines()
        at = next(k for k, line in enumerate(lines) if line.startswith(("ITEM: ATOMS", "ITEM: ENTRIES"))) + number
        words = lines[at].split()
        words[column] = word
        lines[at] = " ".join(words)
        return "\n".join(lines) + "\n"

    return change


def scaled(column, factor):
    """Multiply a column of the table."""

    def change(text):
        begin, heading, table = text.partition("ITEM: ENTRIES ")
        names, *lines = table.splitlines()
        words = [line.split() for line in lines]
        for row in words:
            row[column] = f"{factor * float(row[column]):.17g}"
        return begin + heading + names + "\n" + "\n".join(map(" ".join, words)) + "\n"

    return change


def short(text):
    return "\n".join(text.splitlines()[:-3]) + "\n"


def fewer_digits(text):
    begin, heading, table = text.partition("ITEM: ATOMS ")
    names, *lines = table.splitlines()
    rounded = [" ".join(f"{float(word):g}" for word in line.split()) for line in lines]
    return begin + heading + names + "\n" + "\n".join(rounded) + "\n"


GRAINS = [
    (short, "200: truncated"),
    (lambda text: text[: text.index("ITEM: ATOMS")], "lacks the section 'ITEM: ATOMS '"),
    (lambda text: text + text, "more than one step"),
    (lambda text: "ITEM: UNITS\nlj\n" + text, "in units 'lj', expected 'si'"),
    (lambda text: text.replace("ff ff ff", "xy xz yz ff ff ff"), "a box along the axes"),
    (lambda text: text.replace("\n1000\n", "\nsoon\n", 1), "section TIMESTEP must be a whole number, found 'soon'"),
    (lambda text: text.replace("\n1000\n", "\n2000\n", 1), "is of step 1000, .*state.dump of step 2000"),
    (lambda text: text.replace(" id x y z", " id xs ys zs"), r"lacks the column\(s\) x, y, z"),
    (lambda text: text.replace(" radius ", " rad "), r"lacks the column\(s\) radius"),
    (lambda text: text.replace(" v_wall3 ", " other "), r"does not tell where the wall x- is"),
    (lambda text: text.replace(" y z ", " y y "), "two columns of one name"),
    (cell(2, 1, "nan"), "row 2, column x: expected a number, found 'nan'"),
    (cell(3, 4, "-0.01"), "radius, row .*: expected a positive length"),
    (cell(3, 4, "1e400"), "row 3, column radius: expected a number, found '1e400'"),
    (cell(5, 0, "1.5"), "row 5, column id: expected a whole number"),
    (cell(4, 3, ""), "row 4 has 10 columns, expected the 11"),
    (cell(4, 3, "0.1 0.1"), "row 4 has 12 columns, expected the 11"),
    (fewer_digits, "fewer digits than 'dump_modify format float %.17g'"),
]

CONTACTS = [
    (short, "truncated"),
    (lambda text: text.replace("ENTRIES", "ATOMS"), "lacks the section"),
    (cell(2, 0, "100000"), r"row 2, column c_ids\[1\]: there is no grain 100000"),
    (cell(2, 1, "0"), r"row 2, column c_ids\[2\]: there is no grain 0"),
    (cell(3, 4, "inf"), r"row 3, column c_force\[3\]: expected a number"),
    (scaled(3, -1.0), "must be the normal force along the line of centres"),
    (lambda text: text.replace("c_force[1] c_force[2]", "c_force[2] c_force[1]"), "must be the normal force"),
    (
        lambda text: (
            text.replace("c_force[4]", "c_f").replace("c_force[1]", "c_force[4]").replace("c_f ", "c_force[1] ")
        ),
        "must be the normal",
    ),
]


@pytest.mark.parametrize(("spoil", "words"), GRAINS)
def test_spoilt_dumps_of_grains_are_told(snapshot, tmp_path, spoil, words):
    path, _ = write(snapshot, tmp_path)
    path.write_text(spoil(path.read_text()))
    with pytest.raises((CorruptFile, InvalidInput), match=words) as told:
        rd.io.read(path)
    assert "state." in str(told.value)


@pytest.mark.parametrize(("spoil", "words"), CONTACTS)
def test_spoilt_dumps_of_contacts_are_told(snapshot, tmp_path, spoil, words):
    path = write(snapshot, tmp_path)[0].with_suffix(".contacts")
    path.write_text(spoil(path.read_text()))
    with pytest.raises(CorruptFile, match=words) as told:
        rd.io.read(path.with_suffix(".dump"))
    assert "state.contacts" in str(told.value)


def test_mixed_up_files_are_told(snapshot, tmp_path):
    """Contacts of another state, a grain or a pair twice, no contacts at all, bytes that are no text."""
    path, _ = write(snapshot, tmp_path)
    moved = replace(snapshot, position=snapshot.position + 1e-5 * np.random.default_rng(1).normal(size=(200, 3)))
    other, _ = write(moved, tmp_path, name="other")  # with the normals from before
    with pytest.raises(CorruptFile, match="files of two states"):
        rd.io.read(other)
    with pytest.raises(CorruptFile, match="files of two states"):
        rd.io.lammps.read_snapshot(other, path.with_suffix(".contacts"))
    lines = path.read_text().splitlines()
    path.write_text("\n".join([*lines[:-1], lines[-2], ""]))
    with pytest.raises(CorruptFile, match="column id names a grain twice"):
        rd.io.read(path)
    path.write_bytes("ITEM: TIMESTEP\né\n".encode("latin-1"))
    with pytest.raises(CorruptFile, match=r"state\.dump is no text file"):
        rd.io.read(path)
    contacts = other.with_suffix(".contacts")
    lines = contacts.read_text().splitlines()
    contacts.write_text("\n".join([*lines[:-1], lines[-2], ""]))
    with pytest.raises(CorruptFile, match="name a pair of grains twice"):
        rd.io.read(other)
    contacts.unlink()
    with pytest.raises(InvalidInput, match=r"no file .*other\.contacts"):
        rd.io.read(other)


def test_walls_that_are_not_known(snapshot, tmp_path):
    """A wall that no grain touches must be given; one that is no plane across an axis is refused."""
    last = snapshot.second == snapshot.n_grains + 5
    kept = {
        name: getattr(snapshot, name)[~last] for name in ("first", "second", "normal", "force_n", "force_t")
    }  # fmt: skip
    path, _ = write(replace(snapshot, **kept), tmp_path, "fixes")
    with pytest.raises(InvalidInput, match=r"where the wall z\+ is: no grain touches it"):
        rd.io.read(path)
    found = rd.io.lammps.read_snapshot(path, walls=snapshot.wall_position)
    assert_allclose(found.wall_position, snapshot.wall_position, rtol=0, atol=1e-15)
    with pytest.raises(InvalidInput, match="walls must have shape"):
        rd.io.lammps.read_snapshot(path, walls=[0.0, 1.0])
    path, _ = write(snapshot, tmp_path, "fixes")
    lines = path.read_text().splitlines()
    at = next(k for k, line in enumerate(lines) if len(line.split()) == 26 and line.split()[5] == "1")
    words = lines[at].split()
    for column, expected in ((10, "no plane across an axis"), (9, "lie in more than one plane")):
        spoilt = words.copy()
        spoilt[column] = f"{float(words[column]) + 1e-4:.17g}"
        path.write_text("\n".join([*lines[:at], " ".join(spoilt), *lines[at + 1 :], ""]))
        with pytest.raises(CorruptFile, match=expected):
            rd.io.read(path)


# -- any change ----------------------------------------------------------------------------------

PLAIN = settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
WORDS = ["", "nan", "inf", "-1", "1e400", "0x10", "1_0", "ITEM:", "999999", "1.5", "0", "0 0", "'", "#", "\x00"]


def outcome(read, path, measure):
    """What agrees with itself, or an error of ours that names the file."""
    told = ""
    try:
        found = read(path)
    except RendulicError as error:
        told = str(error)
    if told:
        assert path.stem in told, told
    else:
        assert np.isfinite(measure(found))


def spoil(data, text):
    """Text with a word changed, or bytes flipped, cut off, doubled or put in between."""
    how = data.draw(st.sampled_from(["word", "flip", "cut", "insert", "double"]))
    if how == "word":
        lines = text.split("\n")
        line = data.draw(st.integers(0, len(lines) - 1))
        words = lines[line].split(" ")
        words[data.draw(st.integers(0, len(words) - 1))] = data.draw(st.sampled_from(WORDS))
        lines[line] = " ".join(words)
        return "\n".join(lines).encode()
    spoilt = bytearray(text.encode())
    at = data.draw(st.integers(0, len(spoilt) - 1))
    if how == "flip":
        spoilt[at] ^= data.draw(st.integers(1, 255))
    elif how == "cut":
        del spoilt[at:]
    elif how == "insert":
        spoilt[at:at] = data.draw(st.binary(min_size=1, max_size=20))
    else:
        spoilt[at:at] = spoilt[: data.draw(st.integers(1, len(spoilt)))]
    return bytes(spoilt)


@pytest.fixture(scope="module")
def few(snapshot, tmp_path_factory):
    """A state of twelve grains, as two kinds of dump and as a data file: folders and texts."""
    near = np.argsort(np.linalg.norm(snapshot.position - snapshot.wall_position[0::2], axis=1))[:12]
    number = np.full(snapshot.n_grains + 6, -1)
    number[near], number[-6:] = np.arange(12), 12 + np.arange(6)
    first, second = number[snapshot.first], number[snapshot.second]
    kept = (first >= 0) & (second >= 0)
    small = replace(
        snapshot, position=snapshot.position[near], radius=snapshot.radius[near], first=first[kept], second=second[kept],
        normal=snapshot.normal[kept], force_n=snapshot.force_n[kept], force_t=snapshot.force_t[kept],
    )  # fmt: skip
    folder = tmp_path_factory.mktemp("few")
    write(small, folder, "faces", "faces")
    write(small, folder, "fixes", "fixes")
    sample = rd.dem.Assembly(small.position, small.radius, snapshot.wall_position)
    rd.io.lammps.write_deck(sample, folder)
    return folder


@PLAIN
@given(st.data())
def test_any_change_of_a_dump_is_refused_or_harmless(few, data):
    name = data.draw(st.sampled_from(["faces.dump", "faces.contacts", "fixes.dump", "fixes.contacts"]))
    path = few / name
    text = path.read_text()

    def read(changed):
        return rd.io.lammps.read_snapshot(changed.with_suffix(".dump"), walls=[0.0, 1.0] * 3)

    try:
        path.write_bytes(spoil(data, text))
        outcome(read, path, lambda found: rd.second_order_work(found, found).boundary)
    finally:
        path.write_text(text)


@PLAIN
@given(st.data())
def test_any_change_of_a_data_file_is_refused_or_harmless(few, data):
    path = few / "spoilt.data"
    path.write_bytes(spoil(data, (few / "state.data").read_text()))
    told = ""
    try:
        found = rd.io.lammps.read_data(path)
    except RendulicError as error:
        told = str(error)
    assert told or np.isfinite(found.stress).all()


@PLAIN
@given(st.data())
def test_any_file_that_is_cut_off_is_refused(few, data):
    """Also in the middle of its last number."""
    name = data.draw(st.sampled_from(["faces.dump", "faces.contacts", "fixes.dump", "state.data"]))
    text = (few / name).read_text()
    for beside in (few / name).parent.glob("faces.*"):
        (few / f"cut{beside.suffix}").write_text(beside.read_text())
    path = few / f"cut{(few / name).suffix}"
    path.write_text(text[: data.draw(st.integers(0, len(text) - 1))])
    read = rd.io.lammps.read_data if name == "state.data" else rd.io.lammps.read_snapshot
    with pytest.raises((CorruptFile, InvalidInput), match="cut"):
        read(path if name == "state.data" else path.with_suffix(".dump"))


# -- data files ----------------------------------------------------------------------------------

DATA = """\
LAMMPS data file via write_data, version 22 Jul 2025, timestep = 4, units = si

2 atoms
1 atom types

0 0.04 xlo xhi
0 0.02 ylo yhi
0 0.02 zlo zhi

Atoms # sphere

7 1 0.02 2600 0.0289 0.01 0.01 0 0 0
3 1 0.02 2600 0.0099 0.01 0.01 0 0 0

Velocities

3 1 0 0 0 0 4
7 2 0 0 0 0 5
"""


def test_a_data_file_becomes_an_assembly(tmp_path):
    (tmp_path / "two.data").write_text(DATA)
    found = rd.io.lammps.read_data(tmp_path / "two.data", damping=0.2)
    assert np.array_equal(found.grains.position, [[0.0099, 0.01, 0.01], [0.0289, 0.01, 0.01]])
    assert np.array_equal(found.grains.radius, [0.01, 0.01])
    assert np.array_equal(found.grains.velocity[:, 0], [1.0, 2.0])
    assert np.array_equal(found.grains.angular_velocity[:, 2], [4.0, 5.0])
    assert np.array_equal(found.walls.position, [0, 0.04, 0, 0.02, 0, 0.02])
    assert (found.density, found.damping) == (2600.0, 0.2)
    assert found.snapshot().force_n[0] == pytest.approx(found.law.modulus * 0.02 * 0.001)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("units = si", "units = lj", "in units 'lj', expected 'si'"),
        ("# sphere", "# atomic", "section Atoms is of style 'atomic'"),
        ("Atoms # sphere", "", "there is no section Atoms"),
        ("2 atoms", "3 atoms", "has 2 rows in section Atoms, its header says 3: truncated"),
        ("2 atoms", "", "its header does not say how many"),
        ("0 0.02 ylo yhi", "", "a line 'low high ylo yhi' of two numbers"),
        ("0 0.02 ylo yhi", "0 a ylo yhi", "a line 'low high ylo yhi' of two numbers"),
        ("7 1 0.02 2600", "7 1 0.02 2500", "column density of section Atoms must be one density"),
        ("7 1 0.02", "3 1 0.02", "column id of section Atoms names a grain twice"),
        ("7 1 0.02", "7 1 nan", "row 1, column diameter: expected a number"),
        ("0.01 0 0 0\n3", "0.01 0 0\n3", "row 1 has 9 columns"),
        ("7 2 0 0 0 0 5", "", "section Velocities does not name the grains"),
        ("0.0289", "0.0589", "spoilt.data: "),
        ("0.0289", "0.0100", "spoilt.data: "),
    ],
)
def test_spoilt_data_files_are_told(tmp_path, old, new, words):
    path = tmp_path / "spoilt.data"
    path.write_text(DATA.replace(old, new))
    with pytest.raises((CorruptFile, InvalidInput), match=words) as told:
        rd.io.lammps.read_data(path)
    assert "spoilt.data" in str(told.value)
    with pytest.raises(InvalidInput, match="no file"):
        rd.io.lammps.read_data(tmp_path / "none.data")
