"""The one reader of HDF5 files, and so of NetCDF 4, that may come from anyone.

What is read are plain arrays and attributes that lie in the file itself:

1. A file with a front block (`rendulic.foundation.sealed`) is compared with its checksum before HDF5 sees it.
2. No link is followed, no other file opened (external or virtual data), and nothing is reached twice.
3. Arrays are of numbers or of text of fixed length; texts of any length only where they are asked for.
4. Nothing is compressed: a few bytes of a compressed file can unpack to any number of bytes. None of rendulic's own files
   are. Checksums and reordered bytes (the filters fletcher32 and shuffle) are read.
5. All that is read together claims no more bytes than the file has.

Whatever the library says about anything else is one `CorruptFile`.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rendulic.foundation.errors import CorruptFile, RendulicError
from rendulic.foundation.sealed import front_block, is_sealed, is_whole

if TYPE_CHECKING:
    import h5py

__all__ = ["PlainFile", "plain_file", "readable"]

NUMBERS, TEXT = "biuf", "S"  # kinds of arrays that are data and nothing else
KEEPING_SIZE = (2, 3)  # filters of HDF5: shuffle and fletcher32
DEEPEST = 8  # groups within groups
MOST = 100_000  # arrays and groups of a file
MOST_TEXTS = 1_000_000  # texts of any length in an array
IN_MEMORY = 100_000_000  # bytes that texts of one read may take; how long they are is known only then
# how NetCDF ties arrays to their dimensions: references to other arrays of the file
DIMENSIONS = ("DIMENSION_LIST", "REFERENCE_LIST")
MOST_DIMENSIONS = 32


@contextmanager
def readable(path: Path, what: str) -> Iterator[None]:
    """Whatever goes wrong in here means that the file at `path` is not `what`, such as "snapshot".

    Raises
    ------
    CorruptFile
        In one line; errors of rendulic pass as they are.
    """
    try:
        yield
    except RendulicError:
        raise
    # the libraries have no list of what they raise on bytes that are not theirs
    except Exception as error:
        reason = " ".join(str(error).split())[:300] or type(error).__name__
        raise CorruptFile(f"{path} is not a readable {what} (truncated, altered or foreign): {reason}") from error


@contextmanager
def plain_file(path: Path, what: str, data: bytes | None = None) -> Iterator[PlainFile]:
    """An open file of which only plain data are read.

    Parameters
    ----------
    path : Path
        Of the file.
    what : str
        What it should be, for messages, such as "snapshot".
    data : bytes, optional
        The whole content, if it has been read already; its checksum then has been compared, too.

    Raises
    ------
    CorruptFile
        Also for whatever goes wrong while it is open: see `readable`.
    """
    import h5py

    with readable(path, what):
        source: Path | BytesIO = path
        size = path.stat().st_size if data is None else len(data)
        if data is not None:
            source = BytesIO(data)
        elif _is_sealed(path):
            source = BytesIO(_unsealed(path))
        with h5py.File(source, "r") as file:
            yield PlainFile(file, path, size)


def _is_sealed(path: Path) -> bool:
    with path.open("rb") as file:
        return is_sealed(file.read(64))


def _unsealed(path: Path) -> bytes:
    """All of a file that is what was written."""
    data = path.read_bytes()
    block = front_block(data)
    if not block or not is_whole(data, block):
        raise CorruptFile(f"{path} has been altered: its content does not match its checksum; write it again")
    return data


class PlainFile:
    """What may be read of an open HDF5 file.

    Parameters
    ----------
    file : h5py.File
    path : Path
        For messages.
    size : int
        Bytes that it has.
    """

    def __init__(self, file: h5py.File, path: Path, size: int) -> None:
        self.file, self.path, self.size = file, path, size
        self.left, self._seen = size, 0

    def attributes(self, place: str = "") -> dict[str, Any]:
        """Text, numbers and arrays of them that are said about a group or an array."""
        item = self._at(place)
        if item is None:
            raise self._wrong(place, "is not there")
        return self._attributes(item, place)

    def array(self, place: str) -> np.ndarray | None:
        """The array at a place, such as "grains/radius"; None if there is nothing."""
        import h5py

        item = self._at(place)
        if item is None:
            return None
        if not isinstance(item, h5py.Dataset):
            raise self._wrong(place, "is not a plain array")
        return self._array(item, place)

    def arrays(self, place: str) -> dict[str, np.ndarray]:
        """All arrays of a group, and of groups in it under names with slashes."""
        import h5py

        group = self._at(place)
        if not isinstance(group, h5py.Group):
            raise self._wrong(
                place, f"{'is not there' if group is None else 'is an array'}: expected a group of arrays"
            )
        start = len(place) + 1
        return {
            own[start:]: self._array(item, own)
            for own, item in self._within(group, place)
            if isinstance(item, h5py.Dataset)
        }

    def check(self) -> None:
        """Refuse the file unless all of it is plain; arrays of texts of any length are. For readers of other libraries."""
        import h5py

        self._attributes(self.file, "")
        for place, item in self._within(self.file, ""):
            self._attributes(item, place)
            if isinstance(item, h5py.Dataset):
                if h5py.check_string_dtype(item.dtype) is not None and item.dtype.kind == "O":
                    self._texts(item, place)
                else:
                    self._expect_plain(item, place)

    def _wrong(self, place: str, why: str) -> CorruptFile:
        # names may hold anything: repr keeps them printable
        return CorruptFile(f"{self.path}: {place!r} {why}")

    def _at(self, place: str) -> Any:
        """The group or array at a place, reached without following links; None if there is none."""
        import h5py

        item: Any = self.file
        for part in place.split("/") if place else ():
            item = self._member(item, part, place) if isinstance(item, h5py.Group) and part in item else None
            if item is None:
                return None
        return item

    def _member(self, group: h5py.Group, name: str, place: str) -> h5py.Group | h5py.Dataset:
        import h5py

        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            raise self._wrong(place, "is a link, and links are not followed: the file must hold its data itself")
        item = group[name]
        if not isinstance(item, h5py.Group | h5py.Dataset):
            raise self._wrong(place, "is neither a plain array nor a group of arrays")
        return item

    def _within(
        self, group: h5py.Group, above: str, met: set[Any] | None = None, depth: int = 1
    ) -> Iterator[tuple[str, Any]]:
        """All that is in a group, the groups in it included."""
        import h5py

        met = set() if met is None else met
        if depth > DEEPEST:
            raise self._wrong(above, f"is more than {DEEPEST} groups deep")
        for name in group:
            place = f"{above}/{name}" if above else name
            item = self._member(group, name, place)
            self._seen += 1
            where = h5py.h5o.get_info(item.id).addr
            if where in met or self._seen > MOST:
                raise self._wrong(
                    place, "is in the file twice" if where in met else f"is one of more than {MOST} things"
                )
            met.add(where)
            yield place, item
            if isinstance(item, h5py.Group):
                yield from self._within(item, place, met, depth + 1)

    def _expect_plain(self, item: h5py.Dataset, place: str, kinds: str = NUMBERS + TEXT) -> None:
        """Refuse an array that is not plain, or has its data elsewhere, or claims more bytes than are left."""
        if item.dtype.kind not in kinds:
            raise self._wrong(place, f"is not a plain array, but of {item.dtype}")
        if item.is_virtual or item.external is not None:
            raise self._wrong(
                place, "has its data in other files, which are not opened: the file must hold them itself"
            )
        properties = item.id.get_create_plist()
        packed = [
            own for own in map(properties.get_filter, range(properties.get_nfilters())) if own[0] not in KEEPING_SIZE
        ]
        if packed:
            raise self._wrong(place, f"is compressed ({packed[0][3].decode(errors='replace') or packed[0][0]}), which is not "
                              "read, as it can unpack to any size: write it uncompressed, or use `h5repack -f NONE`")  # fmt: skip
        chunk = prod(item.chunks) * item.dtype.itemsize if item.chunks else 0
        # a piece of an array is always read whole; the room beyond the array's end is in the file only if it was written
        self._take(max(item.nbytes, min(chunk, item.id.get_storage_size())), place)
        if chunk > max(self.size, IN_MEMORY):
            raise self._wrong(place, f"has pieces of {chunk} bytes, more than the {self.size} that the file has")

    def _take(self, claimed: int, place: str) -> None:
        self.left -= claimed
        if self.left < 0:
            raise self._wrong(
                place, f"asks for more bytes ({claimed}) than the file has ({self.size} with all that it holds)"
            )

    def _array(self, item: h5py.Dataset, place: str) -> np.ndarray:
        self._expect_plain(item, place)
        return np.asarray(item[()])

    def _texts(self, item: h5py.Dataset, place: str) -> None:
        """Refuse an array of texts that together are longer than the file."""
        self._expect_plain(item, place, "O")
        if item.size > MOST_TEXTS:
            raise self._wrong(place, f"has {item.size} texts, more than the {MOST_TEXTS} that are read")
        if item.shape == () or len(item.shape) > 1 or item.size == 0:
            if item.size * self.size > max(self.size, IN_MEMORY):
                raise self._wrong(place, f"has {item.size} texts in {len(item.shape)} dimensions, too many to be read")
            self._take(sum(map(len, np.ravel(item[()]))), place)
            return
        at_once = max(1, IN_MEMORY // self.size)
        for start in range(0, len(item), at_once):
            self._take(sum(map(len, item[start : start + at_once])), place)

    def _attributes(self, item: h5py.Group | h5py.Dataset, place: str) -> dict[str, Any]:
        import h5py

        found = {}
        for name in item.attrs:
            own = item.attrs.get_id(name)
            shape, kind = own.shape, own.dtype.kind
            count = prod(shape or ())
            if name in DIMENSIONS:
                if name == "DIMENSION_LIST" and count > MOST_DIMENSIONS:
                    raise self._wrong(place, f"has {count} dimensions, more than the {MOST_DIMENSIONS} that are read")
                continue
            if kind == "O" and h5py.check_string_dtype(own.dtype) is not None:
                is_plain = count <= 1 or count * self.size <= IN_MEMORY
            else:
                is_plain = kind in NUMBERS + TEXT and count * own.dtype.itemsize <= self.size
            if not is_plain:
                raise self._wrong(f"{place}/@{name}", f"is not a plain attribute, but {count} of {own.dtype}")
            found[name] = _plain(item.attrs[name])
        return found


def _plain(value: Any) -> Any:
    """Text as str, numbers as of Python, arrays as they are."""
    import h5py

    if isinstance(value, h5py.Empty):
        return ""
    if isinstance(value, bytes):
        return value.decode("utf-8")
    if isinstance(value, np.ndarray) and value.ndim == 0:
        return _plain(value[()])
    if isinstance(value, np.generic):
        return _plain(value.item())
    return value
