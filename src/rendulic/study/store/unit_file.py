"""The file of a finished unit: what it was made from, in plain JSON, and its arrays, in HDF5; one checksum over all.

A file is a header and an HDF5 file. The header fills the user block that HDF5 leaves free at the front (512 bytes or
a power of two times that), so that `head` shows it and any HDF5 tool opens the arrays. It is JSON, blanks, and the
SHA-256 of all other bytes of the file. Nothing in a file is ever executed, and no link in it is followed.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rendulic.foundation.errors import CorruptFile
from rendulic.specimen.state import State
from rendulic.study.store.unit import key_of

if TYPE_CHECKING:
    import h5py
    import xarray as xr

__all__ = ["SCHEMA", "from_bytes", "to_bytes"]

FORMAT, SCHEMA = "rendulic unit", 1
SIGNATURE = b"\x89HDF\r\n\x1a\n"
SMALLEST_BLOCK, LARGEST_BLOCK = 512, 2**26
DIGEST = 65  # characters at the end of the header: 64 hexadecimal digits and a line feed
DEEPEST = 3  # groups within groups
PLAIN = "biufS"  # kinds of arrays that are data and nothing else


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
    text = json.dumps({"format": FORMAT, "schema": SCHEMA, **about, "parts": described}, default=_plain).encode()
    block = SMALLEST_BLOCK
    while block < len(text) + DIGEST:
        block *= 2
    header = text.ljust(block - DIGEST)
    return header + _digest(header, body) + b"\n" + body


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
    import h5py

    block = _block(data, path)
    head = _header(data[: block - DIGEST], path)
    if data[block - DIGEST : block] != _digest(data[: block - DIGEST], data[block:]) + b"\n":
        raise _altered(path)
    try:
        own = key_of(head["kind"], head["inputs"], head["needs"], head["results"])
        if not own == head["key"] == path.stem:
            raise CorruptFile(f"{path} holds unit {own}, which is not the one it is named for: delete it")
        with h5py.File(BytesIO(data[block:]), "r") as file:
            read = _Reader(file, path, len(data))
            parts = {name: _put_together(about, read.arrays(name)) for name, about in head["parts"].items()}
    except (OSError, KeyError, ValueError, TypeError, AttributeError, RuntimeError, RecursionError) as error:
        raise CorruptFile(f"{path} is not a readable unit: {error}") from None
    return head, parts


def _block(data: bytes, path: Path) -> int:
    """Where the HDF5 file begins."""
    block = SMALLEST_BLOCK
    while block < min(len(data), LARGEST_BLOCK):
        if data[block : block + len(SIGNATURE)] == SIGNATURE:
            return block
        block *= 2
    raise CorruptFile(f"{path} is truncated or no unit of a study: run again with --repair")


def _header(text: bytes, path: Path) -> dict[str, Any]:
    try:
        head = json.loads(text)
        found, schema = head["format"], head["schema"]
    except (ValueError, TypeError, KeyError, RecursionError):
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


def _digest(header: bytes, body: bytes) -> bytes:
    digest = hashlib.sha256(header)
    digest.update(body)
    return digest.hexdigest().encode()


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


class _Reader:
    """Arrays of a file, which may be hostile: only plain data that lie in the file itself are read."""

    def __init__(self, file: h5py.File, path: Path, size: int) -> None:
        self.file, self.path, self.left = file, path, size

    def arrays(self, name: str) -> dict[str, np.ndarray]:
        """All arrays of a group, and of groups in it under names with slashes."""
        import h5py

        group = self._item(self.file, name)
        if not isinstance(group, h5py.Group):
            raise CorruptFile(f"{self.path}: '{name}' is not a group of arrays: delete the file")
        return dict(self._within(group, ""))

    def _within(self, group: h5py.Group, above: str) -> Iterator[tuple[str, np.ndarray]]:
        import h5py

        for name in group:
            item = self._item(group, name)
            if isinstance(item, h5py.Group) and above.count("/") < DEEPEST:
                yield from self._within(item, f"{above}{name}/")
            else:
                yield above + name, self._array(item, name)

    def _item(self, group: h5py.Group, name: str) -> Any:
        import h5py

        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            raise CorruptFile(f"{self.path}: '{name}' is a link, and links are not followed: delete the file")
        return group[name]

    def _array(self, item: Any, name: str) -> np.ndarray:
        import h5py

        if not isinstance(item, h5py.Dataset) or item.dtype.kind not in PLAIN:
            raise CorruptFile(f"{self.path}: '{name}' is not a plain array: delete the file")
        if item.is_virtual or item.external is not None:
            raise CorruptFile(
                f"{self.path}: '{name}' has its data in other files, which are not opened: delete the file"
            )
        self.left -= item.nbytes
        if self.left < 0:
            raise CorruptFile(f"{self.path}: '{name}' asks for more bytes than the file has: delete the file")
        return item[()]
