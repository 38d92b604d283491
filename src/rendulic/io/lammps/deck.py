"""The way out: a data file and an input deck with which LAMMPS continues a packing, on as many machines as it likes.

`state.data` has the grains, `continue.in` the rest. Run in their folder, ``mpirun -n 2 lmp -in continue.in -var eps1 1e-5``
strains the packing by `eps1, eps2, eps3` (logarithmic, contraction positive) in `steps` steps, after `relax` steps with
the walls held, and writes snapshots `NAME.STEP.dump` with `NAME.STEP.contacts` every `every` steps.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from string import Template

import numpy as np

from rendulic.dem.assembly import Assembly
from rendulic.dem.laws import LinearFrictional
from rendulic.foundation.checks import whole_number
from rendulic.foundation.errors import InvalidInput, NotEquilibrated
from rendulic.foundation.whole_file import whole_file, writable_folder
from rendulic.io.lammps.data import NUMBER, write_data
from rendulic.io.lammps.grain_types import GrainTypes, sorted_into_types
from rendulic.io.lammps.history import velocities_for

__all__ = ["Continuation", "write_deck"]

STEP = 1e6  # s, of the step that makes tangential forces: velocities are then next to nothing

DECK = Template("""\
# Written by rendulic: LAMMPS continues the packing of state.data. $summary
variable name index probe    # of the snapshots, NAME.STEP.dump with NAME.STEP.contacts
variable eps1 index 0.0      # strains of the run, logarithmic, contraction positive
variable eps2 index 0.0
variable eps3 index 0.0
variable steps index $n_steps
variable every index $${steps}
variable relax index 0       # steps with the walls held, before

units si
atom_style sphere
newton off
boundary f f f
comm_modify vel yes
neighbor $skin bin
neigh_modify every 1 delay 0 check yes
read_data state.data

# the springs of rendulic's law, by pairs of grain types; no viscous damping
pair_style granular
$pairs

# frictionless walls with each grain's own spring, at the faces of the box
compute r all property/atom radius
variable ramp equal 0.0
$walls

# one step without an integrator: the velocities of state.data are slips, that become tangential forces; then rest
timestep $step
run 1 post no
velocity all set 0.0 0.0 0.0
set group all omega 0.0 0.0 0.0

fix move all nve/sphere
fix damping all damping/cundall $damping $damping
timestep $time_step
thermo $${every}
run $${relax} post no

reset_timestep 0
variable ramp equal step/v_steps
$rates
fix box all deform 1 $faces remap none
# the stress of the pairs, for audits
compute press all pressure NULL pair
variable p1 equal c_press[1]
variable p2 equal c_press[2]
variable p3 equal c_press[3]
variable sxx atom v_p1
variable syy atom v_p2
variable szz atom v_p3
compute ids all property/local patom1 patom2 cutoff radius
compute force all pair/local fx fy fz p1 p2 p3 cutoff radius
dump grains all custom $${every} $${name}.*.dump id x y z radius v_wall1 v_wall2 v_wall3 v_wall4 v_wall5 v_wall6 &
    v_sxx v_syy v_szz
