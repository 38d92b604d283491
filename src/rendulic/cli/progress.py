"""Progress on the terminal: one bar per stage, plain lines where there is no terminal."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Lock
from typing import TYPE_CHECKING

from rich.progress import (
    BarColumn,
    Progress,
    TaskProgressColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from rendulic.cli.terminal import Words, console
from rendulic.foundation.progress import Progress as Callback
from rendulic.foundation.progress import silent

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import TaskID

    from rendulic.study.execution.run import Watch
    from rendulic.study.store.unit import Unit

__all__ = ["campaign", "stages"]

SECONDS_BETWEEN_LINES = 15.0


@contextmanager
def stages(quiet: bool = False) -> Iterator[Callable[[str], Callback]]:
    """Yield a function that opens a named stage and returns its progress callback."""
    if quiet:
        yield lambda _name: silent
        return
    terminal = console(stderr=True)
    if not terminal.is_terminal:
        yield lambda name: _lines(terminal, name)
        return
    bars = Progress(
        Words("{task.description}"), BarColumn(bar_width=24), TaskProgressColumn(), TimeElapsedColumn(),
        TimeRemainingColumn(compact=True), Words("{task.fields[note]}", "dim"), console=terminal,
    )  # fmt: skip

    def open_stage(name: str) -> Callback:
        task = bars.add_task(name, total=None, note="", visible=False)

        def show(done: float, total: float, note: str = "") -> None:
            bars.update(task, completed=done, total=total, note=note, visible=True)

        return show

    with bars:
        yield open_stage


def _lines(terminal: Console, name: str) -> Callback:
    """Progress as a line now and then."""
    lock, start, last = Lock(), time.monotonic(), [0.0]

    def show(done: float, total: float, note: str = "") -> None:
        now = time.monotonic()
        with lock:
            if now - last[0] < SECONDS_BETWEEN_LINES and done < total:
                return
            last[0] = now
        share = done / total if total else 0.0
        left = f", {(now - start) * (1 - share) / share:.0f} s left" if 0.02 < share < 1 else ""
        terminal.print(
            f"{name}: {100 * share:.0f} % after {now - start:.0f} s{left}; {note}",
            highlight=False,
            soft_wrap=True,
        )

    return show


@contextmanager
def campaign(quiet: bool = False) -> Iterator[Watch | None]:
    """Yield what a run of units tells its progress to: overall and per running unit, or a line now and then."""
    if quiet:
        yield None
        return
    terminal = console(stderr=True)
    if not terminal.is_terminal:
        yield _CampaignLines(terminal)
        return
    columns = (
        Words("{task.description}"), BarColumn(bar_width=24), TaskProgressColumn(), TimeElapsedColumn(),
        TimeRemainingColumn(compact=True), Words("{task.fields[note]}", "dim"),
    )  # fmt: skip
    with Progress(*columns, console=terminal) as bars:
        yield _CampaignBars(bars)


class _Tally:
    """How far a run is."""

    def __init__(self) -> None:
        self.done = self.total = self.made = self.failed = 0
        self.since = time.monotonic()
        self.shares: dict[str, float] = {}

    def begin(self, done: int, total: int) -> None:
        self.done, self.total, self.since = done, total, time.monotonic()

    def started(self, unit: Unit) -> None:
        self.shares[unit.key] = 0.0

    def progress(self, unit: Unit, done: float, total: float, note: str) -> None:
        self.shares[unit.key] = done / total if total else 0.0

    def ended(self, unit: Unit, error: str | None) -> None:
        self.shares.pop(unit.key, None)
        self.done += error is None
        self.made += error is None
        self.failed += error is not None

    @property
    def rate(self) -> str:
        seconds = max(time.monotonic() - self.since, 1e-9)
        left = self.total - self.done - self.failed
        made = self.made + sum(self.shares.values())
        text = f"{60.0 * made / seconds:.3g} units a minute" if made else "no unit finished yet"
        text += f", about {seconds * left / made:.0f} s left" if made and left else ""
        return text + (f", {self.failed} failed" if self.failed else "")


class _CampaignBars(_Tally):
    """One bar for all units, one for each that runs."""

    def __init__(self, bars: Progress) -> None:
        super().__init__()
        self.bars = bars
        self.tasks: dict[str, TaskID] = {}
        self.overall = bars.add_task("units", total=None, note="")

    def begin(self, done: int, total: int) -> None:
        super().begin(done, total)
        self.bars.update(self.overall, completed=done, total=total)

    def started(self, unit: Unit) -> None:
        super().started(unit)
        self.tasks[unit.key] = self.bars.add_task(unit.label, total=None, note="")

    def progress(self, unit: Unit, done: float, total: float, note: str) -> None:
        super().progress(unit, done, total, note)
        if unit.key in self.tasks:
            self.bars.update(self.tasks[unit.key], completed=done, total=total, note=note)
        self._show()

    def ended(self, unit: Unit, error: str | None) -> None:
        super().ended(unit, error)
        if unit.key in self.tasks:
            self.bars.remove_task(self.tasks.pop(unit.key))
        if error is not None:
            self.bars.console.print(f"failed: {unit.label}: {error}", style="red", highlight=False)
        self._show()

    def _show(self) -> None:
        self.bars.update(self.overall, completed=self.done + sum(self.shares.values()), note=self.rate)


class _CampaignLines(_Tally):
    """A line now and then, and at the end."""

    def __init__(self, console: Console) -> None:
        super().__init__()
        self.console, self.last = console, 0.0

    def progress(self, unit: Unit, done: float, total: float, note: str) -> None:
        super().progress(unit, done, total, note)
        self._say(f"{unit.label}: {100 * self.shares[unit.key]:.0f} %, {note}")

    def ended(self, unit: Unit, error: str | None) -> None:
        super().ended(unit, error)
        self._say(unit.label if error is None else f"failed: {unit.label}: {error}", error is not None)

    def _say(self, what: str, at_once: bool = False) -> None:
        now = time.monotonic()
        if at_once or now - self.last >= SECONDS_BETWEEN_LINES or self.done + self.failed == self.total:
            self.last = now
            self.console.print(
                f"{self.done} of {self.total} units, {self.rate}; {what}", highlight=False, soft_wrap=True
            )
