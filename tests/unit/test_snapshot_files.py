"""Snapshots in files: round trips, foreign and spoilt files, and what is said of them."""

from __future__ import annotations

import json
import struct
import subprocess
import sys
from dataclasses import fields, replace
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import rendulic as rd
from rendulic.foundation.errors import CorruptFile, InvalidInput, RendulicError
from rendulic.tensors.rendulic_plane import increment_along


@pytest.fixture(scope="module")
def sample(sheared_state):
    return rd.dem.Assembly.from_state(sheared_state)


@pytest.fixture(scope="module")
def snapshot(sample):
    return sample.snapshot()


COMMAND = Path(sys.executable).with_name("rendulic")


def periodic(snapshot):
    """The same grains without walls, some contacts across faces; the numbers need not be mechanics."""
    kept = ~snapshot.is_wall
    image = np.zeros((int(kept.sum()), 3), dtype=np.int64)
    image[:5, 0] = 1
    normal = snapshot.normal[kept].copy()
    return replace(
        snapshot, first=snapshot.first[kept], second=snapshot.second[kept], normal=normal,
        force_n=snapshot.force_n[kept], force_t=snapshot.force_t[kept], image=image,
    )  # fmt: skip


def same(one, other, exact=True):
    for field in fields(one):
        a, b = getattr(one, field.name), getattr(other, field.name)
        if field.name == "recorded":
            assert exact is False or a == b
        elif a is None or b is None or field.name == "friction":
            assert a == b, field.name
        elif exact or field.name in ("first", "second", "image"):
            assert np.array_equal(a, b), field.name
        else:
            assert np.allclose(a, b, rtol=0, atol=1e-14 * np.abs(a).max()), field.name


def test_neutral_files_give_back_every_bit(snapshot, tmp_path):
    for one in (snapshot, periodic(snapshot), replace(snapshot, friction=None)):
        path = rd.io.write_snapshot(one, tmp_path / "one.h5", {"engine": "rendulic", "step": 3})
        same(rd.io.read_snapshot(path), one)
        same(rd.io.read(path), one)
        assert rd.io.read_about(path) == {"engine": "rendulic", "step": 3}


def test_plain_text_gives_back_the_snapshot(snapshot, tmp_path):
    folder = rd.io.write_plain_text(snapshot, tmp_path / "text")
    same(rd.io.read(folder), snapshot, exact=False)


def test_plain_text_of_another_orientation_and_convention(snapshot, tmp_path):
    """Axes renamed, forces on the first body, contacts and grains in another order, no normals."""
    folder = rd.io.write_plain_text(snapshot, tmp_path / "text")
    # z is axial: axes 1, 2, 3 are z, x, y
    # the default parser of older pandas loses last bits
    grains, contacts = (
        pd.read_csv(folder / name, float_precision="round_trip") for name in ("grains.csv", "contacts.csv")
    )
    grains = grains.rename(columns={"x": "z", "y": "x", "z": "y"}).sample(frac=1.0, random_state=1)
    contacts = contacts.rename(columns={"fx": "fz", "fy": "fx", "fz": "fy"}).drop(columns=["nx", "ny", "nz"])
    contacts[["fx", "fy", "fz"]] *= -1.0
    contacts = contacts.sample(frac=1.0, random_state=2)
    faces, n = snapshot.wall_position.reshape(3, 2)[[1, 2, 0]].reshape(-1), snapshot.n_grains
    walls = (n + 1 + np.arange(6)).reshape(3, 2)[[1, 2, 0]].reshape(-1).tolist()
    grains.to_csv(folder / "grains.csv", index=False, float_format="%.17g")
    contacts.to_csv(folder / "contacts.csv", index=False, float_format="%.17g")
    box = f'faces = {faces.tolist()}\nwalls = {walls}\nforces = "on first"\naxes = "zxy"\nfriction = {snapshot.friction}\n'
    (folder / "box.toml").write_text(box)
    found = rd.io.read(folder)
    assert np.allclose(found.wall_stress, snapshot.wall_stress, rtol=0, atol=1e-9)
    work = rd.second_order_work(snapshot, found)
    assert abs(work.contacts) < 1e-12
    assert np.allclose(found.position, snapshot.position, rtol=1e-14, atol=0)


