"""The complete state of a specimen, in memory and in a file, exact to the bit."""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from rendulic.foundation.errors import CorruptFile, InvalidInput
from rendulic.foundation.hdf5 import plain_file
from rendulic.foundation.json_text import read_json_text
from rendulic.foundation.notebooks import Shown
from rendulic.foundation.sealed import sealed
from rendulic.foundation.whole_file import whole_file

__all__ = ["State"]

FORMAT, SCHEMA = "rendulic state", 1


@dataclass(frozen=True)
class State(Shown):
    """What `Specimen.save` returns and `Specimen.restore` takes.

    Parameters
    ----------
    kind : str
        Class of the specimen it came from.
    arrays : dict of str to array
        Everything with an extent.
    attributes : dict
        Numbers and names, as JSON can hold them.
    """

    kind: str
    arrays: dict[str, np.ndarray] = field(repr=False)
    attributes: dict[str, Any] = field(repr=False)

    def _facts(self) -> dict[str, object]:
        size = sum(array.nbytes for array in self.arrays.values())
        return {"of": self.kind, "arrays": len(self.arrays), "size": f"{size / 1e6:.3g} MB", "checksum": self.checksum}

    def expect_kind(self, kind: str) -> None:
        """Raise `InvalidInput` unless the state is of this kind of specimen."""
        if self.kind != kind:
            raise InvalidInput(f"expected the state of a specimen of kind '{kind}', got one of kind '{self.kind}'")

    @property
    def checksum(self) -> str:
        """SHA-256 over kind, attributes and arrays: equal states have equal checksums."""
        digest = hashlib.sha256(json.dumps([self.kind, self.attributes], sort_keys=True).encode())
        for name in sorted(self.arrays):
            array = np.ascontiguousarray(self.arrays[name])
            digest.update(f"{name}{array.dtype.str}{array.shape}".encode())
            digest.update(array.tobytes())
        return digest.hexdigest()

    def to_file(self, path: str | os.PathLike) -> Path:
        """Write an HDF5 file, whole or not at all, and return its path.

        Raises
        ------
        InvalidInput
            If the folder cannot be written to.
        """
        import h5py

        with h5py.File("state", "w", driver="core", backing_store=False) as file:
            file.attrs.update(format=FORMAT, schema=SCHEMA, kind=self.kind, checksum=self.checksum)
            file.attrs["attributes"] = json.dumps(self.attributes)
            for name, array in self.arrays.items():
                file.create_dataset(f"arrays/{name}", data=array)
            file.flush()
            body = file.id.get_file_image()
        with whole_file(path) as temporary:
            temporary.write_bytes(sealed({"format": FORMAT, "schema": SCHEMA, "kind": self.kind}, body))
        return Path(path)

    @classmethod
    def from_file(cls, path: str | os.PathLike) -> State:
        """Read a file written by `to_file`; nothing in it is ever executed.

        Raises
        ------
        InvalidInput
            If there is no such file.
        CorruptFile
            If it is truncated, altered, not a rendulic state, or of a later schema.
        """
        path = Path(path)
        if not path.is_file():
            raise InvalidInput(f"no state file at {path}: check the path")
        with plain_file(path, "rendulic state") as file:
            about = file.attributes()
            found, schema = about.get("format"), about.get("schema")
            if found != FORMAT:
                raise CorruptFile(f"{path} is an HDF5 file but not a rendulic state (its 'format' is {found!r})")
            if schema != SCHEMA:
                raise CorruptFile(f"{path} has schema {schema}; this version of rendulic reads schema {SCHEMA}")
            kind, expected, attributes = (str(about[name]) for name in ("kind", "checksum", "attributes"))
            state = cls(kind, file.arrays("arrays"), read_json_text(attributes))
            if not isinstance(state.attributes, dict):
                raise ValueError(f"expected attributes with names, found {attributes[:80]!r}")
        if state.checksum != expected:
            raise CorruptFile(f"{path} has been altered: its content does not match its checksum; write it again")
        return state
