"""Specimens that many tests share, and what tests want to say in the summary.

Several processes (`pytest -n 2`) share what takes long to make: the first that needs it makes it, the others wait and
read its file.
"""

from __future__ import annotations

import os
import signal

import numpy as np
import pytest
from filelock import FileLock

import rendulic as rd
from rendulic.dem.kernels.arrays import Drive

# fast preparation: these specimens serve algebra and bookkeeping, not soil mechanics
FAST = rd.dem.QuasiStatic(inertial_number=2e-4)

# whole studies, pages followed word for word, a real browser
LONG_FOLDERS = ("end_to_end", "docs", "browser")

collect_ignore = ["reference/yade_states.py"]  # runs inside Yade

_LINES = pytest.StashKey[list[str]]()


def pytest_configure(config):
    config.stash[_LINES] = []
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        # so does a shell to what it runs in the background; programs that tests start must feel Ctrl-C
        signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_modifyitems(items):
    """Folders that are long as a whole; what takes long comes first, so that no process is left alone with it at the end."""
    for item in items:
        if item.path.parent.name in LONG_FOLDERS:
            item.add_marker(pytest.mark.long)
    items.sort(key=lambda item: "long" not in item.keywords)


def pytest_sessionfinish(session):
    """One process of several hands its lines to the one that writes the summary."""
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["lines"] = session.config.stash[_LINES]


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node):
    """Take the lines of a process that has ended."""
    node.config.stash[_LINES].extend(getattr(node, "workeroutput", {}).get("lines", ()))


def pytest_terminal_summary(terminalreporter, config):
    if config.stash[_LINES]:
        terminalreporter.section("agreement with outside evidence")
        for line in config.stash[_LINES]:
            terminalreporter.write_line(line)


@pytest.fixture(scope="session")
def shared(tmp_path_factory):
    """Make something once for all processes of a run: `shared(name, make)` is the path that `make(path)` has filled."""
    root = tmp_path_factory.getbasetemp()
    place = (root.parent if "PYTEST_XDIST_WORKER" in os.environ else root) / "shared"
    place.mkdir(exist_ok=True)

    def once(name, make):
        with FileLock(place / f"{name}.lock"):
            if not (place / f"{name}.made").exists():
                make(place / name)
                (place / f"{name}.made").touch()
        return place / name

    return once


@pytest.fixture(scope="session")
def say(request):
    """Write a line into the summary at the end of the test run."""
    return request.config.stash[_LINES].append


@pytest.fixture(scope="session")
def fast():
    """Preparation settings for small specimens."""
    return FAST


def packed_grains(**options):
    """Two hundred grains at rest under 200 kPa."""
    return rd.dem.pack(n_grains=200, radius=(6e-3, 12e-3), seed=3, speed=FAST, **options)


@pytest.fixture(scope="session")
def packed_state(shared):
    """Two hundred grains at rest under 200 kPa."""
    return rd.State.from_file(shared("packed.h5", lambda path: packed_grains().save().to_file(path)))


@pytest.fixture(scope="session")
def dense_state(shared):
    """Two hundred grains packed without friction, hence dense."""
    return rd.State.from_file(shared("dense.h5", lambda path: packed_grains(growth_friction=0.0).save().to_file(path)))


@pytest.fixture(scope="session")
def sheared_state(packed_state, shared):
    """The same grains after 1 % of drained compression, at rest: sliding contacts and shear forces."""

    def make(path):
        sample = rd.dem.Assembly.from_state(packed_state)
        sample.load(rd.paths.drained_triaxial(until_strain=0.01), speed=FAST)
        rd.dem.bring_to_rest(sample, "stress", FAST)
        sample.save().to_file(path)

    return rd.State.from_file(shared("sheared.h5", make))


@pytest.fixture
def packed(packed_state):
    """An assembly of one's own, in the packed state."""
    return rd.dem.Assembly.from_state(packed_state)


@pytest.fixture
def sheared(sheared_state):
    """An assembly of one's own, in the sheared state."""
    return rd.dem.Assembly.from_state(sheared_state)


@pytest.fixture(scope="session")
def straining():
    """Make a drive of given principal strain rates in 1/s, contraction positive."""

    def make(rates=(0.0, 0.0, 0.0)) -> Drive:
        return Drive(
            inverse=np.eye(3),
            conjugate=np.eye(3),
            is_stress=np.zeros(3, dtype=bool),
            rate=np.array(rates, dtype=float),
            target=np.zeros(3),
            target_rate=np.zeros(3),
            rate_cap=np.array([1.0]),
        )

    return make


@pytest.fixture(scope="session")
def reported_study(shared):
    """The folder of a finished study with a little of everything, its figures not drawn; its numbers mean nothing."""
    from rendulic.study.execution.campaign import run_study
    from rendulic.study.language.study import Study
    from rendulic.study.plan import plan_of
    from rendulic.study.store.store import Store
    from rendulic.study.task import How, task_from

    study = {
        "title": "A <b>little</b> of everything & more",
        "specimen": [
            {
                "name": "loose", "kind": "grains", "n_grains": 100, "radius_min_m": 6e-3, "radius_max_m": 12e-3, "seeds": [2],
                "eta": (0.1, 0.25), "axial_strain": 0.01, "to_the_end": True, "loading": {"inertial_number": 5e-4},
            },
            {"name": "hostun", "kind": "chang_hicher", "pressure_pa": 3e5, "void_ratios": [0.9], "eta": (0.25, 0.9)},
        ],
        "probes": [
            {"name": "circle", "step_deg": 30.0, "norms": (1e-4, 2e-4), "rate": 1e-06, "settle": False},
            {"name": "inside", "step_deg": 60.0, "norms": (2e-4,), "rate": 1e-06, "settle": False, "anatomy": True},
            {"name": "sphere", "eta": [0.25], "sphere_directions": 12, "norms": (2e-4,), "rate": 2e-06, "settle": False},
        ],
        "cones": [{"name": "edges", "norm": 2e-4, "rate": 1e-06, "settle": False, "step_deg": 60.0, "tolerance_deg": 30.0}],
        "bursts": [{"name": "pushes", "cones": "edges", "rate": 1e-06, "hold_steps": 5000, "step_deg": 90.0}],
        "path": [{"name": "undrained", "specimens": ["hostun"], "path": "undrained", "axial_strain": 0.03}],
        "figures": {"diagram_norm": 2e-4},
    }  # fmt: skip
    checked = Study.model_validate(study)

    def make(folder):
        store = Store(folder)
        # in this process, where the kernels are
        for unit in plan_of(checked).units.values():
            needs = {role: store.read(need.key) for role, need in unit.needs.items()}
            store.write(unit.order(), task_from(unit.kind, unit.inputs).run(needs, How()))
        run_study(checked, folder)

    return shared("reported", make)
