"""Pages of the site that are made when it is built: from the repository's own files, the code, and the examples."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

sys.path.insert(0, str(Path(__file__).parent))

from command_line import command_line_page
from gallery import gallery_files, gallery_page
from toml_reference import toml_page

ROOT = Path(__file__).parents[2]
# pages that stand in the repository under another name: one place per fact
MIRRORED = {
    "index.md": "README.md",
    "performance.md": "benchmarks/README.md",
    "design.md": "ARCHITECTURE.md",
    "contributing.md": "CONTRIBUTING.md",
    "changelog.md": "CHANGELOG.md",
}
LINK = re.compile(r"\[([^]]*)\]\((?!https?:|#)([^)\s]+)\)")


def on_files(files: Files, config: Any) -> Files:
    """Add the pages and pictures that are made rather than written."""
    for page, source in MIRRORED.items():
        files.append(File.generated(config, page, content=mirrored(source)))
    files.append(File.generated(config, "reference/toml.md", content=toml_page()))
    files.append(File.generated(config, "reference/command_line.md", content=command_line_page()))
    files.append(File.generated(config, "gallery.md", content=gallery_page()))
    for place, picture in gallery_files().items():
        files.append(File.generated(config, place, abs_src_path=str(picture)))
    return files


def on_post_page(output: str, page: Any, config: Any) -> str:
    """The page without its one script from the network, which the search needs in a folder: a copy is in assets."""
    up = "../" * page.url.count("/")
    return output.replace("https://unpkg.com/iframe-worker/shim", f"{up}assets/iframe-worker.js")


def mirrored(source: str) -> str:
    """The text of a file of the repository, with its links turned to pages of the site."""
    here = (ROOT / source).parent
    pages = {(ROOT / path).resolve(): page for page, path in MIRRORED.items()}

    def turned(match: re.Match[str]) -> str:
        path, _, anchor = match[2].partition("#")
        target = (here / path).resolve()
        if target in pages:
            place = pages[target]
        elif target.is_relative_to(ROOT / "docs"):
            place = target.relative_to(ROOT / "docs").as_posix()
        else:
            return match[1]  # a file that is no page: its name is enough
        return f"[{match[1]}]({place}{'#' if anchor else ''}{anchor})"

    return LINK.sub(turned, (ROOT / source).read_text(encoding="utf-8"))
