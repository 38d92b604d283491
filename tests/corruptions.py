"""Data that are wrong in known ways, in every form that rendulic reads: what audits must notice, or the docs must admit."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

import rendulic as rd
from rendulic.foundation.errors import RendulicError
from rendulic.probing.audits import increment, one_state
from rendulic.specimen.recorded import Recorded

REFERENCE = Path(os.environ.get("RENDULIC_REFERENCE", Path(__file__).parents[2] / "shared" / "reference")) / "yade-a"
PER_CONTACT = ("first", "second", "normal", "force_n", "force_t")


# --- what goes wrong ------------------------------------------------------------------------------------


def with_rows(snapshot, rows):
    """The same state with the contacts of these rows."""
    image = None if snapshot.image is None else snapshot.image[rows]
    return replace(snapshot, image=image, **{name: getattr(snapshot, name)[rows] for name in PER_CONTACT})


def medium(snapshot):
    """Row of the contact between grains whose force is the median."""
    between = np.flatnonzero(~snapshot.is_wall)
    order = np.argsort(snapshot.force_n[between])
    return int(between[order[len(order) // 2]])


def times(factor):
    return lambda one, other: replace(one, force_n=factor * one.force_n, force_t=factor * one.force_t)


def one_left_out(one, other):
    return with_rows(one, np.delete(np.arange(len(one.first)), medium(one)))


def half_left_out(one, other):
    """By the numbers of the bodies, so that the same contacts are left out of both states."""
    return with_rows(one, np.flatnonzero((one.first + one.second) % 2 == 0))


def normals_reversed(one, other):
    return replace(one, normal=-one.normal)


def one_normal_reversed(one, other):
    normal = one.normal.copy()
    normal[medium(one)] *= -1.0
    return replace(one, normal=normal)


def tangential_reversed(one, other):
    return replace(one, force_t=-one.force_t)


def shuffled(one, other):
    return replace(one, position=one.position[np.random.default_rng(1).permutation(one.n_grains)])


def wall_moved(one, other):
    faces = one.wall_position.copy()
    faces[1] += 1e-4 * one.lengths[0]
    return replace(one, wall_position=faces)


def in_millimetres(one, other):
    return replace(one, position=1e3 * one.position, radius=1e3 * one.radius, wall_position=1e3 * one.wall_position)


def contacts_of_the_other(one, other):
    return replace(one, image=other.image, **{name: getattr(other, name) for name in PER_CONTACT})


def one_twice(one, other):
    return with_rows(one, np.append(np.arange(len(one.first)), medium(one)))


CORRUPTIONS = {
    "forces ten times as large": times(10.0),
    "one contact left out": one_left_out,
    "all normals reversed": normals_reversed,
    "one normal reversed": one_normal_reversed,
    "tangential forces reversed": tangential_reversed,
    "centres shuffled among the grains": shuffled,
    "a wall moved by 1e-4 of the box": wall_moved,
    "lengths in millimetres": in_millimetres,
    "forces in kilonewtons": times(1e-3),
    "forces of the other sign": times(-1.0),
    "contacts of the other state (step)": contacts_of_the_other,
    "one contact listed twice": one_twice,
    "half of the contacts left out": half_left_out,
}


# --- the forms that data have: write(snapshot, which of the two states, path) gives what is read -----------


def own(snapshot, at, path):
    """As rendulic has it in memory, or reads from its states."""
    return snapshot


def neutral(snapshot, at, path):
    """The neutral file, through HDF5."""
    return rd.io.read(rd.io.write_snapshot(snapshot, path.with_suffix(".h5")))


def any_shape(snapshot, at, path):
    """Grains of which only forces, centres and normals are known, as of clumps."""
    return replace(snapshot, recorded=Recorded(are_spheres=False))


def plain_with_all(snapshot, at, path):
    """Plain text with forces on the walls, springs, friction and step."""
    return rd.io.read(rd.io.write_plain_text(snapshot, path))


def plain_with_least(snapshot, at, path):
    """Plain text with nothing that could be left out: no normals, no friction."""
    folder = rd.io.write_plain_text(replace(snapshot, recorded=None, friction=None), path)
    table = pd.read_csv(folder / "contacts.csv").drop(columns=["nx", "ny", "nz"])
    table.to_csv(folder / "contacts.csv", index=False, float_format="%.17g")
    return rd.io.read(folder)


def lammps(states, with_stress):
    """A dump with its contacts as LAMMPS would write these two states, columns v_wall1 to v_wall6 for the walls."""

    def write(snapshot, at, path):
        true, n, wall = states[at], snapshot.n_grains, snapshot.is_wall
        face = snapshot.second[wall] - n
        along = np.where(face % 2 == 0, -1.0, 1.0) * snapshot.normal[wall, face // 2]
        of_walls = np.zeros((n, 6))
        np.add.at(of_walls, (snapshot.first[wall], face), snapshot.force_n[wall] * along)
        heading = "id x y z radius v_wall1 v_wall2 v_wall3 v_wall4 v_wall5 v_wall6"
        grains = np.column_stack((np.arange(1, n + 1), snapshot.position, snapshot.radius, of_walls))
        if with_stress:
            pairs = ~true.is_wall
            stress = np.diag(true.force[pairs].T @ true.branch[pairs]) / true.volume
            grains, heading = np.hstack((grains, np.tile(stress, (n, 1)))), heading + " v_sxx v_syy v_szz"
        ids = np.column_stack((snapshot.first, snapshot.second))[~wall] + 1
        on_first = -np.hstack((snapshot.force_n[:, None] * snapshot.normal, snapshot.force_t))[~wall]
        local = "c_ids[1] c_ids[2] " + " ".join(f"c_force[{k}]" for k in range(1, 7))
        bounds = snapshot.wall_position.reshape(3, 2)
        for kind, names, rows, ending in (
            ("ATOMS", heading, grains, ".dump"),
            ("ENTRIES", local, np.hstack((ids, on_first)), ".contacts"),
        ):
            head = f"ITEM: TIMESTEP\n{true.recorded.step}\nITEM: NUMBER OF {kind}\n{len(rows)}\n"
            head += f"ITEM: BOX BOUNDS ff ff ff\n{lines(bounds)}ITEM: {kind} {names}\n"
            path.with_suffix(ending).write_text(head + lines(rows))
        return rd.io.lammps.read_snapshot(path.with_suffix(".dump"), friction=true.friction)

    return write


def lines(rows):
    return "".join(" ".join(f"{value:.17g}" for value in row) + "\n" for row in rows)


YADE_FILES = ("initial", "final_120")


def of_yade():
    """Two states of the reference run of Yade."""
    return tuple(rd.io.yade.read_snapshot(REFERENCE / f"{name}.npz") for name in YADE_FILES)


def yade(with_all):
    """The reference files of Yade with other grains, walls and contacts: all that the exporter writes, or the least."""

    def write(snapshot, at, path):
        with np.load(REFERENCE / f"{YADE_FILES[at]}.npz", allow_pickle=False) as archive:
            raw = {name: archive[name] for name in archive.files}
        axes, faces = np.array([1, 0, 2]), np.array([2, 3, 0, 1, 4, 5])
        body = np.concatenate((np.sort(raw["ids"]), raw["wallids"][faces])).astype(int)
        pairs = np.column_stack((body[snapshot.first], body[snapshot.second]))
        known = {frozenset(row[:2].astype(int).tolist()): row[2:4] for row in raw["contacts"]}
        stiffness = np.array([known.get(frozenset(pair), (0.0, 0.0)) for pair in pairs.tolist()])
        normal = snapshot.normal[:, axes]
        across = snapshot.force_t[:, axes]
        contacts = np.hstack((pairs, stiffness, snapshot.force_n[:, None] * normal, across, normal))
        place = raw["wallpos"].copy()
        place[faces, faces // 2] = snapshot.wall_position
        row = np.argsort(np.argsort(raw["ids"]))
        found = raw | {"pos": snapshot.position[row][:, axes], "rad": snapshot.radius[row], "wallpos": place}
        kept = ["ids", "pos", "rad", "wallids", "wallpos"]
        if with_all:
            kept += ["vel", "dt", "force", "wallforce"]
            found |= {"is_sphere": np.full(len(row), True), "friction": np.full(len(pairs), 0.7), "step": 1000 * at}
            kept += ["is_sphere", "friction", "step"]
        else:
            contacts[:, 2:4] = 0.0
        np.savez(path.with_suffix(".npz"), contacts=contacts, **{name: found[name] for name in kept})
        return rd.io.read(path.with_suffix(".npz"))

    return write


def sources(states):
    """Name of each form: its two states, and how it is written and read; those of Yade where the reference is."""
    found = {
        "rendulic, in memory": (states, own),
        "neutral file": (states, neutral),
        "plain text, all": (states, plain_with_all),
        "plain text, least": (states, plain_with_least),
        "LAMMPS, with its stress": (states, lammps(states, True)),
        "LAMMPS": (states, lammps(states, False)),
        "any shape": (states, any_shape),
    }
    if REFERENCE.is_dir():
        pair = of_yade()
        found |= {"Yade, exported": (pair, yade(True)), "Yade, by hand": (pair, yade(False))}
    return found


# --- what comes of it -------------------------------------------------------------------------------------

CLEARLY = (
    3.0  # times its limit, for an audit to be named: which side a number near its limit is on may depend on the machine
)


def outcome(pair, write, corrupt, in_both, folder):
    """ "refused" by a reader or for the two states together, or the audits of what was read."""
    wrong = [corrupt(pair[0], pair[1]) if in_both else pair[0], corrupt(pair[1], pair[0])]
    folder.mkdir()
    try:
        read = [write(snapshot, at, folder / f"state{at}") for at, snapshot in enumerate(wrong)]
        return rd.second_order_work(*read).audits
    except RendulicError:
        return "refused"


def is_caught(found):
    return found == "refused" or bool(found.failed)


def outcomes(states, folder):
    """By corruption, form, and whether both states are wrong."""
    return {
        (what, form, in_both): outcome(pair, write, corrupt, in_both, folder / f"{i}_{k}_{in_both}")
        for i, (form, (pair, write)) in enumerate(sources(states).items())
        for k, (what, corrupt) in enumerate(CORRUPTIONS.items())
        for in_both in (False, True)
    }


def table(found):
    """Markdown: what is caught, by corruption and form; then which audits catch it."""
    forms = list(dict.fromkeys(form for _, form, _ in found))
    rows = ["| what is wrong | " + " | ".join(forms) + " |", "|---" * (len(forms) + 1) + "|"]
    for what in CORRUPTIONS:
        cells = [_cell(found[what, form, False], found[what, form, True]) for form in forms]
        rows.append(f"| {what} | " + " | ".join(cells) + " |")
    rows += ["", "| what is wrong | audits that fail, in one form or another |", "|---|---|"]
    for what in CORRUPTIONS:
        each = [one for (name, *_), one in found.items() if name == what and one != "refused"]
        names = [name for one in each for name, audit in one.failed.items() if audit.residual > CLEARLY * audit.limit]
        refused = ["refused"] if any(one == "refused" for (name, *_), one in found.items() if name == what) else []
        rows.append(f"| {what} | {', '.join([f'`{name}`' for name in sorted(set(names))] + refused)} |")
    return "\n".join(rows)


def _cell(one, both):
    words = ["refused" if each == "refused" else "caught" if each.failed else "**not caught**" for each in (one, both)]
    return words[0] if words[0] == words[1] else f"{words[0]}; both: {words[1]}"


def power(n_tried=40):
    """Markdown: how small a single wrong contact may be and still be seen, in the forms of one state of Yade."""
    state = rd.io.yade.read_snapshot(REFERENCE / "initial.npz")
    forms = {
        "exported": state,
        "by hand": replace(state, recorded=Recorded(slack=state.recorded.slack)),
        "any shape": replace(state, recorded=Recorded(are_spheres=False)),
    }
    between = np.flatnonzero(~state.is_wall)
    mean = np.linalg.norm(state.force, axis=1).mean()
    chosen = np.random.default_rng(1).choice(between, n_tried, replace=False)
    size = state.force_n[chosen] / mean
    rows = [
        "| form | one contact left out: seen | down to, of the mean force | one force times 1.5: seen | down to |",
        "|---|---|---|---|---|",
    ]
    for form, snapshot in forms.items():
        cells = []
        for spoil in (without, enlarged):
            seen = np.array([bool(rd.audits(spoil(snapshot, row)).failed) for row in chosen])
            unseen = size[~seen].max(initial=0.0)
            cells += [f"{seen.sum()} of {n_tried}", f"{size[size > unseen].min():.2f}"]
        rows.append(f"| {form} | " + " | ".join(cells) + " |")
    return "\n".join(rows)


def without(snapshot, row):
    return with_rows(snapshot, np.delete(np.arange(len(snapshot.first)), row))


def enlarged(snapshot, row):
    force = snapshot.force_n.copy()
    force[row] *= 1.5
    return replace(snapshot, force_n=force)


# --- the page -------------------------------------------------------------------------------------------------

PAGE = Path(__file__).parents[1] / "docs" / "audits.md"
TABLES = {
    "audits": ("<!-- table: audits, made by python tests/corruptions.py -->", "<!-- end of the audits -->"),
    "corruptions": (
        "<!-- table: corruptions, made by python tests/corruptions.py -->",
        "<!-- end of the corruptions -->",
    ),
    "power": ("<!-- table: power, made by python tests/corruptions.py -->", "<!-- end of the power -->"),
}


def listed():
    """Markdown: every audit, what it compares and catches."""
    rows = ["| audit | compares | could catch |", "|---|---|---|"]
    rows += [f"| `{one.name}` | {one.compares} | {one.catches} |" for one in (*one_state.AUDITS, *increment.AUDITS)]
    return "\n".join(rows)


def on_page(name):
    start, end = TABLES[name]
    return PAGE.read_text(encoding="utf-8").split(start)[1].split(end)[0].strip()


def states_of(sample):
    """Before and after a strain probe of norm 1.2e-4."""
    before = sample.snapshot()
    sample.probe(np.array([1e-4, -5e-5, -5e-5]), 2000)
    return before, sample.snapshot()


def main():
    """Write the tables of the page."""
    import tempfile

    from conftest import FAST, packed_grains

    sample = packed_grains()
    sample.load(rd.paths.drained_triaxial(until_strain=0.01), speed=FAST)
    rd.dem.bring_to_rest(sample, "stress", FAST)
    with tempfile.TemporaryDirectory() as folder:
        made = {"audits": listed(), "corruptions": table(outcomes(states_of(sample), Path(folder))), "power": power()}
    text = PAGE.read_text(encoding="utf-8")
    for name, (start, end) in TABLES.items():
        text = f"{text.split(start)[0]}{start}\n\n{made[name]}\n\n{end}{text.split(end)[1]}"
    PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
