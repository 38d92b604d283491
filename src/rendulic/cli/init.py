"""`rendulic init`: a commented study to begin with."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rendulic.cli.terminal import say

__all__ = ["init", "write_new"]


def init(
    file: Annotated[Path, typer.Argument(help="The file to write.")] = Path("study.toml"),
    preset: Annotated[str | None, typer.Option(help="quick, paper or element_tests: write this study instead.")] = None,
) -> None:
    """Write a study with every entry, its default and its meaning.

    Example: rendulic init study.toml && rendulic run study.toml -o results
    """
    from rendulic.study.language.study_file import preset_text, template

    write_new(file, f"{template()}{_figures()}" if preset is None else preset_text(preset))


def _figures() -> str:
    """The names of all figures, as comments."""
    from rendulic.views.catalogue import catalogue

    lines = [
        f"#   {name:<14} {figure.shows}; needs {figure.lacks}"
        for name, figure in catalogue().items()
        if not figure.in_report_only
    ]
    return "\n".join(["# names of figures:", *lines, ""])


def write_new(file: Path, text: str) -> None:
    """Write a file that is not there yet, and say so."""
    from rendulic.foundation.errors import InvalidInput

    if file.exists():
        raise InvalidInput(f"{file} exists already: choose another name for the new file")
    if not file.parent.is_dir():
        raise InvalidInput(f"there is no folder {file.parent} to write {file.name} to: make it first")
    try:
        file.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InvalidInput(f"cannot write {file}: {error.strerror or error}") from None
    say(f"written: {file}")
