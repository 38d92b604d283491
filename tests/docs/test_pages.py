"""Every command and every snippet of the documentation runs."""

from __future__ import annotations

import pytest
from pages import PAGES, ROOT, Reader, blocks_of, missing_programs, programs_needed


def name_of(page):
    return page.relative_to(ROOT).as_posix()


RUNNING = {page: [block for block in blocks_of(page) if block.runs] for page in PAGES}
QUICK = [
    page for page, blocks in RUNNING.items() if not programs_needed(page) and any("long" not in b.about for b in blocks)
]
LONG = [page for page, blocks in RUNNING.items() if programs_needed(page) or any("long" in b.about for b in blocks)]


@pytest.mark.parametrize("page", QUICK, ids=name_of)
def test_page(page, tmp_path):
    """What takes seconds, in order, in an empty folder."""
    reader = Reader(tmp_path)
    for block in RUNNING[page]:
        if "long" not in block.about:
            reader.follow(block)


@pytest.mark.long
@pytest.mark.parametrize("page", LONG, ids=name_of)
def test_whole_page(page, tmp_path):
    """All of it, also what takes minutes or needs another program."""
    if missing := missing_programs(page):
        pytest.skip(f"{name_of(page)} needs {', '.join(missing)}, not installed here")
    reader = Reader(tmp_path)
    for block in RUNNING[page]:
        reader.follow(block)


def test_pages_are_found_and_failures_are_noticed(tmp_path):
    """The README's block is seen; a wrong command and a wrong line of Python do not pass."""
    blocks = blocks_of(ROOT / "README.md")
    assert {"bash", "python"} <= {block.language for block in blocks}
    assert len(QUICK) >= 5
    page = tmp_path / "page.md"
    page.write_text(
        "<!-- file: a.txt -->\n```text\nhello\n```\n\n```bash\ngrep -q hello a.txt\nmkdir b && cd b\n```\n\n"
        "```python\nimport os\nassert os.path.basename(os.getcwd()) == 'b'\n```\n\n    rendulic no_such_command\n\n"
        "<!-- not run: why -->\n```bash\nfalse\n```\n",
        encoding="utf-8",
    )
    file, shell, python, wrong, not_run = blocks_of(page)
    assert [block.runs for block in (file, shell, python, wrong, not_run)] == [True, True, True, True, False]
    folder = tmp_path / "folder"
    folder.mkdir()
    reader = Reader(folder)
    for block in (file, shell, python):
        reader.follow(block)
    with pytest.raises(AssertionError, match=r"page\.md:16 failed"):
        reader.follow(wrong)
