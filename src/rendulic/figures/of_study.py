"""The figures that a study asks for, from its finished results."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from rendulic.figures.draw import draw
from rendulic.figures.style import save
from rendulic.foundation.errors import one_of
from rendulic.foundation.whole_file import whole_file
from rendulic.io.tables import write_dataset
from rendulic.study.results import Results
from rendulic.views.catalogue import catalogue
from rendulic.views.view import View

__all__ = ["Drawn", "draw_study"]


@dataclass(frozen=True, eq=False)
class Drawn:
    """A view of a study and its files."""

    view: View
    files: list[Path]


def draw_study(results: Results, names: Iterable[str], folder: Path | None = None) -> dict[str, list[Drawn]]:
    """Draw figures of a study, each as far as its results are finished; return the views of each with their files.

    A view is written as PNG and PDF; its tables as Markdown and its data as NetCDF, where it has any, under the same name.

    Raises
    ------
    InvalidInput
        If a figure is unknown, or the folder cannot be written.
    """
    folder = results.store.folder if folder is None else folder
    return {
        name: [
            Drawn(view, _files(view, folder, stem))
            for stem, view in catalogue()[one_of(name, catalogue(), "figure")].views(results).items()
        ]
        for name in names
    }


def _files(view: View, folder: Path, stem: str) -> list[Path]:
    files = save(draw(view), folder, stem)
    if view.tables:
        path = folder / f"{stem}.md"
        with whole_file(path) as temporary:
            parts = [
                f"{table.caption}\n\n{table.markdown()}" if table.caption else table.markdown() for table in view.tables
            ]
            temporary.write_text("\n\n".join(part for part in (view.verdict, *parts) if part) + "\n", encoding="utf-8")
        files.append(path)
    if view.data is not None:
        files.append(write_dataset(view.data, folder / f"{stem}.nc"))
    return files
