"""The one reader of HDF5 files, and so of NetCDF 4, that may come from anyone.

Some damaged files make the HDF5 library crash (a few in a thousand of those with altered bytes, in every version), loop for
ever, or ask for all memory. So it reads in another process (`rendulic.foundation.hdf5_apart`), which hands back arrays and
attributes as plain bytes and JSON. What is promised:

1. Whatever the bytes of a file are, this process goes on: a file on which the library crashes, or is busy for longer than
   `hdf5_apart.PATIENCE`, or wants more memory than twice the file and 200 MB (where the system can limit that: Linux), is
   one `CorruptFile`, as any other file that cannot be read.
2. Nothing of other files is read, and no more bytes than the file has: `rendulic.foundation.plain_hdf5`.
3. A file with a front block (`rendulic.foundation.sealed`) is compared with its checksum first. If that is right, the bytes
   are those that were written, and the library reads them in this process: states and units cost no other one.

Where no other Python can be started (a frozen program, an interpreter within another program), the library reads all
files in this process: then point 1 does not hold.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from errno import EMFILE, ENFILE, ENOMEM
from pathlib import Path

from rendulic.foundation.errors import CorruptFile, RendulicError
from rendulic.foundation.hdf5_apart import FileApart, can_start, file_apart
from rendulic.foundation.plain_hdf5 import PlainFile, opened
from rendulic.foundation.sealed import front_block, is_sealed, is_whole

__all__ = ["plain_file", "readable"]


@contextmanager
def readable(path: Path, what: str) -> Iterator[None]:
    """Whatever goes wrong in here means that the file at `path` is not `what`, such as "snapshot".

    Raises
    ------
    CorruptFile
        In one line; errors of rendulic pass as they are, and so does what the system does not allow: that is no fault of
        the file.
    """
    try:
        yield
    except (RendulicError, ImportError):
        raise
    # the libraries have no list of what they raise on bytes that are not theirs
    except Exception as error:
        if isinstance(error, OSError) and error.errno in (EMFILE, ENFILE, ENOMEM):
            raise
        reason = " ".join(str(error).split())[:300] or type(error).__name__
        raise CorruptFile(f"{path} is not a readable {what} (truncated, altered or foreign): {reason}") from error


@contextmanager
def plain_file(path: Path, what: str, data: bytes | None = None) -> Iterator[PlainFile | FileApart]:
    """An open file of which only plain data are read.

    Parameters
    ----------
    path : Path
        Of the file.
    what : str
        What it should be, for messages, such as "snapshot".
    data : bytes, optional
        The whole content of a file with a front block, if it has been read, and compared with its checksum, already.

    Raises
    ------
    CorruptFile
        Also for whatever goes wrong while it is open: see `readable`.
    """
    with readable(path, what):
        if data is None and _is_sealed(path):
            data = _unsealed(path)
        with opened(path, data) if data is not None or not can_start() else file_apart(path) as file:
            yield file


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
