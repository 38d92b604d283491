"""What is said on the terminal: whatever comes from files is shown, and never obeyed.

Control characters are escaped, and square brackets are no markup. A closed pipe (`rendulic info DIR | head`) ends the
output and not the work.
"""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from typing import IO, Any

import typer
from rich.console import Console
from rich.progress import Task, TextColumn
from rich.text import Text

__all__ = ["Words", "console", "say", "shown"]


def shown(text: str) -> str:
    """Text with control characters, and those that turn the order of letters around, as escapes; line ends and tabs stay.

    >>> shown("a\\x1b[31mb \\u202e Höhe [red]")
    'a\\\\x1b[31mb \\\\u202e Höhe [red]'
    """
    if text.isprintable():
        return text
    return "".join(one if one.isprintable() or one in "\n\t" else repr(one)[1:-1] for one in text)


def say(text: object = "", *, err: bool = False, **style: Any) -> None:
    """Say something on standard output, or on standard error; styles as of `typer.secho`."""
    try:
        typer.secho(shown(str(text)), err=err, **style)
    except BrokenPipeError:
        _say_no_more(sys.stderr if err else sys.stdout)


def console(stderr: bool = False) -> Console:
    """Where tables and bars go."""
    return _Console(stderr=stderr, markup=False, emoji=False, highlight=False)


class Words(TextColumn):
    """A column of text beside bars, without markup."""

    def __init__(self, text_format: str, style: str = "none") -> None:
        super().__init__(text_format, style=style, markup=False)

    def render(self, task: Task) -> Text:
        """The text of one bar."""
        return Text(shown(self.text_format.format(task=task)).replace("\n", " "), style=self.style)


class _Console(Console):
    def render_str(self, text: str, **options: Any) -> Text:
        return super().render_str(shown(text), **options)

    def print(self, *objects: Any, **options: Any) -> None:
        try:
            super().print(*objects, **options)
        except BrokenPipeError:
            self.on_broken_pipe()

    def on_broken_pipe(self) -> None:
        """The work goes on; rich would end the program."""
        self.quiet = True
        _say_no_more(self.file)


def _say_no_more(stream: IO[str]) -> None:
    """Let what is still written to a closed pipe go nowhere."""
    with suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)
