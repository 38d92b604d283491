"""Files that appear whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rendulic.foundation.errors import InvalidInput

__all__ = ["is_reserved", "whole_file", "writable_folder"]

# names of devices on Windows, with any ending
DEVICES = {"con", "prn", "aux", "nul", *(f"{port}{k}" for port in ("com", "lpt") for k in range(10))}

# the process's file mask can only be read by setting it: once, before there are threads
MASK = os.umask(0)
os.umask(MASK)


def is_reserved(name: str) -> bool:
    """Whether Windows has a device of this name, so that no file or folder there can have it.

    >>> is_reserved("NUL.toml"), is_reserved("null")
    (True, False)
    """
    return name.partition(".")[0].strip().lower() in DEVICES


def _expect_own_name(path: Path) -> None:
    for part in (path.name, path.parent.name):
        if is_reserved(part):
            raise InvalidInput(
                f"cannot write {path}: {part} is the name of a device on Windows, where no file can have it: choose another one"
            )


@contextmanager
def whole_file(path: str | os.PathLike) -> Iterator[Path]:
    """Yield a temporary path beside `path`; flush it to disk and rename it to `path` at the end.

    If anything fails, `path` is left as it was and the temporary file is gone.

    Raises
    ------
    InvalidInput
        If the folder cannot be made or written to.
    """
    path = Path(path)
    _expect_own_name(path)
    if path.exists() and not path.is_file():
        raise InvalidInput(f"cannot write {path}: it exists and is not a regular file; choose another name")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=f".part{path.suffix}", dir=path.parent)
    except OSError as error:
        raise InvalidInput(f"cannot write {path}: {error.strerror or error}") from None
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        with temporary.open("rb+") as written:
            os.fsync(written.fileno())
        temporary.chmod(0o666 & ~MASK)
        temporary.replace(path)
    except OSError as error:
        raise InvalidInput(f"cannot write {path}: {error.strerror or error}") from None
    finally:
        temporary.unlink(missing_ok=True)


def writable_folder(folder: str | os.PathLike) -> Path:
    """Return `folder` if files can be written to it, once it is made; it is not made here.

    Raises
    ------
    InvalidInput
        If not: better before hours of work than after.
    """
    folder = Path(folder)
    _expect_own_name(folder)
    nearest = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    try:
        tempfile.TemporaryFile(dir=nearest).close()
    except OSError as error:
        raise InvalidInput(f"cannot write to {folder}: {error.strerror or error}") from None
    return folder
