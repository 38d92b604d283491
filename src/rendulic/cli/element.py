"""`rendulic element`: tests with the Chang-Hicher model."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rendulic.cli.init import write_new
from rendulic.cli.run import run_and_draw

__all__ = ["element"]


def element(
    study: Annotated[Path, typer.Argument(help="A TOML file with [[specimen]] and [[path]].")],
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for tables and figures.")] = Path("elements"),
    init: Annotated[bool, typer.Option("--init", help="Write a commented file to begin with, and stop.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress, only how it went.")] = False,
) -> None:
    """Run tests of a sand with the Chang-Hicher model: curves, planes and events as CSV and NetCDF, figures.

    The file is a study like any other: this command draws its tests, whatever else it asks for.

    Example: rendulic element tests.toml --init && rendulic element tests.toml -o elements
    """
    from rendulic.study.language.study_file import preset_text, read_study

    if init:
        write_new(study, preset_text("element_tests"))
        return
    run_and_draw(read_study(study), output, quiet=quiet, figures=["elements"])
