"""What goes out: tables as NetCDF and CSV and back, `rendulic export`, and what is refused."""

from __future__ import annotations

import csv
import json
import sys

import h5py
import numpy as np
import pytest
import xarray as xr
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

import rendulic as rd
from rendulic.foundation.errors import CorruptFile, InvalidInput, RendulicError
from rendulic.io.export import export, export_all
from rendulic.io.tables import write_tables


@pytest.fixture(scope="module")
def curve():
    """An undrained test of the model: variables along records, planes and events, and units on all."""
    return rd.ChangHicher.preset("hostun_loose").at(pressure=300e3, void_ratio=0.9).load(rd.paths.constant_volume(0.03))


@pytest.fixture(scope="module")
def instants(sheared_state):
    """A sheared packing before and after a small compression."""
    sample = rd.dem.Assembly.from_state(sheared_state)
    before = sample.snapshot()
    sample.probe(np.array([1e-4, -2e-5, -2e-5]), 100)
    return before, sample.snapshot()


@pytest.fixture(scope="module")
def other():
    """Other grains."""
    return rd.dem.pack(n_grains=60, radius=(8e-3, 12e-3), pressure=200e3, seed=1).snapshot()


@pytest.fixture(scope="module")
def folder(tmp_path_factory, instants, curve):
    """Files to export, one of them spoilt."""
    place = tmp_path_factory.mktemp("out")
    for name, snapshot in zip(("before", "after"), instants, strict=True):
        rd.io.write_snapshot(snapshot, place / f"{name}.h5")
    rd.io.write_dataset(curve, place / "tests" / "curve.nc")
    (place / "tests" / "spoilt.h5").write_bytes((place / "after.h5").read_bytes()[:3000])
    return place


def columns_of(path):
    """Columns of a CSV file by their names without units, and the units."""
    with path.open(encoding="utf-8", newline="") as file:
        headings, *rows = csv.reader(file)
    parts = [heading.removesuffix("]").partition(" [") for heading in headings]
    columns = {part[0]: np.array([_number(row[k]) for row in rows]) for k, part in enumerate(parts)}
    return columns, {part[0]: part[2] for part in parts}


def _number(text):
    try:
        return float(text)
    except ValueError:
        return text


# --- tables -----------------------------------------------------------------------------------------------


def test_netcdf_gives_back_all(curve, tmp_path):
    """Values, dimensions, units and attributes of a curve and of a set of probes."""
    probes = rd.probe(
        rd.ChangHicher.preset("hostun_loose").at(300e3, 0.9), rd.directions.rendulic(60), norm=[1e-6, 1e-5]
    )
    for table in (curve, probes):
        found = rd.io.read_dataset(rd.io.write_dataset(table, tmp_path / "one.nc"))
        assert_array_equal(list(found.variables), list(table.variables))
        for name in table.variables:
            assert_array_equal(found[name].values, table[name].values)
            assert found[name].attrs == table[name].attrs
        assert set(found.attrs) == set(table.attrs)


def test_csv_has_every_digit_and_the_units(curve, tmp_path):
    """A table of one dimension, read back by pandas, is the same to the last bit; headings name the units."""
    values, units = columns_of(rd.io.write_csv(curve[["eps_1", "q", "eta"]], tmp_path / "curve.csv"))
    for name in ("eps_1", "q", "eta"):
        assert_array_equal(values[name], curve[name].values)
    assert units == {"record": "", "eps_1": "", "q": "Pa", "eta": ""}