def test_plain_text_of_grains_that_touch_twice(snapshot, tmp_path):
    """Points of one pair are summed where normals are given; a repeated row is refused, and so are two points of spheres."""
    folder = rd.io.write_plain_text(snapshot, tmp_path / "text")
    rows = pd.read_csv(folder / "contacts.csv")
    force = ["fx", "fy", "fz"]
    halves = rows.copy()
    halves[force] *= 0.25
    rows[force] *= 0.75
    pd.concat((rows, halves)).to_csv(folder / "contacts.csv", index=False, float_format="%.17g")
    merged, order = rd.io.read(folder), np.lexsort((snapshot.second, snapshot.first))
    assert np.array_equal(merged.second, snapshot.second[order])
    assert np.allclose(merged.force, snapshot.force[order], rtol=0, atol=1e-15 * np.abs(snapshot.force).max())
    assert np.allclose(merged.normal, snapshot.normal[order], rtol=0, atol=1e-14)
    pd.concat((rows, rows[:1])).to_csv(folder / "contacts.csv", index=False, float_format="%.17g")
    with pytest.raises(CorruptFile, match=rf"row {len(rows) + 2} repeats another; each contact must appear once"):
        rd.io.read(folder)
    spheres = pd.concat((rows, halves[:1])).drop(columns=["nx", "ny", "nz"])
    spheres.to_csv(folder / "contacts.csv", index=False, float_format="%.17g")
    with pytest.raises(InvalidInput, match="lists the same pair of bodies twice"):
        rd.second_order_work(rd.io.read(folder), snapshot)


@pytest.mark.parametrize("box", ["walls", "cell"])
def test_another_axial_axis_is_the_same_state(snapshot, box):
    """Turned axes turn stress and branches, and nothing else; three turns are none."""
    start = snapshot if box == "walls" else periodic(snapshot)
    for axis in range(3):
        turned = start.with_axial(axis)
        order = np.roll(np.arange(3), -axis)
        assert np.allclose(np.diag(turned.wall_stress), np.diag(start.wall_stress)[order], rtol=1e-15, atol=0)
        assert np.array_equal(turned.branch, start.branch[:, order])
        assert np.allclose(turned.force, start.force[:, order], rtol=1e-14, atol=0)
        same(turned.with_axial((3 - axis) % 3), start)


def test_states_are_snapshots_too(sample, snapshot, tmp_path):
    sample.save().to_file(tmp_path / "state.h5")
    same(rd.io.read(tmp_path / "state.h5"), snapshot)
    sand = rd.ChangHicher().at(pressure=300e3, void_ratio=0.9)
    sand.save().to_file(tmp_path / "sand.h5")
    with pytest.raises(InvalidInput, match="expected the state of a specimen of kind"):
        rd.io.read(tmp_path / "sand.h5")


def test_probes_of_snapshots_are_those_of_probe(sample, tmp_path):
    """A set of probes, made here and read back from files, gives the same dataset and the same cone."""
    around, norm = rd.directions.rendulic(60), 2e-4
    expected = rd.probe(sample, around, norm, rate=norm / 100, settle=False)
    after = {}
    for alpha in (*around.alpha, None):
        one = sample.clone()
        one.probe(increment_along(alpha, norm) if alpha is not None else np.zeros(3), 100)
        after[alpha] = one.snapshot()
    null = after.pop(None)
    found = rd.probes_of_snapshots(sample.snapshot(), after.values(), null)
    assert np.allclose(found.alpha, expected.alpha, rtol=0, atol=1e-8)
    # strains are differences of walls at 0.1 m, rounded by 1e-17 m: 1e-12 of an increment of 2e-4, and of its work
    for name in ("w2_normalised", "w2_boundary", "w2_contacts", "w2_drift", "unbalanced_force"):
        scale = float(np.abs(expected["w2_boundary" if name == "w2_drift" else name]).max())
        assert np.allclose(found[name], expected[name], rtol=0, atol=1e-11 * scale), name
    assert (found.identity_residual < 1e-12).all()
    assert rd.cone_of(found).smallest_w2n == pytest.approx(rd.cone_of(expected).smallest_w2n, abs=1e-11)
    with pytest.raises(InvalidInput, match="probe 1 has no strain"):
        rd.probes_of_snapshots(sample.snapshot(), [sample.snapshot()])
    with pytest.raises(InvalidInput, match="there are no snapshots"):
        rd.probes_of_snapshots(sample.snapshot(), [])
    with pytest.raises(InvalidInput, match="probes 1 and 2 have the same direction"):
        rd.probes_of_snapshots(sample.snapshot(), [after[0.0], after[0.0]])


