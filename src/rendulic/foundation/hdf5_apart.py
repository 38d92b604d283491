"""HDF5 files read in another process, which may crash: `python -m rendulic.foundation.hdf5_apart`.

Orders and answers are lines of JSON; the arrays of an answer follow it as plain bytes. The process ends with the one that
started it, as its input does. It serves one file after another; several are at work where several files are open at once.
"""

from __future__ import annotations

import atexit
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from math import prod
from pathlib import Path
from threading import Timer
from typing import IO, Any

import numpy as np

from rendulic.foundation.errors import CorruptFile, RendulicError
from rendulic.foundation.plain_hdf5 import PlainFile, opened

__all__ = ["FileApart", "can_start", "file_apart", "main"]

PATIENCE = 30.0  # seconds that the library may take for an answer, and a second more for each so many bytes:
PACE = 5_000_000
TO_START = 120.0  # seconds that the process may take to start
IN_MEMORY = 200_000_000  # bytes that it may take beside twice the file
MOST_IDLE = 4  # processes kept for other files
PROGRAM = ["-m", "rendulic.foundation.hdf5_apart"]
THREADS = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")}

_idle: list[_Process] = []


@atexit.register
def _end_idle() -> None:
    while _idle:
        _idle.pop().end()


def can_start() -> bool:
    """Whether another Python can be started, so that the library can crash there."""
    return bool(sys.executable) and not getattr(sys, "frozen", False) and sys.platform not in ("emscripten", "wasi")


@contextmanager
def file_apart(path: Path) -> Iterator[FileApart]:
    """A file that another process reads.

    Raises
    ------
    OSError
        If it cannot be opened.
    CorruptFile, ValueError
        If it is not a file of plain data: see `rendulic.foundation.plain_hdf5.PlainFile`.
    """
    file = FileApart(path)
    try:
        yield file
    finally:
        file.close()


class FileApart:
    """What may be read of an HDF5 file; methods as of `rendulic.foundation.plain_hdf5.PlainFile`.

    Parameters
    ----------
    path : Path
    """

    def __init__(self, path: Path) -> None:
        self.path, self.size = path, path.stat().st_size
        self._process: _Process | None = None

    def attributes(self, place: str = "") -> dict[str, Any]:
        return self._ask("attributes", place)

    def array(self, place: str) -> np.ndarray | None:
        return self._ask("array", place)

    def arrays(self, place: str) -> dict[str, np.ndarray]:
        return self._ask("arrays", place)

    def variables(self) -> dict[str, Any]:
        return self._ask("variables")

    def close(self) -> None:
        """Let the process serve other files."""
        process, self._process = self._process, None
        if process is None:
            return
        try:
            process.answer({"order": ["close"]}, PATIENCE, 0)
        except EOFError:
            process.end()
            return
        if len(_idle) < MOST_IDLE:
            _idle.append(process)
        else:
            process.end()

    def _ask(self, *order: str) -> Any:
        seconds = PATIENCE + self.size / PACE
        while True:
            process = self._process or _process()
            self._process, was_used = process, process.has_served
            process.has_served = True
            try:
                answer = process.answer({"path": str(self.path.absolute()), "order": order}, seconds, 2 * self.size)
            except EOFError:
                self._process = None
                if process.end():
                    raise ValueError(f"it keeps the HDF5 library busy for more than {seconds:.0f} s") from None
                # what an earlier file did to its memory is not this file's fault
                if was_used:
                    continue
                raise ValueError("it makes the HDF5 library crash") from None
            except BaseException:
                # an answer of which a part was read: nobody else can use the process
                self._process = None
                process.end()
                raise
            if "refused" in answer:
                raise CorruptFile(answer["refused"])
            if "failed" in answer:
                raise ValueError(answer["failed"])
            return answer["found"]


def _process() -> _Process:
    """A process that waits for orders, of this process: after a fork, those of the parent are the parent's."""
    while _idle:
        with suppress(IndexError):  # another thread may be faster
            process = _idle.pop()
            if process.parent == os.getpid() and process.is_running():
                return process
    return _Process()


class _Process:
    """The process, seen from the one that started it."""

    def __init__(self) -> None:
        self.parent, self.has_served, self._was_late = os.getpid(), False, False
        places = os.pathsep.join(filter(None, sys.path))  # the packages that are found here are found there
        apart: dict[str, Any] = {"start_new_session": True}  # Ctrl-C is not for it
        if sys.platform == "win32":
            apart = {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP | subprocess.CREATE_NO_WINDOW}
        try:
            self.process = subprocess.Popen(
                [sys.executable, "-P", *PROGRAM], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL, env=os.environ | THREADS | {"PYTHONPATH": places}, **apart,
            )  # fmt: skip
        except OSError as error:
            raise _not_started(error.strerror or str(error)) from None
        try:
            self.answer(None, TO_START, 0)
        except EOFError:
            self.end()
            raise _not_started("it ended at once") from None
        except BaseException:
            self.end()
            raise

    def is_running(self) -> bool:
        return self.process.poll() is None

    def answer(self, order: dict[str, Any] | None, seconds: float, most: int) -> dict[str, Any]:
        """What it says to an order.

        Raises
        ------
        EOFError
            If it ends before it has said all, also because it has not after so many seconds; or claims to hand over more
            than so many bytes.
        """
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        timer = Timer(seconds, self._late)
        timer.daemon = True
        timer.start()
        try:
            if order is not None:
                self.process.stdin.write(json.dumps(order).encode() + b"\n")
                self.process.stdin.flush()
            return _received(self.process.stdout, most)
        except (OSError, ValueError) as error:
            raise EOFError from error
        finally:
            timer.cancel()

    def _late(self) -> None:
        self._was_late = True
        self.process.kill()

    def end(self) -> bool:
        """Kill it; say whether that had been done because it took too long."""
        self.process.kill()
        for pipe in (self.process.stdin, self.process.stdout):
            with suppress(OSError):
                assert pipe is not None
                pipe.close()
        self.process.wait()
        return self._was_late


