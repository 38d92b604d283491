"""The count of cores respects whatever limits this process."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

import pytest

from rendulic.foundation import cores as module
from rendulic.foundation.cores import LIMITS, cores, workers_or_cores
from rendulic.foundation.errors import InvalidInput
from rendulic.study.execution.local import LocalWorkers


@pytest.fixture(autouse=True)
def machine(monkeypatch, tmp_path):
    """Eight cores, no limits, no control groups."""
    monkeypatch.setattr(os, "sched_getaffinity", lambda _process: set(range(8)), raising=False)
    monkeypatch.setattr(module, "GROUPS", tmp_path / "cgroup")
    monkeypatch.setattr(module, "CONTROL", tmp_path / "control")
    for name in LIMITS:
        monkeypatch.delenv(name, raising=False)
    return tmp_path


def test_all_cores_without_limits():
    assert cores() == 8


@pytest.mark.parametrize("name", LIMITS)
@pytest.mark.parametrize(
    ("text", "count"), [("3", 3), ("4,2", 4), ("0", 8), ("-2", 8), ("many", 8), ("", 8), ("99", 8)]
)
def test_the_environment_limits(monkeypatch, name, text, count):
    """The first level of OpenMP's list counts; what is no positive number does not."""
    monkeypatch.setenv(name, text)
    assert cores() == count


def group(folder, files):
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        (folder / name).write_text(text)


@pytest.mark.parametrize(("quota", "count"), [("250000 100000", 3), ("50000 100000", 1), ("max 100000", 8), ("?", 8)])
def test_the_quota_of_a_container_limits(machine, quota, count):
    """Of version 2: of the group itself or any above it, rounded up."""
    (machine / "cgroup").write_text("0::/all/mine\n")
    group(machine / "control" / "all" / "mine", {"cpu.max": "max 100000"})
    group(machine / "control" / "all", {"cpu.max": quota})
    assert cores() == count


@pytest.mark.parametrize(("quota", "count"), [("200000", 2), ("-1", 8)])
def test_the_quota_of_an_old_container_limits(machine, quota, count):
    """Of version 1, with other controllers beside the one that counts."""
    (machine / "cgroup").write_text("4:memory:/m\n1:cpu,cpuacct:/mine\nnonsense\n")
    group(machine / "control" / "cpu" / "mine", {"cpu.cfs_quota_us": quota, "cpu.cfs_period_us": "100000"})
    assert cores() == count


def test_workers_are_as_many_as_cores_or_as_asked(monkeypatch, tmp_path):
    """One for each core that may be used, if nobody says how many."""
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    assert LocalWorkers(tmp_path).capacity == 2
    assert workers_or_cores(5) == 5
    with pytest.raises(InvalidInput, match="workers must be a whole number of at least 1"):
        workers_or_cores(0)


@pytest.mark.skipif(shutil.which("taskset") is None, reason="no taskset on this system")
def test_one_core_is_one_worker():
    """As the system tells it, in a process of its own."""
    code = "from rendulic.foundation.cores import cores; raise SystemExit(cores())"
    free = {name: value for name, value in os.environ.items() if name not in LIMITS}
    assert subprocess.run(["taskset", "-c", "0", sys.executable, "-c", code], env=free).returncode == 1
