"""States computed by LAMMPS, as its text dumps.

A state is two files of one step, `NAME.dump` and `NAME.contacts`. These lines of an input script write them:

.. code-block:: none

    compute ids all property/local patom1 patom2 cutoff radius
    compute force all pair/local fx fy fz p1 p2 p3 cutoff radius
    dump grains all custom 1000 run.*.dump id x y z radius f_walls[*]
    dump contacts all local 1000 run.*.contacts c_ids[*] c_force[*]
    dump_modify grains format float %.17g
    dump_modify contacts format float %.17g

`f_walls` is a ``fix wall/gran`` or ``wall/gran/region`` with the keyword ``contacts``, of any name; there may be several.
Instead, `v_wall1` to `v_wall6` may be the normal forces of frictionless walls at the faces of the box, -x, +x, -y, ...
Periodic axes have no walls. Units are SI, axes 1, 2, 3 are x, y, z.

If the dump of the grains has the columns `v_sxx v_syy v_szz`, audits hold the stress of the contacts against LAMMPS's own:

.. code-block:: none

    compute press all pressure NULL pair
    variable p1 equal c_press[1]
    variable p2 equal c_press[2]
    variable p3 equal c_press[3]
    variable sxx atom v_p1
    variable syy atom v_p2
    variable szz atom v_p3
"""

from __future__ import annotations

import os
import re
from pathlib import Path

import numpy as np

from rendulic.foundation.checks import finite_array
from rendulic.foundation.errors import CorruptFile, InvalidInput
from rendulic.io.lammps.text import Dump, numbers_of, read_dump, rows_of, whole_numbers_of
from rendulic.io.snapshot import checked, nearest_images
from rendulic.specimen.recorded import Recorded
from rendulic.specimen.snapshot import Snapshot

__all__ = ["read_snapshot"]

PLACES = (("x", "y", "z"), ("xu", "yu", "zu"))
FACE_FORCES = tuple(f"v_wall{face}" for face in range(1, 7))
IDS = ("c_ids[1]", "c_ids[2]")
STRESSES = ("v_sxx", "v_syy", "v_szz")
FORCES = tuple(f"c_force[{k}]" for k in range(1, 7))
PARALLEL = 1e-6  # of a force or branch: how far it may be off the line it must be on
FLAT = 1e-9  # of the box: how far contacts with one wall may be off its plane
FACES = ("x-", "x+", "y-", "y+", "z-", "z+")


