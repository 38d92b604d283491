"""Snapshots, NetCDF files and sealed states with hostile content: HDF5 that is whole, and not what it should be."""

from __future__ import annotations

import random
import resource
import warnings
from contextlib import suppress

import h5py
import numpy as np
import pytest
import xarray as xr

import rendulic as rd
from rendulic.cli.specimens import read_specimen
from rendulic.foundation.errors import RendulicError
from rendulic.foundation.sealed import front_block, sealed

FILES = 200
NUMBERS = (0, -1, 1, 2**31 - 1, -(2**31), 2**63 - 1, 1e300, -1e-300, float("nan"), float("inf"), 10**6)
WORDS = ("", "x", "\x1b[31m", "é", "[", '{"a":' + "[" * 5000, "nan", "days since 0000-00-00", b"\xff\xfe", True)
ARRAYS = (np.zeros(3), np.zeros((2, 2)), np.array(["a", "b"], dtype=object), np.bytes_(b"ab"))
ATTRIBUTES = (
    "format", "schema", "about", "units", "calendar", "_FillValue", "missing_value", "scale_factor", "add_offset", "coordinates",
    "DIMENSION_LIST", "CLASS", "NAME", "dtype", "_Unsigned", "_Netcdf4Dimid",
)  # fmt: skip
# what h5py itself refuses to write
REFUSED = (
    KeyError,
    ValueError,
    TypeError,
    OSError,
    IndexError,
    RuntimeError,
    MemoryError,
    OverflowError,
    AttributeError,
)


def tamper(path, chance):
    """One to three changes of arrays, types, shapes, links, layouts and attributes."""
    with h5py.File(path, "r+") as file:
        for _ in range(chance.choice((1, 1, 2, 3))):
            names = []
            file.visititems(
                lambda name, item, names=names: names.append(name) if isinstance(item, h5py.Dataset) else None
            )
            with suppress(*REFUSED):
                chance.choice(CHANGES)(file, chance.choice(names), chance)


def another(make):
    """Put what `make(values, chance)` gives in the place of an array."""

    def change(file, name, chance):
        values = file[name][()]
        del file[name]
        file[name] = make(values, chance)

    return change


def a_number(file, name, chance):
    values = file[name][()]
    with np.errstate(all="ignore"):
        values.reshape(-1)[chance.randrange(values.size)] = np.asarray(chance.choice(NUMBERS)).astype(values.dtype)
    file[name][...] = values


def made(**options):
    def change(file, name, chance):
        del file[name]
        file.create_dataset(name, **options)

    return change


def an_attribute(file, name, chance):
    item = chance.choice((file, file[name]))
    which = chance.choice((*ATTRIBUTES, *item.attrs))
    if chance.random() < 0.2:
        del item.attrs[which]
    else:
        item.attrs.create(which, chance.choice((*NUMBERS, *WORDS, *ARRAYS)))


def something_new(file, _name, chance):
    file.create_dataset(
        chance.choice(("a/b/c/d/e/f/g/h/i/j", "new", "\x1b[31m")), data=chance.choice((*ARRAYS, np.zeros(2, "f8,S3")))
    )
    file[f"type {chance.random()}"] = np.dtype("f8")


CHANGES = (
    a_number, a_number, a_number, an_attribute, an_attribute, an_attribute, something_new,
    another(lambda values, chance: values[: chance.randrange(len(values) + 1)]),
    another(lambda values, chance: values.astype(chance.choice(("f4", "i8", ">f8", "S3", "u1", "f2", "c16", "?")))),
    another(lambda values, chance: np.zeros((*values.shape, chance.choice((0, 1, 2))))),
    another(lambda _values, chance: np.array(["a" * chance.choice((0, 5, 10**5))] * chance.choice((1, 50)), dtype=object)),
    another(lambda _values, _chance: h5py.SoftLink("/nowhere")),
    another(lambda _values, _chance: h5py.ExternalLink("/etc/passwd", "/x")),
    lambda file, name, _chance: file.__delitem__(name),
    lambda file, name, _chance: file.__setitem__(f"{name} again", file[name]),
    made(shape=(2**40,), dtype="f8", chunks=(1000,)), made(shape=(10**6,), dtype="f8", chunks=(5,)),
    made(data=np.zeros(1000), compression="gzip"), made(shape=(100,), dtype="u1", external=[("/etc/passwd", 0, 100)]),
)  # fmt: skip


@pytest.fixture
def snapshots(sheared_state, tmp_path):
    snapshot = rd.dem.Assembly.from_state(sheared_state).snapshot()
    rd.io.write_snapshot(snapshot, tmp_path / "good.h5")

    def use(path):
        found = rd.io.read(path)
        rd.second_order_work(found, found)

    return (tmp_path / "good.h5").read_bytes(), bytes, use


@pytest.fixture
def tables(tmp_path):
    texts = np.array(["a", "", "Höhe"], dtype=object)
    table = xr.Dataset({"kind": ("event", texts), "x": (("event", "y"), np.ones((3, 2)), {"units": "Pa", "_FillValue": -1.0}),
                        "time": ("event", np.arange(3).astype("M8[ns]"))},
                       coords={"y": [1, 2]}, attrs={"texts": ["x", "y"], "number": 3})  # fmt: skip
    rd.io.write_dataset(table, tmp_path / "good.nc")
    return (tmp_path / "good.nc").read_bytes(), bytes, lambda path: repr(rd.io.read_dataset(path))


@pytest.fixture
def states(sheared_state, tmp_path):
    data = sheared_state.to_file(tmp_path / "good.h5").read_bytes()

    def use(path):
        specimen = read_specimen(path)
        specimen.probe(np.array([1e-7, 0.0, 0.0]), 5)
        assert np.isfinite(specimen.stress).all()

    return data[front_block(data) :], lambda body: sealed({"format": "rendulic state"}, body), use


@pytest.mark.parametrize("kind", ["snapshots", "tables", "states"])
def test_tampered_files_are_refused_or_used(request, tmp_path, kind):
    """One sentence that names the file, or numbers; no more memory than twice the file and 200 MB."""
    good, signed, use = request.getfixturevalue(kind)
    chance = random.Random(kind)
    body, path, told = tmp_path / "body", tmp_path / "tampered.h5", []
    for _ in range(FILES):
        body.write_bytes(good)
        tamper(body, chance)
        path.write_bytes(signed(body.read_bytes()))
        before = memory()
        try:
            # what h5netcdf says of odd attributes on the way
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                use(path)
        except RendulicError as error:
            told.append(str(error))
        assert memory() - before < 2 * path.stat().st_size + 200e6
    assert 0.2 * FILES < len(told) < FILES
    assert not [words for words in told if "\n" in words or "tampered.h5" not in words]


def memory():
    """The most that this process has had, in bytes."""
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
