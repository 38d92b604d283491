"""Carrying out the units of a plan: what is finished is found, what is ready runs, what fails does not stop the rest."""

from __future__ import annotations

import heapq
import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from rendulic.foundation.errors import RendulicError
from rendulic.study.execution.executor import Event, Executor
from rendulic.study.store.store import Store
from rendulic.study.store.unit import Unit

__all__ = ["Outcome", "Unwatched", "Watch", "run_units"]

DEATHS = 5  # of workers at one unit, after which it is not handed out again in this run
SECONDS_PER_LOOK, SECONDS_PER_NOTE = 0.5, 2.0
PATIENCE, SECONDS_PER_TRY = 5.0, 0.1  # seconds for a network file system to show a result


class Watch(Protocol):
    """What is told while units run."""

    def begin(self, done: int, total: int) -> None: ...

    def started(self, unit: Unit) -> None: ...

    def progress(self, unit: Unit, done: float, total: float, note: str) -> None: ...

    def ended(self, unit: Unit, error: str | None) -> None: ...


class Unwatched:
    """Nobody looks."""

    def begin(self, done: int, total: int) -> None:
        """Say nothing."""

    def started(self, unit: Unit) -> None:
        """Say nothing."""

    def progress(self, unit: Unit, done: float, total: float, note: str) -> None:
        """Say nothing."""

    def ended(self, unit: Unit, error: str | None) -> None:
        """Say nothing."""


@dataclass
class Outcome:
    """What became of the units of a plan.

    Parameters
    ----------
    done : set of str
        Hashes of all finished units, those found included.
    made : int
        How many were made now.
    failed : dict of Unit to str
        Why units failed, now or before.
    blocked : list of Unit
        Units that wait for a failed one.
    """

    done: set[str] = field(default_factory=set)
    made: int = 0
    failed: dict[Unit, str] = field(default_factory=dict)
    blocked: list[Unit] = field(default_factory=list)


class _Run:
    """One run: who waits for whom."""

    def __init__(self, units: Mapping[str, Unit], store: Store, executor: Executor, watch: Watch) -> None:
        self.units, self.store, self.executor, self.watch = units, store, executor, watch
        self.outcome = Outcome(done=store.keys() & set(units))
        self.missing: dict[str, int] = {}
        self.wanted_by: dict[str, list[Unit]] = {}
        self.ready: list[tuple[int, int, Unit]] = []
        self.running: dict[str, Unit] = {}
        self.deaths: Counter[str] = Counter()
        self.places = {key: k for k, key in enumerate(units)}
        self.shares: dict[str, list[Any]] = {}
        self.noted = float("-inf")

    def go(self, retry: bool) -> Outcome:
        notes = {key: note for key, note in self.store.failures().items() if key in self.units}
        final = set() if retry else {key for key, note in notes.items() if note["is_final"]}
        for key, unit in self.units.items():
            if key in self.outcome.done:
                continue
            if key in final:
                self.outcome.failed[unit] = notes[key]["error"]
                continue
            waits = [need.key for need in unit.needs.values() if need.key not in self.outcome.done]
            self.missing[key] = len(waits)
            for need in waits:
                self.wanted_by.setdefault(need, []).append(unit)
            if not waits:
                self._make_ready(unit)
        self.watch.begin(len(self.outcome.done), len(self.units))
        while self.ready or self.running:
            self._hand_out()
            for event in self.executor.events(SECONDS_PER_LOOK):
                self._take(event)
            self._note_running()
        left = set(self.missing) - self.outcome.done - {unit.key for unit in self.outcome.failed}
        self.outcome.blocked = [self.units[key] for key in self.units if key in left]
        return self.outcome

    def _make_ready(self, unit: Unit) -> None:
        # those that others wait for come first
        heapq.heappush(self.ready, (unit.key not in self.wanted_by, self.places[unit.key], unit))

    def _hand_out(self) -> None:
        room = self.executor.capacity + self.executor.ahead
        while self.ready and len(self.running) < room:
            beside = min(len(self.ready) + len(self.running), self.executor.capacity)
            unit = heapq.heappop(self.ready)[-1]
            self.running[unit.key] = unit
            self.executor.submit(unit.order(), max(1, self.executor.capacity // max(beside, 1)))
            self.watch.started(unit)

    def _take(self, event: Event) -> None:
        unit = self.running.get(event.key)
        if unit is None:
            return
        if event.what == "progress":
            self.shares[unit.key] = event.about
            self.watch.progress(unit, *event.about)
            return
        del self.running[unit.key]
        self.shares.pop(unit.key, None)
        if event.what == "done":
            self._finish(unit)
        elif event.what == "failed":
            self._fail(unit, **event.about)
        elif event.what == "stopped":
            raise RendulicError(f"stopped at {unit.label}: {event.about}")
        else:
            self.deaths[unit.key] += 1
            if self.deaths[unit.key] < DEATHS:
                self._make_ready(unit)
            else:
                self._fail(unit, f"its worker died {DEATHS} times; perhaps for lack of memory", False)

    def _finish(self, unit: Unit) -> None:
        """A unit is done when its file is in the store as this process sees it, whatever a worker says."""
        until = time.monotonic() + PATIENCE
        while not self.store.is_kept(unit.key):
            if time.monotonic() > until:
                raise RendulicError(
                    f"a worker says that {unit.label} is done, but there is no whole file {self.store.file(unit.key)}: the workers "
                    f"must see the folder {self.store.folder} of this process, under the same name"
                )
            time.sleep(SECONDS_PER_TRY)
        self.outcome.done.add(unit.key)
        self.outcome.made += 1
        self.store.forget_failure(unit.key)
        self.watch.ended(unit, None)
        for waiting in self.wanted_by.get(unit.key, ()):
            self.missing[waiting.key] -= 1
            if self.missing[waiting.key] == 0:
                self._make_ready(waiting)

    def _fail(self, unit: Unit, error: str, is_final: bool) -> None:
        self.outcome.failed[unit] = error
        self.store.note_failure(unit.key, unit.label, error, is_final)
        self.watch.ended(unit, error)

    def _note_running(self) -> None:
        """For those who look from outside."""
        now = time.monotonic()
        if now - self.noted >= SECONDS_PER_NOTE:
            self.noted = now
            self.store.write_json("running.json", {key: self.shares.get(key) for key in self.running})


def run_units(
    units: Mapping[str, Unit], store: Store, executor: Executor, *, retry: bool = False, watch: Watch | None = None
) -> Outcome:
    """Carry out all units that are not finished, each after those it needs.

    Parameters
    ----------
    units : dict of hash to Unit
        Each after those that it needs, as in a `Plan`.
    store : Store
        Claimed by this process.
    executor : Executor
        Closed at the end, however it ends.
    retry : bool
        Whether units that failed before, as the mechanics would have it, are tried again; others always are.
    watch : Watch, optional
        What is told on the way.

    Raises
    ------
    RendulicError
        If results cannot be kept, because the disk is full for example, or workers are of another version. Nothing
        that was finished is lost.
    """
    try:
        store.sweep()
        return _Run(units, store, executor, watch or Unwatched()).go(retry)
    finally:
        executor.close()
