"""State files: exact round trips, and refusal of everything that is not one."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

import rendulic as rd
from naive import different_arrays
from rendulic.foundation.errors import CorruptFile, InvalidInput
from rendulic.foundation.sealed import front_block, sealed


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


def test_names_in_the_file_stay(sheared):
    """Files of earlier versions can be read, and equal states have equal checksums: names and their order are fixed."""
    groups = {
        "grains": ["row", "mass", "inertia"], "contacts": ["first", "second", "force"],
        "walls": ["position", "force", "stiffness"], "wall_contacts": ["grain", "wall", "force"],
    }  # fmt: skip
    arrays = [f"{group}/{name}" for group, names in groups.items() for name in names]
    state = sheared.save()
    assert list(state.arrays) == [*arrays, "list_origin", "list_wall_origin", "spent", "strain_origin"]
    assert list(state.attributes) == [
        "law", "law_fields", "density", "damping", "inertial_radius", "time_step_fraction", "time_step",
        "has_fixed_time_step", "time", "n_steps", "n_rebuilds", "margin", "steps_since_build", "growth_since_build",
    ]  # fmt: skip


def test_a_clone_is_whole_and_independent(sheared_state, straining):
    """Same class, same state; what one does afterwards the other does not feel."""

    class Own(rd.dem.Assembly):
        """A user's own assembly."""

    sample = Own.from_state(sheared_state)
    twin = sample.clone()
    assert type(twin) is Own
    assert twin.save().checksum == sheared_state.checksum
    assert twin.grains.row.ctypes.data % 64 == 0
    twin.advance(50, straining((5.0, -5.0, 0.0)))
    twin.scale_radii(1.001)
    assert sample.save().checksum == sheared_state.checksum


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


def edit(change, then=lambda path: None):
    """Change a file that has no front block, as those of the first version: its checksum is seen after it has been parsed."""

    def do(path):
        data = path.read_bytes()
        path.write_bytes(data[front_block(data) :])
        rd.State.from_file(path)
        with h5py.File(path, "r+") as file:
            change(file)
        then(path)

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
    "no arrays": (edit(lambda f: f.pop("arrays")), "'arrays' is not there: expected a group of arrays"),
    "foreign HDF5": (edit(lambda f: f.attrs.pop("format")), "is an HDF5 file but not a rendulic state"),
    "later schema": (edit(lambda f: f.attrs.update(schema=2)), "has schema 2; this version of rendulic reads schema 1"),
    "truncated": (truncate(0.5), "has been altered"),
    "almost whole": (truncate(0.999), "has been altered"),
    "of the first version, truncated": (edit(lambda f: None, truncate(0.5)), "truncated, altered or foreign"),
    "empty": (truncate(0.0), "truncated, altered or foreign"),
    "text": (lambda path: path.write_text("not a state"), "truncated, altered or foreign"),
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


def test_damage_is_seen_before_the_file_is_parsed(written, monkeypatch):
    """Some damaged files keep the HDF5 library busy for ever: it never gets to see them."""
    data = written.read_bytes()
    monkeypatch.setattr(h5py, "File", None)
    places = {*range(64, len(data), 997), *range(440, 520), len(data) - 1}
    for place in sorted(places):
        spoilt = bytearray(data)
        spoilt[place] ^= 1
        written.write_bytes(spoilt)
        with pytest.raises(CorruptFile, match="has been altered"):
            rd.State.from_file(written)


def test_nested_json_is_refused(written):
    """Deeper than any of ours, and than Python follows."""

    def nest(file):
        file.attrs["attributes"] = "[" * 60_000

    edit(nest)(written)
    with pytest.raises(CorruptFile, match="expected JSON, found lists and tables more than 64 deep"):
        rd.State.from_file(written)


def test_text_stored_as_bytes_is_text(sheared_state, written):
    """Other writers of HDF5 store text so."""

    def as_bytes(file):
        for name, value in dict(file.attrs).items():
            if isinstance(value, str):
                file.attrs[name] = value.encode()

    edit(as_bytes)(written)
    assert rd.State.from_file(written).checksum == sheared_state.checksum


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
    monkeypatch.setattr(Path, "write_bytes", fail)
    with pytest.raises(InvalidInput, match=r"cannot write .*No space left on device"):
        sheared_state.to_file(written)
    assert written.read_bytes() == before
    assert all_names(written.parent) == ["good.h5"]


def test_interruption_while_writing_leaves_no_part(sheared_state, written, monkeypatch):
    """Even an error that is none of ours cleans up."""

    def stop(*_args, **_options):
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "write_bytes", stop)
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

    probes = rd.probe(packed, rd.directions.rendulic(step=180), norm=[1e-5, 2e-5], rate=2e-6, settle=False)
    path = write_dataset(probes, tmp_path / "probes.nc")
    back = read_dataset(path)
    for name in probes.variables:
        np.testing.assert_array_equal(back[name].values, probes[name].values, err_msg=name)
    assert back.w2_macro.attrs == probes.w2_macro.attrs
    assert [p.name for p in tmp_path.iterdir()] == ["probes.nc"]
    truncated = tmp_path / "half.nc"
    shutil.copy(path, truncated)
    truncate(0.5)(truncated)
    with pytest.raises(CorruptFile, match="truncated, altered or foreign"):
        read_dataset(truncated)
    with pytest.raises(InvalidInput, match="no table at"):
        read_dataset(tmp_path / "no.nc")


def linked_elsewhere(file):
    del file["arrays"]
    file["arrays"] = h5py.ExternalLink("/tmp/other.h5", "/arrays")


def stored_elsewhere(file):
    file["arrays"].create_dataset("raw", shape=(8,), dtype="u1", external=[("/etc/hostname", 0, 8)])


def swollen(file):
    file["arrays"].create_dataset("swollen", shape=(2**40,), dtype="f8", chunks=(2**16,))


def compressed(file):
    file["arrays"].create_dataset("packed", data=np.zeros(1000), compression="gzip")


def twice(file):
    file["arrays/again"] = file["arrays/grains"]


def texts(file):
    file["arrays"].create_dataset("texts", data=["a", "b"], dtype=h5py.string_dtype())


def odd(file):
    file.attrs.create("kind", np.zeros(2, dtype=[("a", "f8"), ("b", "i4")]))


HOSTILE = [
    (linked_elsewhere, "'arrays' is a link, and links are not followed"),
    (stored_elsewhere, "'arrays/raw' has its data in other files"),
    (swollen, r"'arrays/swollen' asks for more bytes \(8796093022208\) than the file has"),
    (compressed, "'arrays/packed' is compressed"),
    (twice, "is in the file twice"),
    (texts, "'arrays/texts' is not a plain array"),
    (odd, "'/@kind' is not a plain attribute"),
]


@pytest.mark.parametrize(("change", "words"), HOSTILE)
@pytest.mark.parametrize("has_front", [False, True])
def test_only_data_of_the_file_itself_are_read(written, change, words, has_front):
    """No link is followed, no other file opened, nothing unpacked, no array larger than the file made; whoever signed it."""
    edit(change)(written)
    if has_front:
        written.write_bytes(sealed({"format": "rendulic state"}, written.read_bytes()))
    with pytest.raises(CorruptFile, match=words):
        rd.State.from_file(written)