def test_tables_of_several_dimensions_are_several_files(curve, tmp_path):
    """No value is repeated: each file has as many rows as its dimensions have points, and all of their variables."""
    extra = curve.assign(limit=((), 2.5, {"units": "kPa"}))
    written = {path.name: path for path in write_tables(extra, tmp_path / "curve.csv")}
    assert {"curve.csv", "curve_event.csv", "curve_record_plane.csv", "curve_values.csv"} <= set(written)
    assert len(columns_of(written["curve.csv"])[0]["q"]) == curve.sizes["record"]
    assert len(columns_of(written["curve_event.csv"])[0]["event_q"]) == curve.sizes["event"]
    found = {name for path in written.values() for name in columns_of(path)[0]}
    assert found >= set(map(str, extra.variables))
    planes = columns_of(written["curve_record_plane.csv"])[0]
    assert_array_equal(planes["w2_plane"], curve.w2_plane.values.ravel())
    assert columns_of(written["curve_values.csv"])[1]["limit"] == "kPa"


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # h5netcdf closes what it never opened
@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_spoilt_tables_are_refused_or_read(tmp_path, data):
    """Any change of bytes of a NetCDF file gives a table or one clear error that names the file."""
    good = tmp_path / "good.nc"
    if not good.exists():
        rd.io.write_dataset(xr.Dataset({"q": ("record", np.arange(9.0), {"units": "Pa"})}), good)
    raw = bytearray(good.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        raw[data.draw(st.integers(0, len(raw) - 1))] = data.draw(st.integers(0, 255))
    if data.draw(st.booleans()):
        raw = raw[: data.draw(st.integers(0, len(raw)))]
    bad = tmp_path / "bad.nc"
    bad.write_bytes(raw)
    assert outcome(bad) in ("read", "refused")


def outcome(path):
    """Whether a table is read, or refused in one line that names the file; anything else is an error."""
    try:
        rd.io.read_dataset(path)
    except RendulicError as error:
        return "refused" if path.name in str(error) and "\n" not in str(error) else str(error)
    return "read"


def test_a_small_file_cannot_claim_a_large_table(tmp_path):
    """Rows that were never written would take all memory when filled."""
    with h5py.File(tmp_path / "large.nc", "w") as file:
        file.create_dataset("q", (10**12,), chunks=(1000,), dtype=float).make_scale("q")
    with pytest.raises(CorruptFile, match=r"large.nc: 'q' asks for more bytes \(8000000000000\) than"):
        rd.io.read_dataset(tmp_path / "large.nc")


def other_files(file):
    file.create_dataset("q", shape=(100,), dtype="u1", external=[("/etc/passwd", 0, 100)])


def other_hdf5(file):
    file["q"] = h5py.ExternalLink("other.h5", "/q")


def within_itself(file):
    file["above"] = file["/"]
    file["also"] = file["/"]


def seen_elsewhere(file):
    layout = h5py.VirtualLayout((3,), "f8")
    layout[:] = h5py.VirtualSource("/tmp/other.h5", "q", (3,))
    file.create_virtual_dataset("q", layout)


def packed(file):
    file.create_dataset("q", data=np.zeros(100_000), compression="gzip")


def one_text_many_times(file):
    file.create_dataset("long", data="x" * 1_000_000, dtype=h5py.string_dtype())
    file.attrs["texts"] = np.array(["x" * 1_000_000] * 200, dtype=object)


def odd_attribute(file):
    file["q"] = np.zeros(3)
    file["q"].attrs["units"] = np.zeros(2, dtype=[("a", "f8"), ("b", "S3")])


HOSTILE = [
    (other_files, "'q' has its data in other files, which are not opened"),
    (other_hdf5, "'q' is a link, and links are not followed"),
    (within_itself, "is in the file twice"),
    (seen_elsewhere, "'q' has its data in other files"),
    (packed, "'q' is compressed"),
    (one_text_many_times, "'/@texts' is not a plain attribute"),
    (odd_attribute, "'q/@units' is not a plain attribute"),
]


@pytest.mark.parametrize(("change", "words"), HOSTILE)
def test_a_table_reads_no_other_file_and_no_more_than_it_has(tmp_path, change, words):
    """Nothing of /etc/passwd goes into a CSV file; nothing is written at all."""
    with h5py.File(tmp_path / "bad.nc", "w") as file:
        change(file)
    with pytest.raises(CorruptFile, match=f"bad.nc: .*{words}"):
        rd.io.read_dataset(tmp_path / "bad.nc")
    with pytest.raises(CorruptFile):
        export(tmp_path / "bad.nc", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_texts_of_any_length_are_read(tmp_path):
    """As xarray writes them, in one dimension, in two and in none."""
    texts = np.array(["a", "", "Höhe" * 1000], dtype=object)
    table = xr.Dataset({"kind": ("event", texts), "both": (("event", "x"), np.stack((texts, texts), 1)), "one": ((), "ok")},
                       attrs={"empty": "", "list": ["a", "b"], "number": 3})  # fmt: skip
    back = rd.io.read_dataset(rd.io.write_dataset(table, tmp_path / "texts.nc"))
    assert back.kind.values.tolist() == texts.tolist()
    assert back.both.values.tolist() == table.both.values.tolist()
    assert back.one.item() == "ok"
    assert (back.attrs["empty"], back.attrs["number"], list(back.attrs["list"])) == ("", 3, ["a", "b"])


# --- export -----------------------------------------------------------------------------------------------


def test_grains_for_paraview(folder, instants, tmp_path):
    """Three files; with the state before, grains and contacts carry the second-order work of `rd.anatomy`."""
    before, after = instants
    plain = export(folder / "after.h5", tmp_path / "plain")
    assert [path.name for path in plain] == ["grains.vtkhdf", "contacts.vtkhdf", "walls.vtkhdf"]
    assert rd.io.write_vtkhdf(after, tmp_path / "python", before) == [tmp_path / "python" / path.name for path in plain]
    export(folder / "after.h5", tmp_path / "work", "vtkhdf", before)
    found = rd.anatomy(before, after)
    with h5py.File(tmp_path / "work" / "grains.vtkhdf") as file:
        assert_array_equal(file["VTKHDF/PointData/w2"], found.grain_w2)
        moved = file["VTKHDF/PointData/displacement"][()]
        assert_array_equal(moved, after.position - before.position)
    with h5py.File(tmp_path / "work" / "contacts.vtkhdf") as file:
        assert sorted(file["VTKHDF/CellData/w2"]) == sorted(found.w2.values)
    with h5py.File(plain[0]) as file:
        assert set(file["VTKHDF/PointData"]) == {"id", "radius", "coordination", "wall_contacts", "resultant"}


def test_grains_as_text_and_back(folder, instants, tmp_path):
    """The plain text is a source itself and gives the same file for ParaView; with a state before, the work is beside it."""
    written = export(folder / "after.h5", tmp_path / "text", "csv", instants[0])
    assert all(path.is_file() for path in written)
    assert_array_equal(columns_of(tmp_path / "text" / "anatomy.csv")[0]["w2"], rd.anatomy(*instants).w2.values)
    for source, name in ((folder / "after.h5", "one"), (tmp_path / "text", "other")):
        export(source, tmp_path / name)
    with h5py.File(tmp_path / "one" / "grains.vtkhdf") as one, h5py.File(tmp_path / "other" / "grains.vtkhdf") as other:
        # some versions of pandas read the last digits of a number wrongly
        assert_allclose(one["VTKHDF/Points"], other["VTKHDF/Points"], rtol=1e-12, atol=0.0)


def test_grains_as_netcdf(folder, instants, tmp_path):
    [path] = export(folder / "after.h5", tmp_path, "netcdf", instants[0])
    assert_array_equal(rd.io.read_dataset(path).grain_w2, rd.anatomy(*instants).grain_w2)


def test_a_folder_of_results(folder, tmp_path):
    """All that can be written is, at its place; what cannot is told with its name."""
    written, passed_over = export_all(folder, tmp_path / "all")
    names = {str(path.relative_to(tmp_path / "all")) for path in written}
    assert {"after/grains.vtkhdf", "before/walls.vtkhdf", "tests/curve.csv", "tests/curve_event.csv"} <= names
    assert len(passed_over) == 1
    assert "spoilt.h5" in passed_over[0]
    only_grains, _ = export_all(folder, tmp_path / "grains", "vtkhdf")
    assert {path.suffix for path in only_grains} == {".vtkhdf"}


REFUSED = [
    (["nowhere.h5"], "no snapshot at nowhere.h5"),
    (["tests/spoilt.h5"], "truncated"),
    (["tests/nowhere.nc"], "no table at tests/nowhere.nc"),
    (["after.h5", "--to", "vtkhd"], "unknown format 'vtkhd': did you mean 'vtkhdf'"),
    (["after.h5", "--to", "netcdf"], "give the state before"),
    (["after.h5", "--before", "other.h5"], "must hold the same grains"),
    (["tests/curve.nc", "--to", "vtkhdf"], "is a table, which goes to csv"),
    (["tests/curve.nc", "--before", "before.h5"], "a state before is for grains only"),
    (["point.h5"], "point.h5"),
    (["empty"], "it has no .h5, .npz, .nc file"),
    (["after.h5", "-o", "before.h5"], "cannot write"),
]  # fmt: skip


@pytest.fixture(scope="module")
def spoilt(folder, other):
    rd.io.write_snapshot(other, folder / "other.h5")
    rd.ChangHicher.preset("hostun_loose").at(300e3, 0.9).save().to_file(folder / "point.h5")
    (folder / "empty").mkdir()
    return folder


@pytest.mark.parametrize(("arguments", "words"), REFUSED)
def test_refused_in_one_line(spoilt, arguments, words, monkeypatch, capsys):
    """Code 2, one line that says what is wrong, and nothing written."""
    from rendulic.cli import main

    before = sorted(spoilt.rglob("*"))
    monkeypatch.chdir(spoilt)
    monkeypatch.setattr(sys, "argv", ["rendulic", "export", *arguments])
    with pytest.raises(SystemExit) as left:
        main.run()
    out, err = capsys.readouterr()
    assert left.value.code == 2
    assert words in err
    assert len(err.splitlines()) == 1
    assert out == ""
    assert sorted(spoilt.rglob("*")) == before


def test_the_command_names_what_it_wrote(folder, tmp_path, monkeypatch, capsys):
    from rendulic.cli import main

    monkeypatch.chdir(folder)
    monkeypatch.setattr(
        sys, "argv", ["rendulic", "export", "after.h5", "--before", "before.h5", "-o", str(tmp_path / "pv")]
    )
    with pytest.raises(SystemExit) as left:
        main.run()
    assert left.value.code in (None, 0)
    assert capsys.readouterr().out.split() == [
        str(tmp_path / "pv" / f"{n}.vtkhdf") for n in ("grains", "contacts", "walls")
    ]


def write_yade(snapshot, path):
    """A snapshot as a user of Yade saves one: axes y, x, z, walls first in the list of ids, forces on the second body."""
    n, axes, walls = snapshot.n_grains, [1, 0, 2], np.array([2, 3, 0, 1, 4, 5])
    bodies = np.concatenate((np.arange(n) + 6, walls))
    along = [
        (snapshot.force_n[:, None] * snapshot.normal)[:, axes],
        snapshot.force_t[:, axes],
        snapshot.normal[:, axes],
    ]
    pairs = np.stack((bodies[snapshot.first], bodies[snapshot.second]), axis=1)
    wall_position = np.zeros((6, 3))
    wall_position[walls, walls // 2] = snapshot.wall_position
    still = np.zeros((n, 3))
    np.savez(
        path, pos=snapshot.position[:, axes], rad=snapshot.radius, mass=np.ones(n), vel=still, angvel=still,
        ids=np.arange(n) + 6, wallids=np.arange(6), wallpos=wall_position,
        contacts=np.hstack((pairs, np.ones((len(pairs), 2)), *along)),
    )  # fmt: skip


def test_from_yade_to_paraview(instants, tmp_path, monkeypatch, capsys):
    """Two states of Yade, analysed and exported: the grains that vtk opens carry all of the second-order work."""
    vtk_hdf = pytest.importorskip("vtkmodules.vtkIOHDF", reason="vtk is not installed: `pip install vtk`")
    from rendulic.cli import main

    monkeypatch.chdir(tmp_path)
    for name, snapshot in zip(("before", "after"), instants, strict=True):
        write_yade(snapshot, f"{name}.npz")
    for arguments in (
        "analyze before.npz after.npz --report report",
        "export after.npz --before before.npz --to vtkhdf -o paraview",
    ):
        monkeypatch.setattr(sys, "argv", ["rendulic", *arguments.split()])
        with pytest.raises(SystemExit) as left:
            main.run()
        assert not left.value.code
        assert capsys.readouterr().err == ""
    work = json.loads((tmp_path / "report" / "second_order_work.json").read_text())
    reader = vtk_hdf.vtkHDFReader()
    reader.SetFileName("paraview/grains.vtkhdf")
    reader.Update()
    found = reader.GetOutput().GetPointData().GetArray("w2")
    total = sum(found.GetValue(k) for k in range(found.GetNumberOfTuples()))
    assert total == pytest.approx(work["w2_boundary"] * instants[0].volume, rel=1e-9)
    assert total == pytest.approx(rd.second_order_work(*instants).boundary * instants[0].volume, rel=1e-9)


def test_a_refusal_leaves_no_folder_behind(instants, other, tmp_path):
    with pytest.raises(InvalidInput, match="the same grains"):
        rd.io.write_vtkhdf(instants[1], tmp_path / "new", other)
    assert not (tmp_path / "new").exists()


def test_a_deck_for_lammps_needs_a_packing_that_steps_on(sheared_state, folder, instants, tmp_path):
    """A state becomes a deck; a snapshot, which has no law, is refused, and so is a state before."""
    sheared_state.to_file(tmp_path / "state.h5")
    written = export(tmp_path / "state.h5", tmp_path / "deck", "lammps")
    assert [path.name for path in written] == ["state.data", "continue.in"]
    again = export(written[0], tmp_path / "again", "lammps")
    assert_allclose(
        rd.io.lammps.read_data(again[0]).grains.position, rd.io.lammps.read_data(written[0]).grains.position
    )
    with pytest.raises(InvalidInput, match="is no packing that steps on: expected a state of rendulic"):
        export(folder / "after.h5", tmp_path / "deck", "lammps")
    with pytest.raises(InvalidInput, match="starts from one state"):
        export(tmp_path / "state.h5", tmp_path / "deck", "lammps", instants[0])
