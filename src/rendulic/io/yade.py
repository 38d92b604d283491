"""States and probes computed by Yade, written by `yade_exporter.py` inside Yade or with NumPy by hand.

Fields (units, axes and signs as in Yade): `ids, pos, rad, mass, vel, angvel` per grain; `wallids` and `wallpos` of the
walls in the order x-, x+, y-, y+, z-, z+, or `cell`, the edges of a periodic cell that begins at the origin; `contacts`,
one row each: id1, id2, k_n, k_t, normal force (3), shear force (3), normal from 1 to 2 (3). Both forces act on body 2 in
Yade's own sign, so the normal force of a compressed contact points from 1 to 2. If they are there: `celldist`, cells
between the two bodies of each contact; `friction` of each contact; `axial`, the axis of the test ("y" without it);
`is_sphere`; `dt`. For audits, also if they are there: `wallforce` (6, 3), force by the grains on each wall; `force` and `torque`
(n, 3), sum and moment of the contact forces on each grain; `stress` (3, 3) in Yade's axes and sign, or (3,) of rendulic's axes 1, 2, 3, compression
positive; `step`.
"""

from __future__ import annotations

import os
import zipfile
import zlib
from pathlib import Path

import numpy as np

from rendulic.dem.assembly import Assembly
from rendulic.dem.laws import LinearFrictional
from rendulic.dem.state.assembly_state import DAMPING
from rendulic.foundation.checks import finite_array
from rendulic.foundation.errors import CorruptFile, InvalidInput
from rendulic.foundation.whole_file import whole_file
from rendulic.io.snapshot import LARGEST, checked
from rendulic.specimen.recorded import Recorded, Springs
from rendulic.specimen.snapshot import Snapshot

__all__ = ["exporter", "read", "read_snapshot"]

# rendulic's axes 1 (axial), 2, 3 in Yade's x, y, z
AXES = {"x": (0, 1, 2), "y": (1, 0, 2), "z": (2, 0, 1)}
SHAPES: dict[str, tuple[int | None, ...]] = {
    "pos": (None, 3), "rad": (None,), "mass": (None,), "vel": (None, 3), "angvel": (None, 3),
    "ids": (None,), "wallids": (6,), "wallpos": (6, 3), "contacts": (None, None),
    "cell": (3,), "celldist": (None, 3), "dt": (),
    "wallforce": (6, 3), "force": (None, 3), "torque": (None, 3), "step": (),
}  # fmt: skip
PER_GRAIN = ("ids", "pos", "rad", "mass", "vel", "angvel", "is_sphere", "force", "torque")
FOR_ANALYSIS = ("ids", "pos", "rad", "contacts")
FOR_STEPPING = (*FOR_ANALYSIS, "mass", "vel", "angvel", "wallids", "wallpos")
ROW = 13 * 8  # bytes of a contact
RULES = ("harmonic", "mean_diameter")
OPTIONAL = ("wallids", "wallpos", "cell", "celldist", "friction", "axial", "is_sphere", "dt",
            "vel", "wallforce", "force", "torque", "stress", "step")  # fmt: skip


def exporter(path: str | os.PathLike) -> Path:
    """Write `yade_exporter.py`, the script that saves states inside Yade, to a path; return it."""
    from rendulic.io import yade_exporter

    with whole_file(path) as temporary:
        temporary.write_bytes(Path(yade_exporter.__file__).read_bytes())
    return Path(path)


