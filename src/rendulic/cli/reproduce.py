"""`rendulic reproduce`: the paper, figure by figure."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from rendulic.cli.progress import campaign, stages
from rendulic.cli.run import in_order, say_how_it_went, workers_of

if TYPE_CHECKING:
    import xarray as xr

    from rendulic.study.results import Results

__all__ = ["reproduce"]

FIRST = ("fig1", "fig2", "fig3", "fig4")
OTHERS = ("elements",)  # figures of studies that the paper's have not


def reproduce(
    figures: Annotated[
        list[str] | None,
        typer.Argument(
            help="fig1 fig2 fig3 fig4 (grains), fig6 fig7 fig9 fig10 fig3_model (Chang-Hicher model), all of these if "
            "none is named; cones map bursts anatomy (failure itself, several packings: take their time)."
        ),
    ] = None,
    preset: Annotated[str, typer.Option(help="quick (1 000 grains) or paper (10 000 grains).")] = "quick",
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for states, data and figures.")] = Path(
        "results"
    ),
    seed: Annotated[int | None, typer.Option(help="Another packing of the same recipe.")] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Processes; one per core if not given. Results do not depend on it.")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress, only the table.")] = False,
) -> None:
    """Reproduce the paper's figures, with grains and with the Chang-Hicher model, and show failure itself.

    The studies behind it are files, see rendulic init --preset. What the folder holds already is found again, so an
    interrupted run goes on where it stopped.

    Example: rendulic reproduce fig6 fig7 fig9 fig10 -o model
    """
    from rendulic.foundation.errors import one_of
    from rendulic.study import reproduce_model as model
    from rendulic.study.execution.campaign import run_study
    from rendulic.study.language.config import FIGURES
    from rendulic.study.language.study_file import preset as load_preset
    from rendulic.study.language.study_file import with_seed

    of_study = [name for name in FIGURES if name not in OTHERS]
    wanted = [one_of(name, (*of_study, *model.FIGURES), "figure") for name in figures or (*FIRST, *model.FIGURES)]
    study = load_preset(preset)
    if seed is not None:
        study = with_seed(study, seed)
    of_model = [name for name in wanted if name in model.FIGURES]
    of_grains = [name for name in wanted if name in of_study]
    # the quicker part first
    if of_model:
        with stages(quiet) as stage:
            _list(model.reproduce_model(output, of_model, stage=stage))
    if of_grains:
        with in_order(), campaign(quiet) as watch:
            report = run_study(study, output, figures=of_grains, executor=workers_of(None, workers), watch=watch)
        if set(report.figures) & set(FIRST):
            _show_states(report.results, bool({"fig3", "fig4"} & set(report.figures)))
        say_how_it_went(report, output)


def _list(files: dict[str, list[Path]]) -> None:
    for name, paths in files.items():
        typer.echo(f"{name}: {', '.join(str(path) for path in paths)}")


def _show_states(results: Results, with_probes: bool) -> None:
    """Tables of the states that Figs. 1 to 4 show."""
    from rendulic.study.draw import state_table

    first = results.study.packing[0]
    places = [place for place in results.plan.states if place.packing == first.name]
    around = results.study.around
    probes = [results.probes(around, place) for place in places] if with_probes and around else None
    table = state_table(results, places, probes)
    Console().print(_summary(table))
    if probes:
        Console().print(_amplitudes(table))


def _summary(table: xr.Dataset) -> Table:
    """The states: what they are and how they came to rest."""
    shown = Table(
        title="Probed states",
        box=SIMPLE_HEAD,
        pad_edge=False,
        caption="unbal.: unbalanced force; crept: axial strain while coming to rest at constant stress",
    )
    for heading in (
        "eta",
        "q [kPa]",
        "p [kPa]",
        "eps_1 [%]",
        "eps_v [%]",
        "porosity",
        "contacts",
        "unbalanced",
        "crept",
    ):
        shown.add_column(heading, justify="right")
    for k in range(table.sizes["state"]):
        row = {name: float(table[name][k]) for name in table.data_vars if table[name].dims == ("state",)}
        shown.add_row(
            f"{row['eta']:.3f}", f"{row['q'] / 1e3:.1f}", f"{row['p'] / 1e3:.1f}", f"{100 * row['eps_1']:.3f}",
            f"{100 * row['eps_v']:.3f}", f"{row['porosity']:.4f}", f"{row['n_contacts']:.0f}",
            f"{row['unbalanced_force']:.1e}", f"{row['crept']:.0e}",
        )  # fmt: skip
    return shown


def _amplitudes(table: xr.Dataset) -> Table:
    """Smallest W2n of every state and norm, its direction, and the identity residual."""
    shown = Table(
        box=SIMPLE_HEAD,
        pad_edge=False,
        title="Smallest normalised second-order work (direction in degrees)",
        caption="(?): not larger than the drift of the null probe. Largest identity residual "
        f"{float(table.largest_identity_residual.max()):.0e}",
    )
    shown.add_column("eta", justify="right")
    for norm in table.norm.values:
        shown.add_column(f"norm {norm:g}", justify="right")
    for k in range(table.sizes["state"]):
        cells = []
        for norm in table.norm.values:
            row = table.isel(state=k).sel(norm=norm)
            doubt = "" if bool(row.smallest_w2n_is_significant) else " (?)"
            text = f"{float(row.smallest_w2n):+.3f} ({float(row.smallest_w2n_alpha):.0f}){doubt}"
            cells.append(f"[red]{text}[/red]" if float(row.smallest_w2n) < 0 and not doubt else text)
        shown.add_row(f"{float(table.eta[k]):.3f}", *cells)
    return shown
