"""The gallery: every example is run, and shown with its picture, its words and its code."""

from __future__ import annotations

import ast
import hashlib
import subprocess
import sys
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
RUNS = ROOT / "build" / "gallery"
OPENING = """# Gallery

Each example is a file of less than 80 lines in `examples/`, run when this page was built; run it yourself with
`python examples/NAME.py FOLDER`. What it prints stands below its picture.

"""


def examples() -> list[Path]:
    """All examples, by name."""
    return sorted((ROOT / "examples").glob("*.py"))


@cache
def run(example: Path) -> Path:
    """The folder in which this example has been run; again only after it, or the package, has changed."""
    sources = [example, *sorted((ROOT / "src").rglob("*.py"))]
    print_of = hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()[:16]
    folder = RUNS / f"{example.stem}-{print_of}"
    said = folder / "said.txt"
    if not said.is_file():
        folder.mkdir(parents=True, exist_ok=True)
        done = subprocess.run([sys.executable, str(example), "."], cwd=folder, capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(f"{example.name} failed:\n{done.stderr}")
        said.write_text(done.stdout, encoding="utf-8")
    return folder


def gallery_files() -> dict[str, Path]:
    """Place on the site of every picture."""
    return {f"gallery/{path.stem}.png": run(path) / f"{path.stem}.png" for path in examples()}


def gallery_page() -> str:
    """Thumbnails, then every example."""
    thumbs, parts = [], []
    for path in examples():
        code = path.read_text(encoding="utf-8")
        title, _, about = (ast.get_docstring(ast.parse(code)) or "").partition("\n")
        title = title.rstrip(".")
        anchor = path.stem.replace("_", "-")
        picture = f"gallery/{path.stem}.png"
        thumbs.append(f"[![{title}]({picture})<br>{title}](#{anchor})\n")
        parts.append(
            f"## {title} {{ #{anchor} }}\n\n{about.strip()}\n\n![{title}]({picture})\n\n"
            f"```text\n{(run(path) / 'said.txt').read_text(encoding='utf-8').strip()}\n```\n\n"
            f'??? example "examples/{path.name}"\n\n    ```python\n'
            + "".join(f"    {line}\n" for line in code.splitlines())
            + "    ```\n\n"
        )
    return OPENING + '<div class="gallery" markdown>\n\n' + "\n".join(thumbs) + "\n</div>\n\n" + "".join(parts)
