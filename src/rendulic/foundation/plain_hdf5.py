"""What is read of HDF5 files, and so of NetCDF 4: plain arrays and attributes that lie in the file itself.

1. No link is followed, no other file opened (external or virtual data), and nothing is reached twice.
2. Arrays are of numbers or of text of fixed length; texts of any length only where they are asked for.
3. Nothing is compressed: a few bytes of a compressed file can unpack to any number of bytes. None of rendulic's own files
   are. Checksums and reordered bytes (the filters fletcher32 and shuffle) are read.
4. All that is read together claims no more bytes than the file has.
5. Heaps of texts are looked at first, as damaged ones make the library loop for ever, or ask for gigabytes.

The library itself can still crash or never end on damaged files: `rendulic.foundation.hdf5` keeps it apart.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from math import prod
from pathlib import Path
from struct import unpack_from
from typing import TYPE_CHECKING, Any

import numpy as np

from rendulic.foundation.errors import CorruptFile
from rendulic.foundation.sealed import SIGNATURE

if TYPE_CHECKING:
    import h5py

__all__ = ["PlainFile", "opened"]

NUMBERS, TEXT = "biuf", "S"  # kinds of arrays that are data and nothing else
KEEPING_SIZE = (2, 3)  # filters of HDF5: shuffle and fletcher32
DEEPEST = 8  # groups within groups
MOST = 100_000  # arrays and groups of a file
MOST_TEXTS = 1_000_000  # texts of any length in an array
HEAP = re.compile(rb"GCOL\x01\0\0\0")  # where a heap of texts begins
# the type of texts, or of references to dimensions, of any length: of characters, of strings of one, of addresses
ANY_LENGTH = re.compile(
    rb"[\x19\x29\x39\x49][\x00-\x2f]..\x10\0\0\0(?:[\x10\x20\x30\x40]...\x01\0\0\0....|[\x13\x23\x33\x43]...\x01\0\0\0|"
    rb"[\x17\x27\x37\x47]...\x08\0\0\0)",
    re.DOTALL,
)
REFERENCES = np.dtype([("length", "<u4"), ("address", "<u8"), ("number", "<u4")])
REFERENCE = REFERENCES.itemsize
MOST_PIECES = 4096  # of an array of such texts
IN_MEMORY = 100_000_000  # bytes that texts of one read may take; how long they are is known only then
# how NetCDF ties arrays to their dimensions: references to other arrays of the file
DIMENSIONS = ("DIMENSION_LIST", "REFERENCE_LIST")
MOST_DIMENSIONS = 32


@contextmanager
def opened(path: Path, data: bytes | None = None) -> Iterator[PlainFile]:
    """A file of which only plain data are read, with the HDF5 library in this process.

    Parameters
    ----------
    path : Path
        Of the file.
    data : bytes, optional
        The whole content, if it has been read already.
    """
    import h5py

    data = path.read_bytes() if data is None else data
    expect_sound_texts(data)
    with h5py.File(BytesIO(data), "r") as file:
        yield PlainFile(file, path, data)


def expect_sound_texts(data: bytes) -> None:
    """Refuse texts of any length that would keep the library busy for ever, or make it ask for memory that no text needs.

    1. They lie in heaps: blocks of objects, one after another, each with its length; free room is object 0. The library
       follows a free room of length 0 without end.
    2. An attribute refers to them by length and place, after its type and its dimensions. The library asks for as much
       memory as the length says before it looks at the place.

    Raises
    ------
    ValueError
        If there is such a heap or reference, or lengths in the file do not have 8 bytes, so that both look otherwise.
    """
    start = data.find(SIGNATURE)
    if start < 0 or data[start + 8 : start + 9] not in (b"\0", b"\1", b"\2", b"\3"):
        raise ValueError("it has no beginning of HDF5")
    widths = start + (13 if data[start + 8] < 2 else 9)
    if data[widths : widths + 2] != b"\x08\x08":
        raise ValueError("its addresses and lengths do not have 8 bytes")
    for heap in re.finditer(HEAP, data):
        (size,) = unpack_from("<Q", data, heap.end())
        at, end = heap.start() + 16, min(heap.start() + size, len(data))
        while at + 16 <= end:
            number, length = unpack_from("<H6xQ", data, at)
            if number == length == 0:
                raise ValueError("a heap of texts has no end")
            at += 16 + (length + 7) // 8 * 8 if number else length
    for kind in re.finditer(ANY_LENGTH, data):
        for length in _lengths(data, kind.end()):
            if length > len(data):
                raise ValueError(f"a text claims {length} bytes, more than the {len(data)} that the file has")


def _lengths(data: bytes, at: int) -> Iterator[int]:
    """Lengths in the references of an attribute whose type ends at a place; none if it is of something else."""
    for padding in (0, 4):
        version, rank, flags, scalar = data[at + padding : at + padding + 4].ljust(4, b"\xff")
        if version == 1 and rank <= MOST_DIMENSIONS and flags < 2:
            sizes = at + padding + 8
        elif version == 2 and rank <= MOST_DIMENSIONS and flags < 2 and scalar == (rank > 0):
            sizes = at + padding + 4
        else:
            continue
        if sizes + 8 * rank > len(data):
            return
        count = prod(unpack_from(f"<{rank}Q", data, sizes))
        begin = sizes + 8 * rank * (1 + flags)
        for place in range(begin, min(begin + REFERENCE * count, len(data) - REFERENCE + 1), REFERENCE):
            yield unpack_from("<I", data, place)[0]
        return


class PlainFile:
    """What may be read of an open HDF5 file.

    Parameters
    ----------
    file : h5py.File
    path : Path
        For messages.
    data : bytes
        All of it.
    """

    def __init__(self, file: h5py.File, path: Path, data: bytes) -> None:
        self.file, self.path, self.data, self.size = file, path, data, len(data)
        self.left, self._seen = self.size, 0

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
        start = len(place) + 1 if place else 0
        return {
            own[start:]: self._array(item, own)
            for own, item in self._within(group, place)
            if isinstance(item, h5py.Dataset)
        }

    def variables(self) -> dict[str, Any]:
        """What xarray finds in a NetCDF file before it decodes times and missing values.

        Returns
        -------
        dict
            `variables`, each with its dimensions, values and attributes, and `attributes` of the whole.
        """
        from xarray.backends import H5NetCDFStore

        self._check()
        store = H5NetCDFStore.open(BytesIO(self.data))
        try:
            variables, attributes = store.load()
            own = {name: [list(one.dims), one.values, dict(one.attrs)] for name, one in variables.items()}
            return {"variables": own, "attributes": dict(attributes)}
        finally:
            store.close()

    def _check(self) -> None:
        """Refuse the file unless all of it is plain.

        Arrays of texts of any length are plain here, if together they are no longer than the file.
        """
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
        self._take(sum(int(lengths.sum()) for lengths in self._text_lengths(item, place)), place)

    def _text_lengths(self, item: h5py.Dataset, place: str) -> Iterator[np.ndarray]:
        """How long the texts of an array say that they are, from the bytes of the file: nothing is asked of the library."""
        import h5py

        layout, pieces = item.id.get_create_plist().get_layout(), []
        is_shuffled = bool(item.shuffle)
        if layout == h5py.h5d.CHUNKED and not is_shuffled and (count := item.id.get_num_chunks()) <= MOST_PIECES:
            infos = (item.id.get_chunk_info(k) for k in range(count))
            pieces = [(info.byte_offset, info.size // REFERENCE) for info in infos]
        elif layout == h5py.h5d.CONTIGUOUS:
            begin = item.id.get_offset()
            pieces = [] if begin is None else [(begin, item.size)]
        else:
            raise self._wrong(place, "has texts of any length in an unusual layout, which are not read")
        if not self.data.startswith(SIGNATURE):
            raise self._wrong(place, "has texts of any length, which are not read after a front block")
        for begin, count in pieces:
            yield np.frombuffer(self.data, REFERENCES, count, begin)["length"].astype(np.int64)

    def _attributes(self, item: h5py.Group | h5py.Dataset, place: str) -> dict[str, Any]:
        import h5py

        found = {}
        for name in item.attrs:
            own = item.attrs.get_id(name)
            shape, kind = own.shape, own.dtype.kind
            count = prod(shape or ())
            if name in DIMENSIONS:
                if not _are_references(own) or count > max(MOST_DIMENSIONS, self.size // REFERENCE):
                    raise self._wrong(f"{place}/@{name}", "does not name dimensions of the file")
                continue
            if kind == "O" and h5py.check_string_dtype(own.dtype) is not None:
                is_plain = (count <= 1 or count * self.size <= IN_MEMORY) and _is_of_characters(own.get_type())
            else:
                is_plain = kind in NUMBERS + TEXT and count * own.dtype.itemsize <= self.size
            if not is_plain:
                raise self._wrong(f"{place}/@{name}", f"is not a plain attribute, but {count} of {own.dtype}")
            found[name] = _plain(item.attrs[name])
        return found


def _is_of_characters(kind: h5py.h5t.TypeID) -> bool:
    """Whether texts of any length are of single characters, and their type stands where they are: so far they were sought."""
    return kind.get_super().get_size() == 1 and not kind.committed()


def _are_references(attribute: h5py.h5a.AttrID) -> bool:
    """Whether an attribute has references to dimensions, or to what has a dimension and which, and nothing else."""
    import h5py

    kind = attribute.get_type()
    if kind.committed():
        return False
    if isinstance(kind, h5py.h5t.TypeVlenID):
        return isinstance(kind.get_super(), h5py.h5t.TypeReferenceID)
    members = [kind.get_member_type(k) for k in range(kind.get_nmembers())]
    return [type(member) for member in members] == [h5py.h5t.TypeReferenceID, h5py.h5t.TypeIntegerID]


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
