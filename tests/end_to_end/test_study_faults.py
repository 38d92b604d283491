"""Studies survive what happens to long computations: killed processes, full disks, damaged files, failing units.

What ends in the folder must be, to the last byte, what an undisturbed run leaves.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from rendulic.foundation.errors import RendulicError
from rendulic.study.execution import run
from rendulic.study.execution.campaign import run_study
from rendulic.study.execution.local import LocalWorkers
from rendulic.study.language.study_file import read_study
from rendulic.study.plan import plan_of
from rendulic.study.store.store import Store

COMMAND = [sys.executable, "-c", "from rendulic.cli.main import run; run()"]
NO_TABLES = "[figures]\ntables = false\n"
GRAINS = (
    NO_TABLES
    + """
[[specimen]]
name = "loose"
kind = "grains"
n_grains = 40
radius_min_m = 8e-3
radius_max_m = 12e-3
eta = [0.05, 0.1]
axial_strain = 0.2
loading = { inertial_number = 1e-3 }
[[probes]]
name = "circle"
step_deg = 30
norms = [1e-5]
rate = 1e-6
settle = false
"""
)
SAND = '[[specimen]]\nname = "sand"\nkind = "chang_hicher"\npressure_pa = 1e5\nvoid_ratios = [0.9]\nsphere_rule = "{rule}"\n'
PATH = '[[path]]\nname = "t{k}"\nspecimens = ["sand"]\npath = "undrained"\naxial_strain = {strain}\n'


def sand_tests(count, strain=0.02, rule="bazant_oh_37"):
    """A sand and so many tests of it, each a little longer: one unit more than tests."""
    return SAND.format(rule=rule) + "".join(PATH.format(k=k, strain=strain + 1e-4 * k) for k in range(count))


@pytest.fixture
def study(tmp_path):
    """Write a study and return its path."""

    def write(text, name="study.toml"):
        (tmp_path / name).write_text(text)
        return tmp_path / name

    return write


def start(path, folder, *options):
    """The command in a process and session of its own."""
    return subprocess.Popen(
        [*COMMAND, "run", str(path), "-o", str(folder), "--quiet", "--workers", "2", *options],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip


def finish(path, folder, *options):
    """Run the command to its end."""
    process = start(path, folder, *options)
    out, err = process.communicate(timeout=200)
    return process.returncode, out, err


def units(folder):
    """Every file of the store with its bytes; nothing else may be there."""
    return {
        str(path.relative_to(folder)): path.read_bytes() for path in Path(folder, "units").rglob("*") if path.is_file()
    }


def workers_of(process):
    """Processes that a process has started."""
    try:
        return [int(pid) for pid in Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()]
    except OSError:
        return []


def kill(pid):
    try:
        os.kill(pid, signal.SIGKILL)
    except ProcessLookupError:
        return False
    return True


needs_proc = pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="finds workers in /proc")


@pytest.mark.long
@needs_proc
def test_fifty_kills_at_random_moments(study, tmp_path, say):
    """Main processes and workers are killed at random moments, again and again; the result is the undisturbed one."""
    path = study(GRAINS + sand_tests(60, 0.2, "lebedev_29"))
    assert finish(path, tmp_path / "calm")[0] == 0
    calm = units(tmp_path / "calm")
    assert len(calm) == len(plan_of(read_study(path)).units)
    chance, kills, runs = random.Random(5), {"main": 0, "worker": 0}, 0
    while sum(kills.values()) < 50:
        folder = tmp_path / f"killed_{runs}"
        runs += 1
        process = start(path, folder)
        while sum(kills.values()) < 50 and process.poll() is None:
            time.sleep(chance.uniform(0.1, 2.5))
            workers = workers_of(process)
            if chance.random() < 0.6:
                kills["worker"] += bool(workers) and kill(chance.choice(workers))
            elif process.poll() is None:
                kills["main"] += kill(process.pid)
                process.communicate()
                process = start(path, folder)
        process.kill()
        process.communicate()
        code, _, err = finish(path, folder)
        assert code == 0, err
        assert units(folder) == calm
    say(
        f"study killed {kills['main']} times in its main process and {kills['worker']} times in a worker, in {runs} folders: the same bytes"
    )


WRITER = """
import os, signal, sys
from pathlib import Path
from rendulic.study.execution import worker
from rendulic.study.store import store, unit_file
from rendulic.study.language.study_file import read_study
from rendulic.study.plan import plan_of
import rendulic.foundation.whole_file as whole

