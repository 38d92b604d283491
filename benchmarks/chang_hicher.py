"""How fast the Chang-Hicher model follows an undrained test, how exact that is, and what a batch takes.

Run it from the repository root, with rendulic installed::

    python benchmarks/chang_hicher.py                     all sections, about five minutes
    python benchmarks/chang_hicher.py --quick             fewer repeats, a small batch, one compilation: 25 seconds
    python benchmarks/chang_hicher.py --only accuracy     one section: test, accuracy, peer, batch or compile
    python benchmarks/chang_hicher.py --only batch --samples 10000

The test is the same everywhere: loose Hostun sand, 300 kPa, void ratio 0.9, constant volume to 20 % axial
strain. Every number is a median over the repeats, with the lowest and the highest beside it; within a
section the repeats of what is compared are interleaved, so that a busy moment hits all alike. Times of
one thread are *processor* time, because other programs on the machine would spoil wall time; those of
the batch and of the first call are wall time. What is timed runs once before it counts.

Section `test`: `kernel` is `following.follow_path`, `record` the labelled dataset made of it
(`point_curve`). `load` makes at least 200 records, evenly along the path; "steps only" records where the
integration steps. `events` says whether those of every plane are located, or only those of the assembly
(as in `load_many`). `steps` are accepted ones; a step is six evaluations of the rates. The second table
repeats both ways (steps only) with Lebedev rules; `relative` is time per plane over that of the default rule.

Section `accuracy`: tolerance against cost, as in `load_many`. The errors are relative and against
tolerance 1e-13: of q at its peak, which is an event, and of q at 20 % strain.

Section `peer`: SciPy's `solve_ivp` around the same compiled rates. Fixed by hand what it has no notion
of: the loading planes are kept within a piece, a terminal event ends the piece where one of them changes
sides, and the kernels' own `find_loading_planes` finds those to go on with. The peak of q and the loss of
second-order work are events too, as they are in rendulic. The independent variable is the axial strain,
not arc length. SciPy is spared the set-up of the control, the strains of the planes and the records, all
of which rendulic's time includes; it pays for calls from Python to the compiled rates, as anybody who
took it would. `evaluations` of the rates include those that locate events, but not those within `find_loading_planes`;
rendulic's kernel does not count its own. Equal tolerances do not give equal errors: compare those too.

Section `batch`: `ChangHicher.load_many` with samples of k_pR, k_rR and dilatancy. `10 000 tests` is
extrapolated. `same` says whether the results are those of one worker, to the bit.

Section `compile`: fresh interpreters, numba's cache in a temporary folder, empty or filled by the run
before. `first` and `second` are model, point and kernel; `load` after them also imports xarray.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from statistics import median

import numpy as np
from scipy.integrate import solve_ivp
from stepping import heading, processor, table  # beside this file

import rendulic as rd
from rendulic.chang_hicher.drive.equations import control_of
from rendulic.chang_hicher.drive.following import follow_path
from rendulic.chang_hicher.drive.integration import TOLERANCE, Integration
from rendulic.chang_hicher.drive.point_curve import point_curve
from rendulic.chang_hicher.kernels.columns import STATE
from rendulic.chang_hicher.kernels.events import least_slack
from rendulic.chang_hicher.kernels.integrate import find_at_yield, remember
from rendulic.chang_hicher.kernels.rates import VALID, find_loading_planes, rates
from rendulic.tensors.sphere_rules import lebedev

PATH = rd.paths.constant_volume(0.2)
VIRGIN = {"pressure": 300e3, "void_ratio": 0.9}
REFERENCE = 1e-13
SEED = 7
RANGES = {"k_pR": (0.5, 2.0), "k_rR": (0.3, 1.0), "dilatancy": (0.5, 2.0)}
MANY = 10_000


def main() -> None:
    """Run the sections asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer repeats, a small batch, one compilation")
    parser.add_argument("--only", choices=SECTIONS, help="one section")
    parser.add_argument("--samples", type=int, help="tests of the batch, 2000 by default (60 with --quick)")
    options = parser.parse_args()
    if options.samples is not None and options.samples < 1:
        parser.error("--samples must be at least 1")
    effort = QUICK if options.quick else FULL
    if options.samples is not None:
        effort = replace(effort, n_samples=options.samples)
    print(f"rendulic {rd.__version__}, Python {sys.version.split()[0]}, {processor()}, {os.cpu_count()} cores,")
    print(f"load of the machine at the start: {os.getloadavg()[0]:.1f} (one thread of this benchmark makes it 1)")
    for name, section in SECTIONS.items():
        if options.only in (None, name):
            section(effort)