def read_snapshot(path: str | os.PathLike, friction: float | None = 0.7) -> Snapshot:
    """Read a state for analysis only: forces are Yade's own, nothing is recomputed.

    Grains that touch at several points (clumps) get one contact with the summed force.

    Parameters
    ----------
    friction : float, optional
        Coulomb coefficient between grains where the file has none; contacts slide at it.

    Raises
    ------
    InvalidInput, CorruptFile
        Naming file, field and what was expected.
    """
    fields = _fields(path, FOR_ANALYSIS)
    axes = _axes(path, fields)
    vector, rows = np.array(axes), fields["contacts"]
    first, second = _bodies(path, fields, axes)
    image = None
    if "cell" in fields:
        if "celldist" not in fields or len(fields["celldist"]) != len(rows):
            raise CorruptFile(f"{path}: a periodic state needs the field celldist with one row per contact")
        image = fields["celldist"].astype(np.int64)[:, vector]
    swap = first > second  # walls come second, as everywhere in rendulic
    sign = np.where(swap, -1, 1)[:, None]
    normal = sign * rows[:, 10:13][:, vector]
    snapshot = Snapshot(
        position=fields["pos"][:, vector],
        radius=fields["rad"],
        wall_position=_faces(fields, axes),
        first=np.where(swap, second, first),
        second=np.where(swap, first, second),
        normal=normal,
        force_n=(sign * rows[:, 4:7][:, vector] * normal).sum(axis=1),
        force_t=sign * rows[:, 7:10][:, vector],
        friction=_friction(fields, (first < len(fields["ids"])) & (second < len(fields["ids"])), friction),
        image=None if image is None else sign * image,
        recorded=_recorded(path, fields, axes, first, second),
    )
    return checked(checked(snapshot, str(path)).with_pairs_merged(), str(path))


def read(
    path: str | os.PathLike,
    law: LinearFrictional | None = None,
    damping: float = DAMPING,
    friction: float = LinearFrictional.friction,
) -> Assembly:
    """Read a state of spheres between walls as an `Assembly` that steps on.

    Parameters
    ----------
    path : path
        An `.npz` with the fields above.
    law : LinearFrictional, optional
        By default stiffnesses and friction are the file's.
    damping : float
        Of Yade's NewtonIntegrator; the file does not know it.
    friction : float
        Coulomb coefficient where the file has none.

    Notes
    -----
    Normal forces are recomputed from positions and radii; tangential forces are the file's. The
    time step is the file's `dt` where it has one.

    Raises
    ------
    InvalidInput, CorruptFile
        Naming file, field and what was expected.
    """
    fields = _fields(path, FOR_ANALYSIS)
    if "cell" in fields:
        raise InvalidInput(f"{path} is periodic, and only specimens between walls step on: read_snapshot analyses it")
    fields = _fields(path, FOR_STEPPING)
    volume = 4.0 / 3.0 * np.pi * fields["rad"] ** 3
    density = float(fields["mass"].sum() / volume.sum())
    if not np.asarray(fields.get("is_sphere", True)).all():
        raise InvalidInput(
            f"{path} has grains that are not spheres, and only spheres step on: read_snapshot analyses it"
        )
    if not np.allclose(fields["mass"], density * volume, rtol=1e-6):
        raise CorruptFile(f"{path}: the masses are not those of spheres of one density; fields mass and rad disagree")
    axes = _axes(path, fields)
    vector = np.array(axes)
    handed = np.linalg.det(np.eye(3)[vector])  # pseudovectors change sign with an odd order of axes
    first, second = _bodies(path, fields, axes)
    between = (first < len(fields["ids"])) & (second < len(fields["ids"]))
    if (on_walls := _friction(fields, ~between, 0.0)) not in (0.0, None):
        raise InvalidInput(f"{path} has walls with friction {on_walls:g}, and those of rendulic are smooth: analyse it")
    assembly = Assembly(
        fields["pos"][:, vector],
        fields["rad"],
        _faces(fields, axes),
        density=density,
        law=law or _law(path, fields, first, second, _friction(fields, between, friction)),
        damping=damping,
        velocity=fields["vel"][:, vector],
        angular_velocity=handed * fields["angvel"][:, vector],
    )
    first, second = first[between], second[between]
    swap = first > second
    shear = np.where(swap, -1.0, 1.0)[:, None] * fields["contacts"][between, 7:10][:, vector]
    # Yade saves positions after a step and the forces from before it
    dt = float(fields["dt"]) if "dt" in fields else 0.0
    assembly.set_tangential_forces(np.where(swap, second, first), np.where(swap, first, second), shear, age=dt)
    if dt:
        assembly.set_time_step(dt)
    return assembly


