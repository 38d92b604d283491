"""`rendulic analyze`: second-order work between snapshots of any engine."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.box import SIMPLE_HEAD
from rich.table import Table

from rendulic.cli.terminal import console, say

if TYPE_CHECKING:
    from rendulic.probing.audits import Audits
    from rendulic.specimen.snapshot import Snapshot

__all__ = ["analyze"]

MANIFEST = "probes.csv"
MOST_TOLD = 3  # probes whose audits fail, in words
AXES = {"1": 0, "2": 1, "3": 2, "x": 0, "y": 1, "z": 2}


def analyze(
    before: Annotated[
        Path, typer.Argument(help="The state before: .h5, Yade's .npz, LAMMPS's .dump, or a folder of plain text.")
    ],
    after: Annotated[Path, typer.Argument(help=f"The state after, or a folder with many and {MANIFEST}.")],
    report: Annotated[
        Path | None, typer.Option("--report", "-o", help="Folder for JSON, tables and figures; none if not given.")
    ] = None,
    friction: Annotated[
        float | None,
        typer.Option(min=0.0, help="Coulomb coefficient, if the files do not say it: shows which contacts slide."),
    ] = None,
    axial: Annotated[
        str, typer.Option(help="Which axis of the files is axial: 1, 2 or 3 (of LAMMPS's dumps x, y or z).")
    ] = "1",
    strict: Annotated[bool, typer.Option("--strict", help="End with exit code 1 if an audit fails.")] = False,
) -> None:
    """Second-order work between two states of grains, at the walls and at the contacts, or the cone of many probes.

    A folder of probes has a probes.csv: its column 'file' names the states after, and, if there is a column 'role', one of
    them may be 'null', the state after a probe of no increment.

    Audits hold independent numbers of the data against each other. If one fails, that is said first: do not believe the
    result before you know why.

    Example: rendulic analyze before.h5 after.h5 --report report
    """
    from dataclasses import replace

    from rendulic.foundation.errors import one_of
    from rendulic.foundation.whole_file import writable_folder
    from rendulic.io.reading import read

    axis = AXES[one_of(axial, AXES, "axial axis")]

    def snapshot_of(path: Path) -> Snapshot:
        found = read(path).with_axial(axis)
        return found if friction is None else replace(found, friction=friction)

    first = snapshot_of(before)
    if after.is_dir() and (after / MANIFEST).is_file():
        has_failed = _many(first, after, snapshot_of, report and writable_folder(report))
    else:
        has_failed = _two(first, snapshot_of(after), f"{before} to {after}", report and writable_folder(report))
    if strict and has_failed:
        raise typer.Exit(1)


def _two(before: Snapshot, after: Snapshot, title: str, report: Path | None) -> bool:
    from rendulic import figures
    from rendulic.io.tables import write_dataset
    from rendulic.probing.anatomy import anatomy_of
    from rendulic.probing.second_order_work import second_order_work
    from rendulic.views.anatomy import clusters_of_pair

    work = second_order_work(before, after)
    found = anatomy_of(work, before, after)
    carriers = found.sel(which="carriers")
    rows: dict[str, tuple[Any, str, str]] = {
        "d_eps": (work.d_eps, "", "principal strain increment, contraction positive"),
        "d_sigma": (work.d_sigma, "Pa", "principal stress increment, compression positive"),
        "w2_normalised": (work.normalised, "", "W2 over the norms of both increments"),
        "w2_boundary": (work.boundary, "J/m3", "of the boundary, exact"),
        "w2_eulerian": (work.eulerian, "J/m3", "d_sigma : d_eps"),
        "w2_lagrangian": (work.lagrangian, "J/m3", "dPi : dF"),
        **{f"w2_{name}": (value, "J/m3", f"contacts: {name}") for name, value in work.by_class.items()},
        "w2_inertial": (work.grains, "J/m3", "grains out of equilibrium"),
        "w2_paper": (work.paper, "J/m3", "contacts in both states only, and the inertial term"),
        "identity_residual": (
            work.identity_residual,
            "",
            "a test of the code's sums: boundary less contacts less grains",
        ),
        "negative_contacts": (float(found.negative_contacts), "", "share of contacts with negative work"),
        "carriers": (float(found.carriers), "", "share of contacts that carries half of it"),
        "cluster_index": (float(carriers.cluster_index), "", "Moran's I of these, contacts that share a grain"),
        "beyond_index": (float(found.beyond_index.sel(sign="negative")), "", "the same, contacts that share no grain"),
        "unbalanced_before": (before.unbalanced_force, "", "unbalanced force before"),
        "unbalanced_after": (after.unbalanced_force, "", "unbalanced force after"),
    }
    _warn(work.audits.warnings)
    _show(rows, title)
    say(clusters_of_pair(found))
    _show_audits(work.audits)
    if report is not None:
        told = {name: value for name, (value, *_) in rows.items()}
        _write_json({**told, **_plain(work.audits)}, report / "second_order_work.json")
        write_dataset(found, report / "anatomy.nc")
        figures.save(figures.anatomy(found, title), report, "anatomy")
        say(f"written to {report}")
    return bool(work.audits.failed)


def _many(before: Snapshot, folder: Path, snapshot_of: Callable[[Path], Snapshot], report: Path | None) -> bool:
    from rendulic import figures
    from rendulic.io.tables import write_csv, write_dataset
    from rendulic.probing.audits import audits
    from rendulic.probing.cone import cone_of
    from rendulic.probing.of_snapshots import probes_of_snapshots

    files, null = _manifest(folder)
    after_null = None if null is None else snapshot_of(folder / null)
    of_files: dict[str, Audits] = {}

    def audited() -> Iterator[Snapshot]:
        for name in files:
            now = snapshot_of(folder / name)
            of_files[name] = audits(before, now)
            yield now

    probes = probes_of_snapshots(before, audited(), after_null, anatomy=True)
    failed = {name: found for name, found in of_files.items() if found.failed}
    rows: dict[str, tuple[Any, str, str]] = {
        "probes": (probes.sizes["alpha"], "", "directions of strain"),
        "norm": (float(probes.norm), "", "of the strain increments"),
        "smallest_w2n": (float(probes.w2_normalised.min()), "", "smallest normalised second-order work"),
        "smallest_alpha": (float(probes.alpha[int(probes.w2_normalised.argmin("alpha"))]), "degrees", "its direction"),
        "identity_residual": (float(probes.identity_residual.max()), "", "a test of the code's sums, largest"),
        "audits_failed": (len(failed), "", f"probes of {len(of_files)} with an audit that fails"),
    }
    try:
        cone = cone_of(probes)
        rows["cone"] = (str(cone), "", "unstable directions")
    except ValueError as error:
        rows["cone"] = (None, "", str(error))
    told = [f"{name}: {' '.join(found.warnings)}" for name, found in failed.items()]
    _warn(told[:MOST_TOLD] + ([f"And {len(told) - MOST_TOLD} more."] if len(told) > MOST_TOLD else []))
    _show(rows, str(folder))
    if null is None:
        say("No null probe was given: no sign can be told from drift.")
    if report is not None:
        values = {name: value for name, (value, *_) in rows.items()}
        _write_json(
            {**values, "audits": {name: _plain(found) for name, found in of_files.items()}},
            report / "second_order_work.json",
        )
        write_dataset(probes, report / "probes.nc")
        write_csv(
            probes[["w2_normalised", "w2_boundary", "w2_contacts", "w2_grains", "negative_contacts"]],
            report / "probes.csv",
        )
        figures.save(figures.circular_diagram({folder.name: probes}, str(folder)), report, "circular")
        say(f"written to {report}")
    return bool(failed)


def _manifest(folder: Path) -> tuple[list[str], str | None]:
    """Files after probes, and that after the null probe, if there is one; none lies outside of the folder."""
    import pandas as pd

    from rendulic.foundation.errors import CorruptFile

    path = folder / MANIFEST
    try:
        table = pd.read_csv(path, dtype=str, skipinitialspace=True, keep_default_na=False)
    except (ValueError, UnicodeDecodeError) as error:
        raise CorruptFile(f"{path} is not a table in CSV: {error}") from None
    if "file" not in table.columns:
        raise CorruptFile(f"{path} lacks the column file; it has {', '.join(map(str, table.columns))}")
    roles = table["role"] if "role" in table.columns else pd.Series("probe", index=table.index)
    for name, role in zip(table["file"], roles, strict=True):
        if role not in ("probe", "null"):
            raise CorruptFile(f"{path}: column role must be 'probe' or 'null', found {role!r}")
        if not (folder / name).resolve().is_relative_to(folder.resolve()):
            raise CorruptFile(f"{path}: {name!r} lies outside of the folder")
    null = table["file"][roles == "null"].tolist()
    if len(null) > 1:
        raise CorruptFile(f"{path}: one file may have the role 'null', found {len(null)}")
    return table["file"][roles == "probe"].tolist(), (null or [None])[0]


def _show(rows: dict[str, tuple[Any, str, str]], title: str) -> None:
    import numpy as np

    table = Table(title=title, box=SIMPLE_HEAD, pad_edge=False, title_justify="left")
    for heading in ("", "value", "unit", "meaning"):
        table.add_column(heading, justify="right" if heading == "value" else "left")
    for name, (value, unit, meaning) in rows.items():
        numbers = [f"{one:.4g}" for one in np.atleast_1d(value)] if not isinstance(value, str | None) else [value or ""]
        table.add_row(name, ", ".join(numbers), unit, meaning)
    console().print(table)


def _warn(sentences: list[str]) -> None:
    """What is wrong with the data, before any result."""
    if sentences:
        say("These data contradict themselves: do not believe the result before you know why.", fg="red", bold=True)
        for sentence in sentences:
            say(f"- {sentence}", fg="red")


def _show_audits(audits: Audits) -> None:
    table = Table(
        title="audits: independent numbers of these data", box=SIMPLE_HEAD, pad_edge=False, title_justify="left"
    )
    for heading in ("", "verdict", "residual", "limit", "compared"):
        table.add_column(heading, justify="right" if heading in ("residual", "limit") else "left")
    for name, one in sorted(audits.items(), key=lambda item: item[1].passed):
        verdict = "passed" if one.passed else f"FAILED {one.where}"
        table.add_row(name, verdict, f"{one.residual:.2g}", f"{one.limit:.2g}", one.compares)
    for name, why in audits.not_possible.items():
        table.add_row(name, "not possible", "", "", why)
    console().print(table)


def _plain(audits: Audits) -> dict[str, Any]:
    """Audits as JSON can hold them."""
    return {
        "audits": {
            name: {
                "passed": one.passed,
                "residual": one.residual,
                "limit": one.limit,
                "where": one.where,
                "compares": one.compares,
            }
            for name, one in audits.items()
        },
        "audits_not_possible": audits.not_possible,
    }


def _write_json(values: dict[str, Any], path: Path) -> None:
    import json

    import numpy as np

    from rendulic.foundation.whole_file import whole_file

    plain = {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in values.items()}
    with whole_file(path) as temporary:
        temporary.write_text(json.dumps(plain, indent=1) + "\n", encoding="utf-8")
