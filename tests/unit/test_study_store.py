"""Files of finished units: exact, checked to the last bit, and nothing but data."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import sys
import threading
import time
from io import BytesIO

import h5py
import numpy as np
import pytest
import xarray as xr

from rendulic.foundation.errors import CorruptFile, InvalidInput
from rendulic.specimen.state import State
from rendulic.study.store.store import Store
from rendulic.study.store.unit import Unit, key_of
from rendulic.study.store.unit_file import from_bytes

UNIT = Unit("state", "a state", {"eta": 0.1, "norms": [1e-5, 2e-5], "porosity": None}, {})


def table():
    return xr.Dataset(
        {
            "q": ("record", np.array([1.0, np.nan, 1 / 3]), {"units": "Pa", "note": "µ"}),
            "is_reached": ("record", np.array([True, False, True])),
            "kind": ("event", np.array(["peak", "Höhe"], dtype=object)),
            "label": ("event", np.array(["peak", "Höhe"])),
            "count": ((), np.int64(3)),
            "empty": (("record", "none"), np.zeros((3, 0))),
        },
        {"eps_1": ("record", np.array([0.0, 0.1, 0.2]), {"long_name": "axial strain"})},
        {"stopped_by": "eta", "crept": [1e-9, 2e-9], "n_steps": 5, "limit": float("inf")},
    )


PARTS = {
    "state": State("Assembly", {"grains/radius": np.arange(4.0), "n": np.int32([1])}, {"eta": 0.1}),
    "curve": table(),
}


@pytest.fixture
def store(tmp_path):
    return Store(tmp_path / "study")


@pytest.fixture
def file(store):
    return store.write(UNIT.order(), PARTS)


def test_what_is_written_is_read(store, file):
    """States and datasets come back to the bit, with dimensions, units and texts."""
    parts = store.read(UNIT.key)
    assert list(parts) == ["state", "curve"]
    assert parts["curve"].identical(PARTS["curve"])
    assert list(parts["curve"].variables) == list(PARTS["curve"].variables)
    assert [each.dtype for each in parts["curve"].variables.values()] == [
        v.dtype for v in PARTS["curve"].variables.values()
    ]
    assert parts["state"].checksum == PARTS["state"].checksum
    assert store.keys() == {UNIT.key}
    assert file == store.file(UNIT.key)


def test_equal_results_are_equal_bytes(store, file, tmp_path):
    """Nothing of the time, the place or the process is in a file."""
    other = Store(tmp_path / "other")
    assert other.write(UNIT.order(), PARTS).read_bytes() == file.read_bytes()


def test_any_hdf5_tool_reads_the_arrays(file):
    """The header lies in the user block, so that the arrays open by themselves and the header with `head`."""
    with h5py.File(file, "r") as opened:
        assert opened["curve/eps_1"][()].tolist() == [0.0, 0.1, 0.2]
    head, _ = json.JSONDecoder().raw_decode(file.read_bytes()[:4096].decode(errors="replace"))
    assert (head["kind"], head["inputs"]["eta"], head["schema"]) == ("state", 0.1, 1)


def test_every_flipped_bit_is_found(file):
    """One bit in every 13, and all of the first and last bytes."""
    data = file.read_bytes()
    places = {*range(0, 8 * len(data), 13), *range(64), *range(8 * len(data) - 64, 8 * len(data))}
    for place in sorted(places):
        spoilt = bytearray(data)
        spoilt[place // 8] ^= 1 << (place % 8)
        with pytest.raises(CorruptFile, match=file.name):
            from_bytes(bytes(spoilt), file)


def test_every_truncation_is_found(file):
    data = file.read_bytes()
    for length in (*range(0, len(data), 7), len(data) - 1):
        with pytest.raises(CorruptFile, match=file.name):
            from_bytes(data[:length], file)
    with pytest.raises(CorruptFile, match="checksum"):
        from_bytes(data + b"\0", file)


def signed(file, head=None, body=None):
    """A file as someone would forge it: with another header or body, and the right checksum."""
    data = file.read_bytes()
    start = data.index(b"\x89HDF")
    own = json.loads(data[: start - 65]) | (head or {})
    text = json.dumps(own).encode().ljust(start - 65)
    body = data[start:] if body is None else body
    return text + hashlib.sha256(text + body).hexdigest().encode() + b"\n" + body


@pytest.mark.parametrize(
    ("head", "words"),
    [
        ({"schema": 0}, "has schema 0, and this version of rendulic reads schema 1"),
        ({"schema": 2, "rendulic": "9.0"}, r"has schema 2, .*use the version that wrote it \(9.0\)"),
        ({"format": "something"}, "is no unit of a study"),
        ({"inputs": {"eta": 0.2}}, "is not the one it is named for"),
        ({"key": "0" * 32}, "is not the one it is named for"),
        ({"parts": {"curve": 5}}, "not a readable unit"),
        ({"parts": {"nothing": {"is": "state"}}}, "'nothing'"),
    ],
)
def test_headers_that_do_not_fit(file, head, words):
    """Other schemas are refused with the reason; a file under another unit's name is none."""
    with pytest.raises(CorruptFile, match=words):
        from_bytes(signed(file, head), file)


def forged(change):
    """The body of a file in which `change` did something to the group of the curve."""
    body = BytesIO()
    with h5py.File(body, "w") as made:
        group = made.create_group("curve")
        for name, values in (("q", np.zeros(3)), ("eps_1", np.zeros(3))):
            group[name] = values
        change(group)
    return body.getvalue()


def elsewhere(group):
    group["secret"] = h5py.ExternalLink("/etc/passwd", "/")


def aside(group):
    group["again"] = h5py.SoftLink("/curve/q")


