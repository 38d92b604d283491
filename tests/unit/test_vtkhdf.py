"""Files for ParaView: structure by h5py, the same numbers read by vtk, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import rendulic as rd
from rendulic.foundation.errors import InvalidInput
from rendulic.io.vtkhdf import write_contacts, write_grains, write_walls

WRITERS = {"grains": write_grains, "contacts": write_contacts, "walls": write_walls}
KIND = {"grains": "Vertices", "contacts": "Lines", "walls": "Polygons"}


def snapshot(contacts, shift=0.0, image=None):
    """Four grains in a box of 4 x 5 x 6 with contacts {(first, second): force_n}; the first grain moved by `shift`."""
    position = np.array([[1.0 + shift, 1, 1], [3, 1, 1], [1, 3, 1], [1, 1, 3]])
    walls = np.array([0.0, 4, 0, 5, 0, 6])
    first, second = (np.array([pair[k] for pair in contacts], dtype=np.int64) for k in range(2))
    made = rd.Snapshot(
        position, np.array([1.0, 1.1, 0.9, 1.0]), walls, first, second, np.zeros((len(first), 3)),
        np.array(list(contacts.values()), dtype=float), np.zeros((len(first), 3)), 0.5, image,
    )  # fmt: skip
    normal = made.branch / np.linalg.norm(made.branch, axis=1)[:, None] if contacts else made.branch
    across = np.roll(normal, 1, axis=1)  # normal to the branches here, which are along axes
    return replace(made, normal=normal, force_t=0.5 * made.force_n[:, None] * across * (first == 0)[:, None])


@pytest.fixture(scope="module")
def probed():
    """Before and after: pair 0-2 opens, 0-3 is created, 2 stays on the wall 1-; later contacts come in another order."""
    before = snapshot({(0, 1): 10.0, (0, 2): 20.0, (2, 4): 30.0})
    return before, snapshot({(2, 4): 31.0, (0, 3): 5.0, (0, 1): 12.0}, shift=0.01)


@pytest.fixture(scope="module")
def anatomy(probed):
    return rd.anatomy(*probed)


def read(path):
    """All datasets by their path below VTKHDF."""
    found = {}
    with h5py.File(path) as file:
        file["VTKHDF"].visititems(lambda name, item: found.update({name: item[()]} if hasattr(item, "shape") else {}))
    return found


@pytest.mark.parametrize("what", WRITERS)
def test_structure(what, probed, tmp_path):
    """Version and type as vtk asks for; offsets and counts agree; every variable has its length, unit and line."""
    found = read(path := WRITERS[what](probed[1], tmp_path / f"{what}.vtkhdf"))
    with h5py.File(path) as file:
        root = file["VTKHDF"]
        assert list(root.attrs["Version"]) == [2, 0]
        assert root.attrs["Type"] == b"PolyData"
        assert h5py.h5a.open(root.id, b"Type").get_type().get_cset() == h5py.h5t.CSET_ASCII
        units = {name: item.attrs["units"] for place in ("PointData", "CellData") for name, item in root[place].items()}
        assert root["FieldData/variables"].id.get_type().get_cset() == h5py.h5t.CSET_ASCII
    assert found["NumberOfPoints"] == len(found["Points"])
    for kind in ("Vertices", "Lines", "Polygons", "Strips"):
        (n_cells,), (n_ids,) = found[f"{kind}/NumberOfCells"], found[f"{kind}/NumberOfConnectivityIds"]
        assert (n_cells > 0) == (kind == KIND[what])
        assert len(found[f"{kind}/Offsets"]) == n_cells + 1
        assert found[f"{kind}/Offsets"][-1] == n_ids == len(found[f"{kind}/Connectivity"])
    assert_array_equal(found[f"{KIND[what]}/Connectivity"], np.arange(len(found["Points"])))
    n_rows = {"PointData": len(found["Points"]), "CellData": found[f"{KIND[what]}/NumberOfCells"][0]}
    columns = {name: values for name, values in found.items() if name.split("/")[0] in n_rows}
    assert columns
    assert all(len(values) == n_rows[name.split("/")[0]] for name, values in columns.items())
    lines = [line.decode() for line in found["FieldData/variables"]]
    assert sorted(line.split(":")[0] for line in lines) == sorted(f"{name} [{unit}]" for name, unit in units.items())


def test_grains(probed, anatomy, tmp_path):
    """Numbers of contacts, displacement and second-order work are those of each grain."""
    before, after = probed
    found = read(write_grains(after, tmp_path / "g.vtkhdf", anatomy=anatomy, before=before))
    assert_array_equal(found["Points"], after.position)
    assert_array_equal(found["PointData/radius"], after.radius)
    assert found["PointData/coordination"].tolist() == [2, 1, 0, 1]
    assert found["PointData/wall_contacts"].tolist() == [0, 0, 1, 0]
    assert_allclose(found["PointData/displacement"][:, 0], [0.01, 0, 0, 0], atol=1e-15)
    assert_array_equal(found["PointData/w2"], anatomy.grain_w2)
    assert_array_equal(found["PointData/resultant"], after.resultant[:4])


def test_contacts_without_anatomy(probed, tmp_path):
    """A line per contact, from centre to centre or along the normal to the wall; sliding ones are told."""
    found = read(write_contacts(probed[0], tmp_path / "c.vtkhdf"))
    assert found["Points"].reshape(-1, 2, 3).tolist() == [
        [[1, 1, 1], [3, 1, 1]],
        [[1, 1, 1], [1, 3, 1]],
        [[1, 3, 1], [0, 3, 1]],
    ]
    assert_allclose(found["CellData/relative_force"], [0.5, 1.0, 1.5], rtol=1e-15)
    assert found["CellData/is_sliding"].tolist() == [1, 1, 0]
    assert_array_equal(found["CellData/force_t"], probed[0].force_t)
    assert "CellData/w2" not in found


@pytest.mark.parametrize(("instant", "other", "class_of_other"), [(0, (0, 3), 3), (1, (0, 2), 2)])
def test_contacts_with_anatomy(instant, other, class_of_other, probed, anatomy, tmp_path):
    """Before or after, all pairs are there with their own work; the one that touches only in the other is last."""
    shown = probed[instant]
    found = read(write_contacts(shown, tmp_path / "c.vtkhdf", anatomy=anatomy))
    cell = {name.split("/")[1]: values for name, values in found.items() if name.startswith("CellData")}
    work = {
        (int(a), int(b)): (w, k)
        for a, b, w, k in zip(
            anatomy.first, anatomy.second, anatomy.w2.values, anatomy.class_of_pair.values, strict=True
        )
    }
    written = list(zip(cell["first"].tolist(), cell["second"].tolist(), strict=True))
    assert [(w, k) for w, k in zip(cell["w2"], cell["class_of_pair"], strict=True)] == [work[pair] for pair in written]
    assert written[-1] == other
    assert cell["class_of_pair"][-1] == class_of_other
    assert cell["is_closed"].tolist() == [1, 1, 1, 0]
    assert [cell[name][-1] for name in ("force_n", "relative_force", "is_sliding")] == [0, 0, 0]
    assert cell["relative_force"][:3].mean() == pytest.approx(1.0)
    assert_allclose(found["Points"].reshape(-1, 2, 3)[-1], shown.position[list(other)], atol=1e-15)


def test_a_periodic_contact_goes_on_to_the_image(tmp_path):
    """The line leaves the cell, and both faces carry the force."""
    before = snapshot({(1, 0): 8.0}, image=np.array([[1, 0, 0]]))
    closed = read(write_contacts(before, tmp_path / "c.vtkhdf"))["Points"]
    assert closed.tolist() == [[3, 1, 1], [5, 1, 1]]
    walls = read(write_walls(before, tmp_path / "w.vtkhdf"))
    assert_allclose(walls["CellData/force"][:2, 0], [-8.0, 8.0])
    assert_allclose(walls["CellData/stress"], [8 / 30, 8 / 30, 0, 0, 0, 0], atol=1e-15)
    assert_allclose(before.wall_stress[0, 0], 8 / 30)


def test_opened_pairs_reach_the_nearest_image(tmp_path):
    """A pair through a face that only the other snapshot has is not drawn across the box."""
    position = np.array([[0.1, 1, 1], [3.9, 1, 1], [1.9, 1, 1], [1, 3, 1]])

    def periodic(contacts, image):
        made = replace(snapshot(contacts, image=np.array(image)), position=position)
        return replace(made, normal=made.branch / np.linalg.norm(made.branch, axis=1)[:, None])

    before = periodic({(0, 1): 1.0, (0, 2): 1.0}, [[-1, 0, 0], [0, 0, 0]])
    after = periodic({(0, 2): 1.0, (1, 2): 1.0, (1, 3): 1.0}, [[0, 0, 0], [0, 0, 0], [1, 0, 0]])
    found = read(write_contacts(after, tmp_path / "c.vtkhdf", anatomy=rd.anatomy(before, after)))
    ends = found["Points"].reshape(-1, 2, 3)
    assert found["CellData/is_closed"].tolist() == [1, 1, 1, 0]
    assert_allclose(ends[-1], [[0.1, 1, 1], [-0.1, 1, 1]], atol=1e-12)


def test_walls(probed, tmp_path):
    """Quads on their planes around the box, seen counterclockwise from outside; stress is force over area."""
    found = read(write_walls(probed[0], tmp_path / "w.vtkhdf"))
    corners, normal = found["Points"].reshape(6, 4, 3), found["CellData/normal"]
    turned = np.cross(corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0])
    assert_allclose(turned, normal * np.repeat([30.0, 24, 20], 2)[:, None], atol=1e-12)
    assert_array_equal(
        (corners * np.abs(normal)[:, None]).sum(axis=2), np.repeat([[0], [4], [0], [5], [0], [6]], 4, axis=1)
    )
    assert found["CellData/stress"].tolist() == [1.0, 0, 0, 0, 0, 0]
    assert found["CellData/force"][0].tolist() == [-30.0, 0, 0]


def refusals():
    before, after = snapshot({(0, 1): 10.0}), snapshot({(0, 2): 12.0})
    anatomy = rd.anatomy(before, after)
    strange = snapshot({(1, 3): 1.0, (0, 1): 1.0})
    other = replace(before, radius=2 * before.radius)
    nowhere = replace(before, position=before.position * np.nan)
    twice = anatomy.isel(pair=[0, 0])
    return {
        "suffix": (lambda p: write_walls(before, p / "a.vtk"), "ends with .vtkhdf or .hdf, by which it is known; got a.vtk"),
        "not finite": (lambda p: write_grains(nowhere, p / "a.vtkhdf"), "position of the grains must be finite everywhere"),
        "summary": (
            lambda p: write_grains(before, p / "a.vtkhdf", anatomy=anatomy.drop_dims(["pair", "grain"])),
            r"lacks grain_w2, grain_radius: give one of rd.anatomy\(before, after\)",
        ),
        "no pairs": (
            lambda p: write_contacts(before, p / "a.vtkhdf", anatomy=anatomy.drop_dims(["pair"])),
            "the anatomy lacks w2, class_of_pair, first, second",
        ),
        "other grains": (
            lambda p: write_grains(other, p / "a.vtkhdf", anatomy=anatomy),
            "of the snapshot's 4 grains, in their order; its 4 grains have other radii",
        ),
        "other instant": (
            lambda p: write_contacts(strange, p / "a.vtkhdf", anatomy=anatomy),
            "one of the two that the anatomy was made of, but 1 of its 2 contacts",
        ),
        "twice": (lambda p: write_contacts(before, p / "a.vtkhdf", anatomy=twice), "has a pair of grains twice"),
        "fewer before": (
            lambda p: write_grains(
                before, p / "a.vtkhdf", before=replace(before, position=before.position[:2], radius=before.radius[:2])
            ),
            "must hold the same 4 grains as the snapshot, got 2",
        ),
    }  # fmt: skip


@pytest.mark.parametrize("why", refusals())
def test_refused_in_one_sentence_and_nothing_written(why, tmp_path):
    write, words = refusals()[why]
    with pytest.raises(InvalidInput, match=words) as error:
        write(tmp_path)
    assert "\n" not in str(error.value)
    assert list(tmp_path.iterdir()) == []


def test_inputs_stay_as_they_are(probed, anatomy, tmp_path):
    """Neither snapshot nor anatomy is changed by being written."""
    kept = {name: np.copy(value) for name, value in vars(probed[1]).items() if isinstance(value, np.ndarray)}
    copy = anatomy.copy(deep=True)
    write_contacts(probed[1], tmp_path / "c.vtkhdf", anatomy=anatomy)
    write_grains(probed[1], tmp_path / "g.vtkhdf", anatomy=anatomy, before=probed[0])
    assert all(np.array_equal(getattr(probed[1], name), value) for name, value in kept.items())
    assert anatomy.identical(copy)


@pytest.mark.parametrize("what", [*WRITERS, "nothing"])
def test_vtk_reads_the_same(what, probed, tmp_path):
    """The reader of vtk, which is that of ParaView, gives points, cells, variables and units back."""
    pytest.importorskip(
        "vtkmodules", reason="vtk is not installed: `pip install vtk` lets the files be read by it, too"
    )
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOHDF import vtkHDFReader

    writer = WRITERS.get(what, write_contacts)
    path = writer(snapshot({}) if what == "nothing" else probed[1], tmp_path / "a.vtkhdf")
    written = read(path)
    reader = vtkHDFReader()
    assert reader.CanReadFile(str(path))
    reader.SetFileName(str(path))
    reader.Update()
    output = reader.GetOutput()
    assert output.GetClassName() == "vtkPolyData"
    assert output.GetNumberOfPoints() == written["NumberOfPoints"][0]
    cells = {"Vertices": output.GetVerts(), "Lines": output.GetLines(), "Polygons": output.GetPolys()}
    for kind, own in cells.items():
        assert own.GetNumberOfCells() == written[f"{kind}/NumberOfCells"][0]
        assert_array_equal(vtk_to_numpy(own.GetConnectivityArray()), written[f"{kind}/Connectivity"])
    names = [name.split("/") for name in written if name.startswith(("PointData", "CellData"))]
    for place, name in names:
        array = getattr(output, f"Get{place}")().GetArray(name)
        assert_array_equal(vtk_to_numpy(array).reshape(written[f"{place}/{name}"].shape), written[f"{place}/{name}"])
    lines = output.GetFieldData().GetAbstractArray("variables")
    assert [lines.GetValue(k).encode() for k in range(lines.GetNumberOfValues())] == list(
        written["FieldData/variables"]
    )
