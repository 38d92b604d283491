"""`rendulic reproduce`: the paper, figure by figure."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rendulic.cli.run import run_and_draw

__all__ = ["reproduce"]

# the paper's figures, and what its packings say together, as far as a preset draws them; it can draw more
FIRST = ("fig1", "fig2", "fig3", "fig4", "fig6", "fig7", "fig9", "fig10", "fig3_model", "ensemble")


def reproduce(
    figures: Annotated[
        list[str] | None,
        typer.Argument(
            help="fig1 fig2 fig3 fig4 (grains), fig6 fig7 fig9 fig10 fig3_model (Chang-Hicher model), all of these if "
            "none is named; cones map bursts anatomy (failure itself, of several packings: a quarter of an hour)."
        ),
    ] = None,
    preset: Annotated[str, typer.Option(help="quick (16 packings of 300 grains) or paper (10 000 grains).")] = "quick",
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for states, data and figures.")] = Path(
        "results"
    ),
    seed: Annotated[
        int | None, typer.Option(help="Seed of the first packing; those of the others move with it.")
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Processes; one per core if not given. Results do not depend on it.")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress, only how it went.")] = False,
) -> None:
    """Reproduce the paper's figures, with grains and with the Chang-Hicher model, and show failure itself.

    It runs a study that is a file, see rendulic init --preset. Finished work in the folder is not done again, so an
    interrupted run goes on where it stopped.

    Example: rendulic reproduce fig6 fig7 fig9 fig10 -o model
    """
    from rendulic.study.language.study_file import preset as load_preset
    from rendulic.study.language.study_file import with_seed

    study = load_preset(preset)
    if seed is not None:
        study = with_seed(study, seed)
    first = [name for name in study.figures.draw if name in FIRST]
    run_and_draw(study, output, workers=workers, quiet=quiet, figures=list(dict.fromkeys(figures or first)))
