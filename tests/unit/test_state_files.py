"""State files: exact round trips, and refusal of everything that is not one."""

from __future__ import annotations

import shutil
from dataclasses import replace

import h5py
import numpy as np
import pytest

import rendulic as rd
from naive import different_arrays
from rendulic.foundation.errors import CorruptFile, InvalidInput


@pytest.fixture
def written(sheared_state, tmp_path):
    """A good state file."""
    return sheared_state.to_file(tmp_path / "good.h5")


def test_round_trip_is_exact(sheared_state, tmp_path):
    """Arrays to the bit, types, attributes and checksum; the path comes back, and nothing else is left."""
    path = sheared_state.to_file(tmp_path / "deep" / "er" / "state.h5")
    back = rd.State.from_file(path)
    assert back.kind == "Assembly"
    assert different_arrays(sheared_state, back) == []
    assert {n: a.dtype for n, a in back.arrays.items()} == {n: a.dtype for n, a in sheared_state.arrays.items()}
    assert back.attributes == sheared_state.attributes
    assert back.checksum == sheared_state.checksum
    assert [p.name for p in path.parent.iterdir()] == ["state.h5"]


def test_writing_again_replaces(sheared_state, packed_state, written):
    """An existing file is replaced whole."""
    packed_state.to_file(written)
    assert rd.State.from_file(written).checksum == packed_state.checksum
    assert packed_state.checksum != sheared_state.checksum


def test_checksum_sees_every_array_and_number(sheared_state):
    """One bit of any array, its type or one attribute changes the checksum."""
    checksums = {sheared_state.checksum}
    for name, array in sheared_state.arrays.items():
        changed = array.copy()
        changed.reshape(-1).view(np.uint8)[-1] ^= 1
        checksums.add(replace(sheared_state, arrays=sheared_state.arrays | {name: changed}).checksum)
    checksums.add(replace(sheared_state, attributes=sheared_state.attributes | {"damping": 0.06}).checksum)
    checksums.add(replace(sheared_state, kind="Other").checksum)
    assert len(checksums) == len(sheared_state.arrays) + 3


def edit(change):
    def do(path):
        with h5py.File(path, "r+") as file:
            change(file)

    return do


def flip_a_bit(file):
    rows = file["arrays/grains/row"][...]
    rows.view(np.uint8)[3, 5] ^= 1
    file["arrays/grains/row"][...] = rows


def truncate(share):
    return lambda path: path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])


def numbers_for_arrays(file):
    del file["arrays"]
    file["arrays"] = np.zeros(3)


SPOILT = {
    "one bit flipped": (edit(flip_a_bit), "has been altered: its content does not match its checksum"),
    "an array missing": (edit(lambda f: f["arrays/grains"].pop("mass")), "has been altered"),
    "an array added": (edit(lambda f: f["arrays"].create_dataset("extra", data=[1.0])), "has been altered"),
    "an attribute altered": (edit(lambda f: f.attrs.update(attributes="{}")), "has been altered"),
    "kind altered": (edit(lambda f: f.attrs.update(kind="Other")), "has been altered"),
    "not JSON": (edit(lambda f: f.attrs.update(attributes="{")), "not a readable rendulic state"),
    "no checksum": (edit(lambda f: f.attrs.pop("checksum")), "not a readable rendulic state"),
    "no arrays": (edit(lambda f: f.pop("arrays")), "not a readable rendulic state"),
    "foreign HDF5": (edit(lambda f: f.attrs.pop("format")), "is an HDF5 file but not a rendulic state"),
    "later schema": (edit(lambda f: f.attrs.update(schema=2)), "has schema 2; this version of rendulic reads schema 1"),
    "truncated": (truncate(0.5), r"truncated or foreign"),
    "almost whole": (truncate(0.999), r"truncated or foreign"),
    "empty": (truncate(0.0), r"truncated or foreign"),
    "text": (lambda path: path.write_text("not a state"), r"truncated or foreign"),
}


@pytest.mark.parametrize("name", SPOILT)
def test_spoilt_files_are_refused(written, name):
    """Every way to spoil a file ends in `CorruptFile` with the path and the reason."""
    spoil, words = SPOILT[name]
    rd.State.from_file(written)
    spoil(written)
    with pytest.raises(CorruptFile, match=words) as caught:
        rd.State.from_file(written)
    assert str(written) in str(caught.value)


@pytest.mark.parametrize(
    "change",
    [lambda f: f.attrs.update(attributes=3), numbers_for_arrays],
    ids=["attributes a number", "arrays a dataset"],
)
def test_files_of_the_wrong_shape_are_refused(written, change):
    """Fields of the wrong kind are a corrupt file, too."""
    edit(change)(written)
    with pytest.raises(CorruptFile):
        rd.State.from_file(written)


