"""The folder of a study: one file for each finished unit, notes of the failed ones, logs, and who works there."""

from __future__ import annotations

import json
import os
import re
import socket
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from filelock import BaseFileLock, FileLock, Timeout

from rendulic.foundation.errors import CorruptFile, InvalidInput
from rendulic.foundation.json_text import read_json_text
from rendulic.foundation.sealed import front_block, is_whole
from rendulic.foundation.whole_file import whole_file
from rendulic.study.store.unit_file import from_bytes, to_bytes

if TYPE_CHECKING:
    import xarray as xr

    from rendulic.specimen.state import State

__all__ = ["Store"]

LOCK, HOLDER = "lock", "holder.json"
PATIENCE = 1.0  # seconds that a claim waits
GLANCE = 0.05  # seconds that a look waits for others that look
NAMED = re.compile(r"[0-9a-f]{32}\.h5")
LEFT_OVER = re.compile(r"\..*\.part(\.\w+)?")


class Store:
    """What is finished, failed and running in a study's folder.

    Parameters
    ----------
    folder : path
        Need not exist. `units/` has a file for each finished unit, named by its hash, whole or not there at all;
        `failed/` a note for each unit that failed; `logs/` a log for each unit; `running.json` what runs now;
        `lock` is held by the process that works on it, which `holder.json` names.
    """

    def __init__(self, folder: str | os.PathLike) -> None:
        self.folder = Path(folder)

    def file(self, key: str) -> Path:
        """Where the result of a unit is, or would be."""
        return self.folder / "units" / key[:2] / f"{key}.h5"

    def keys(self) -> set[str]:
        """Hashes of all finished units, by the names of their files.

        Raises
        ------
        InvalidInput
            If the folder cannot be read.
        """
        return {entry.name[:-3] for entry in self._entries() if NAMED.fullmatch(entry.name)}

    def _entries(self) -> Iterator[os.DirEntry]:
        """All that is in the folders of units; a link to a folder is followed, as it is when a unit is read."""
        try:
            with os.scandir(self.folder / "units") as folders:
                for folder in folders:
                    if folder.is_dir():
                        with os.scandir(folder.path) as files:
                            yield from files
        except FileNotFoundError:
            return
        except OSError as error:
            raise InvalidInput(f"cannot read {error.filename}: {error.strerror or error}") from None

    def write(self, order: Mapping[str, Any], parts: Mapping[str, State | xr.Dataset]) -> Path:
        """Keep a result, whole or not at all; the same result again changes nothing.

        Raises
        ------
        InvalidInput
            If the folder cannot be written to, or its disk is full.
        """
        path = self.file(order["key"])
        data = to_bytes(order, parts)
        with whole_file(path) as temporary:
            temporary.write_bytes(data)
        return path

    def read(self, key: str) -> dict[str, Any]:
        """The parts of a finished unit, each a `State` or a dataset.

        Raises
        ------
        InvalidInput
            If it is not finished.
        CorruptFile
            If its file is truncated, altered or foreign.
        """
        path = self.file(key)
        try:
            data = path.read_bytes()
        except FileNotFoundError:
            raise InvalidInput(f"unit {key} is not in {self.folder}: run the study again") from None
        except OSError as error:
            raise CorruptFile(f"cannot read {path}: {error.strerror or error}") from None
        return from_bytes(data, path)[1]

    def is_kept(self, key: str) -> bool:
        """Whether a unit's file is there and whole, as this process sees it."""
        try:
            data = self.file(key).read_bytes()
        except OSError:
            return False
        block = front_block(data)
        return block is not None and is_whole(data, block)

    def damaged(self, keys: set[str]) -> dict[str, CorruptFile]:
        """Those of these finished units whose files are not what was written, and why."""
        found = {}
        for key in sorted(keys):
            try:
                self.read(key)
            except CorruptFile as error:
                found[key] = error
        return found

    def remove(self, key: str) -> None:
        """Forget a result."""
        self.file(key).unlink(missing_ok=True)

    def sweep(self) -> int:
        """Remove what killed processes left half-written, and return how many files that were."""
        left = [entry.path for entry in self._entries() if LEFT_OVER.fullmatch(entry.name)]
        left += [str(path) for place in (self.folder, self.folder / "failed") for path in place.glob(".*.part*")]
        for path in left:
            Path(path).unlink(missing_ok=True)
        return len(left)

    def failures(self) -> dict[str, dict[str, Any]]:
        """Notes of failed units: `label`, `error`, and whether the failure `is_final`, as those of the mechanics are."""
        notes = {}
        for path in sorted((self.folder / "failed").glob("*.json")):
            with suppress(OSError, ValueError):
                note = read_json_text(path.read_text(encoding="utf-8"))
                if isinstance(note, dict) and {"label", "error", "is_final"} <= set(note):
                    notes[path.stem] = note
        return notes

    def note_failure(self, key: str, label: str, error: str, is_final: bool) -> None:
        """Write down that a unit failed."""
        self.write_json(f"failed/{key}.json", {"label": label, "error": error, "is_final": is_final})

    def forget_failure(self, key: str) -> None:
        """After it has been done, or is tried again."""
        (self.folder / "failed" / f"{key}.json").unlink(missing_ok=True)

    def write_json(self, name: str, value: Any) -> None:
        """A small file of the folder, whole or not at all."""
        with whole_file(self.folder / name) as temporary:
            temporary.write_text(json.dumps(value, indent=1), encoding="utf-8")

    def read_json(self, name: str) -> Any:
        """A small file of the folder, or None if there is none that can be read."""
        with suppress(OSError, ValueError):
            return read_json_text((self.folder / name).read_text(encoding="utf-8"))
        return None

    @contextmanager
    def claimed(self) -> Iterator[None]:
        """Be the one process that works on this folder; the system ends the claim with the process, however it ends.

        Raises
        ------
        InvalidInput
            If another process does, or the folder cannot be written to.
        """
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            # somebody who only looks holds the lock for less than a millisecond
            held = self._lock().acquire(timeout=PATIENCE, poll_interval=PATIENCE / 100)
        except Timeout:
            holder = self.read_json(HOLDER)
            who = holder if isinstance(holder, str) and holder.isprintable() else "another process"
            raise InvalidInput(
                f"{self.folder} is being worked on by {who[:200]}: wait for it, or choose another folder"
            ) from None
        except OSError as error:
            raise InvalidInput(f"cannot write to {self.folder}: {error.strerror or error}") from None
        except NotImplementedError:  # no locks on this file system: results are whole, and equal whoever writes them
            yield
            return
        with held:
            self.write_json(HOLDER, f"process {os.getpid()} on {socket.gethostname()}")
            try:
                yield
            finally:
                (self.folder / HOLDER).unlink(missing_ok=True)

    def is_claimed(self) -> bool:
        """Whether a process works on this folder now; nothing is written, and no claim of another is disturbed."""
        # without a note there is no holder; a killed process leaves its note, and then the lock tells
        try:
            if not (self.folder / HOLDER).exists():
                return False
            with self._lock().acquire(timeout=GLANCE, poll_interval=GLANCE / 5):
                return False
        except Timeout:
            return True
        except (OSError, NotImplementedError):
            return False

    def _lock(self) -> BaseFileLock:
        return FileLock(self.folder / LOCK)