@dataclass(frozen=True)
class Effort:
    """How often things are measured."""

    n: int
    n_calls: int  # of a repeat, which is their mean
    degrees: tuple[int, ...]  # of Lebedev rules
    n_samples: int
    n_batches: int
    n_compilations: int

    def __str__(self) -> str:
        return f"{self.n} repeats" + (f" of {self.n_calls} calls" if self.n_calls > 1 else "")


QUICK = Effort(5, 1, (11, 17, 23), 60, 5, 1)
FULL = Effort(9, 5, (11, 17, 23, 31, 41, 53), 2000, 5, 5)


# -- one test ------------------------------------------------------------------------------------


@dataclass
class Test:
    """One way to follow the undrained test, and what it gave."""

    sand: rd.ChangHicher
    tolerance: float = TOLERANCE
    least_records: int = 1
    watches_planes: bool = False
    makes_record: bool = False

    def __call__(self) -> tuple[float, float]:
        """Processor seconds of kernel and of record."""
        point = self.sand.at(**VIRGIN)
        start = time.process_time()
        followed = follow_path(point, PATH, self.tolerance, self.least_records, watches_planes=self.watches_planes)
        middle = time.process_time()
        if self.makes_record:
            point_curve(point, PATH.name, followed.phases, followed.stopped_by)
        end = time.process_time()
        self.phase = followed.phases[-1]
        return middle - start, end - middle

    @property
    def n_steps(self) -> int:
        """Accepted steps; where a plane changes sides there are two records of one state."""
        return int(np.count_nonzero(np.diff(self.phase.record["parameter"])))

    @property
    def q(self) -> tuple[float, float]:
        """At the peak and at the end, Pa."""
        return deviator(self.phase.events("q_peak")["stress"][0]), deviator(self.phase.record["stress"][-1])


def deviator(stress: np.ndarray) -> float:
    return float(stress[0] - 0.5 * (stress[1] + stress[2]))


def errors(found: tuple[float, float], exact: tuple[float, float]) -> list[str]:
    """Relative errors of q at the peak and at the end."""
    return [f"{abs(a / b - 1.0):.0e}" for a, b in zip(found, exact, strict=True)]


def measure(ways: list, effort: Effort) -> list[np.ndarray]:
    """For each way its repeats (n, parts) in milliseconds, interleaved, after one that does not count."""
    for way in ways:
        way()
    taken: list[list] = [[] for _ in ways]
    for _ in range(effort.n):
        for way, values in zip(ways, taken, strict=True):
            values.append(np.mean([way() for _ in range(effort.n_calls)], axis=0))
    return [1e3 * np.array(values) for values in taken]


def spread(values: np.ndarray) -> list[str]:
    """Median, lowest, highest."""
    return [f"{value:.2f}" for value in (np.median(values), values.min(), values.max())]


# -- sections ------------------------------------------------------------------------------------


def one_test(effort: Effort) -> None:
    """Milliseconds of one test, kernel and record, and how they grow with the number of planes."""
    sand = rd.ChangHicher()
    heading(f"One undrained test to 20 %, {len(sand.rule)} planes, tolerance {TOLERANCE:g}, {effort}")
    ways = [
        Test(sand, least_records=200, watches_planes=True, makes_record=True),
        Test(sand, least_records=200, makes_record=True),
        Test(sand, watches_planes=True, makes_record=True),
        Test(sand),
    ]
    names = ["load (200 records)", "load, planes unwatched", "steps only", "as in load_many"]
    rows = []
    for name, way, taken in zip(names, ways, measure(ways, effort), strict=True):
        record = spread(taken[:, 1]) if way.makes_record else ["", "", ""]
        rows.append([
            name, "all" if way.watches_planes else "assembly's", f"{way.n_steps}", *spread(taken[:, 0]), *record,
            f"{np.median(taken.sum(axis=1)):.2f}",
        ])  # fmt: skip
    table(
        ["", "events", "steps", "kernel [ms]", "lowest", "highest", "record [ms]", "lowest", "highest", "both [ms]"],
        rows,
    )

    effort = replace(effort, n_calls=1)
    heading(f"The same with more planes (Lebedev), kernel, steps only, {effort}")
    sands = [sand, *(rd.ChangHicher(rule=lebedev(degree)) for degree in effort.degrees)]
    sands.sort(key=lambda one: len(one.rule))
    ways = [Test(one, watches_planes=watches) for watches in (True, False) for one in sands]
    taken = [values[:, 0] for values in measure(ways, effort)]
    base = [np.median(values) / len(way.sand.rule) for way, values in zip(ways, taken, strict=True) if way.sand is sand]
    rows = []
    for k, one in enumerate(sands):
        n, cells = len(one.rule), []
        for own, way, values in zip(base, ways[k :: len(sands)], taken[k :: len(sands)], strict=True):
            per_plane = np.median(values) / n
            cells += [f"{way.n_steps}", *spread(values), f"{per_plane:.3f}", f"{per_plane / own:.2f}"]
        rows.append([one.rule.name, f"{n}", *cells, f"{ways[k].q[0] / 1e3:.2f}"])
    columns = ["steps", "[ms]", "lowest", "highest", "ms/plane", "relative"]
    table(["rule", "planes", "watched: steps", *columns[1:], "not: steps", *columns[1:], "q_peak [kPa]"], rows)