def test_missing_file(tmp_path):
    """No file, or a folder, is wrong input and not a corrupt file."""
    for path in (tmp_path / "no.h5", tmp_path):
        with pytest.raises(InvalidInput, match="no state file at"):
            rd.State.from_file(path)


def below_a_file(folder):
    (folder / "file").write_text("kept")
    return folder / "file" / "state.h5"


def a_folder(folder):
    (folder / "taken").mkdir()
    return folder / "taken"


def all_names(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


@pytest.mark.parametrize("place", [below_a_file, a_folder])
def test_nothing_half_written_where_writing_fails(sheared_state, tmp_path, place):
    """Folders that cannot be written to are wrong input, and leave no file behind."""
    path = place(tmp_path)
    before = all_names(tmp_path)
    with pytest.raises(InvalidInput, match="cannot write"):
        sheared_state.to_file(path)
    assert all_names(tmp_path) == before


def test_failure_while_writing_keeps_the_old_file(sheared_state, written, monkeypatch):
    """If the disk fails half way, the file that was there stays, and no part is left."""

    def fail(*_args, **_options):
        raise OSError(28, "No space left on device")

    before = written.read_bytes()
    monkeypatch.setattr(h5py.Group, "create_dataset", fail)
    with pytest.raises(InvalidInput, match=r"cannot write .*No space left on device"):
        sheared_state.to_file(written)
    assert written.read_bytes() == before
    assert all_names(written.parent) == ["good.h5"]


def test_interruption_while_writing_leaves_no_part(sheared_state, written, monkeypatch):
    """Even an error that is none of ours cleans up."""

    def stop(*_args, **_options):
        raise KeyboardInterrupt

    monkeypatch.setattr(h5py.Group, "create_dataset", stop)
    with pytest.raises(KeyboardInterrupt):
        sheared_state.to_file(written)
    assert all_names(written.parent) == ["good.h5"]


def test_what_is_not_a_file_is_not_replaced(sheared_state, tmp_path):
    """A named pipe in the way is wrong input; writing must not destroy it."""
    import os

    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InvalidInput):
        sheared_state.to_file(tmp_path / "pipe")
    assert (tmp_path / "pipe").is_fifo()


def test_states_of_another_kind_are_refused(sheared):
    """Restoring asks for the kind, and leaves the specimen as it was."""
    before = sheared.save().checksum
    with pytest.raises(
        InvalidInput, match="expected the state of a specimen of kind 'Assembly', got one of kind 'Clay'"
    ):
        sheared.restore(rd.State("Clay", {}, {}))
    assert sheared.save().checksum == before


def test_tables_round_trip(packed, tmp_path):
    """Probe data come back from NetCDF as they were, and a truncated file is corrupt."""
    from rendulic.io.tables import read_dataset, write_dataset

    probes = rd.probe(packed, rd.directions.rendulic(step=180), norm=[1e-5, 2e-5], n_steps=5)
    path = write_dataset(probes, tmp_path / "probes.nc")
    back = read_dataset(path)
    for name in probes.variables:
        np.testing.assert_array_equal(back[name].values, probes[name].values, err_msg=name)
    assert back.w2_macro.attrs == probes.w2_macro.attrs
    assert [p.name for p in tmp_path.iterdir()] == ["probes.nc"]
    truncated = tmp_path / "half.nc"
    shutil.copy(path, truncated)
    truncate(0.5)(truncated)
    with pytest.raises(CorruptFile, match="truncated or foreign"):
        read_dataset(truncated)
    with pytest.raises(InvalidInput, match="no table at"):
        read_dataset(tmp_path / "no.nc")


def linked_elsewhere(file):
    del file["arrays"]
    file["arrays"] = h5py.ExternalLink("/tmp/other.h5", "/arrays")


def stored_elsewhere(file):
    file["arrays"].create_dataset("raw", shape=(8,), dtype="u1", external=[("/etc/hostname", 0, 8)])


def swollen(file):
    file["arrays"].create_dataset("swollen", shape=(2**40,), dtype="f8", chunks=(2**16,), compression="gzip")


@pytest.mark.parametrize("change", [linked_elsewhere, stored_elsewhere, swollen])
def test_only_data_of_the_file_itself_are_read(written, change):
    """No link is followed, no other file opened, no array larger than the file made."""
    edit(change)(written)
    with pytest.raises(
        CorruptFile, match=r"links are not followed|has its data elsewhere or claims more than the file has"
    ):
        rd.State.from_file(written)
