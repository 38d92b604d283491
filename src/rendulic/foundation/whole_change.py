"""Changes of an object that neither Ctrl-C nor another thread breaks in the middle."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from types import FrameType
from typing import Any, ParamSpec, TypeVar

from rendulic.foundation.errors import InvalidInput

__all__ = ["heed_interrupts", "is_interrupted", "whole_change"]

P = ParamSpec("P")
R = TypeVar("R")

_changed_by: dict[int, int] = {}  # objects being changed, by their identity, and the threads that change them


def whole_change(function: Callable[P, R]) -> Callable[P, R]:
    """Decorate a function that changes its first argument in place.

    1. Ctrl-C waits until the change is whole: at the end of the outermost decorated function, or where the function calls
       `heed_interrupts` because the object is whole there. Pressed again before that, it acts at once, wherever it is.
       Other handlers of the signal wait in the same way.
    2. While one thread changes an object, another one that tries to is refused.

    Raises
    ------
    InvalidInput
        In the second thread.

    >>> @whole_change
    ... def grow(radii, factor):
    ...     radii[:] = [factor * radius for radius in radii]
    >>> radii = [1.0, 2.0]
    >>> grow(radii, 2.0); radii
    [2.0, 4.0]
    """

    @wraps(function)
    def whole(*args: P.args, **kwargs: P.kwargs) -> R:
        changed = args[0]
        with _interrupts.kept(), _alone_with(changed):
            return function(*args, **kwargs)

    return whole


def is_interrupted() -> bool:
    """Whether Ctrl-C waits to be heeded by this thread."""
    return _interrupts.came and threading.current_thread() is threading.main_thread()


def heed_interrupts() -> None:
    """Let Ctrl-C act if it came meanwhile; to be called where what is changed is whole."""
    if is_interrupted():
        _interrupts.act()


@contextmanager
def _alone_with(thing: object) -> Iterator[None]:
    own = threading.get_ident()
    owner = _changed_by.get(id(thing))
    if owner == own:
        yield
        return
    if _changed_by.setdefault(id(thing), own) != own:
        raise InvalidInput(
            "another thread is changing this specimen at the moment: give each thread a copy of its own, from clone()"
        )
    try:
        yield
    finally:
        del _changed_by[id(thing)]


class _Interrupts:
    """The signal of Ctrl-C, kept until it may act. Only the main thread gets it."""

    def __init__(self) -> None:
        self.came = False
        self.depth = 0
        self.handler: Callable[[int, FrameType | None], Any] | None = None

    @contextmanager
    def kept(self) -> Iterator[None]:
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        handler = signal.getsignal(signal.SIGINT)
        # nothing to keep where the signal ends the process or is ignored
        if self.depth == 0 and callable(handler):
            self.handler = handler
            signal.signal(signal.SIGINT, self._note)
        self.depth += 1
        try:
            yield
        finally:
            self.depth -= 1
            if self.depth == 0 and self.handler is not None:
                own = self.handler
                # unless what was called has put another one in its place
                if signal.getsignal(signal.SIGINT) == self._note:
                    signal.signal(signal.SIGINT, own)
                if self.came:
                    self.act()

    def act(self) -> None:
        self.came, handler = False, self.handler
        if handler is not None:
            handler(signal.SIGINT, None)

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self.came:
            self.act()
        self.came = True


_interrupts = _Interrupts()