def die(*_):
    os.kill(os.getpid(), signal.SIGKILL)

path, folder, moment = sys.argv[1:]
if moment == "half":
    written = Path.write_bytes
    Path.write_bytes = lambda self, data: (written(self, data[: len(data) // 2]), die())
elif moment == "before fsync":
    whole.os.fsync = die
else:
    Path.replace = die
order = next(iter(plan_of(read_study(path)).units.values())).order()
worker.answer_to(order, folder, 1, lambda answer: None)
"""


@pytest.mark.parametrize("moment", ["half", "before fsync", "before rename"])
def test_killed_in_the_middle_of_writing(study, tmp_path, moment):
    """A file is whole or not there; what was half-written is swept away by the next run."""
    path, folder = study(NO_TABLES + sand_tests(1)), tmp_path / "out"
    done = subprocess.run(
        [sys.executable, "-c", WRITER, path, folder, moment], capture_output=True, timeout=100, check=False
    )
    assert done.returncode == -signal.SIGKILL, done.stderr
    left = list((folder / "units").rglob("*.part.h5"))
    assert len(left) == 1
    assert Store(folder).keys() == set()
    assert run_study(read_study(path), folder).outcome.made == 2
    assert not left[0].exists()
    run_study(read_study(path), tmp_path / "calm")
    assert units(folder) == units(tmp_path / "calm")


@needs_proc
def test_workers_end_with_the_main_process(study, tmp_path):
    """A killed main process leaves nobody computing."""
    process = start(study(NO_TABLES + sand_tests(200, 0.2)), tmp_path / "out")
    until = time.monotonic() + 60
    while len(workers := workers_of(process)) < 2 and time.monotonic() < until:
        time.sleep(0.05)
    assert len(workers) == 2
    time.sleep(1.0)
    kill(process.pid)
    process.communicate()
    while any(Path(f"/proc/{pid}/cmdline").exists() and Path(f"/proc/{pid}/cmdline").read_bytes() for pid in workers):
        assert time.monotonic() < until
        time.sleep(0.05)


def test_ctrl_c_ends_cleanly(study, tmp_path):
    """One sentence, code 130, workers ended, nothing half-written; the next run goes on."""
    path, folder = study(NO_TABLES + sand_tests(30, 0.1)), tmp_path / "out"
    process = start(path, folder)
    store, until = Store(folder), time.monotonic() + 60
    while len(store.keys()) < 3 and time.monotonic() < until:
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=30)
    assert process.returncode == 130, err
    assert err.startswith("rendulic: stopped")
    assert len(err.splitlines()) == 1
    assert not list(folder.rglob("*.part*"))
    before = store.keys()
    assert 3 <= len(before) < 31
    code, out, _ = finish(path, folder)
    assert code == 0
    assert f"31 of 31 units are done, {31 - len(before)} of them now" in out


def test_two_processes_on_one_folder(study, tmp_path):
    """While one has claimed a folder, another is refused in one sentence and touches nothing."""
    folder = tmp_path / "out"
    with Store(folder).claimed():
        code, out, err = finish(study(NO_TABLES + sand_tests(1, 0.2)), folder)
        assert sorted(path.name for path in folder.rglob("*")) == ["holder.json", "lock"]
    assert (code, out) == (2, "")
    assert f"{folder} is being worked on by process {os.getpid()} on " in err
    assert len(err.splitlines()) == 1


def test_a_unit_that_fails_is_recorded_and_the_rest_goes_on(study, tmp_path):
    """Code 3, the reason on the screen, in the folder and in `info`; not tried again unless asked for."""
    beyond = GRAINS.replace("eta = [0.05, 0.1]", "eta = [0.05, 2.0]").replace(
        "axial_strain = 0.2", "axial_strain = 0.01"
    )
    path, folder = study(beyond + sand_tests(2)), tmp_path / "out"
    code, out, err = finish(path, folder)
    assert code == 3
    assert "failed: state loose, seed 1, eta = 2: DidNotConverge: eta = 2 was not reached within 0.01" in err
    assert "2 units wait for these" in err
    assert out.startswith("7 of 10 units are done, 7 of them now")
    ((key, note),) = Store(folder).failures().items()
    assert note["is_final"]
    told = subprocess.run([*COMMAND, "info", folder], capture_output=True, text=True, timeout=60, check=True).stdout
    assert "7 of 10 units are done" in told
    assert "failed: state loose, seed 1, eta = 2: DidNotConverge" in told
    assert told.count("missing: probes 'circle'") == 2
    log = folder / "logs" / f"{key}.log"
    assert "failed: eta = 2 was not reached" in log.read_text()
    tried = log.stat().st_size
    run_study(read_study(path), folder)
    assert log.stat().st_size == tried
    run_study(read_study(path), folder, retry=True)
    assert log.stat().st_size > tried


def test_damaged_files_are_found_named_and_made_again(study, tmp_path):
    """A run and `info --check` name all, with a code of their own; `--repair` makes them again, to the same bytes."""
    path, folder = study(GRAINS), tmp_path / "out"
    run_study(read_study(path), folder)
    before, store = units(folder), Store(folder)
    packing, state, *others = plan_of(read_study(path)).units
    truncated, flipped = store.file(packing), store.file(others[-1])
    truncated.write_bytes(truncated.read_bytes()[:-100])
    data = bytearray(flipped.read_bytes())
    data[len(data) // 2] ^= 4
    flipped.write_bytes(data)
    asked = [*COMMAND, "info", folder, "--check"]
    done = subprocess.run(asked, capture_output=True, text=True, timeout=60, check=False)
    told = done.stdout
    assert done.returncode == 4
    assert f"damaged: {truncated}" in told
    assert f"damaged: {flipped}" in told
    # a state that starts from a damaged packing must be made: the run says what is damaged and what to do
    store.remove(state)
    code, out, err = finish(path, folder)
    assert code == 4
    assert f"damaged: {truncated}" in err
    assert f"damaged: {flipped}" in err
    assert f"{len(before) - 3} of {len(before)} units are done" in out
    assert "--repair" in err
    assert store.failures()[state]["is_final"] is False
    code, out, err = finish(path, folder, "--repair")
    assert code == 0, err
    assert f"made again: {truncated}" in out
    assert f"made again: {flipped}" in out
    assert units(folder) == before


def test_a_full_disk_stops_the_run(study, tmp_path):
    """One sentence that says so, code 2, whole files only; with room again, the run goes on to the same bytes."""
    path = study(NO_TABLES + sand_tests(4, 0.2))
    run_study(read_study(path), tmp_path / "calm")
    calm = units(tmp_path / "calm")
    room = sum(map(len, calm.values())) // 2048
    small = tmp_path / "small"
    small.mkdir()
    script = (
        f"mount -t tmpfs -o size={room}k none {small} && {sys.executable} -c 'from rendulic.cli.main import run; run()' "
        f"run {path} -o {small}/out -q --workers 1; code=$?; cp -r {small}/out {tmp_path}/kept; exit $code"
    )
    if subprocess.run(["unshare", "-rm", "true"], capture_output=True, check=False).returncode:
        pytest.skip("cannot mount a small disk here")
    done = subprocess.run(
        ["unshare", "-rm", "sh", "-c", script], capture_output=True, text=True, timeout=100, check=False
    )
    assert done.returncode == 2, done.stderr
    assert "No space left on device" in done.stderr
    assert len(done.stderr.splitlines()) == 1
    kept = units(tmp_path / "kept")
    assert 0 < len(kept) < len(calm)
    assert kept.items() <= calm.items()
    run_study(read_study(path), tmp_path / "kept")
    assert units(tmp_path / "kept") == calm


def test_a_folder_that_cannot_be_written_to(study, tmp_path):
    """One sentence before anything is computed; /proc admits no new folder, whoever asks."""
    path = study(NO_TABLES + sand_tests(1))
    for folder in ("/proc/rendulic", path):
        code, out, err = finish(path, folder)
        assert (code, out) == (2, "")
        assert err.startswith("rendulic: cannot write to ")
        assert len(err.splitlines()) == 1


def test_clock_jumps_change_nothing(study, tmp_path, monkeypatch):
    """Results are found by hash: neither times of files nor the clock are asked."""
    read, folder = read_study(study(NO_TABLES + sand_tests(3))), tmp_path / "out"
    hours = iter([0.0, 1e9, -1e9, 5e9] * 1000)
    monkeypatch.setattr(time, "time", lambda: next(hours))
    run_study(read, folder)
    before = units(folder)
    for k, path in enumerate((folder / "units").rglob("*.h5")):
        os.utime(path, (4e9 * (k % 2), 4e9 * (k % 2)))
    assert run_study(read, folder).outcome.made == 0
    assert units(folder) == before


def test_a_worker_of_another_version_is_refused(study, tmp_path, monkeypatch):
    """Nothing of another version gets among the results."""
    from rendulic.study.store import unit

    monkeypatch.setattr(unit, "__version__", "0.0.9")
    with pytest.raises(RendulicError, match=r"this worker runs rendulic .*, the study rendulic 0\.0\.9"):
        run_study(read_study(study(NO_TABLES + sand_tests(1))), tmp_path / "out")
    assert Store(tmp_path / "out").keys() == set()


class Dying(LocalWorkers):
    """Workers of which every one that gets a certain unit is killed at once."""

    unlucky = ""

    def submit(self, order, threads):
        super().submit(order, threads)
        if order["key"] == self.unlucky:
            self._busy[order["key"]].process.kill()


def test_a_unit_that_kills_its_workers_is_given_up(study, tmp_path):
    """After five deaths it has failed, but not for good: the next run tries it again."""
    read = read_study(study(NO_TABLES + sand_tests(3)))
    Dying.unlucky = list(plan_of(read).units)[1]
    report = run_study(read, tmp_path / "out", executor=lambda folder: Dying(folder, 2))
    ((failed, error),) = report.outcome.failed.items()
    assert failed.key == Dying.unlucky
    assert "its worker died 5 times" in error
    assert report.outcome.made == 3
    again = run_study(read, tmp_path / "out")
    assert (again.outcome.made, again.outcome.failed) == (1, {})
    assert Store(tmp_path / "out").failures() == {}


def test_workers_do_not_change_results(study, tmp_path):
    """However many processes there are, the store is the same."""
    read = read_study(study(GRAINS + sand_tests(2)))
    for count in (1, 3):
        run_study(read, tmp_path / str(count), executor=lambda folder, count=count: LocalWorkers(folder, count))
    assert units(tmp_path / "1") == units(tmp_path / "3")


class Elsewhere(LocalWorkers):
    """Workers that keep their results in another folder, as a worker of a cluster does that sees another disk."""

    def __init__(self, folder):
        super().__init__(folder.parent / "elsewhere", 1)


def test_a_workers_word_is_not_taken_for_the_file(study, tmp_path, monkeypatch):
    """What is not in the folder of the main process is not done: one sentence after a few seconds of patience."""
    monkeypatch.setattr(run, "PATIENCE", 0.3)
    with pytest.raises(
        RendulicError, match=r"a worker says that sand sand, e = 0\.9 is done, but there is no whole file"
    ):
        run_study(read_study(study(NO_TABLES + sand_tests(1))), tmp_path / "out", executor=Elsewhere)
    assert Store(tmp_path / "out").keys() == set()
    assert len(Store(tmp_path / "elsewhere").keys()) == 1
