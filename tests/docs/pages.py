"""The code of a page of documentation, and how to run it.

A comment before a block says what is special about it: ``<!-- file: NAME -->`` (the block is that file),
``<!-- long: why -->`` (minutes), ``<!-- not run: why -->``; ``<!-- needs: PROGRAM ... -->`` holds for the page.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from markdown_it import MarkdownIt

ROOT = Path(__file__).parents[2]
CONTRIBUTING = ROOT / "docs" / "contributing"  # these need a copy of the source: tests/end_to_end follows them
PAGES = [
    path
    for path in (*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "benchmarks").glob("*.md"))
    if "build" not in path.relative_to(ROOT).parts and CONTRIBUTING not in path.parents
]
COMMENT = re.compile(r"<!-- (file|long|not run|needs): (.+?) -->")
SHELL = ("bash", "sh", "console")
# what an indented block, which cannot say its language, begins with
SHELL_WORDS = {"rendulic", "python", "make", "mpirun", "cd", "bash", "pip"}
PYTHON_WORDS = {"import", "from"}

# the interpreter of the tests, and its rendulic, also where that is not installed as a program
PYTHON = '#!/bin/sh\nexec "{}" "$@"\n'
RENDULIC = "#!{}\nimport sys\nsys.argv[0] = 'rendulic'\nfrom rendulic.cli.main import run\nrun()\n"


@dataclass(frozen=True)
class Block:
    """Code of a page."""

    page: Path
    line: int
    language: str
    code: str
    about: dict[str, str]

    @property
    def runs(self) -> bool:
        """Whether it is a command or a program that is to be run, or a file that others need."""
        return "not run" not in self.about and ("file" in self.about or self.language in ("python", *SHELL))


def blocks_of(page: Path) -> list[Block]:
    """All blocks of code, in order, also those within lists and tabs."""
    found, about = [], {}
    for token in MarkdownIt().parse(page.read_text(encoding="utf-8")):
        if token.type == "html_block":
            about |= dict(COMMENT.findall(token.content))
        elif token.type in ("fence", "code_block"):
            words = token.info.split() if token.type == "fence" else [_guessed(token.content)]
            found.append(Block(page, token.map[0] + 1, words[0] if words else "", token.content, about))
            about = {}
    return found


def _guessed(code: str) -> str:
    first = (code.split() or [""])[0]
    return "bash" if first in SHELL_WORDS else "python" if first in PYTHON_WORDS else ""


def programs_needed(page: Path) -> list[str]:
    """Programs without which a page cannot be followed."""
    tokens = MarkdownIt().parse(page.read_text(encoding="utf-8"))
    # not those that a text speaks of
    said = [found for token in tokens if token.type == "html_block" for found in COMMENT.findall(token.content)]
    return dict(said).get("needs", "").split()


class Reader:
    """Someone who follows pages word for word, in a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.names: dict[str, object] = {"__name__": "page"}
        programs = folder / ".programs"
        programs.mkdir()
        for name, program in {"python": PYTHON, "rendulic": RENDULIC}.items():
            (programs / name).write_text(program.format(sys.executable), encoding="utf-8")
            (programs / name).chmod(0o755)
        beside = Path(sys.executable).parent
        self.environment = {
            **os.environ,
            "PATH": f"{programs}:{beside}:{os.environ['PATH']}",
            "PYTHONPATH": os.pathsep.join(entry for entry in sys.path if entry),
            "COLUMNS": "160",
        }

    def follow(self, block: Block) -> None:
        """Write the file, run the program, or give the commands; an error names page and line."""
        where = f"{block.page}:{block.line}"
        if "file" in block.about:
            (self.folder / block.about["file"]).write_text(block.code, encoding="utf-8")
        elif block.language == "python":
            # lines are counted as in the page
            code = compile("\n" * block.line + block.code, str(block.page), "exec")
            before = Path.cwd()
            os.chdir(self.folder)
            try:
                exec(code, self.names)
            finally:
                os.chdir(before)
        else:
            self.command(block.code, where)

    def command(self, code: str, where: str) -> str:
        """Run commands in a shell that stops at the first error, and stay in the folder where it ended."""
        place = self.folder / ".place"
        done = subprocess.run(
            ["bash", "-euo", "pipefail", "-c", f'{code}\npwd > "{place}"'],
            cwd=self.folder, env=self.environment, capture_output=True, text=True, timeout=1200,
        )  # fmt: skip
        assert done.returncode == 0, f"{where} failed:\n{code}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
        self.folder = Path(place.read_text(encoding="utf-8").strip())
        place.unlink()
        return done.stdout


def missing_programs(page: Path) -> list[str]:
    """Those of the programs needed that are not here."""
    beside = Path(sys.executable).parent
    path = f"{beside}:{os.environ['PATH']}"
    return [program for program in programs_needed(page) if shutil.which(program, path=path) is None]
