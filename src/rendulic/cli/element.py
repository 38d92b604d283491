"""`rendulic element`: the tests of a study along paths."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rendulic.cli.init import write_new
from rendulic.cli.run import run_and_draw

__all__ = ["element"]


def element(
    study: Annotated[Path, typer.Argument(help="A TOML file of a study with tests; see --init.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for tables and figures.")] = Path("elements"),
    init: Annotated[bool, typer.Option("--init", help="Write a commented file to begin with, and stop.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress, only how it went.")] = False,
) -> None:
    """Run the tests of a study along paths: curves, planes and events as CSV and NetCDF, one figure of all tests.

    The file is a study like any other, with [[specimen]] and [[path]]; only its tests are run and drawn. --init writes tests of a
    sand with the Chang-Hicher model.

    Example: rendulic element tests.toml --init && rendulic element tests.toml -o elements
    """
    from rendulic.study.language.study_file import preset_text, read_study

    if init:
        write_new(study, preset_text("element_tests"))
        return
    run_and_draw(read_study(study), output, quiet=quiet, figures=["elements"])