SPOILT = [
    (lambda file: file.attrs.__delitem__("forces"), "attribute 'forces' must be 'on second, compression positive'"),
    (lambda file: file.attrs.__setitem__("schema", 2), "attribute 'schema' must be 1, found"),
    (lambda file: file.attrs.__setitem__("about", "[1"), "not a readable snapshot"),
    (lambda file: file.attrs.__setitem__("friction", -0.5), "friction must be zero or positive"),
    (lambda file: file.__delitem__("grains/position"), "lacks the field grains/position"),
    (lambda file: file["grains/position"].__setitem__((3, 1), np.nan), "position, row 3: expected a finite number"),
    (lambda file: file["grains/radius"].__setitem__(2, -1.0), "radius, row 2: expected a positive length"),
    (lambda file: file["contacts/first"].__setitem__(0, 10**6), "first, row 0: expected a grain, 0 to 199"),
    (lambda file: file["contacts/second"].__setitem__(1, -1), "second, row 1: expected a grain below 200"),
    (lambda file: file["contacts/normal"].__setitem__(4, [0.0, 0.0, 2.0]), "normal, row 4: expected a unit vector"),
    (lambda file: file["contacts/normal"].__setitem__(..., -file["contacts/normal"][()]), "normal must point from"),
    (lambda file: file["box/faces"].__setitem__(..., [0, -1, 0, 1, 0, 1]), "faces of the box must be"),
    (lambda file: replaced(file, "contacts/force_n", np.ones(3)), "force_n has 3 rows"),
    (lambda file: replaced(file, "contacts/first", np.ones(3)), "must be of integers"),
    (lambda file: replaced(file, "box/faces", np.ones(5)), r"must have the shape \(6,\), found \(5,\)"),
    (lambda file: replaced(file, "grains/radius", np.array([b"a"])), "must be of numbers"),
    (lambda file: linked(file, h5py.ExternalLink("other.h5", "/radius")), "is a link"),
    (lambda file: linked(file, h5py.SoftLink("/grains/position")), "is a link"),
]  # fmt: skip


def replaced(file, name, values):
    del file[name]
    file[name] = values


def linked(file, link):
    del file["grains/radius"]
    file["grains/radius"] = link


@pytest.mark.parametrize(("spoil", "words"), SPOILT)
def test_spoilt_neutral_files_are_told(snapshot, tmp_path, spoil, words):
    path = rd.io.write_snapshot(snapshot, tmp_path / "one.h5")
    with h5py.File(path, "r+") as file:
        spoil(file)
    with pytest.raises(CorruptFile, match=words) as told:
        rd.io.read(path)
    assert "one.h5" in str(told.value)


def objects_of_heap(data):
    """Places of the objects in the heap of texts of a file, with their numbers."""
    heap = data.index(b"GCOL\1\0\0\0")
    at, end = heap + 16, heap + int.from_bytes(data[heap + 8 : heap + 16], "little")
    while at + 16 <= end:
        number, length = struct.unpack_from("<H6xQ", data, at)
        yield at, number
        at += 16 + (length + 7) // 8 * 8 if number else length


def test_a_heap_without_end_is_refused(snapshot, tmp_path):
    """The library would follow a free room of no length for ever."""
    path = rd.io.write_snapshot(snapshot, tmp_path / "one.h5")
    data = bytearray(path.read_bytes())
    (free,) = (at for at, number in objects_of_heap(data) if number == 0)
    data[free + 8 : free + 16] = bytes(8)
    path.write_bytes(data)
    with pytest.raises(CorruptFile, match=r"one.h5 .*a heap of texts has no end"):
        rd.io.read(path)


