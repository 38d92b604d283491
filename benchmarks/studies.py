"""How studies scale: workers, tiny units, long listings. Run: python benchmarks/studies.py [workers|units|listing ...]

- workers: a campaign of probes of one packing by one and by two processes; efficiency is the time of one over twice
  that of two. Processes are started in both.
- units: ten thousand element tests of a few milliseconds; what a unit costs beyond its own computation and file.
- listing: a store of a hundred thousand units is listed, and its study planned, as `rendulic info` does.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
import time
from pathlib import Path

from rendulic.study.work import carry_out

from rendulic.study.execution.campaign import run_study
from rendulic.study.execution.local import LocalWorkers
from rendulic.study.execution.run import run_units
from rendulic.study.language.study_file import study_from
from rendulic.study.plan import plan_of
from rendulic.study.store.store import Store


def tests(count, strain):
    table = {"path": "undrained", "void_ratio": 0.9, "axial_strain": strain}
    return [{"name": f"t{k}", "pressure_pa": 100e3 + k, **table} for k in range(count)]


def study(**parts):
    return study_from({"figures": {"tables": False}, **parts}, "benchmark")


def workers(folder: Path) -> None:
    grains = {
        "specimen": {"n_grains": 1000},
        "loading": {"inertial_number": 2e-4},
        "packing": [{"name": "loose", "eta": [0.1]}],
    }
    states = study(**grains)
    probed = study(**grains, probes=[{"name": "circle", "step_deg": 1.25, "norms": [5e-5], "n_steps": 6000}])
    seconds = {}
    run_study(states, folder / "states", executor=lambda where: LocalWorkers(where, 1))
    for count in (1, 2):
        own = folder / str(count)
        shutil.copytree(folder / "states", own)
        begin = time.perf_counter()
        outcome = run_study(probed, own, executor=lambda where, count=count: LocalWorkers(where, count)).outcome
        seconds[count] = time.perf_counter() - begin
        print(f"{count} worker(s): {outcome.made} batches of probes in {seconds[count]:.1f} s")
    print(f"efficiency from one worker to two: {seconds[1] / seconds[2] / 2:.2f}")


def units(folder: Path) -> None:
    many = study(test=tests(10_000, 1e-4))
    begin = time.perf_counter()
    plan = plan_of(many)
    print(f"planned {len(plan.units)} units in {time.perf_counter() - begin:.2f} s")
    alone, store = list(plan.units.values())[:200], Store(folder / "alone")
    carry_out(alone[0].order(), folder / "alone")
    begin = time.perf_counter()
    for unit in alone:
        store.write(unit.order(), carry_out(unit.order(), folder / "alone"))
    own = (time.perf_counter() - begin) / len(alone)
    store = Store(folder / "units")
    for count in (1, 2):
        begin = time.perf_counter()
        with store.claimed():
            outcome = run_units(plan.units, store, LocalWorkers(store.folder, count))
        each = (time.perf_counter() - begin) / outcome.made
        print(
            f"{count} worker(s): {outcome.made} units, {1e3 * each:.1f} ms each; computed and written in this process "
            f"{1e3 * own:.1f} ms: overhead {1e3 * (each - own / count):.1f} ms"
        )
        shutil.rmtree(store.folder)


def listing(folder: Path) -> None:
    many = study(test=tests(100_000, 1e-4))
    begin = time.perf_counter()
    plan = plan_of(many)
    print(f"planned {len(plan.units)} units in {time.perf_counter() - begin:.2f} s")
    store = Store(folder)
    data = b"x" * 4096
    for key in plan.units:
        path = store.file(key)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    begin = time.perf_counter()
    found = store.keys()
    print(f"listed {len(found)} units in {time.perf_counter() - begin:.2f} s")


if __name__ == "__main__":
    every = {"workers": workers, "units": units, "listing": listing}
    for name in sys.argv[1:] or every:
        with tempfile.TemporaryDirectory() as place:
            every[name](Path(place))
