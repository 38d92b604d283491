"""The pages for contributors, followed word for word in a copy of the source: a measurement and a figure of one's own."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import rendulic
from rendulic.io.tables import read_dataset

ROOT = Path(__file__).parents[2]
PAGES = ("add_a_measurement", "add_a_figure")
COMMAND = f'#!/bin/sh\nexec "{sys.executable}" -c "from rendulic.cli.main import run; run()" "$@"\n'
BLOCK = re.compile(r"(?:<!-- file: (\S+) -->\n)?```(python|toml|bash)\n(.*?)```", re.DOTALL)


def follow(page: str, tree: Path) -> str:
    """Write the files of a page and run its commands in a tree; what they print."""
    said = ""
    (tree / "bin").mkdir(exist_ok=True)
    command = tree / "bin" / "rendulic"
    command.write_text(COMMAND)
    command.chmod(0o755)
    around = os.environ | {"PYTHONPATH": str(tree / "src"), "PATH": f"{tree / 'bin'}{os.pathsep}{os.environ['PATH']}"}
    for name, language, code in BLOCK.findall(
        (ROOT / "docs" / "contributing" / f"{page}.md").read_text(encoding="utf-8")
    ):
        if name:
            (tree / name).write_text(code, encoding="utf-8")
        elif language == "bash":
            done = subprocess.run(
                ["bash", "-euc", code], cwd=tree, env=around, capture_output=True, text=True, timeout=300, check=False
            )
            assert done.returncode == 0, done.stderr
            said += done.stdout
    return said


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    """A copy of the source, with compiled kernels as they are."""
    place = tmp_path_factory.mktemp("contributor")
    shutil.copytree(Path(rendulic.__file__).parent, place / "src" / "rendulic")
    return place


def test_a_measurement_needs_one_file(tree):
    """Its table is understood, its units run in workers, its results are written."""
    before = {path for path in (tree / "src").rglob("*.py")}
    said = follow("add_a_measurement", tree)
    assert "10 of 10 units are done, 10 of them now" in said
    assert {path.name for path in (tree / "src").rglob("*.py")} - {path.name for path in before} == {"modulus.py"}
    found = read_dataset(tree / "out" / "hostun_e_0.65" / "modulus_stiff_eta_0.100.nc")
    # an elastic isotropic packing has a modulus of some hundred MPa here; plasticity makes it less
    assert 1e7 < float(found.modulus) < 1e9


def test_a_figure_needs_one_file_for_each_kind_of_picture(tree):
    """Drawn by the command with its verdict, and shown in the report; the measurement is found as it was."""
    said = follow("add_a_figure", tree)
    assert "modulus: hostun, e = 0.65 is the stiffest." in said
    assert "10 of 10 units are done, 0 of them now" in said
    assert (tree / "out" / "modulus.png").stat().st_size > 4000
    assert "hostun, e = 0.9" in (tree / "out" / "modulus.md").read_text(encoding="utf-8")
    page = (tree / "out" / "report.html").read_text(encoding="utf-8")
    assert 'id="figure-modulus"' in page
    assert "Constrained modulus" in page or "d_sigma_1 / d_eps_1 of axial compression." in page