def _recorded(path, fields: dict[str, np.ndarray], axes: tuple[int, int, int], first, second) -> Recorded:
    """What Yade says besides its contacts, as far as the file has it."""
    vector = np.array(axes)
    walls, force, torque, stress = (fields.get(name) for name in ("wallforce", "force", "torque", "stress"))
    handed = np.linalg.det(np.eye(3)[vector])  # pseudovectors change sign with an odd order of axes
    if stress is not None:
        stress = np.asarray(stress)
        if stress.shape not in ((3,), (3, 3)) or stress.dtype.kind not in "fiu" or not np.isfinite(stress).all():
            raise CorruptFile(f"{path}: field stress must be (3,) or (3, 3) finite numbers, found {stress.shape}")
        if stress.shape == (3,):
            principal, stress = stress, np.full((3, 3), np.nan)
            np.fill_diagonal(stress, principal)
        else:
            stress = -stress[np.ix_(vector, vector)]
    outward = np.tile([-1.0, 1.0], 3)
    return Recorded(
        wall_force=None
        if walls is None or "cell" in fields
        else outward * np.array([walls[2 * axis + side, axis] for axis in axes for side in (0, 1)]),
        grain_force=None if force is None else force[:, vector],
        grain_moment=None if torque is None else handed * torque[:, vector],
        stress=stress,
        springs=_springs(fields, first, second),
        slack=float(fields["dt"]) * np.linalg.norm(fields["vel"], axis=1) if {"dt", "vel"} <= set(fields) else None,
        are_spheres=bool(np.asarray(fields["is_sphere"]).all()) if "is_sphere" in fields else None,
        step=int(fields["step"]) if "step" in fields else None,
    )


def _springs(fields: dict[str, np.ndarray], first, second) -> Springs | None:
    """The one linear law that the stiffnesses of all contacts have; None if they have none."""
    n, rad = len(fields["ids"]), fields["rad"]
    between = (first < n) & (second < n)
    k_n = fields["contacts"][:, 2]
    if not between.any() or not (k_n > 0.0).all():
        return None
    on_wall = k_n[~between] / (2.0 * rad[np.minimum(first, second)[~between]])
    for rule in RULES:
        each = k_n[between] / Springs(1.0, rule).between(rad[first[between]], rad[second[between]])
        if np.ptp(each) < 1e-6 * each.mean():
            one_wall = len(on_wall) and np.ptp(on_wall) < 1e-6 * on_wall.mean()
            return Springs(float(np.median(each)), rule, float(np.median(on_wall)) if one_wall else None)
    return None


def _law(path, fields: dict[str, np.ndarray], first, second, friction: float | None) -> LinearFrictional:
    """The law whose stiffnesses all contacts between grains have."""
    between = (first < len(fields["ids"])) & (second < len(fields["ids"]))
    k_n, k_t = fields["contacts"][between, 2:4].T
    if friction is None or not len(k_n) or not (k_n > 0.0).all():
        raise InvalidInput(f"{path} does not tell one stiffness and friction of all its contacts: give law=")
    radii = fields["rad"][first[between]], fields["rad"][second[between]]
    for rule in ("harmonic", "mean_diameter"):
        unit = LinearFrictional(modulus=1.0, tangential_ratio=1.0, stiffness_rule=rule)
        modulus = k_n / unit.stiffness(*radii, unit.parameters)[0]
        if np.ptp(modulus) < 1e-6 * modulus.mean() and np.ptp(k_t / k_n) < 1e-6:
            return LinearFrictional(float(np.median(modulus)), float(np.median(k_t / k_n)), friction, rule)
    raise InvalidInput(
        f"{path}: the stiffnesses of its contacts are not those of one linear law (2 E R1 R2 / (R1 + R2) or K (R1 + R2)): "
        "give law=, or read_snapshot analyses the state"
    )


def _friction(fields: dict[str, np.ndarray], which: np.ndarray, otherwise: float | None) -> float | None:
    """The one friction coefficient of some contacts; None if they differ."""
    if "friction" not in fields or not np.isfinite(fields["friction"][which]).all() or not which.any():
        return otherwise
    found = fields["friction"][which]
    return float(np.median(found)) if np.ptp(found) <= 1e-12 else None


def _axes(path, fields: dict[str, np.ndarray]) -> tuple[int, int, int]:
    name = str(fields.get("axial", "y"))
    if name not in AXES:
        raise CorruptFile(f"{path}: field axial must be 'x', 'y' or 'z', found {name!r}")
    return AXES[name]