def accuracy(effort: Effort) -> None:
    """Tolerance against cost and error."""
    sand = rd.ChangHicher()
    heading(f"Accuracy against cost, {len(sand.rule)} planes, as in load_many, {effort}")
    exact = reference(sand)
    ways = [Test(sand, 10.0**-digits) for digits in range(5, 12)]
    rows = [
        [f"{way.tolerance:.0e}", f"{way.n_steps}", *spread(taken[:, 0]), *errors(way.q, exact)]
        for way, taken in zip(ways, measure(ways, effort), strict=True)
    ]
    table(["tolerance", "steps", "kernel [ms]", "lowest", "highest", "error of q_peak", "of q at 20 %"], rows)
    print(f"reference: tolerance {REFERENCE:g}, q_peak {exact[0] / 1e3:.6f} kPa, q at 20 % {exact[1] / 1e3:.6f} kPa")


def reference(sand: rd.ChangHicher) -> tuple[float, float]:
    """q at the peak and at the end, as exactly as can be."""
    best = Test(sand, REFERENCE)
    best()
    return best.q


def peer(effort: Effort) -> None:
    """SciPy around the same rates."""
    sand = rd.ChangHicher()
    heading(f"SciPy's solve_ivp around the same compiled rates, {len(sand.rule)} planes, {effort}")
    exact = reference(sand)
    rows = []
    for tolerance in (1e-6, TOLERANCE, 1e-10):
        own = Test(sand, tolerance)
        own()
        ways = [own, *(SciPyTest(sand, tolerance, method) for method in ("RK45", "DOP853"))]
        taken = [values[:, 0] for values in measure(ways, effort)]
        for way, values in zip(ways, taken, strict=True):
            ratios = values / taken[0]
            rows.append([
                "rendulic" if way is own else f"SciPy {way.method}", f"{tolerance:.0e}", f"{way.n_steps}",
                "" if way is own else f"{way.n_evaluations}", *spread(values), *errors(way.q, exact),
                *([""] * 3 if way is own else [f"{value:.1f} x" for value in (np.median(ratios), min(ratios), max(ratios))]),
            ])  # fmt: skip
    table(
        [
            "",
            "tolerance",
            "steps",
            "evaluations",
            "[ms]",
            "lowest",
            "highest",
            "error of q_peak",
            "of q at 20 %",
            "rendulic is",
            "lowest",
            "highest",
        ],
        rows,
    )
    print(f"one evaluation of the rates called from Python: {evaluation_time(ways[-1]):.1f} us")


