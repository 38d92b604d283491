"""Run inside Yade (`yade -x -n -j1 yade_states.py FOLDER`): states before and after a strain, as a user would export them."""

import sys
from math import atan

import numpy as np
from yade import O, utils
from yade.wrapper import (
    Bo1_Box_Aabb,
    Bo1_Sphere_Aabb,
    ForceResetter,
    FrictMat,
    Ig2_Box_Sphere_ScGeom,
    Ig2_Sphere_Sphere_ScGeom,
    InsertionSortCollider,
    InteractionLoop,
    Ip2_FrictMat_FrictMat_FrictPhys,
    Law2_ScGeom_FrictPhys_CundallStrack,
    NewtonIntegrator,
    PeriTriaxController,
    TriaxialStressController,
)

FOLDER = sys.argv[-1]
sys.path.insert(0, FOLDER)
from yade_exporter import export  # noqa: E402

EDGE, STRAIN, N_STEPS, PRESSURE = 0.1, 5e-5, 3000, 100e3  # m, -, -, Pa


def engines(damping):
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Box_Aabb()], verletDist=1e-3),
        InteractionLoop(
            [Ig2_Sphere_Sphere_ScGeom(), Ig2_Box_Sphere_ScGeom()],
            [Ip2_FrictMat_FrictMat_FrictPhys()],
            [Law2_ScGeom_FrictPhys_CundallStrack()],
        ),
        NewtonIntegrator(damping=damping),
    ]


def until(reached):
    """Run until a condition holds, or give up: a test must not wait forever."""
    for _ in range(200):
        O.run(500, wait=True)
        if reached():
            return
    raise SystemExit(f"no state at rest: stress {utils.getStress()}, unbalanced force {utils.unbalancedForce()}")


def materials(friction):
    grain = {"young": 712e6, "poisson": 0.42, "density": 2600}
    O.materials.append(FrictMat(frictionAngle=atan(friction), label="grains", **grain))
    O.materials.append(FrictMat(frictionAngle=0.0, label="walls", **grain))


def between_walls():
    """Spheres between six walls, pressed isotropically, then strained along z with the other walls held."""
    materials(0.5)
    walls = O.bodies.append(
        utils.aabbWalls([(0, 0, 0), (EDGE,) * 3], thickness=0, material="walls", oversizeFactor=1.2)
    )
    rng = np.random.default_rng(3)
    grid = (np.stack(np.meshgrid(*[np.arange(6)] * 3), axis=-1).reshape(-1, 3) + 0.5) * EDGE / 6
    for x in grid:
        O.bodies.append(utils.sphere(tuple(x + 2e-4 * rng.normal(size=3)), rng.uniform(6e-3, 8e-3), material="grains"))
    engines(0.2)
    servo = TriaxialStressController(
        wall_left_id=walls[0], wall_right_id=walls[1], wall_bottom_id=walls[2], wall_top_id=walls[3],
        wall_back_id=walls[4], wall_front_id=walls[5], thickness=0.0, internalCompaction=False, stressMask=7,
        goal1=-PRESSURE, goal2=-PRESSURE, goal3=-PRESSURE, max_vel=0.2, stressDamping=0.25,
    )  # fmt: skip
    O.engines = [*O.engines[:3], servo, O.engines[3]]
    O.dt = 0.3 * utils.PWaveTimeStep()
    until(lambda: abs(servo.meanStress + PRESSURE) < 0.01 * PRESSURE and utils.unbalancedForce() < 1e-3)
    servo.dead = True
    for wall in walls:
        O.bodies[wall].state.vel = (0, 0, 0)
    until(lambda: utils.unbalancedForce() < 1e-5)
    O.engines[-1].damping = 0.05
    export(FOLDER + "/walls_before.npz", axial="z")
    height = O.bodies[walls[5]].state.pos[2] - O.bodies[walls[4]].state.pos[2]
    speed = 0.5 * height * STRAIN / (N_STEPS * O.dt)
    O.bodies[walls[4]].state.vel, O.bodies[walls[5]].state.vel = (0, 0, speed), (0, 0, -speed)
    O.run(N_STEPS, wait=True)
    export(FOLDER + "/walls_after.npz", axial="z")


def clumps_in_a_cell():
    """Pairs of overlapping spheres in a periodic cell, pressed isotropically, then strained along y."""
    O.reset()
    materials(0.5)
    O.periodic = True
    O.cell.setBox(0.08, 0.09, 0.1)
    rng = np.random.default_rng(5)
    for place in np.stack(np.meshgrid(*[np.arange(5)] * 3), axis=-1).reshape(-1, 3):
        middle = (place + 0.5) * np.array([0.08, 0.09, 0.1]) / 5
        along = rng.normal(size=3)
        along *= 2e-3 / np.linalg.norm(along)
        O.bodies.appendClumped(
            [
                utils.sphere(tuple(middle - along), 5.5e-3, material="grains"),
                utils.sphere(tuple(middle + along), 5.5e-3, material="grains"),
            ]
        )
    engines(0.2)
    servo = PeriTriaxController(
        stressMask=7, goal=(-PRESSURE,) * 3, maxUnbalanced=1e-3, relStressTol=1e-2, dynCell=False,
        globUpdate=5, maxStrainRate=(5.0,) * 3, doneHook="", mass=0.0,
    )  # fmt: skip
    O.engines = [*O.engines[:3], servo, O.engines[3]]
    O.dt = 0.3 * utils.PWaveTimeStep()
    until(lambda: utils.getStress().trace() / 3 < -0.5 * PRESSURE)
    servo.maxStrainRate = (0.1,) * 3
    until(lambda: abs(utils.getStress().trace() / 3 + PRESSURE) < 0.02 * PRESSURE and utils.unbalancedForce() < 1e-3)
    servo.dead = True
    O.cell.velGrad = utils.Matrix3.Zero
    until(lambda: utils.unbalancedForce() < 1e-5)
    export(FOLDER + "/cell_before.npz", axial="y")
    O.cell.velGrad = utils.Matrix3(0, 0, 0, 0, -STRAIN / (N_STEPS * O.dt), 0, 0, 0, 0)
    O.run(N_STEPS, wait=True)
    export(FOLDER + "/cell_after.npz", axial="y")
    stress = utils.getStress()
    np.savetxt(FOLDER + "/cell_stress.txt", [-stress[1, 1], -stress[0, 0], -stress[2, 2]])


between_walls()
clumps_in_a_cell()
