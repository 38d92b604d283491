"""Errors of rendulic. Each message says what was expected, what came and what to do."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from difflib import get_close_matches

__all__ = [
    "ComingChange",
    "CorruptFile",
    "DidNotConverge",
    "DoubtfulResult",
    "InvalidInput",
    "NotEquilibrated",
    "RendulicError",
    "UnstableTimeStep",
    "nearest",
    "one_of",
    "told_of",
]


class RendulicError(Exception):
    """Base of every error that rendulic raises on purpose."""


class InvalidInput(RendulicError, ValueError):
    """An argument, option or field is outside what the mechanics or the interface admits."""


class NotEquilibrated(RendulicError):
    """A state that must be at rest is not, after all the steps that were allowed."""


class DidNotConverge(RendulicError):
    """A target (pressure, porosity, stress ratio) was not reached."""


class UnstableTimeStep(RendulicError):
    """The time step exceeds what the stiffest grain admits, or the motion has diverged."""


class CorruptFile(RendulicError):
    """A file is truncated, altered, foreign, or of a schema this version does not read."""


class ComingChange(FutureWarning):
    """What works now, and will not in the next version; the warning says what to write instead."""


class DoubtfulResult(UserWarning):
    """A result that may not say what it seems to; the warning says why, and what to do."""


@contextmanager
def told_of(where: object) -> Iterator[None]:
    """Wrong input and corrupt files in here are told of a file: its path comes before the sentence.

    >>> with told_of("state.h5"):
    ...     raise CorruptFile("no grains")
    Traceback (most recent call last):
        ...
    rendulic.foundation.errors.CorruptFile: state.h5: no grains
    """
    try:
        yield
    except (InvalidInput, CorruptFile) as error:
        raise type(error)(f"{where}: {error}") from None


def nearest(name: str, options: Iterable[str]) -> str | None:
    """The option most like `name`, upper and lower case alike, or None if none is."""
    own = {option.lower(): option for option in options}
    near = get_close_matches(name.lower(), own, n=1)
    return own[near[0]] if near else None


def one_of(value: str, options: Iterable[str], name: str) -> str:
    """Return `value` if it is one of `options`, else raise with the nearest valid one.

    >>> one_of("harmonic", ["harmonic", "mean_diameter"], "stiffness rule")
    'harmonic'
    >>> one_of("harmonc", ["harmonic", "mean_diameter"], "stiffness rule")
    Traceback (most recent call last):
        ...
    rendulic.foundation.errors.InvalidInput: unknown stiffness rule 'harmonc': did you mean 'harmonic'? ...
    """
    options = list(options)
    if value in options:
        return value
    near = nearest(str(value), options)
    hint = f"did you mean '{near}'? " if near else ""
    raise InvalidInput(f"unknown {name} '{value}': {hint}valid ones are {', '.join(options)}")
