"""Studies on a Dask cluster: the same bytes as on one machine, also when parts of the cluster die."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import tomlkit

from rendulic.foundation.errors import InvalidInput, RendulicError
from rendulic.study.execution.campaign import run_study
from rendulic.study.execution.cluster import ClusterWorkers
from rendulic.study.language.study_file import study_from
from rendulic.study.store.store import Store

pytest.importorskip("distributed")

COMMAND = [sys.executable, "-c", "from rendulic.cli.main import run; run()"]
SAND = {"name": "sand", "kind": "chang_hicher", "pressure_pa": 1e5, "void_ratios": [0.9]}
PATHS = [
    {"name": f"t{k}", "specimens": ["sand"], "path": "undrained", "axial_strain": 0.1 + 1e-4 * k} for k in range(20)
]  # fmt: skip
GRAINS = {
    "name": "loose", "kind": "grains", "n_grains": 40, "radius_min_m": 8e-3, "radius_max_m": 12e-3, "eta": [0.05],
    "axial_strain": 0.2, "loading": {"inertial_number": 1e-3},
}  # fmt: skip
PROBES = [{"name": "circle", "step_deg": 30.0, "norms": [1e-5], "rate": 1e-07, "settle": False}]


def study(**parts):
    return study_from({"figures": {"tables": False}} | parts, "study")


def units(folder):
    return {path.name: path.read_bytes() for path in Path(folder, "units").rglob("*") if path.is_file()}


class Cluster:
    """A scheduler and two workers with one thread each, as processes of this machine."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "scheduler.json"
        self.scheduler = self._start("dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard",
                                     "--scheduler-file", self.file)  # fmt: skip
        until = time.monotonic() + 60
        while not self.file.exists() or not self.file.read_text().rstrip().endswith("}"):
            assert time.monotonic() < until
            time.sleep(0.1)
        self.workers = [self._worker() for _ in range(2)]

    def _worker(self):
        return self._start("dask_worker", "--scheduler-file", self.file, "--nworkers", "1", "--nthreads", "1", "--no-dashboard",
                           "--no-nanny", "--death-timeout", "60")  # fmt: skip

    def _start(self, what, *options):
        return subprocess.Popen([sys.executable, "-m", f"distributed.cli.{what}", *map(str, options)],
                                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
                                env=os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"})  # fmt: skip

    @property
    def address(self):
        import json

        return json.loads(self.file.read_text())["address"]

    def ready(self):
        """Wait for both workers."""
        from distributed import Client

        with Client(self.address, set_as_default=False) as client:
            client.wait_for_workers(2, timeout=60)
        return self

    def end(self):
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()


@pytest.fixture
def cluster(tmp_path):
    made = Cluster(tmp_path)
    yield made.ready()
    made.end()


@pytest.mark.versions
def test_a_cluster_gives_the_same_bytes(cluster, tmp_path):
    """Grains and sands on two workers of a cluster, and on one process of this machine."""
    what = study(specimen=[GRAINS, SAND], path=PATHS[:3], probes=PROBES)
    report = run_study(what, tmp_path / "far", executor=lambda folder: ClusterWorkers(folder, cluster.address))
    assert (report.outcome.made, report.outcome.failed) == (8, {})
    run_study(what, tmp_path / "near")
    assert units(tmp_path / "far") == units(tmp_path / "near")
    # what a worker has to say on the way arrives
    assert (
        run_study(what, tmp_path / "far", executor=lambda folder: ClusterWorkers(folder, cluster.address)).outcome.made
        == 0
    )


def start(cluster, tmp_path):
    """The command with a study of many tests, once some are done."""
    path = tmp_path / "study.toml"
    path.write_text(tomlkit.dumps({"figures": {"tables": False}, "specimen": [SAND], "path": PATHS}))
    process = subprocess.Popen(
        [*COMMAND, "run", str(path), "-o", str(tmp_path / "far"), "--quiet", "--scheduler", cluster.address],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    until = time.monotonic() + 60
    while len(Store(tmp_path / "far").keys()) < 2 and time.monotonic() < until:
        time.sleep(0.02)
    return process


def test_a_killed_worker_is_done_without(cluster, tmp_path):
    """Its unit goes to the other one."""
    process = start(cluster, tmp_path)
    os.kill(cluster.workers[0].pid, signal.SIGKILL)
    out, err = process.communicate(timeout=120)
    assert process.returncode == 0, err
    assert out.startswith("21 of 21 units are done")
    run_study(study(specimen=[SAND], path=PATHS), tmp_path / "near")
    assert units(tmp_path / "far") == units(tmp_path / "near")


def test_a_killed_scheduler_ends_the_run_with_a_sentence(cluster, tmp_path):
    """What was finished is kept, and a run without the cluster goes on from there."""
    process = start(cluster, tmp_path)
    os.kill(cluster.scheduler.pid, signal.SIGKILL)
    _, err = process.communicate(timeout=120)
    assert process.returncode == 2, err
    assert err.splitlines()[-1].startswith("rendulic: the Dask scheduler is gone")
    assert len(err.splitlines()) == 1, err
    kept = len(Store(tmp_path / "far").keys())
    assert 2 <= kept < 21
    report = run_study(study(specimen=[SAND], path=PATHS), tmp_path / "far")
    assert report.outcome.made == 21 - kept
    run_study(study(specimen=[SAND], path=PATHS), tmp_path / "near")
    assert units(tmp_path / "far") == units(tmp_path / "near")


def test_workers_of_another_version_are_refused(cluster, tmp_path, monkeypatch):
    from rendulic.study.store import unit

    monkeypatch.setattr(unit, "__version__", "0.0.9")
    with pytest.raises(RendulicError, match=r"this worker runs rendulic .*, the study rendulic 0\.0\.9"):
        run_study(
            study(specimen=[SAND], path=PATHS[:1]),
            tmp_path / "far",
            executor=lambda folder: ClusterWorkers(folder, cluster.address),
        )
    assert Store(tmp_path / "far").keys() == set()


def test_no_scheduler_is_told(tmp_path, monkeypatch):
    from rendulic.study.execution import cluster

    monkeypatch.setattr(cluster, "TO_SAY_WHO", 1.0)
    with pytest.raises(InvalidInput, match=r"no Dask scheduler at tcp://127\.0\.0\.1:1: "):
        ClusterWorkers(tmp_path, "tcp://127.0.0.1:1")
