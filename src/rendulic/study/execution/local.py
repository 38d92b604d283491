"""Workers on this machine: processes of their own, orders and answers as lines of JSON, no server."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import IO, Any

from rendulic.foundation.cores import workers_or_cores
from rendulic.foundation.errors import RendulicError
from rendulic.study.execution.executor import Event
from rendulic.study.store.store import Store

__all__ = ["LocalWorkers"]

# one thread for each, and a word on a crash
ENVIRONMENT = {
    name: "1" for name in ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "PYTHONFAULTHANDLER")
}
PATIENCE = 3.0  # seconds for a worker to end before it is killed


class LocalWorkers:
    """Processes that carry out units; one that dies is replaced.

    Parameters
    ----------
    folder : path
        Of the study.
    count : int, optional
        By default one for each core.
    """

    def __init__(self, folder: str | os.PathLike, count: int | None = None) -> None:
        self.folder = str(Path(folder).absolute())
        self.capacity = workers_or_cores(count)
        self.ahead = 0
        self._idle: list[_Worker] = []
        self._busy: dict[str, _Worker] = {}
        self._events: SimpleQueue[tuple[_Worker, Event]] = SimpleQueue()

    def submit(self, order: Mapping[str, Any], threads: int) -> None:
        """Hand a unit to an idle worker, or to a new one."""
        while self._idle and self._idle[-1].process.poll() is not None:
            self._idle.pop()
        worker = self._idle.pop() if self._idle else _Worker(self.folder, self._events)
        self._busy[order["key"]] = worker
        worker.give(order, threads)

    def events(self, seconds: float) -> list[Event]:
        """What happened, after so many seconds at most; `lost` is a unit whose worker died."""
        happened = []
        try:
            found = self._events.get(timeout=seconds)
            while True:
                happened += self._taken(*found)
                found = self._events.get_nowait()
        except Empty:
            return happened

    def _taken(self, worker: _Worker, event: Event) -> list[Event]:
        if self._busy.get(event.key) is not worker:
            return []
        if event.what != "progress":
            del self._busy[event.key]
            if event.what == "lost":
                worker.end()
            else:
                self._idle.append(worker)
        return [event]

    def close(self) -> None:
        """End all workers, whatever they are doing, and remove what one of them had half-written."""
        every = [*self._idle, *self._busy.values()]
        self._idle, self._busy = [], {}
        for worker in every:
            worker.process.terminate()
        for worker in every:
            worker.end()
        # a folder that cannot be read is told where its units are listed
        with suppress(OSError, RendulicError):
            Store(self.folder).sweep()


def _complaints(folder: Path) -> IO[bytes]:
    """Where workers write what is no answer, such as why they crashed; nowhere, if that cannot be written."""
    try:
        (folder / "logs").mkdir(parents=True, exist_ok=True)
        return (folder / "logs" / "workers.log").open("ab")
    except OSError:
        return Path(os.devnull).open("ab")


class _Worker:
    """One process, and the thread that listens to it."""

    def __init__(self, folder: str, events: SimpleQueue) -> None:
        # a session of its own: Ctrl-C in the terminal reaches the process that can stop all of it in order
        with _complaints(Path(folder)) as complaints:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "rendulic.study.execution.worker", folder], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                stderr=complaints, text=True, encoding="utf-8", start_new_session=True, env=os.environ | ENVIRONMENT,
            )  # fmt: skip
        self.key, self.events = "", events
        threading.Thread(target=self._listen, daemon=True).start()

    def give(self, order: Mapping[str, Any], threads: int) -> None:
        assert self.process.stdin is not None
        self.key = order["key"]
        # a worker that is dead already is noticed where it is listened to
        with suppress(OSError):
            self.process.stdin.write(json.dumps({"order": order, "threads": threads}) + "\n")
            self.process.stdin.flush()

    def _listen(self) -> None:
        assert self.process.stdout is not None
        with suppress(ValueError):  # the last line of a killed process may be half a line
            for line in self.process.stdout:
                ((what, about),) = json.loads(line).items()
                self.events.put((self, Event(what, self.key, about)))
        self.events.put((self, Event("lost", self.key)))

    def end(self) -> None:
        """Wait for it to end, and kill it if it does not."""
        with suppress(OSError):
            assert self.process.stdin is not None
            self.process.stdin.close()
        try:
            self.process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