class SciPyTest:
    """The undrained test by `solve_ivp`, with rendulic's own control.

    The unknowns are stress and strain (12,); the variable is the share of the path.
    """

    def __init__(self, sand: rd.ChangHicher, tolerance: float, method: str) -> None:
        self.sand, self.tolerance, self.method = sand, tolerance, method
        point, strain = sand.at(**VIRGIN), PATH.until.strain * np.array(PATH.strain_rate)
        control = control_of(point, np.zeros((3, 3)), np.eye(3), strain)
        own = Integration(point, control, tolerance, ends={"reach": 0.0})
        self.problem, self.now, self.scratch, self.control = own.problem, own.now, own.scratch, control
        # SciPy, too, gets one of the planes that respond alike
        self.planes, self.first = own.problem.planes, slice(None) if own.orbits is None else own.orbits.first
        self.active, self.at_yield = own.now.active, np.zeros_like(own.now.active)
        self.rate = np.zeros_like(own.now.y)
        # rendulic's scales: the stress, and the elastic strain of the mean stress
        self.atol = tolerance * np.repeat((0.01 * self.control.stress_scale, self.control.strain_scale), 6)
        self.events: list = [self.slack, self.growth_of_q, self.second_order_work]
        self.n_steps = self.n_evaluations = 0
        self.q = (np.nan, np.nan)

    def __call__(self) -> tuple[float]:
        """Processor seconds."""
        point = self.sand.at(**VIRGIN)
        self.material, self.memory = point.material, point.memory[self.first].copy()
        y, share, q_peak = np.concatenate((point.sigma, point.eps)), 0.0, np.nan
        self.n_steps = self.n_evaluations = 0
        events = [_direction(event, k == 0) for k, event in enumerate(self.events)]
        start = time.process_time()
        self.active[:] = False
        self.find_loading(y)
        while share < 1.0:
            piece = solve_ivp(
                self.rates, (share, 1.0), y, self.method, events=events, rtol=self.tolerance, atol=self.atol
            )
            if not piece.success:
                raise RuntimeError(f"SciPy {self.method} stopped at {piece.t[-1]:.4f} of the path: {piece.message}")
            share, y = float(piece.t[-1]), np.ascontiguousarray(piece.y[:, -1])
            self.n_steps += len(piece.t) - 1
            if len(piece.t_events[1]) and np.isnan(q_peak):
                q_peak = deviator(piece.y_events[1][0])
            if share < 1.0:
                self.evaluate(share, y)
                remember(self.material, self.active, self.scratch, self.memory)
                self.find_loading(y)
        taken = time.process_time() - start
        self.q = (q_peak, deviator(y))
        return (taken,)

    def find_loading(self, y: np.ndarray) -> None:
        """The planes that load from here on."""
        self.evaluate(-1.0, y)
        find_at_yield(self.scratch, self.active, self.at_yield)
        arguments = (self.material, self.planes, self.control, y[:6], y[6:], self.memory)
        if find_loading_planes(*arguments, self.at_yield, self.active, self.scratch, self.rate) != VALID:
            raise RuntimeError("no consistent loading of the planes")
        self.seen = (-1.0, y)

    def evaluate(self, share: float, y: np.ndarray) -> bool:
        """Rates at a state into `rate` and `scratch`; the last ones are kept, the events ask for them."""
        self.seen, self.n_evaluations = (share, y.copy()), self.n_evaluations + 1
        arguments = (self.material, self.planes, self.control, y[:6], y[6:], self.memory)
        return rates(*arguments, self.active, self.scratch, self.rate) == VALID

    def rates(self, share: float, y: np.ndarray) -> np.ndarray:
        """Per share of the path; NaN outside of the admissible states shortens SciPy's step."""
        return (
            self.rate[: STATE.parameter] / self.rate[STATE.parameter]
            if self.evaluate(share, y)
            else np.full(12, np.nan)
        )

    def evaluate_once(self, share: float, y: np.ndarray) -> None:
        if self.seen[0] != share or not np.array_equal(self.seen[1], y):
            self.evaluate(share, y)

    def slack(self, share: float, y: np.ndarray) -> float:
        """Zero where a plane changes sides."""
        self.evaluate_once(share, y)
        return least_slack(self.problem, self.now, y, self.rate, self.scratch)[0]

    def growth_of_q(self, share: float, y: np.ndarray) -> float:
        self.evaluate_once(share, y)
        return deviator(self.rate)

    def second_order_work(self, share: float, y: np.ndarray) -> float:
        self.evaluate_once(share, y)
        return float(self.rate[: STATE.strain] @ self.rate[STATE.strain : STATE.parameter])


def _direction(event: Callable, is_terminal: bool) -> Callable:
    """An event in the form that SciPy wants: a function with attributes, here one that falls through zero."""
    form = partial(event)
    form.direction, form.terminal = -1, is_terminal
    return form


def evaluation_time(test: SciPyTest) -> float:
    """Microseconds of one evaluation of the rates, called from Python."""
    test()
    point = test.sand.at(**VIRGIN)
    y = np.concatenate((point.sigma, point.eps))
    taken = []
    for _ in range(5):
        start = time.process_time()
        for _ in range(1000):
            test.rates(0.0, y)
        taken.append(time.process_time() - start)
    return 1e3 * median(taken)


