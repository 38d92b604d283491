"""`rendulic init`, `run` and `info` as their users see them."""

from __future__ import annotations

import sys
from io import StringIO
from types import SimpleNamespace

import pytest
from rich.console import Console

from rendulic.cli import progress
from rendulic.study.execution.campaign import results_in
from rendulic.study.language.study_file import read_study
from rendulic.study.store.store import Store
from rendulic.study.store.unit import Unit

pytestmark = pytest.mark.long  # whole studies, with processes of their own

TESTS = '[[specimen]]\nname = "sand"\nkind = "chang_hicher"\npressure_pa = 1e5\nvoid_ratios = [0.9]\n' + "".join(
    f'[[path]]\nname = "t{k}"\npath = "undrained"\naxial_strain = 0.01{k}\n' for k in range(3)
)
UNITS = [Unit("test", f"test {k}", {"k": k}) for k in range(3)]


@pytest.fixture
def run(capsys, monkeypatch, tmp_path):
    """Run the entry point of the command in this process, in a folder of its own with a study of three tests."""
    from rendulic.cli import main

    monkeypatch.chdir(tmp_path)
    (tmp_path / "three.toml").write_text(TESTS)

    def do(*arguments):
        monkeypatch.setattr(sys, "argv", ["rendulic", *map(str, arguments)])
        with pytest.raises(SystemExit) as left:
            main.run()
        out, err = capsys.readouterr()
        return SimpleNamespace(returncode=left.value.code or 0, stdout=out, stderr=err)

    return do


def test_init_writes_a_study_once(run, tmp_path):
    """A valid file, which is not written over; a preset if asked for."""
    assert run("init", "new.toml").stdout == "written: new.toml\n"
    assert read_study(tmp_path / "new.toml").title == "A first study"
    again = run("init", "new.toml")
    assert (again.returncode, again.stderr) == (
        2,
        "rendulic: new.toml exists already: choose another name for the new file\n",
    )
    run("init", "paper.toml", "--preset", "paper")
    assert read_study(tmp_path / "paper.toml").specimen[0].n_grains == 10000
    assert run("init", "other.toml", "--preset", "papr").returncode == 2
    assert not (tmp_path / "other.toml").exists()


def test_run_goes_into_a_folder_of_the_studys_name(run, tmp_path):
    """What is done, how many now, and where; tables of every test; the second time nothing is done."""
    first = run("run", "three.toml", "--workers", "1", "--quiet")
    assert (first.returncode, first.stderr) == (0, "")
    assert first.stdout.startswith("4 of 4 units are done, 4 of them now, in three\n")
    assert first.stdout.endswith("rendulic report three\n")
    assert {path.name for path in (tmp_path / "three" / "sand_e_0.9").glob("path_t0*")} == {
        "path_t0.nc", "path_t0.csv", "path_t0_events.csv", "path_t0_planes.csv"
    }  # fmt: skip
    assert run("run", "three.toml", "-q").stdout.startswith("4 of 4 units are done, 0 of them now, in three\n")
    assert run("info", "three").stdout.startswith(
        "three: 4 of 4 units are done\n  sand         1 of 1\n  test         3 of 3\n"
    )


def test_info_tells_what_is_running_failed_and_missing(run, tmp_path):
    """From the folder alone; running is what a living process says, not what a dead one left."""
    run("run", "three.toml", "-q", "--workers", "1")
    results = results_in(tmp_path / "three")
    units, store = results.wanted, results.store
    _, first, second, third = units
    for key in (first, second, third):
        store.remove(key)
    store.note_failure(first, units[first].label, "DidNotConverge: too loose", True)
    store.write_json("running.json", {second: [1.0, 4.0, "eta 0.2"]})
    idle = run("info", "three").stdout
    assert "  failed: path 't0': sand, e = 0.9, as made: DidNotConverge: too loose\n" in idle
    assert "running" not in idle
    assert "  missing: path 't1': sand, e = 0.9, as made\n  missing: path 't2': sand, e = 0.9, as made\n" in idle
    with Store(tmp_path / "three").claimed():
        busy = run("info", "three").stdout
    assert "  running: path 't1': sand, e = 0.9, as made 25 %, eta 0.2\n" in busy
    assert "missing: path 't1'" not in busy
    assert third not in busy


def test_info_keeps_count_of_other_versions(run, tmp_path):
    """Results of an earlier description stay, and are told apart."""
    run("run", "three.toml", "-q", "--workers", "1")
    (tmp_path / "three.toml").write_text(TESTS.replace("0.010", "0.015"))
    run("run", "three.toml", "-q", "--workers", "1")
    told = run("info", "three").stdout
    assert "three: 4 of 4 units are done" in told
    assert "1 more results of other versions of the study are kept" in told


def watched(watch):
    """Tell a watch of a run in which one unit succeeds, one fails and one is half done."""
    watch.begin(0, 3)
    for unit in UNITS:
        watch.started(unit)
    watch.progress(UNITS[0], 1.0, 2.0, "eta 0.1")
    watch.ended(UNITS[0], None)
    watch.ended(UNITS[1], "DidNotConverge: too loose")
    watch.progress(UNITS[2], 1.0, 2.0, "eta 0.2")


def test_progress_in_lines(monkeypatch):
    """Counts, rate, time left and failures in plain lines, where there is no terminal."""
    out = StringIO()
    monkeypatch.setattr(progress, "console", lambda **_: Console(file=out, width=200))
    with progress.campaign() as watch:
        watched(watch)
    lines = out.getvalue().splitlines()
    assert "units a minute, about" in lines[0]
    assert "s left" in lines[0]
    assert any(
        line.startswith("1 of 3 units, ") and line.endswith("1 failed; failed: test 1: DidNotConverge: too loose")
        for line in lines
    )
    assert "\x1b" not in out.getvalue()


def test_progress_in_bars(monkeypatch):
    """One bar for all units and one for each that runs, on a terminal; what has ended is gone."""
    out = StringIO()
    monkeypatch.setattr(progress, "console", lambda **_: Console(file=out, width=200, force_terminal=True))
    with progress.campaign() as watch:
        watched(watch)
        shown = {task.description: task.completed for task in watch.bars.tasks}
    assert shown == {"units": 1.5, "test 2": 1.0}
    assert "failed: test 1: DidNotConverge: too loose" in out.getvalue()


def test_quiet_is_quiet():
    with progress.campaign(quiet=True) as watch:
        assert watch is None