def _faces(fields: dict[str, np.ndarray], axes: tuple[int, int, int]) -> np.ndarray:
    if "cell" in fields:
        return np.array([edge for axis in axes for edge in (0.0, fields["cell"][axis])])
    return np.array([fields["wallpos"][2 * axis + side, axis] for axis in axes for side in (0, 1)])


def _fields(path: str | os.PathLike, wanted: tuple[str, ...]) -> dict[str, np.ndarray]:
    """The fields wanted, and any of the optional ones, checked one by one and against each other; grains by id."""
    path = Path(path)
    if not path.is_file():
        raise InvalidInput(f"no Yade state at {path}: check the path")
    found: dict[str, np.ndarray] = {}
    try:
        with zipfile.ZipFile(path) as members:
            if (size := sum(member.file_size for member in members.infolist())) > LARGEST * ROW:
                raise CorruptFile(
                    f"{path} unpacks to {size / 1e9:.3g} GB, more than the {LARGEST * ROW / 1e9:.3g} that are read"
                )
        archive = np.load(path, allow_pickle=False)
        with archive:
            box = ("wallids", "wallpos") if "cell" not in archive.files else ()
            missing = [name for name in dict.fromkeys((*wanted, *box)) if name not in archive.files]
            if missing:
                raise CorruptFile(f"{path} lacks the field(s) {', '.join(missing)}; it has {', '.join(archive.files)}")
            for name in dict.fromkeys((*wanted, *OPTIONAL)):
                if name in archive.files:
                    found[name] = archive[name]
    except (OSError, ValueError, EOFError, zipfile.BadZipFile, zlib.error, KeyError, MemoryError) as error:
        raise CorruptFile(f"{path} is not a readable .npz archive: {error}") from None
    for name in set(SHAPES) & set(found):
        try:
            found[name] = finite_array(name, found[name], SHAPES[name])
        except InvalidInput as error:
            raise CorruptFile(f"{path}, field {error}") from None
    for name in {*PER_GRAIN, "friction"} & set(found):
        like = "contacts" if name == "friction" else "ids"
        if found[name].shape[:1] != found[like].shape[:1]:
            raise CorruptFile(
                f"{path}: field {name} has {found[name].shape[0] if found[name].ndim else 0} rows, "
                f"{like} has {len(found[like])}"
            )
        if found[name].dtype.kind not in "fiub":
            raise CorruptFile(f"{path}: field {name} must be of numbers, found {found[name].dtype}")
    by_id = np.argsort(found["ids"], kind="stable")
    for name in PER_GRAIN:
        if name in found:
            found[name] = found[name][by_id]
    if found["contacts"].shape[1] < 13:
        raise CorruptFile(f"{path}: field contacts has {found['contacts'].shape[1]} columns, at least 13 are needed")
    return found


def _bodies(path, fields: dict[str, np.ndarray], axes: tuple[int, int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Bodies of each contact: grains by index, walls as `n + wall` in rendulic's order."""
    ids = fields["ids"].astype(np.int64)
    number = {int(body): index for index, body in enumerate(ids)}
    if len(number) != len(ids):
        raise CorruptFile(f"{path}: field ids names a grain twice")
    if "cell" not in fields:
        walls = fields["wallids"].astype(np.int64)
        if len({*walls.tolist()} - number.keys()) != 6:
            raise CorruptFile(f"{path}: field wallids must name six bodies that are no grains, found {walls.tolist()}")
        order = [2 * axis + side for axis in axes for side in (0, 1)]
        number |= {int(walls[yade]): len(ids) + ours for ours, yade in enumerate(order)}
    try:
        bodies = [[number[int(body)] for body in row[:2]] for row in fields["contacts"]]
    except KeyError as error:
        known = "in ids" if "cell" in fields else "in ids nor in wallids"
        raise CorruptFile(
            f"{path}: a contact names body {error}, which is {'not' if 'cell' in fields else 'neither'} {known}"
        ) from None
    pairs = np.array(bodies, dtype=np.int64).reshape(-1, 2)
    return pairs[:, 0], pairs[:, 1]
