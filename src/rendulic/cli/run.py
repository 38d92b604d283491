"""`rendulic run`: a study from its file."""

from __future__ import annotations

import signal
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rendulic.cli.progress import campaign
from rendulic.cli.terminal import say
from rendulic.views.view import verdicts

if TYPE_CHECKING:
    from rendulic.figures.of_study import Drawn
    from rendulic.study.execution.campaign import StudyRun
    from rendulic.study.language.study import Study

__all__ = ["in_order", "run", "run_and_draw", "say_how_it_went", "workers_of"]

# exit codes: some units failed and all others are done; finished ones are damaged; stopped by the user
FAILED, DAMAGED, STOPPED = 3, 4, 130


def run(
    study: Annotated[Path, typer.Argument(help="A TOML file; see rendulic init.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Folder of the study; named as the file if not given.")
    ] = None,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes; one per core if not given.")] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(help="Address or scheduler file of a Dask scheduler; its workers must see the folder, too."),
    ] = None,
    retry: Annotated[
        bool, typer.Option("--retry", help="Try failed work again, also where the mechanics failed.")
    ] = False,
    repair: Annotated[
        bool, typer.Option("--repair", help="Check all finished results, make damaged ones again.")
    ] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress, only how it went.")] = False,
) -> None:
    """Do what a study asks for: specimens, states, probes, cones, bursts, paths, figures.

    Finished work in the folder is not done again, so an interrupted run goes on where it stopped. Exit code 3: something
    failed, the rest is done; 4: finished results are damaged, --repair makes them again.

    Example: rendulic run study.toml -o results
    """
    from rendulic.study.language.study_file import read_study

    run_and_draw(
        read_study(study),
        output or Path(study.stem),
        scheduler,
        workers,
        quiet,
        retry=retry,
        repair=repair,
        what=str(study),
    )


def run_and_draw(
    study: Study,
    folder: Path,
    scheduler: str | None = None,
    workers: int | None = None,
    quiet: bool = False,
    figures: list[str] | None = None,
    retry: bool = False,
    repair: bool = False,
    what: str = "",
) -> None:
    """Do all of a study, or what some figures need; draw, and say how it went. Codes as of `say_how_it_went`."""
    from rendulic.figures.of_study import draw_study
    from rendulic.foundation.errors import InvalidInput
    from rendulic.study.execution.campaign import run_study
    from rendulic.study.plan import plan_of
    from rendulic.views.catalogue import check_figures, units_for

    names = list(study.figures.draw) if figures is None else figures
    try:
        check_figures(plan_of(study), names)
    except InvalidInput as error:
        raise InvalidInput(f"{what}: {error}" if what else str(error)) from None
    only = None if figures is None else lambda plan: units_for(plan, names)
    with in_order(), campaign(quiet) as watch:
        done = run_study(
            study, folder, only=only, executor=workers_of(scheduler, workers), retry=retry, repair=repair, watch=watch
        )
        drawn = draw_study(done.results, names)
    say_how_it_went(done, drawn)


@contextmanager
def in_order() -> Iterator[None]:
    """Let Ctrl-C, or a request to end, stop the run with one sentence and code 130."""

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    except KeyboardInterrupt:
        say("rendulic: stopped; all that was finished is kept, the same command goes on from there", fg="red", err=True)
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


def say_how_it_went(run: StudyRun, drawn: Mapping[str, list[Drawn]]) -> None:
    """Answers, counts, figures, failures; ends the program with code 3 if there are any of these, 4 for damage."""
    outcome, folder = run.outcome, run.results.store.folder
    for damage in run.repaired.values():
        say(f"made again: {str(damage).partition('; run again')[0]}")
    for name, views in drawn.items():
        for verdict in verdicts((one.view.title, one.view) for one in views):
            say(f"{name}: {verdict}")
    total = len(outcome.done) + len(outcome.failed) + len(outcome.blocked)
    say(f"{len(outcome.done - set(run.damaged))} of {total} units are done, {outcome.made} of them now, in {folder}")
    for name, views in drawn.items():
        files = [str(file) for one in views for file in one.files]
        say(f"{name}: {', '.join(files) or 'not drawn, as nothing that it shows is finished'}")
    say(f"all of it on one page: rendulic report {folder}")
    for damage in run.damaged.values():
        say(f"damaged: {damage}", fg="red", err=True)
    for unit, error in outcome.failed.items():
        say(f"failed: {unit.label}: {error}", fg="red", err=True)
    if outcome.blocked:
        say(f"{len(outcome.blocked)} units wait for these", fg="red", err=True)
    if run.damaged or outcome.failed:
        raise typer.Exit(DAMAGED if run.damaged else FAILED)
