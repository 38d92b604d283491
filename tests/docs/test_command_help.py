"""The help of every command ends with an example that works when pasted; the shell can complete commands."""

from __future__ import annotations

import re
import shutil

import numpy as np
import pytest
import typer
from pages import ROOT, Reader

import rendulic as rd
from rendulic.cli.main import app

COMMANDS = typer.main.get_command(app).commands
EXAMPLE = re.compile(r"Example: (.+?)\s*(?:\n\n|$)", re.DOTALL)


def example_of(command) -> str:
    found = EXAMPLE.search(command.help or "")
    assert found, f"the help of `rendulic {command.name}` has no line that begins with 'Example: '"
    return " ".join(found[1].split())


QUICK_STUDY = """
[[specimen]]
name = "hostun"
kind = "chang_hicher"
preset = "hostun_loose"
pressure_pa = 3e5
void_ratios = [0.9]

[[path]]
name = "undrained"
path = "undrained"
axial_strain = 0.02
"""


@pytest.fixture
def folder(tmp_path, packed, sheared_state, reported_study):
    """What the examples speak of: a study and its results, a test of a laboratory, two states, and the folder that `make demo` leaves."""
    (tmp_path / "study.toml").write_text(QUICK_STUDY, encoding="utf-8")
    shutil.copytree(reported_study, tmp_path / "results")
    packed.save().to_file(tmp_path / "before.h5")
    packed.probe([1e-4, -5e-5, -5e-5], n_steps=100)
    packed.save().to_file(tmp_path / "after.h5")
    test = rd.ChangHicher.preset("hostun_loose").at(300e3, 0.9).load(rd.paths.constant_volume(0.03))
    strain = np.linspace(0.0, 0.028, 200)
    q, lateral = (np.interp(strain, test.eps_1, test[name]) / 1e3 for name in ("q", "sigma_3"))
    columns = np.stack((100.0 * strain, q, 400.0 - lateral), axis=1)
    heading = "Axial strain,Deviator stress,Pore pressure"
    np.savetxt(tmp_path / "test.csv", columns, "%.6f", ",", header=heading, comments="")
    demo = tmp_path / "demo" / "paper_seed_1"
    demo.mkdir(parents=True)
    shutil.copy(tmp_path / "before.h5", demo / "specimen.h5")
    sheared_state.to_file(demo / "state_eta_0.480.h5")
    return tmp_path


def _marked(name):
    """`init` is followed by the study of its template, and `view` serves until it is stopped."""
    marks = {
        "init": pytest.mark.long,
        "view": pytest.mark.skip(reason="serves until it is stopped: tests of the live page run it"),
    }
    return pytest.param(name, marks=marks.get(name, ()))


@pytest.mark.parametrize("name", [_marked(name) for name in COMMANDS])
def test_example_of_the_help(name, folder):
    """Pasted into a shell, the example runs."""
    if name == "init":
        (folder / "study.toml").unlink()
        shutil.rmtree(folder / "results")
    Reader(folder).command(example_of(COMMANDS[name]), f"the example of `rendulic {name} --help`")


def test_example_of_the_overview(tmp_path):
    """`rendulic --help` has an example, too, which runs."""
    Reader(tmp_path).command(app.info.epilog.removeprefix("Example: "), "the example of `rendulic --help`")


def test_help_says_the_same_as_the_program(tmp_path):
    """`rendulic --help` names every command, and each command's help shows its example."""
    reader = Reader(tmp_path)
    overview = reader.command("rendulic --help", "help")
    assert all(name in overview for name in COMMANDS)
    for name, command in COMMANDS.items():
        shown = " ".join(reader.command(f"rendulic {name} --help", name).replace("│", " ").split())
        assert example_of(command) in shown


@pytest.mark.parametrize(("typed", "completed"), [("rendulic re", "reproduce"), ("rendulic element --in", "--init")])
def test_the_shell_completes(typed, completed, tmp_path):
    """What a shell asks for when Tab is pressed, answered as bash expects it."""
    words = len(typed.split()) - 1
    asked = f'_RENDULIC_COMPLETE=complete_bash COMP_WORDS="{typed}" COMP_CWORD={words} rendulic'
    assert completed in Reader(tmp_path).command(asked, "completion").split()


def test_version_is_that_of_the_package(tmp_path):
    """One version."""
    assert rd.__version__ in Reader(tmp_path).command("rendulic --version", "version")
    assert f'version = "{rd.__version__}"' in (ROOT / "pyproject.toml").read_text(encoding="utf-8")
