"""The command line: `rendulic COMMAND`."""

from __future__ import annotations

import sys
import warnings

import typer

from rendulic import __version__
from rendulic.cli.analyze import analyze
from rendulic.cli.element import element
from rendulic.cli.export import export
from rendulic.cli.info import info
from rendulic.cli.init import init
from rendulic.cli.lab import lab
from rendulic.cli.limits import wanting
from rendulic.cli.probe import probe
from rendulic.cli.report import report
from rendulic.cli.reproduce import reproduce
from rendulic.cli.run import run as run_command
from rendulic.cli.terminal import say
from rendulic.cli.view import view
from rendulic.foundation.errors import ComingChange, RendulicError

app = typer.Typer(
    help="Second-order work of granular materials: do they fail, in which directions, through which grains?",
    epilog="Example: rendulic reproduce fig6 -o model",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["--help", "-h"]},
)
app.command()(reproduce)
app.command()(init)
app.command(name="run")(run_command)
app.command()(report)
app.command()(view)
app.command()(element)
app.command()(analyze)
app.command()(lab)
app.command()(export)
app.command()(info)
app.command()(probe)


def _version(show: bool) -> None:
    if show:
        say(f"rendulic {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: bool = typer.Option(False, "--version", help="Print the version.", callback=_version, is_eager=True),
) -> None:
    pass


def _say_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: object = None,
    line: object = None,
) -> None:
    """A warning for the user as text; others are for developers."""
    if issubclass(category, ComingChange):
        say(f"rendulic: {message}", fg="yellow", err=True)


def run() -> None:
    """Entry point: every error on purpose, or for want of what the system allows, is one line on standard error, code 2."""
    warnings.showwarning = _say_warning
    try:
        app()
    except RendulicError as error:
        say(f"rendulic: {error}", fg="red", err=True)
    except (OSError, MemoryError, ImportError, RuntimeError) as error:
        if not (want := wanting(error)):
            raise
        say(f"rendulic: {want}", fg="red", err=True)
    else:
        return
    sys.exit(2)
