"""The file of a finished unit: what it was made from, in plain JSON, and its arrays, in HDF5; one checksum over all.

A file is a front block (`rendulic.foundation.sealed`), which `head` shows, and an HDF5 file, which any HDF5 tool opens.
Nothing in a file is ever executed, and no link in it is followed.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rendulic.foundation.errors import CorruptFile
from rendulic.foundation.hdf5 import plain_file, readable
from rendulic.foundation.json_text import read_json_text
from rendulic.foundation.sealed import front_block, is_whole, sealed, text_of
from rendulic.specimen.state import State
from rendulic.study.store.unit import key_of

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["SCHEMA", "from_bytes", "to_bytes"]

FORMAT, SCHEMA = "rendulic unit", 1


def to_bytes(order: Mapping[str, Any], parts: Mapping[str, State | xr.Dataset]) -> bytes:
    """The whole file of a finished unit; equal results give equal bytes."""
    import h5py

    described: dict[str, Any] = {}
    with h5py.File("unit", "w", driver="core", backing_store=False) as file:
        for name, part in parts.items():
            described[name], arrays = _taken_apart(part)
            group = file.create_group(name)
            for own, array in arrays.items():
                group.create_dataset(own, data=array)
        file.flush()
        body = file.id.get_file_image()
    about = {name: order[name] for name in ("rendulic", "results", "key", "kind", "inputs", "needs")}
    return sealed({"format": FORMAT, "schema": SCHEMA, **about, "parts": described}, body, _plain)


def from_bytes(data: bytes, path: Path) -> tuple[dict[str, Any], dict[str, State | xr.Dataset]]:
    """What a unit was made from, and its parts.

    Parameters
    ----------
    data : bytes
        The file.
    path : Path
        Of the file, named by the unit's hash; for messages and to compare with.

    Raises
    ------
    CorruptFile
        If it is truncated, altered, foreign, of another schema, or not the unit that its name says.
    """
    block = front_block(data)
    if not block:
        raise CorruptFile(f"{path} is truncated or no unit of a study: run again with --repair")
    head = _header(text_of(data, block), path)
    if not is_whole(data, block):
        raise _altered(path)
    with readable(path, "unit"):
        own = key_of(head["kind"], head["inputs"], head["needs"], head["results"])
        if not own == head["key"] == path.stem:
            raise CorruptFile(f"{path} holds unit {own}, which is not the one it is named for: delete it")
        with plain_file(path, "unit", data) as file:
            parts = {name: _put_together(about, file.arrays(name)) for name, about in head["parts"].items()}
    return head, parts


def _header(text: bytes, path: Path) -> dict[str, Any]:
    try:
        head = read_json_text(text)
        found, schema = head["format"], head["schema"]
    except (ValueError, TypeError, KeyError):
        raise _altered(path) from None
    if found != FORMAT:
        raise CorruptFile(f"{path} is no unit of a study (its 'format' is {found!r}): delete it")
    if schema != SCHEMA:
        raise CorruptFile(
            f"{path} has schema {schema}, and this version of rendulic reads schema {SCHEMA}: use the version that wrote it "
            f"({head.get('rendulic')}), or run again with --repair"
        )
    return head


def _altered(path: Path) -> CorruptFile:
    return CorruptFile(f"{path} has been altered: its content does not match its checksum; run again with --repair")


def _plain(value: Any) -> Any:
    """Numbers and arrays of numpy as JSON can hold them."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    raise TypeError(f"{value!r} cannot be kept as JSON")


def _taken_apart(part: State | xr.Dataset) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """A part as description and arrays."""
    if isinstance(part, State):
        return {"is": "state", "kind": part.kind, "attributes": part.attributes}, part.arrays
    variables, arrays = {}, {}
    for name, variable in part.variables.items():
        values = np.asarray(variable.values)
        text = values.dtype.kind if values.dtype.kind in "OU" else None
        if text:
            # of nothing, numpy before 2 makes numbers
            values = np.char.encode(values.astype(str), "utf-8") if values.size else values.astype("S1")
        arrays[str(name)] = values
        about = {"dims": variable.dims, "attrs": variable.attrs, "text": text}
        variables[str(name)] = about | {"is_coordinate": name in part.coords}
    return {"is": "dataset", "variables": variables, "attrs": part.attrs}, arrays


def _put_together(about: Mapping[str, Any], arrays: dict[str, np.ndarray]) -> State | xr.Dataset:
    import xarray as xr

    if about["is"] == "state":
        return State(about["kind"], arrays, about["attributes"])
    variables: dict[str, tuple] = {}
    coords: dict[str, tuple] = {}
    for name, own in about["variables"].items():
        values = arrays[name]
        if own["text"]:
            values = np.char.decode(values, "utf-8") if values.size else values.astype("U1")
            # an empty array of objects has no kind, and old versions of xarray cannot write it
            values = values.astype(object) if own["text"] == "O" and values.size else values
        (coords if own["is_coordinate"] else variables)[name] = (own["dims"], values, own["attrs"])
    return xr.Dataset(variables, coords, about["attrs"])