dump contacts all local $${every} $${name}.*.contacts c_ids[*] c_force[*]
dump_modify grains format float %.17g sort id
dump_modify contacts format float %.17g
run $${steps}
""")


@dataclass(frozen=True)
class Continuation:
    """What LAMMPS will do differently, measured on the present state.

    Parameters
    ----------
    n_types : int
        Grain types in use.
    stiffness_error_rms, stiffness_error_max : float
        Of the relative error of `k_n` over the contacts between grains: root mean square, and largest size.
    history_residual : float
        Norm of the tangential forces that could not be handed over, relative to that of all.
    """

    n_types: int
    stiffness_error_rms: float
    stiffness_error_max: float
    history_residual: float

    def __str__(self) -> str:
        return (
            f"{self.n_types} grain types, stiffness off by {self.stiffness_error_rms:.2g} (rms), "
            f"{self.stiffness_error_max:.2g} (largest); tangential forces by {self.history_residual:.2g}"
        )


def write_deck(
    assembly: Assembly, folder: str | os.PathLike, *, n_types: int = 64, n_steps: int = 5000
) -> Continuation:
    """Write `state.data` and `continue.in` into a folder.

    Parameters
    ----------
    n_types : int
        Most grain types: the more, the nearer the stiffnesses, exact where every radius has its own.
    n_steps : int
        Steps of the run, unless LAMMPS is told another number by ``-var steps``.

    Returns
    -------
    Continuation
        How near LAMMPS's springs and tangential forces are.

    Raises
    ------
    InvalidInput
        For a law that LAMMPS does not have, or a folder that cannot be written to.
    NotEquilibrated
        If grains move: their velocities are not handed over.

    Notes
    -----
    The same in LAMMPS: positions, radii, masses, walls and their motion, wall forces, tangential forces (as far as
    `history_residual` says), friction, damping, time step. Different: normal stiffnesses, unless there is a type per
    radius; grains start at rest; slip is counted at full radii, without the half overlap that is deducted here.
    """
    if not isinstance(assembly.law, LinearFrictional):
        raise InvalidInput(f"LAMMPS has the law LinearFrictional only, this packing has {type(assembly.law).__name__}")
    rest = assembly.equilibrium()
    if rest.kinetic_ratio > rest.kinetic_tolerance:
        raise NotEquilibrated(f"LAMMPS starts from standstill, and this packing moves ({rest}): bring_to_rest it first")
    n_types, n_steps = whole_number("n_types", n_types, 1), whole_number("n_steps", n_steps, 1)
    folder = writable_folder(Path(folder))
    snapshot = assembly.snapshot()
    types = sorted_into_types(snapshot, assembly.law, n_types)
    between = ~snapshot.is_wall
    spring = types.k_n[types.of_grain[snapshot.first[between]], types.of_grain[snapshot.second[between]]]
    velocity, spin, residual = velocities_for(snapshot, assembly.law.tangential_ratio * spring)
    found = Continuation(
        types.n_types,
        float(np.sqrt((types.error**2).mean())) if len(types.error) else 0.0,
        float(np.abs(types.error).max(initial=0.0)),
        residual,
    )
    write_data(assembly, folder / "state.data", types.of_grain + 1, velocity / STEP, spin / STEP)
    with whole_file(folder / "continue.in") as temporary:
        temporary.write_text(_deck(assembly, assembly.law, types, n_steps, str(found)), encoding="utf-8")
    return found


def _deck(assembly: Assembly, law: LinearFrictional, types: GrainTypes, n_steps: int, summary: str) -> str:
    faces, lengths = assembly.walls.position, assembly.lengths
    pairs = [
        f"pair_coeff {i + 1} {j + 1} hooke {NUMBER % types.k_n[i, j]} 0.0 damping velocity "
        f"tangential linear_history {NUMBER % (law.tangential_ratio * types.k_n[i, j])} 0.0 {NUMBER % law.friction}"
        for i in range(types.n_types)
        for j in range(i, types.n_types)
    ]
    stiffness = NUMBER % law.wall_stiffness(1.0, law.parameters)
    gap = NUMBER % (0.5 * assembly.grains.radius.mean())
    walls, rates, boxes = [], [], []
    for k, axis in enumerate("xyz"):
        low, high, half = (NUMBER % number for number in (faces[2 * k], faces[2 * k + 1], 0.5 * lengths[k]))
        walls += [
            f"variable inward{k + 1} equal {half}*(1.0-exp(-v_eps{k + 1}*v_ramp))",
            f"variable depth{2 * k + 1} atom c_r-({axis}-({low}+v_inward{k + 1}))",
            f"variable depth{2 * k + 2} atom c_r-({high}-v_inward{k + 1}-{axis})",
            *(f"variable wall{w} atom {stiffness}*c_r*v_depth{w}*(v_depth{w}>0)" for w in (2 * k + 1, 2 * k + 2)),
            f"variable push{k + 1} atom v_wall{2 * k + 1}-v_wall{2 * k + 2}",
            f"variable near{k + 1} atom (v_depth{2 * k + 1}>-{gap})||(v_depth{2 * k + 2}>-{gap})",
            f"group near{k + 1} dynamic all var near{k + 1} every 100",
            f"fix wall{k + 1} near{k + 1} addforce "
            + " ".join(f"v_push{k + 1}" if j == k else "0.0" for j in range(3)),
        ]
        rates.append(f"variable rate{k + 1} equal -v_eps{k + 1}/(v_steps*dt)")
        boxes.append(f"{axis} trate $${{rate{k + 1}}}".replace("$$", "$"))
    return DECK.substitute(
        step=NUMBER % STEP,
        summary=summary,
        n_steps=n_steps,
        skin=NUMBER % (0.05 * assembly.grains.radius.mean()),
        pairs="\n".join(pairs),
        walls="\n".join(walls),
        rates="\n".join(rates),
        faces=" ".join(boxes),
        damping=NUMBER % assembly.damping,
        time_step=NUMBER % assembly.time_step,
    )