def test_a_text_that_claims_gigabytes_is_refused(snapshot, tmp_path):
    """The library would ask for so much memory before it looks at the text."""
    path = rd.io.write_snapshot(snapshot, tmp_path / "one.h5")
    data = bytearray(path.read_bytes())
    heap = data.index(b"GCOL\1\0\0\0")
    reference = data.index(struct.pack("<QI", heap, 1))
    data[reference - 4 : reference] = struct.pack("<I", 2**32 - 1)
    path.write_bytes(data)
    with pytest.raises(CorruptFile, match=r"one.h5 .*a text claims 4294967295 bytes"):
        rd.io.read(path)


@pytest.fixture(scope="module")
def good_files(snapshot, tmp_path_factory):
    folder = tmp_path_factory.mktemp("good")
    small = folder / "small.h5"
    kept = (snapshot.first < 12) & (snapshot.second < 12)
    rd.io.write_snapshot(
        replace(
            snapshot, recorded=None, position=snapshot.position[:12], radius=snapshot.radius[:12], first=snapshot.first[kept],
            second=snapshot.second[kept], normal=snapshot.normal[kept], force_n=snapshot.force_n[kept], force_t=snapshot.force_t[kept],
        ),
        small,
    )  # fmt: skip
    rd.io.write_plain_text(rd.io.read(small), folder / "text")
    return folder


def outcome(path, names):
    """A snapshot that agrees with itself, or an error of ours that names the file."""
    told = ""
    try:
        found = rd.io.read(path)
    except RendulicError as error:
        told = str(error)
    if told:
        assert any(name in told for name in names), told
    else:
        assert np.isfinite(rd.second_order_work(found, found).boundary)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_any_change_of_bytes_is_refused_or_harmless(good_files, data):
    """Bytes altered, cut or put in between: an error of ours, or a snapshot that agrees with itself; nothing else."""
    folder = good_files
    spoilt = bytearray((folder / "small.h5").read_bytes())
    how = data.draw(st.sampled_from(["flip", "cut", "insert"]))
    at = data.draw(st.integers(0, len(spoilt) - 1))
    if how == "flip":
        spoilt[at] ^= data.draw(st.integers(1, 255))
    elif how == "cut":
        del spoilt[at:]
    else:
        spoilt[at:at] = data.draw(st.binary(min_size=1, max_size=20))
    path = folder / "spoilt.h5"
    path.write_bytes(bytes(spoilt))
    outcome(path, [str(path)])


CELLS = ["", "nan", "inf", "-1", "1e400", "0x10", "=1+1", "__import__('os')", "1;2", "999999", "1.5", "é"]


