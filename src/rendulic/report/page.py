"""The page itself: sections of what is there, in one file that needs nothing else."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from rendulic import __version__
from rendulic.foundation.whole_file import whole_file
from rendulic.report.anatomy import anatomy
from rendulic.report.bursts import bursts
from rendulic.report.circles import circles
from rendulic.report.cones import cones
from rendulic.report.figure import Figure, Section, Table, embedded
from rendulic.report.findings import Findings
from rendulic.report.loading import loading
from rendulic.report.model import model
from rendulic.report.specimen import specimen
from rendulic.report.trust import trust
from rendulic.study.language.config import ConeSet

__all__ = ["NAME", "render", "sections", "write_report"]

NAME = "report.html"
MOST_NAMED = 40  # missing units that are named
MAKERS: tuple[Callable[[Findings], Section | None], ...] = (
    trust, loading, circles, cones, bursts, anatomy, specimen, model,
)  # fmt: skip


def write_report(folder: str | os.PathLike, path: str | os.PathLike | None = None) -> Path:
    """Write the report of a study as one HTML file that needs no other and no network, and return its path.

    Parameters
    ----------
    folder : path
        Of a study, see `rendulic run`; what is not finished is left out, and said to be missing.
    path : path, optional
        `report.html` in the folder if not given.

    Raises
    ------
    InvalidInput
        If the folder holds no study that this version reads, or the file cannot be written.
    CorruptFile
        If a finished result is damaged.
    """
    path = Path(folder) / NAME if path is None else Path(path)
    text = render(Findings(folder))
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path


def sections(findings: Findings) -> list[Section]:
    """Sections that the finished results fill."""
    made = [make(findings) for make in MAKERS]
    return [_what_was_run(findings), *(section for section in made if section is not None), *_missing(findings)]


def render(findings: Findings) -> str:
    """The page as text."""
    from plotly.offline import get_plotlyjs

    shown = sections(findings)
    return template("report.html").render(
        title=findings.study.title or findings.store.folder.resolve().name,
        version=__version__,
        sections=shown,
        figures={part.name: embedded(part.data()) for each in shown for part in each.parts if isinstance(part, Figure)},
        is_figure=lambda part: isinstance(part, Figure),
        done=len(findings.done & set(findings.wanted)),
        total=len(findings.wanted),
        plotly=get_plotlyjs(),
    )


def template(name: str) -> Any:
    """One of the page's templates; what comes from a study is escaped in it."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    return Environment(
        loader=PackageLoader("rendulic.report", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
    ).get_template(name)


def _what_was_run(findings: Findings) -> Section:
    study, units = findings.study, findings.wanted
    done = len(findings.done & set(units))
    words = f"{done} of {len(units)} units of work are finished"
    words += (
        f", {len(findings.failed)} failed, {len(findings.missing)} are missing: see the end."
        if done < len(units)
        else "."
    )
    law = study.contact
    if study.packing:
        words += (
            f" Contacts are linear and frictional: K = {law.modulus_pa / 1e6:g} MPa, k_t/k_n = "
            f"{law.tangential_ratio:g}, friction {law.friction:g}. "
            f"Shearing aims at an inertial number of {study.loading.inertial_number:g}."
        )
    return Section("run", "What was run", [words], list(_tables(findings)))


def _tables(findings: Findings) -> Iterator[Table]:
    study = findings.study
    if study.packing:
        rows = []
        for packing in study.packing:
            recipe = packing.recipe(study.shared)
            rows.append([
                packing.name, ", ".join(map(str, packing.seeds)), str(recipe.n_grains),
                f"{1e3 * recipe.radius_min_m:g} to {1e3 * recipe.radius_max_m:g}", f"{recipe.pressure_pa / 1e3:g}",
                "that of the law" if recipe.growth_friction is None else f"{recipe.growth_friction:g}",
                ", ".join(f"{eta:g}" for eta in packing.eta) or "none",
            ])  # fmt: skip
        heads = ("packing", "seeds", "grains", "radii [mm]", "pressure [kPa]", "friction of growth", "states at η")
        yield Table("Packings", heads, rows)
    rows = [
        [
            f"probes '{each.name}'",
            f"{len(each.directions())} directions, {each.kind}",
            _sizes(each.norms),
            str(each.n_steps),
        ]
        for each in study.probes
    ]
    rows += [
        [f"cones '{each.name}'", _cones_in_words(each), _sizes(each.sizes), str(each.n_steps)] for each in study.cones
    ]
    rows += [
        [f"bursts '{each.name}'", f"around cones '{each.cones}'", "as these", str(each.n_steps)]
        for each in study.bursts
    ]
    if rows:
        yield Table(
            "What was measured in the states", ("set", "what", "size of increments", "time steps to the smallest"), rows
        )


def _cones_in_words(chosen: ConeSet) -> str:
    if chosen.answering is not None:
        return f"stress probes, laid on the probes of cones '{chosen.answering}'"
    return f"edges to {chosen.tolerance_deg:g} degrees"


def _sizes(norms: tuple[float, ...]) -> str:
    return ", ".join(f"{norm:g}" for norm in norms)


def _missing(findings: Findings) -> Iterator[Section]:
    if not findings.failed and not findings.missing:
        return
    rows = [[note["label"], "failed", note["error"]] for note in findings.failed.values()]
    missing = findings.missing
    rows += [[unit.label, "missing", "not done yet"] for unit in missing[:MOST_NAMED]]
    words = [f"and {len(missing) - MOST_NAMED} more units are missing."] if len(missing) > MOST_NAMED else []
    marks = ["bad"] * len(findings.failed) + ["doubtful"] * len(missing[:MOST_NAMED])
    yield Section(
        "missing",
        "What is missing",
        words,
        [Table("Units that are not finished", ("unit", "how", "why"), rows, marks=marks)],
    )