def outside(group):
    group.create_dataset("raw", shape=(100,), dtype="u1", external=[("/etc/passwd", 0, 100)])


def virtual(group):
    layout = h5py.VirtualLayout((3,), "f8")
    layout[:] = h5py.VirtualSource("/tmp/other.h5", "q", (3,))
    group.create_virtual_dataset("seen", layout)


def huge(group):
    group.create_dataset("huge", shape=(2**40,), dtype="f8", chunks=(2**16,))


def objects(group):
    group.create_dataset("texts", data=["a", "b"], dtype=h5py.string_dtype())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (elsewhere, "'curve/secret' is a link, and links are not followed"),
        (aside, "'curve/again' is a link"),
        (outside, "'curve/raw' has its data in other files"),
        (virtual, "'curve/seen' has its data in other files"),
        (huge, "'curve/huge' asks for more bytes .* than the file has"),
        (objects, "'curve/texts' is not a plain array"),
    ],
)
def test_hostile_files_are_refused(file, change, words):
    """Links, data elsewhere, arrays larger than their file: refused before they are read."""
    with pytest.raises(CorruptFile, match=words):
        from_bytes(signed(file, {"parts": {"curve": {"is": "dataset"}}}, forged(change)), file)


def test_strangers_in_the_folder_are_no_units(store, file):
    """Half-written files, notes and links beside units are not taken for results; half-written ones are swept away."""
    place = file.parent
    (place / f".{UNIT.key}.h5.abc.part.h5").write_bytes(b"half")
    (place / "notes.txt").write_text("mine")
    (place / "short.h5").write_text("mine")
    assert store.keys() == {UNIT.key}
    assert store.sweep() == 1
    assert sorted(path.name for path in place.iterdir()) == sorted([file.name, "notes.txt", "short.h5"])


def test_damage_is_named(store, file):
    other = Unit("state", "another", {"eta": 0.2})
    store.write(other.order(), PARTS)
    with file.open("r+b") as opened:
        opened.truncate(1000)
    found = store.damaged({UNIT.key, other.key})
    assert list(found) == [UNIT.key]
    assert str(file) in str(found[UNIT.key])


def test_a_missing_unit_is_told(store):
    with pytest.raises(InvalidInput, match=f"unit {UNIT.key} is not in"):
        store.read(UNIT.key)


def test_keys_are_of_what_is_computed():
    """Of kind, inputs and needs, not of the label or the order of entries; numbers that are not are refused."""
    same = Unit("state", "other words", {"porosity": None, "norms": [1e-5, 2e-5], "eta": 0.1}, {})
    assert same.key == UNIT.key == key_of("state", dict(UNIT.inputs), {})
    assert Unit("state", "", dict(UNIT.inputs), {"before": same}).key != UNIT.key
    with pytest.raises(ValueError, match="JSON"):
        Unit("state", "", {"eta": float("nan")}, {}).key  # noqa: B018


def test_a_claim_is_one_process_s(store):
    """Another claim on the folder is refused by name, and free again afterwards."""
    with store.claimed():
        assert store.is_claimed()
        with pytest.raises(InvalidInput, match=f"is being worked on by process {os.getpid()} on "), store.claimed():
            pass
    assert not store.is_claimed()
    with store.claimed():
        pass


@pytest.mark.parametrize("was_killed", [False, True])
def test_a_look_never_disturbs_a_claim(store, was_killed):
    """While two others look again and again, every claim succeeds; also after a process that left its note."""
    store.folder.mkdir()
    seen, stop = set(), threading.Event()

    def look():
        while not stop.wait(1e-3):
            seen.add(store.is_claimed())

    lookers = [threading.Thread(target=look) for _ in range(2)]
    for each in lookers:
        each.start()
    try:
        for _ in range(20):
            if was_killed:
                store.write_json("holder.json", "process 0 on nowhere")
            with store.claimed():
                time.sleep(2e-3)
    finally:
        stop.set()
        for each in lookers:
            each.join()
    assert seen <= {False, True}
    assert seen
    assert not store.is_claimed()


def test_a_look_writes_nothing(store):
    assert not store.is_claimed()
    assert not store.folder.exists()


def test_a_claim_ends_with_its_process(store):
    """Killed, with no chance to clean up."""
    code = (
        "import sys, time; from rendulic.study.store.store import Store\n"
        "with Store(sys.argv[1]).claimed(): print('claimed', flush=True); time.sleep(60)"
    )
    process = subprocess.Popen([sys.executable, "-c", code, str(store.folder)], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "claimed\n"
    assert store.is_claimed()
    with pytest.raises(InvalidInput, match=f"is being worked on by process {process.pid} on "), store.claimed():
        pass
    process.kill()
    process.communicate()
    assert not store.is_claimed()
    with store.claimed():
        pass


def test_units_behind_a_link_are_found(store, file, tmp_path):
    """A folder that was moved to another disk, with a link in its place."""
    shutil.move(file.parent, tmp_path / "elsewhere")
    file.parent.symlink_to(tmp_path / "elsewhere")
    assert store.keys() == {UNIT.key}
    assert store.read(UNIT.key)["curve"].identical(PARTS["curve"])


def test_a_folder_that_cannot_be_read_is_told(store):
    store.folder.mkdir()
    (store.folder / "units").write_text("mine")
    with pytest.raises(InvalidInput, match=r"cannot read .*units: Not a directory"):
        store.keys()


def test_a_folder_can_be_moved(store, file, tmp_path):
    """Nothing in it knows where it is."""
    shutil.move(store.folder, tmp_path / "moved")
    assert Store(tmp_path / "moved").read(UNIT.key)["curve"].identical(PARTS["curve"])