def _not_started(why: str) -> RendulicError:
    return RendulicError(f"HDF5 files are read in a second process, and it could not be started: {why}")


def _sent(stream: IO[bytes], head: bytes, arrays: list[np.ndarray]) -> None:
    """Write an answer: a line of JSON, then the arrays in it."""
    stream.write(head + b"\n")
    for array in arrays:
        stream.write(np.ascontiguousarray(array).data.cast("B") if array.size else b"")
    stream.flush()


def _answer(what: str, value: Any) -> tuple[bytes, list[np.ndarray]]:
    arrays: list[np.ndarray] = []
    said = {what: _described(value, arrays)}
    return json.dumps({"said": said, "arrays": [[one.dtype.str, one.shape] for one in arrays]}).encode(), arrays


def _received(stream: IO[bytes], most: int) -> dict[str, Any]:
    """Read an answer; `ValueError` if it is none."""
    line = stream.readline()
    if not line.endswith(b"\n"):
        raise EOFError
    head, arrays = json.loads(line), []
    for kind, shape in head["arrays"]:
        dtype = np.dtype(kind)
        most -= prod(shape) * dtype.itemsize
        if most < 0:
            raise EOFError
        array = np.empty(shape, dtype)
        if array.size and stream.readinto(array.reshape(-1).view(np.uint8).data) != array.nbytes:  # type: ignore[attr-defined]
            raise EOFError
        arrays.append(array)
    return {what: _rebuilt(value, arrays) for what, value in head["said"].items()}


def _described(value: Any, arrays: list[np.ndarray]) -> Any:
    """A value as JSON holds it, in which arrays are named by their place in a list."""
    if isinstance(value, np.ndarray) and value.dtype.kind == "O":
        texts = [text.decode() if isinstance(text, bytes) else text for text in value.reshape(-1).tolist()]
        return {"texts": texts, "shape": value.shape}
    if isinstance(value, np.ndarray | np.generic):
        arrays.append(np.asarray(value))
        return {"array" if isinstance(value, np.ndarray) else "number": len(arrays) - 1}
    if isinstance(value, dict):
        return {"named": [[name, _described(own, arrays)] for name, own in value.items()]}
    return [_described(own, arrays) for own in value] if isinstance(value, list | tuple) else value


def _rebuilt(said: Any, arrays: list[np.ndarray]) -> Any:
    """What `_described` was told."""
    if isinstance(said, list):
        return [_rebuilt(own, arrays) for own in said]
    if not isinstance(said, dict):
        return said
    if "named" in said:
        return {name: _rebuilt(own, arrays) for name, own in said["named"]}
    if "texts" in said:
        return np.array([*said["texts"], None], dtype=object)[:-1].reshape(said["shape"])
    return arrays[said["array"]] if "array" in said else arrays[said["number"]][()]


def _serve(orders: IO[bytes], answers: IO[bytes]) -> None:
    """Answer orders until there are no more. A file stays open until it is said to be closed."""
    import h5py  # noqa: F401, so that memory is limited to what files take

    with ExitStack() as stack:
        file: PlainFile | None = None
        _sent(answers, *_answer("found", None))
        for line in orders:
            asked = json.loads(line)
            order = asked["order"]
            try:
                if order == ["close"]:
                    file = None
                    stack.close()
                    answer = _answer("found", None)
                else:
                    if file is None:
                        file = stack.enter_context(_limited(Path(asked["path"]), order[0] == "variables"))
                    answer = _answer("found", _asked(file, *order))
            except RendulicError as error:
                answer = _answer("refused", str(error))
            except MemoryError:
                answer = _answer("failed", "it asks for more memory than twice the file and 200 MB")
            # as for `rendulic.foundation.hdf5.readable`: the libraries have no list of what they raise
            except Exception as error:
                answer = _answer("failed", str(error) or type(error).__name__)
            _sent(answers, *answer)


@contextmanager
def _limited(path: Path, with_xarray: bool) -> Iterator[PlainFile]:
    """A file read with the memory that it may take."""
    if with_xarray:
        import xarray.backends  # noqa: F401
    _limit_memory(IN_MEMORY + 2 * path.stat().st_size)
    with opened(path) as file:
        yield file


def _asked(file: PlainFile, order: str, *places: str) -> Any:
    methods: dict[str, Any] = {
        "attributes": file.attributes,
        "array": file.array,
        "arrays": file.arrays,
        "variables": file.variables,
    }
    return methods[order](*places)


def _limit_memory(more: int) -> None:
    """Let the process take so many bytes more than it has, where the system can limit that."""
    with suppress(ImportError, OSError, ValueError):
        import resource

        pages = int(Path("/proc/self/statm").read_text().split()[0])
        _, hardest = resource.getrlimit(resource.RLIMIT_AS)
        limit = pages * resource.getpagesize() + more
        resource.setrlimit(resource.RLIMIT_AS, (limit if hardest < 0 else min(limit, hardest), hardest))


def main() -> None:
    """Serve the process at the other end of the pipes."""
    # what libraries print is no answer
    own = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    _serve(sys.stdin.buffer, own)


if __name__ == "__main__":
    main()
