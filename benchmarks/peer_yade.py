"""Run by `stepping.py` inside Yade (`yade -x -n -j1 peer_yade.py STATE.npz`): the same packing, the same law.

Reads `run N` and `check` from standard input, answers in lines `## {json}`.
"""

import json
import sys
import time
from math import atan

import numpy as np
from yade import O, config, utils
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
)

VERLET_DISTANCE = 5e-4  # m; 0.2, 1 and 2 mm were no faster on these packings


def build(state):
    """Spheres, six walls and the engines; returns the walls' body ids."""
    material = {"young": float(state["young"]), "poisson": float(state["ratio"]), "density": float(state["density"])}
    grains = O.materials.append(FrictMat(frictionAngle=atan(float(state["friction"])), **material))
    smooth = O.materials.append(FrictMat(frictionAngle=0.0, **material))
    low, high = state["walls"][0::2], state["walls"][1::2]
    walls = O.bodies.append(
        utils.aabbWalls([tuple(low), tuple(high)], thickness=0, material=smooth, oversizeFactor=1.2)
    )
    spheres = [
        O.bodies.append(utils.sphere(tuple(x), float(r), material=grains))
        for x, r in zip(state["position"], state["radius"], strict=True)
    ]
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Box_Aabb()], verletDist=VERLET_DISTANCE),
        InteractionLoop(
            [Ig2_Sphere_Sphere_ScGeom(), Ig2_Box_Sphere_ScGeom()],
            [Ip2_FrictMat_FrictMat_FrictPhys()],
            [Law2_ScGeom_FrictPhys_CundallStrack()],
        ),
        NewtonIntegrator(damping=float(state["damping"])),
    ]
    # a first step that moves nothing makes the contacts; then they get their tangential forces
    O.dt = 1e-20
    O.step()
    for first, second, force in zip(state["first"], state["second"], state["tangential"], strict=True):
        ids = spheres[int(first)], spheres[int(second)]
        contact = O.interactions[ids]
        sign = 1.0 if contact.id1 == ids[0] else -1.0
        contact.phys.shearForce = tuple(float(sign * f) for f in force)
    for sphere in spheres:
        O.bodies[sphere].state.vel = O.bodies[sphere].state.angVel = (0, 0, 0)
    O.dt = float(state["time_step"])
    return walls


def check(walls, state):
    """Closed contacts and mean pressure on the walls in Pa."""
    lengths = state["walls"][1::2] - state["walls"][0::2]
    areas = np.prod(lengths) / lengths
    pressures = [abs(O.forces.f(wall)[i // 2]) / areas[i // 2] for i, wall in enumerate(walls)]
    closed = sum(1 for contact in O.interactions if contact.isReal and contact.geom.penetrationDepth > 0)
    return {"contacts": closed, "pressure": float(np.mean(pressures))}


def answer(**values):
    print("##" + json.dumps(values), flush=True)


state = np.load(sys.argv[1])
walls = build(state)
answer(name=f"Yade {config.version}")
for line in sys.stdin:
    request = line.split()
    if request[0] == "run":
        cpu, wall = time.process_time(), time.perf_counter()
        O.run(int(request[1]), wait=True)
        answer(cpu=time.process_time() - cpu, wall=time.perf_counter() - wall)
    else:
        answer(**check(walls, state))
