"""`rendulic run`: a study from its file."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rendulic.cli.progress import campaign

if TYPE_CHECKING:
    from rendulic.study.execution.campaign import Report

__all__ = ["in_order", "run", "say_how_it_went", "workers_of"]

# exit codes: some units failed and all others are done; stopped by the user
FAILED, STOPPED = 3, 130


def run(
    study: Annotated[Path, typer.Argument(help="A TOML file; see rendulic init.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Folder of the study; named as the file if not given.")
    ] = None,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes; one per core if not given.")] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(help="Address or scheduler file of a Dask scheduler whose workers see the folder, too."),
    ] = None,
    retry: Annotated[bool, typer.Option("--retry", help="Try again what the mechanics refused before.")] = False,
    repair: Annotated[
        bool, typer.Option("--repair", help="Check all that is there, make damaged results again.")
    ] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress, only how it went.")] = False,
) -> None:
    """Do what a study asks for: packings, states, probes, cones, bursts, element tests, figures.

    What the folder holds already is not done again, so an interrupted run goes on where it stopped. Exit code 3: something
    failed, the rest is done.

    Example: rendulic run study.toml -o results
    """
    from rendulic.study.execution.campaign import run_study
    from rendulic.study.language.study_file import read_study

    read = read_study(study)
    folder = output or Path(study.stem)
    with in_order(), campaign(quiet) as watch:
        report = run_study(
            read, folder, executor=workers_of(scheduler, workers), retry=retry, repair=repair, watch=watch
        )
    say_how_it_went(report, folder)


@contextmanager
def in_order() -> Iterator[None]:
    """Let Ctrl-C, or a request to end, stop the run with one sentence and code 130."""

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    except KeyboardInterrupt:
        typer.secho(
            "rendulic: stopped; all that was finished is kept, the same command goes on from there", fg="red", err=True
        )
        raise typer.Exit(STOPPED) from None
    finally:
        signal.signal(signal.SIGTERM, before)


def workers_of(scheduler: str | None, workers: int | None):
    """What gives the workers for a folder."""
    if scheduler is None:
        from rendulic.study.execution.local import LocalWorkers

        return lambda folder: LocalWorkers(folder, workers)
    from rendulic.study.execution.cluster import ClusterWorkers

    return lambda folder: ClusterWorkers(folder, scheduler)


def say_how_it_went(report: Report, folder: Path) -> None:
    """Counts, figures, failures; ends the program with code 3 if there are any of these."""
    outcome = report.outcome
    for damage in report.repaired.values():
        typer.echo(f"made again: {damage}")
    total = len(outcome.done) + len(outcome.failed) + len(outcome.blocked)
    typer.echo(f"{len(outcome.done)} of {total} units are done, {outcome.made} of them now, in {folder}")
    for name, paths in report.figures.items():
        typer.echo(f"{name}: {', '.join(str(path) for path in paths)}")
    if not outcome.failed:
        return
    for unit, error in outcome.failed.items():
        typer.secho(f"failed: {unit.label}: {error}", fg="red", err=True)
    if outcome.blocked:
        typer.secho(f"{len(outcome.blocked)} units wait for these", fg="red", err=True)
    if report.not_drawn:
        typer.secho(f"not drawn for lack of them: {', '.join(report.not_drawn)}", fg="red", err=True)
    raise typer.Exit(FAILED)
