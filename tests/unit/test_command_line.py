"""The command line: one line and code 2 for bad input, help with an example for every command."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

import rendulic as rd

COMMAND = Path(sys.executable).with_name("rendulic")


@pytest.fixture
def run(capsys, monkeypatch, folder):
    """Run the entry point of the command in this process, in the folder."""
    from rendulic.cli import main

    monkeypatch.chdir(folder)
    monkeypatch.setenv("COLUMNS", "200")

    def do(*arguments):
        monkeypatch.setattr(sys, "argv", ["rendulic", *map(str, arguments)])
        with pytest.raises(SystemExit) as left:
            main.run()
        out, err = capsys.readouterr()
        return SimpleNamespace(returncode=left.value.code or 0, stdout=out, stderr=err)

    return do


def run_apart(*arguments, folder):
    """Run the installed command in a process of its own."""
    return subprocess.run(
        [COMMAND, *map(str, arguments)], cwd=folder, capture_output=True, text=True, timeout=120,
        env=os.environ | {"COLUMNS": "200", "NO_COLOR": "1", "TERM": "dumb"}, check=False,
    )  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory, packed_state):
    """A folder with a good state, a spoilt one, and a file where a folder should be."""
    place = tmp_path_factory.mktemp("cli")
    packed_state.to_file(place / "good.h5")
    spoilt = (place / "good.h5").read_bytes()[:3000]
    (place / "spoilt.h5").write_bytes(spoilt)
    (place / "taken").write_text("a file")
    (place / "typo.toml").write_text(
        "[[specimen]]\nname = 'a'\nkind = 'chang_hicher'\nvoid_ratios = [0.9]\nmaterial = { k_pr = 2 }\n"
    )
    return place


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["info", "none.h5"], "no state file at none.h5"),
        (["info", "."], ". is not the folder of a study: it has no study.json"),
        (["info", "spoilt.h5"], "spoilt.h5 has been altered"),
        (["info", "taken"], "not a readable rendulic state"),
        (["probe", "none.h5"], "no state file at none.h5"),
        (["probe", "good.h5", "--step", "7"], "must divide 360"),
        (["probe", "good.h5", "--norm", "nan"], "norm must be finite everywhere"),
        (["probe", "good.h5", "--norm", "-1e-5"], "probe norms must be positive"),
        (
            [
                "probe",
                "good.h5",
                "--norm",
                "1e-5",
                "--step",
                "180",
                "--rate",
                "2e-6",
                "--no-settle",
                "-q",
                "-o",
                "taken",
            ],
            "cannot write",
        ),
        (["reproduce", "fig99"], "unknown figure 'fig99': did you mean 'fig9'"),
        (["reproduce", "fig6", "-o", "taken"], "cannot write to taken"),
        (["element", "none.toml"], "no study at none.toml"),
        (["element", "taken"], "not a TOML file"),
        (["element", "taken", "--init"], "taken exists already"),
        (["element", "nowhere/new.toml", "--init"], "there is no folder nowhere"),
        (["element", "typo.toml"], "specimen 'a', material, k_pr: there is no such entry; did you mean 'k_pR'?"),
        (["reproduce", "--preset", "quik"], "unknown preset 'quik': did you mean 'quick'"),
        (
            ["reproduce", "--seed", "-3"],
            "seed -3: specimen 'paper', seeds number 1: Input should be greater than or equal to 0",
        ),
        (["reproduce", "fig1", "-o", "taken"], "cannot write to taken"),
    ],
)
def test_bad_input_is_one_line(run, folder, arguments, words):
    """Exit code 2, one line on standard error that begins with the program's name, no traceback, no new file."""
    before = sorted(folder.rglob("*"))
    done = run(*arguments)
    assert done.returncode == 2
    assert words in done.stderr
    assert done.stderr.startswith("rendulic: ")
    assert len(done.stderr.splitlines()) == 1
    assert done.stdout == ""
    assert sorted(folder.rglob("*")) == before


@pytest.mark.parametrize(
    "arguments", [["nonsense"], ["probe", "good.h5", "--step", "a"], ["reproduce", "--workers", "0"], ["info"]]
)
def test_wrong_usage_is_told(run, arguments):
    """Options the command line itself refuses: code 2, how to get help, no traceback."""
    done = run(*arguments)
    assert done.returncode == 2
    assert "--help" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("command", ["element", "reproduce", "info", "probe", "export", "lab", "run", "init"])
def test_help_has_an_example(run, command):
    """Every command says what it does and shows a line to copy."""
    done = run(command, "--help")
    assert done.returncode == 0
    assert f"Example: rendulic {command}" in done.stdout
    assert done.stderr == ""


def test_help_and_version(run):
    """The program lists its commands and knows its version."""
    listed = run("--help").stdout
    for command in ("reproduce", "run", "init", "info", "probe"):
        assert command in listed
    assert run("--version").stdout.strip() == f"rendulic {rd.__version__}"


def test_info_says_what_a_state_is(run):
    """Grains, stress and verdict of the state, which is at 200 kPa and at rest."""
    done = run("info", "good.h5")
    assert done.returncode == 0
    assert "200 grains" in done.stdout
    assert "200.0" in done.stdout.split("stress")[1].splitlines()[0]
    assert "at rest: unbalanced force" in done.stdout
    assert "NOT" not in done.stdout


def test_probe_writes_data_and_figure(run, tmp_path):
    """A sweep of two norms: one table, one figure, one line of result per norm."""
    out = tmp_path / "probes"
    done = run(
        "probe",
        "good.h5",
        "--norm",
        "2e-5",
        "--norm",
        "1e-5",
        "--step",
        "90",
        "--rate",
        "1e-6",
        "--no-settle",
        "-o",
        out,
    )
    assert done.returncode == 0, done.stderr
    assert sorted(p.name for p in out.iterdir()) == ["circular.pdf", "circular.png", "probes.nc"]
    from rendulic.io.tables import read_dataset

    probes = read_dataset(out / "probes.nc")
    assert probes.norm.values.tolist() == [1e-5, 2e-5]
    assert done.stdout.count("smallest W2n") == 2
    assert "Traceback" not in done.stderr


@pytest.mark.skipif(not COMMAND.is_file(), reason="the command rendulic is not installed beside Python")
@pytest.mark.parametrize(
    ("arguments", "code"), [(["info", "spoilt.h5"], 2), (["reproduce", "fig99"], 2), (["--version"], 0)]
)
def test_the_installed_command(folder, arguments, code):
    """The same in a process of its own: exit code, one line, no traceback."""
    done = run_apart(*arguments, folder=folder)
    assert done.returncode == code
    assert len((done.stdout + done.stderr).splitlines()) == 1
