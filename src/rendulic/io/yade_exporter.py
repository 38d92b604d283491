"""Save the state of a Yade simulation for rendulic. Runs inside Yade, needs nothing but NumPy.

Put this file beside your script and, wherever a state is worth keeping:

    from yade_exporter import export
    export("before.npz", axial="z")

Spheres, clumps, or any grains with a mass, between six walls (bodies of `Wall` or `Box`) or in a rectangular periodic
cell. Yade 2018 and later, Python 2 or 3. Lengths and forces stay in Yade's axes and signs; rendulic turns them when it
reads the file.
"""

import numpy as np

__all__ = ["export"]


def export(path, axial, omega=None):
    """Write grains, contacts with forces, and the walls or the cell to an .npz file; return what was written, in words.

    Parameters
    ----------
    path : str
        Ends in .npz.
    axial : "x", "y" or "z"
        The axis of the triaxial test: rendulic's axis 1.
    omega : yade.O, optional
        Taken from Yade if not given.

    Raises
    ------
    ValueError
        If there are neither six walls nor a rectangular periodic cell, or contacts with other bodies.
    """
    if axial not in ("x", "y", "z"):
        raise ValueError("axial must be 'x', 'y' or 'z', got %r" % (axial,))
    if omega is None:
        from yade import O

        omega = O
    grains, walls, owner = _bodies(omega)
    fields = {
        "axial": np.array(axial),
        "ids": np.array([body.id for body in grains], dtype=np.int64),
        "pos": _rows([body.state.pos for body in grains]),
        "vel": _rows([body.state.vel for body in grains]),
        "angvel": _rows([body.state.angVel for body in grains]),
        "mass": np.array([body.state.mass for body in grains], dtype=float),
        "rad": np.array([_radius(body, omega) for body in grains], dtype=float),
        "is_sphere": np.array([hasattr(body.shape, "radius") for body in grains], dtype=bool),
        "dt": float(omega.dt),
        "step": int(omega.iter),
        "time": float(omega.time),
    }
    force = _rows([_force(body, omega) for body in grains])
    if np.any(force):  # else they were reset after the contacts were computed
        fields["force"] = force
        if fields["is_sphere"].all():
            fields["torque"] = _rows([omega.forces.t(body.id) for body in grains])
    if omega.periodic:
        from yade.utils import getStress

        fields["cell"] = _cell(omega)
        stress = getStress()  # of walls it is not: Yade takes another volume there
        fields["stress"] = np.array([[float(stress[i, j]) for j in range(3)] for i in range(3)])
    else:
        fields["wallids"], fields["wallpos"] = _six(walls, fields["pos"])
        owner.update((int(body), int(body)) for body in fields["wallids"])
        if np.any(force):
            fields["wallforce"] = _rows([omega.forces.f(int(body)) for body in fields["wallids"]])
    rows, cells, friction = [], [], []
    for contact in omega.interactions:
        if not contact.isReal:
            continue
        if contact.id1 not in owner or contact.id2 not in owner:
            raise ValueError(
                "bodies %d and %d touch, and one of them is neither a grain nor one of the six walls"
                % (contact.id1, contact.id2)
            )
        one, other, cell = owner[contact.id1], owner[contact.id2], [int(number) for number in contact.cellDist]
        if one == other and not any(cell):  # two members of one clump
            continue
        physics = contact.phys
        row = [one, other, getattr(physics, "kn", 0.0), getattr(physics, "ks", 0.0)]
        for vector in (physics.normalForce, physics.shearForce, contact.geom.normal):
            row.extend(float(value) for value in vector)
        rows.append(row)
        cells.append(cell)
        friction.append(float(getattr(physics, "tangensOfFrictionAngle", np.nan)))
    fields["contacts"] = np.array(rows, dtype=float).reshape(-1, 13)
    fields["friction"] = np.array(friction, dtype=float)
    if omega.periodic:
        fields["celldist"] = np.array(cells, dtype=np.int64).reshape(-1, 3)
    np.savez_compressed(path, **fields)
    return "%d grains and %d contacts written to %s" % (len(grains), len(rows), path)


def _bodies(omega):
    """Grains, bodies that may be walls, and the grain that each body belongs to."""
    grains, walls, owner = [], [], {}
    for body in omega.bodies:
        if body is None:
            continue
        kind = type(body.shape).__name__
        if kind in ("Wall", "Box", "Facet"):
            walls.append((body, kind))
        elif body.isClumpMember:
            owner[body.id] = body.clumpId
        else:
            grains.append(body)
            owner[body.id] = body.id
    if not grains:
        raise ValueError("there are no grains to export")
    return grains, walls, owner


def _force(body, omega):
    """Sum of the contact forces on a grain; of a clump on all of its members."""
    members = [int(one) for one in body.shape.members] if body.isClump else [body.id]
    return np.sum([[float(value) for value in omega.forces.f(one)] for one in members], axis=0)


def _rows(vectors):
    return np.array([[float(value) for value in vector] for vector in vectors], dtype=float).reshape(-1, 3)


def _radius(body, omega):
    """Of a sphere; of a clump or another grain, that of a sphere as heavy."""
    if hasattr(body.shape, "radius"):
        return body.shape.radius
    material = body.mat
    if material is None:  # a clump has the material of its members
        material = omega.bodies[next(iter(body.shape.members))].mat
    return (3.0 * body.state.mass / (4.0 * np.pi * material.density)) ** (1.0 / 3.0)


def _cell(omega):
    """Edge lengths of the periodic cell."""
    edges = np.array([[float(omega.cell.hSize[i, j]) for j in range(3)] for i in range(3)])
    lengths = np.diag(edges).copy()
    if np.abs(edges - np.diag(lengths)).max() > 1e-12 * np.abs(lengths).max():
        raise ValueError("the periodic cell is sheared; rendulic reads rectangular cells only")
    return lengths


def _six(walls, positions):
    """Ids and inner faces of the walls in the order x-, x+, y-, y+, z-, z+."""
    middle = positions.mean(axis=0)
    found = {}
    for body, kind in walls:
        if kind == "Facet":
            raise ValueError("the boundary has facets; rendulic reads six Wall or Box bodies, or a periodic cell")
        face = np.array([float(value) for value in body.state.pos])
        if kind == "Wall":
            axis, half = int(body.shape.axis), 0.0
        else:
            extents = np.array([float(value) for value in body.shape.extents])
            axis = int(np.argmin(extents))
            half = extents[axis]
        side = int(face[axis] > middle[axis])
        if (axis, side) in found:
            raise ValueError("there are two walls at the %s%s side" % ("xyz"[axis], "-+"[side]))
        face[axis] += half if side == 0 else -half
        found[axis, side] = (body.id, face)
    places = [(axis, side) for axis in range(3) for side in range(2)]
    missing = ["xyz"[axis] + "-+"[side] for axis, side in places if (axis, side) not in found]
    if missing:
        raise ValueError("rendulic reads six walls or a periodic cell; no wall at %s" % ", ".join(missing))
    order = [found[place] for place in places]
    return np.array([body for body, _ in order], dtype=np.int64), np.array([face for _, face in order])
