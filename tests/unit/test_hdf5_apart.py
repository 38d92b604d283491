"""Files on which the HDF5 library crashes, never ends or takes all memory: the process that reads them ends, ours goes on."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

import rendulic as rd
from rendulic.foundation import hdf5_apart
from rendulic.foundation.errors import CorruptFile, RendulicError
from rendulic.foundation.hdf5 import plain_file

# a library that does what the name of the file says, in the process that reads
FAULTY = """
import os, time
from rendulic.foundation import hdf5_apart, plain_hdf5
plain, served = plain_hdf5.PlainFile.attributes, []
def attributes(file, place=""):
    name = file.path.name
    served.append(name)
    if "crash" in name or name == "second.h5" and len(served) > 1:
        os.abort()
    if "hang" in name:
        time.sleep(1000)
    if "large" in name:
        bytearray(1_000_000_000)
    if "prints" in name:
        os.write(1, b"not an answer")
    return plain(file, place)
plain_hdf5.PlainFile.attributes = attributes
hdf5_apart.main()
"""


@pytest.fixture
def faulty(monkeypatch):
    """The process that reads has the faults above; a new one is started, and ended."""
    kept, hdf5_apart._idle[:] = list(hdf5_apart._idle), []
    monkeypatch.setattr(hdf5_apart, "PROGRAM", ["-c", FAULTY])
    yield
    hdf5_apart._end_idle()
    hdf5_apart._idle[:] = kept


@pytest.fixture
def made(tmp_path):
    def make(name):
        with h5py.File(tmp_path / name, "w") as file:
            file.attrs["said"] = name
            file["numbers"] = np.arange(6.0).reshape(2, 3)
        return tmp_path / name

    return make


def said(path):
    with plain_file(path, "table") as file:
        return file.attributes()["said"]


@pytest.mark.usefixtures("faulty")
def test_a_crash_of_the_library_is_a_sentence(made):
    for _ in range(2):
        with pytest.raises(CorruptFile, match=r"crash.h5 is not a readable table .*makes the HDF5 library crash"):
            said(made("crash.h5"))
        assert said(made("good.h5")) == "good.h5"


@pytest.mark.usefixtures("faulty")
def test_a_library_that_never_ends_is_a_sentence(made, monkeypatch):
    assert said(made("good.h5")) == "good.h5"  # the process is there
    monkeypatch.setattr(hdf5_apart, "PATIENCE", 1.0)
    begin = time.monotonic()
    with pytest.raises(CorruptFile, match=r"hang.h5 .*keeps the HDF5 library busy for more than 1 s"):
        said(made("hang.h5"))
    assert time.monotonic() - begin < 20.0
    monkeypatch.undo()
    assert said(made("good.h5")) == "good.h5"


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="the memory of a process is limited on Linux")
@pytest.mark.usefixtures("faulty")
def test_memory_is_limited_to_what_a_file_needs(made):
    with pytest.raises(CorruptFile, match=r"large.h5 .*asks for more memory than twice the file and 200 MB"):
        said(made("large.h5"))
    assert said(made("good.h5")) == "good.h5"


@pytest.mark.usefixtures("faulty")
def test_what_an_earlier_file_did_is_no_fault_of_the_next(made):
    """A process that served another file and crashes is replaced, and the file read again."""
    assert said(made("first.h5")) == "first.h5"
    assert said(made("second.h5")) == "second.h5"


@pytest.mark.usefixtures("faulty")
def test_what_the_library_prints_is_no_answer(made):
    assert said(made("prints.h5")) == "prints.h5"


def test_one_process_serves_many_files(made):
    """It stays, sees each file as it is now, and several files may be open at once."""
    path = made("one.h5")
    with plain_file(path, "table") as one, plain_file(made("other.h5"), "table") as other:
        assert one.attributes()["said"] == "one.h5"
        assert other.attributes()["said"] == "other.h5"
        first, second = one._process, other._process
        assert first is not second
    for k in range(3):
        with h5py.File(path, "r+") as file:
            file.attrs["said"] = f"version {k}"
        assert said(path) == f"version {k}"
    with plain_file(path, "table") as again:
        np.testing.assert_array_equal(again.array("numbers"), np.arange(6.0).reshape(2, 3))
        assert again.array("none") is None
        assert again._process in (first, second)
    assert len(hdf5_apart._idle) <= hdf5_apart.MOST_IDLE


def test_threads_read_at_once(made):
    paths = [made(f"{k}.h5") for k in range(8)]
    found: dict[str, list[str]] = {}

    def read(path):
        found[path.name] = [said(path) for _ in range(5)]

    threads = [threading.Thread(target=read, args=(path,)) for path in paths]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == {path.name: [path.name] * 5 for path in paths}
    assert len(hdf5_apart._idle) <= hdf5_apart.MOST_IDLE


def test_values_come_as_they_are(tmp_path):
    """Every kind of number, order of bytes and shape, none and empty ones, and texts."""
    kinds = ["<f8", ">f8", "<f4", "<f2", "<i8", ">i4", "|u1", "|S5"]
    values = {f"kind {kind}": np.arange(6).astype(kind).reshape(3, 2) for kind in kinds}
    values |= {"none": np.zeros((0, 3)), "single": np.float64(0.1), "nan": np.array([np.nan, -0.0, np.inf])}
    with h5py.File(tmp_path / "all.h5", "w") as file:
        for name, value in values.items():
            file[name] = value
        file.attrs.update(
            text="Höhe", empty="", whole=3, real=0.1, several=[1, 2], texts=["a", "b"], nothing=h5py.Empty("f")
        )
    with plain_file(tmp_path / "all.h5", "table") as file:
        found, about = file.arrays(""), file.attributes()
    assert set(found) == set(values)
    for name, value in values.items():
        assert (found[name].dtype, found[name].shape) == (value.dtype, value.shape), name
        assert found[name].tobytes() == value.tobytes(), name
        assert found[name].flags.writeable, name
    several, texts = about.pop("several"), about.pop("texts")
    assert (several.tolist(), texts.tolist()) == ([1, 2], ["a", "b"])
    assert about == {"text": "Höhe", "empty": "", "whole": 3, "real": 0.1, "nothing": ""}
    assert (type(about["whole"]), type(about["real"])) == (int, float)


def test_where_no_process_can_be_started(made, monkeypatch):
    """One sentence if it fails; where there is no Python to start, the library reads here."""
    path = made("one.h5")
    kept, hdf5_apart._idle[:] = list(hdf5_apart._idle), []
    try:
        monkeypatch.setattr(sys, "executable", "/nowhere/python")
        with pytest.raises(RendulicError, match="read in a second process, and it could not be started: No such file"):
            said(path)
        monkeypatch.setattr(sys, "frozen", True, raising=False)
        assert said(path) == "one.h5"
        assert not hdf5_apart._idle
    finally:
        hdf5_apart._idle[:] = kept


def test_it_ends_with_the_process_that_started_it(made):
    """Also if that is killed; and nothing that it does is seen in the terminal."""
    code = (
        "import sys, time; from rendulic.foundation import hdf5_apart; from rendulic.foundation.hdf5 import plain_file\n"
        "from pathlib import Path\n"
        "with plain_file(Path(sys.argv[1]), 'table') as file: file.attributes()\n"
        "print(hdf5_apart._idle[0].process.pid, flush=True)\n"
        "time.sleep(float(sys.argv[2]))\n"
    )
    path = str(made("one.h5"))
    ended = subprocess.run([sys.executable, "-c", code, path, "0"], capture_output=True, text=True, check=True)
    assert ended.stderr == ""
    assert gone(int(ended.stdout))
    running = subprocess.Popen([sys.executable, "-c", code, path, "100"], stdout=subprocess.PIPE, text=True)
    with running:
        own = int(running.stdout.readline())
        assert not gone(own, 0.0)
        running.kill()
    assert gone(own)


def gone(pid, seconds=20.0):
    """Whether a process that is not ours ends within so many seconds."""
    until = time.monotonic() + seconds
    while True:
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return True
        status = Path(f"/proc/{pid}/stat")
        if status.exists() and status.read_text().rsplit(")", 1)[1].split()[0] == "Z":
            return True
        if time.monotonic() >= until:
            return False
        time.sleep(0.02)


def test_an_interrupt_while_it_reads_leaves_nothing_half_read(made, monkeypatch):
    """Ctrl-C between an answer and its arrays: that process serves no other file."""
    path = made("one.h5")
    with plain_file(path, "table") as file:
        file.attributes()
        process = file._process
        monkeypatch.setattr(hdf5_apart, "_received", lambda *_: signal.raise_signal(signal.SIGINT))
        with pytest.raises(KeyboardInterrupt):
            file.array("numbers")
        monkeypatch.undo()
        assert not process.is_running()
        np.testing.assert_array_equal(file.array("numbers"), np.arange(6.0).reshape(2, 3))


def test_a_file_that_says_it_has_gigabytes_is_refused(tmp_path):
    """The library would make room for all of them."""
    path = rd.io.write_dataset(xr.Dataset({"q": ("record", np.arange(9.0))}), tmp_path / "table.nc")
    raw = bytearray(path.read_bytes())
    assert int.from_bytes(raw[40:48], "little") == len(raw)
    raw[40:48] = (2**33).to_bytes(8, "little")
    path.write_bytes(raw)
    with pytest.raises(CorruptFile, match=r"table\.nc"):
        rd.io.read_dataset(path)