def read_snapshot(
    path: str | os.PathLike,
    contacts: str | os.PathLike | None = None,
    *,
    friction: float | None = None,
    walls=None,
) -> Snapshot:
    """Read a state for analysis: forces are LAMMPS's own, nothing is recomputed.

    Parameters
    ----------
    path : path
        The dump of the grains.
    contacts : path, optional
        The local dump of the contacts; by default beside it, with the ending `.contacts`.
    friction : float, optional
        Coulomb coefficient between grains, if sliding contacts are to be told.
    walls : (6,) array, optional
        Coordinates of the walls in m, where no grain touches them: elsewhere contacts tell.

    Raises
    ------
    InvalidInput
        If a file is not there, or the position of a wall is not known.
    CorruptFile
        If one is truncated, foreign or inconsistent, or they are of two states: naming file, column and expectation.
    """
    path = Path(path)
    contacts = path.with_suffix(".contacts") if contacts is None else Path(contacts)
    grains, touching = read_dump(path, "ATOMS"), read_dump(contacts, "ENTRIES")
    if touching.step != grains.step:
        raise CorruptFile(
            f"{contacts} is of step {touching.step}, {path} of step {grains.step}: give files of one step"
        )
    names = next((names for names in PLACES if set(names) <= set(grains.table.columns)), PLACES[0])
    size = "diameter" if "radius" not in grains.table.columns and "diameter" in grains.table.columns else "radius"
    ids = whole_numbers_of(path, grains.table, "id")
    if len(np.unique(ids)) != len(ids):
        raise CorruptFile(f"{path}: column id names a grain twice")
    by_id = np.argsort(ids)
    ids = ids[by_id]
    position = numbers_of(path, grains.table, names)[by_id]
    radius = numbers_of(path, grains.table, (size,))[by_id, 0] * (0.5 if size == "diameter" else 1.0)
    n = len(ids)
    first, second = (rows_of(contacts, touching.table, name, ids) for name in IDS)
    pairs = np.sort(np.column_stack((first, second)), axis=1)
    if len(np.unique(pairs, axis=0)) != len(pairs):
        raise CorruptFile(f"{contacts}: columns {', '.join(IDS)} name a pair of grains twice")
    on_first = numbers_of(contacts, touching.table, FORCES)
    faces, wall_contacts = _walls(path, grains, position, by_id, walls)
    lengths = faces[1::2] - faces[0::2]
    position = position - np.floor((position - faces[0::2]) / lengths) * lengths * grains.periodic
    image = nearest_images(position, faces, first, second) * grains.periodic
    apart = position[second] - position[first] + image * lengths
    distance = np.linalg.norm(apart, axis=1)
    if (distance == 0.0).any():
        raise CorruptFile(f"{path}: columns {', '.join(names)} put two grains of a contact at one place")
    normal = apart / distance[:, None]
    force_n = -(on_first[:, :3] * normal).sum(axis=1)
    aside = np.linalg.norm(on_first[:, :3] + force_n[:, None] * normal, axis=1)
    along = np.abs((on_first[:, 3:] * normal).sum(axis=1))
    wrong = np.maximum(aside, along) > PARALLEL * np.linalg.norm(on_first, axis=1)
    if wrong.any():
        raise CorruptFile(
            f"{contacts}, row {int(np.flatnonzero(wrong)[0]) + 1}: columns {FORCES[0]} to {FORCES[2]} must be the normal "
            f"force along the line of centres, {FORCES[3]} to {FORCES[5]} the tangential one across it, and are not: files "
            "of two states, columns in another order, or fewer digits than 'dump_modify format float %.17g' gives?"
        )
    grain, face, force = wall_contacts
    outward = np.zeros((len(grain), 3))
    outward[np.arange(len(grain)), face // 2] = np.where(face % 2 == 0, -1.0, 1.0)
    pressing = (force * outward).sum(axis=1)
    found = Snapshot(
        position,
        radius,
        faces,
        np.concatenate((first, grain)),
        np.concatenate((second, n + face)),
        np.concatenate((normal, outward)),
        np.concatenate((force_n, pressing)),
        np.concatenate((-on_first[:, 3:], force - pressing[:, None] * outward)),
        friction,
        np.concatenate((image, np.zeros((len(grain), 3), dtype=np.int64))) if grains.periodic.any() else None,
        Recorded(
            stress=_stress(path, grains, float(np.prod(lengths))),
            stress_of_pairs=True,
            are_spheres=True,
            step=grains.step,
            derived=("normal",),
        ),
    )
    return checked(found, str(path))


def _stress(path: Path, grains: Dump, volume: float) -> np.ndarray | None:
    """LAMMPS's own stress of the pairs in Pa, of its box, made one of the volume between the walls; None without it."""
    if not set(STRESSES) <= set(grains.table.columns) or not grains.table.rows:
        return None
    stress = np.full((3, 3), np.nan)
    of_box = float(np.prod(grains.box[1::2] - grains.box[0::2]))
    np.fill_diagonal(stress, numbers_of(path, grains.table, STRESSES)[0] * of_box / volume)
    return stress


def _walls(path: Path, grains: Dump, position: np.ndarray, by_id: np.ndarray, walls):
    """Faces of the box, and grain, face and force on the face of each contact with one."""
    table, n = grains.table, len(by_id)
    faces, known = grains.box.copy(), np.repeat(grains.periodic, 2)
    if walls is not None:
        faces[~known] = finite_array("walls", walls, (6,))[~known]
    if set(FACE_FORCES) <= set(table.columns):
        force = numbers_of(path, table, FACE_FORCES)[by_id]
        grain, face = np.nonzero(force)
        on_face = np.zeros((len(grain), 3))
        on_face[np.arange(len(grain)), face // 2] = np.where(face % 2 == 0, -1.0, 1.0) * force[grain, face]
        return faces, (grain, face, on_face)
    fixes = [name[2:-3] for name in table.columns if re.fullmatch(r"f_\w+\[7\]", name)]
    rows = np.concatenate(
        [numbers_of(path, table, tuple(f"f_{fix}[{k}]" for k in range(1, 8)))[by_id] for fix in fixes]
        or [np.zeros((0, 7))]
    )
    place = np.flatnonzero(rows[:, 0])
    grain, touched = place % n, rows[place]
    across = np.where(grains.periodic, 0.0, touched[:, 4:7] - position[grain])
    axis = np.abs(across).argmax(axis=1)
    at = np.arange(len(place))
    reach = across[at, axis].copy()
    across[at, axis] = 0.0
    face = 2 * axis + (reach > 0.0)
    if (np.abs(across).max(axis=1, initial=0.0) > PARALLEL * np.abs(reach)).any():
        raise CorruptFile(f"{path}: a wall of {', '.join(fixes)} is no plane across an axis")
    for k in np.flatnonzero(~known):
        points = touched[face == k, 4 + k // 2]
        if len(points):
            faces[k] = points.mean()
            if np.ptp(points) > FLAT * (grains.box[1::2] - grains.box[0::2]).max():
                raise CorruptFile(f"{path}: contacts with the wall {FACES[k]} lie in more than one plane")
        elif walls is None:
            raise InvalidInput(
                f"{path} does not tell where the wall {FACES[k]} is: no grain touches it, or the dump lacks the columns "
                "f_ID[1] to f_ID[7] of a fix wall/gran with contacts; add them, or give walls"
            )
    return faces, (grain, face, -touched[:, 1:4])