def batch(effort: Effort) -> None:
    """Many sets of parameters, by one worker and by two."""
    n = effort.n_samples
    drawn = np.random.default_rng(SEED).uniform(*zip(*RANGES.values(), strict=True), (n, len(RANGES)))
    samples = dict(zip(RANGES, drawn.T, strict=True))
    ranges = ", ".join(f"{name} {low:g}-{high:g}" for name, (low, high) in RANGES.items())
    heading(f"A batch: {n} tests, {ranges}, seed {SEED}, {effort.n_batches} repeats")
    rd.ChangHicher.load_many({"k_pR": np.ones(2)}, PATH, workers=2)
    workers = (1, 2)
    seconds: dict[int, list[float]] = {one: [] for one in workers}
    shares: dict[int, list[float]] = {one: [] for one in workers}
    found = {}
    for _ in range(effort.n_batches):
        for one in workers:
            cpu, wall = time.process_time(), time.perf_counter()
            found[one] = rd.ChangHicher.load_many(samples, PATH, **VIRGIN, workers=one)
            cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
            seconds[one].append(wall)
            shares[one].append(cpu / wall)
    rows = []
    for one in workers:
        taken = np.array(seconds[one])
        rows.append([
            f"{one}", *spread(taken), f"{n / median(taken):.0f}", f"{median(np.array(seconds[1]) / taken):.2f} x",
            f"{median(shares[one]):.2f}", f"{MANY * median(taken) / n:.0f}",
            "yes" if found[one].identical(found[1]) else "NO",
        ])  # fmt: skip
    table(
        [
            "workers",
            "seconds",
            "lowest",
            "highest",
            "tests/s",
            "speed-up",
            "cores used",
            f"{MANY // 1000} {MANY % 1000:03d} tests [s]",
            "same",
        ],
        rows,
    )
    ends = ", ".join(f"{count} '{end}'" for end, count in zip(*_counts(found[1].stopped_by.values), strict=True))
    q_peak = found[1].q_peak.values / 1e3
    print(f"stopped by: {ends}; without a peak: {np.isnan(q_peak).sum()}; ", end="")
    print(f"q_peak {np.nanmin(q_peak):.0f} to {np.nanmax(q_peak):.0f} kPa")


def _counts(values: np.ndarray) -> tuple[list, list]:
    kinds, counts = np.unique(values, return_counts=True)
    return kinds.tolist(), counts.tolist()


FIRST_CALL = """
import json, time
begin = time.perf_counter()
import rendulic as rd
from rendulic.chang_hicher.drive.following import follow_path
marks = [time.perf_counter() - begin]
for _ in range(2):
    begin = time.perf_counter()
    point = rd.ChangHicher().at(pressure=300e3, void_ratio=0.9)
    follow_path(point, rd.paths.constant_volume(0.2), least_records=200)
    marks.append(time.perf_counter() - begin)
begin = time.perf_counter()
point = rd.ChangHicher().at(pressure=300e3, void_ratio=0.9)
point.load(rd.paths.constant_volume(0.2))
marks.append(time.perf_counter() - begin)
print(json.dumps([*marks, time.process_time()]))
"""


def compilation(effort: Effort) -> None:
    """The first call of a fresh interpreter, without and with numba's cache."""
    heading(f"The first test of a fresh interpreter (wall time), {effort.n_compilations} repeats")
    taken: dict[str, list] = {"empty": [], "filled": []}
    for _ in range(effort.n_compilations):
        with tempfile.TemporaryDirectory() as folder:
            for values in taken.values():
                done = subprocess.run(
                    [sys.executable, "-c", FIRST_CALL], env=os.environ | {"NUMBA_CACHE_DIR": folder},
                    capture_output=True, text=True, check=True,
                )  # fmt: skip
                values.append(json.loads(done.stdout))
    rows = []
    for name, values in taken.items():
        imported, first, second, loaded, cpu = np.array(values).T
        rows.append([
            name, f"{median(imported):.2f}", *spread(first), f"{1e3 * median(second):.1f}", f"{1e3 * median(loaded):.0f}",
            f"{median(cpu):.2f}",
        ])  # fmt: skip
    table(
        ["cache", "import [s]", "first [s]", "lowest", "highest", "second [ms]", "then load [ms]", "processor [s]"],
        rows,
    )


SECTIONS: dict[str, Callable[[Effort], None]] = {
    "test": one_test,
    "accuracy": accuracy,
    "peer": peer,
    "batch": batch,
    "compile": compilation,
}


if __name__ == "__main__":
    main()