@settings(max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_any_change_of_a_cell_is_refused_or_harmless(good_files, data):
    folder = good_files
    name = data.draw(st.sampled_from(["grains.csv", "contacts.csv", "box.toml"]))
    text = (folder / "text" / name).read_text(encoding="utf-8")
    rows = [row.split(",") for row in text.splitlines()]
    row = data.draw(st.integers(0, len(rows) - 1))
    column = data.draw(st.integers(0, len(rows[row]) - 1))
    rows[row][column] = data.draw(st.sampled_from(CELLS))
    try:
        (folder / "text" / name).write_text("\n".join(",".join(row) for row in rows), encoding="utf-8")
        outcome(folder / "text", [name, str(folder)])
    finally:
        (folder / "text" / name).write_text(text, encoding="utf-8")


def test_wrong_things_at_the_path(tmp_path):
    with pytest.raises(InvalidInput, match="no snapshot at"):
        rd.io.read(tmp_path / "none.h5")
    with pytest.raises(InvalidInput, match=r"no box\.toml in"):
        rd.io.read(tmp_path)
    (tmp_path / "note.h5").write_text("not at all")
    with pytest.raises(CorruptFile, match="of no known kind"):
        rd.io.read(tmp_path / "note.h5")
    with h5py.File(tmp_path / "foreign.h5", "w") as file:
        file["a"] = 1
    with pytest.raises(CorruptFile, match="attribute 'format' must be 'rendulic snapshot'"):
        rd.io.read(tmp_path / "foreign.h5")


def run(*arguments, cwd):
    return subprocess.run([COMMAND, "analyze", *arguments], cwd=cwd, capture_output=True, text=True)


def test_analyze_two_snapshots(sample, snapshot, tmp_path):
    after = sample.clone()
    after.probe(increment_along(130.0, 2e-4), 200)
    rd.io.write_snapshot(snapshot, tmp_path / "before.h5")
    rd.io.write_plain_text(after.snapshot(), tmp_path / "after")
    done = run("before.h5", "after", "--report", "report", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "identity_residual" in done.stdout
    numbers = json.loads((tmp_path / "report" / "second_order_work.json").read_text())
    work = rd.second_order_work(snapshot, after.snapshot())
    assert numbers["w2_boundary"] == pytest.approx(work.boundary, rel=1e-9)
    assert numbers["identity_residual"] < 1e-12
    assert {path.name for path in (tmp_path / "report").iterdir()} >= {"anatomy.png", "anatomy.pdf", "anatomy.nc"}


def test_analyze_a_folder_of_probes(sample, snapshot, tmp_path):
    rd.io.write_snapshot(snapshot, tmp_path / "before.h5")
    (tmp_path / "probes").mkdir()
    lines = ["file,role"]
    for alpha in (None, 0, 60, 120, 180, 240, 300):
        one = sample.clone()
        one.probe(np.zeros(3) if alpha is None else increment_along(alpha, 2e-4), 100)
        rd.io.write_snapshot(one.snapshot(), tmp_path / "probes" / f"{alpha}.h5")
        lines.append(f"{alpha}.h5,{'null' if alpha is None else 'probe'}")
    (tmp_path / "probes" / "probes.csv").write_text("\n".join(lines))
    done = run("before.h5", "probes", "--report", "report", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    numbers = json.loads((tmp_path / "report" / "second_order_work.json").read_text())
    assert numbers["probes"] == 6
    assert "unstable" in numbers["cone"]
    assert (tmp_path / "report" / "circular.png").exists()
    (tmp_path / "probes" / "probes.csv").write_text("file\n../before.h5\n")
    refused = run("before.h5", "probes", cwd=tmp_path)
    assert refused.returncode == 2
    assert "lies outside of the folder" in refused.stderr
    assert len(refused.stderr.splitlines()) == 1


def test_analyze_takes_friction_and_the_axial_axis(sample, snapshot, tmp_path):
    """Strain along axis 1 is strain along axis 3 of a file that is turned; sliding contacts are told by the friction."""
    after = sample.clone()
    after.probe(increment_along(120.0, 1e-4), 500)
    for name, state in (("before", snapshot), ("after", after.snapshot())):
        rd.io.write_snapshot(replace(state, friction=None).with_axial(1), tmp_path / f"{name}.h5")
    plain = rd.second_order_work(snapshot, after.snapshot())
    for options, slides in (([], False), (["--friction", "0.7"], True)):
        done = run("before.h5", "after.h5", "--axial", "z", "--report", "r", *options, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        found = json.loads((tmp_path / "r" / "second_order_work.json").read_text())
        assert np.allclose(found["d_eps"], plain.d_eps, rtol=0, atol=1e-15)
        assert (found["w2_sliding"] != 0.0) == slides
    assert run("before.h5", "after.h5", "--axial", "w", cwd=tmp_path).returncode == 2


def test_analyze_refuses_in_one_line(snapshot, tmp_path):
    rd.io.write_snapshot(snapshot, tmp_path / "before.h5")
    other = replace(snapshot, radius=snapshot.radius * 1.01)
    rd.io.write_snapshot(other, tmp_path / "other.h5")
    for arguments, words in (
        (("before.h5", "none.h5"), "no snapshot at none.h5"),
        (("before.h5", "other.h5"), "200 radii differ"),
        (("before.h5", "."), "no box.toml in"),
    ):
        done = run(*arguments, cwd=tmp_path)
        assert done.returncode == 2
        assert words in done.stderr
        assert len(done.stderr.splitlines()) == 1
