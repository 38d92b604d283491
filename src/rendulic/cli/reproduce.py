"""`rendulic reproduce`: the paper, figure by figure."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from rendulic.cli.progress import stages

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["reproduce"]


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
        int | None, typer.Option(min=1, help="Threads; one per core if not given. Results do not depend on it.")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress, only the table.")] = False,
) -> None:
    """Reproduce the paper's figures, with grains and with the Chang-Hicher model, and show failure itself.

    Finished stages in the folder are found again, so an interrupted run goes on where it stopped.

    Example: rendulic reproduce fig6 fig7 fig9 fig10 -o model
    """
    from rendulic.dem import use_threads
    from rendulic.errors import one_of
    from rendulic.study import reproduce as grains
    from rendulic.study import reproduce_failure as failure
    from rendulic.study import reproduce_model as model
    from rendulic.study.config import preset as load_preset

    wanted = [one_of(name, (*grains.FIGURES, *model.FIGURES, *failure.FIGURES), "figure") for name in figures or ()]
    of_grains = [name for name in wanted if name in grains.FIGURES] or ([] if wanted else list(grains.FIGURES))
    of_model = [name for name in wanted if name in model.FIGURES] or ([] if wanted else list(model.FIGURES))
    of_failure = [name for name in wanted if name in failure.FIGURES]
    changes = {} if seed is None else {"specimen": {"seed": seed}}
    study = load_preset(preset, **changes)
    use_threads(workers)
    console = Console()
    files: dict[str, list[Path]] = {}
    with stages(quiet) as stage:
        # the quicker part first
        if of_model:
            files |= model.reproduce_model(output, of_model, stage=stage)
        if of_grains:
            result = grains.reproduce(study, output, of_grains, workers=workers, stage=stage)
            files = result.figures | files
        if of_failure:
            files |= failure.reproduce_failure(study, output, of_failure, workers=workers, stage=stage)
    if of_grains:
        console.print(_summary(result.table))
        if "smallest_w2n" in result.table:
            console.print(_amplitudes(result.table))
    for name, paths in files.items():
        console.print(f"{name}: {', '.join(str(path) for path in paths)}", highlight=False, soft_wrap=True)


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
