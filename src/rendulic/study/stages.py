"""The stages of a study of grains; each finished one is a file, and is found again."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from rendulic import __version__
from rendulic.dem.assembly import Assembly
from rendulic.dem.growth import pack
from rendulic.dem.rest import bring_to_rest
from rendulic.errors import DidNotConverge, InvalidInput
from rendulic.io.tables import read_dataset, write_dataset
from rendulic.loading import directions, paths
from rendulic.probing.probe import probe
from rendulic.progress import Progress
from rendulic.state import State
from rendulic.study.config import GrainStudy
from rendulic.whole_file import whole_file, writable_folder

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["at_rest", "claim", "file_of", "final_curve", "kept", "probes_at", "specimen_of", "state_at"]

RESULTS_SCHEMA = 1  # raised with every change of results: older stages are then not reused


def claim(folder: Path, study: GrainStudy) -> Path:
    """Make the folder this study's own."""
    record = writable_folder(folder) / "study.json"
    own = {"rendulic": __version__, "results": RESULTS_SCHEMA, "study": study.model_dump(mode="json")}
    found = record.read_text(encoding="utf-8") if record.exists() else None
    text = json.dumps(own, indent=1)
    if found is None:
        with whole_file(record) as temporary:
            temporary.write_text(text, encoding="utf-8")
    elif found != text:
        raise InvalidInput(
            f"{folder} holds the results of another study or version (see {record.name} in it): choose another folder"
        )
    return folder


def specimen_of(study: GrainStudy, folder: Path, progress: Progress) -> tuple[Assembly, bool]:
    """The packing, and whether it was made now."""
    path = folder / "specimen.h5"
    if path.exists():
        return Assembly.from_state(State.from_file(path)), False
    what = study.specimen
    sample = pack(
        what.n_grains,
        (what.radius_min_m, what.radius_max_m),
        what.pressure_pa,
        seed=what.seed,
        law=study.contact.law(),
        density=what.density_kg_m3,
        growth_friction=what.growth_friction,
        porosity=what.porosity,
        speed=study.loading.speed(),
        probe_damping=study.probes.damping,
        progress=progress,
    )
    sample.save().to_file(path)
    return sample, True


def file_of(folder: Path, what: str, eta: float, suffix: str) -> Path:
    return folder / f"{what}_eta_{eta:.3f}.{suffix}"


def state_at(
    study: GrainStudy, folder: Path, sample: Assembly, eta: float, anew: bool, progress: Progress
) -> tuple[xr.Dataset, bool]:
    """Load to a stress ratio and bring it to rest, or find that done; the curve, and whether it was made now."""
    state_path, curve_path = file_of(folder, "state", eta, "h5"), file_of(folder, "curve", eta, "nc")
    if not anew and state_path.exists() and curve_path.exists():
        sample.restore(State.from_file(state_path))
        return read_dataset(curve_path), False
    speed = study.loading.speed()
    lateral = study.specimen.pressure_pa
    left = study.loading.axial_strain - float(sample.strain[0, 0])
    path = paths.drained_triaxial(left, until_eta=eta, lateral_stress=lateral)
    curve = sample.load(path, speed=speed, progress=progress)
    if curve.attrs["stopped_by"] != "eta":
        raise DidNotConverge(
            f"eta = {eta:g} was not reached within {study.loading.axial_strain:g} of axial strain (the largest was "
            f"{float(curve.eta.max()):.3f}): ask for smaller stress ratios or a larger strain"
        )
    rest = bring_to_rest(sample, "stress", speed, progress=progress)
    curve.attrs |= {"rest": "test paused, then constant stress", "crept": rest.crept.tolist()}
    sample.save().to_file(state_path)
    write_dataset(curve, curve_path)
    return curve, True


def final_curve(
    study: GrainStudy, folder: Path, sample: Assembly, left: float, anew: bool, progress: Progress
) -> xr.Dataset:
    """The compression from the last state to the final strain."""
    path_left = paths.drained_triaxial(left, lateral_stress=study.specimen.pressure_pa)
    return kept(
        folder / "curve_final.nc",
        anew,
        lambda: sample.load(path_left, speed=study.loading.speed(), progress=progress),
    )


def probes_at(
    study: GrainStudy, folder: Path, eta: float, anew: bool, workers: int | None, progress: Progress
) -> xr.Dataset:
    """Probes of a state in all directions at all norms."""
    around = directions.rendulic(study.probes.step_deg)
    return kept(
        file_of(folder, "probes", eta, "nc"),
        anew,
        lambda: probe(
            at_rest(study, folder, eta),
            around,
            study.probes.norms,
            study.probes.n_steps,
            workers=workers,
            progress=progress,
        ),
    )


def at_rest(study: GrainStudy, folder: Path, eta: float) -> Assembly:
    """A finished state, damped as probes are."""
    sample = Assembly.from_state(State.from_file(file_of(folder, "state", eta, "h5")))
    sample.damping = study.probes.damping
    return sample


def kept(path: Path, anew: bool, make: Callable[[], xr.Dataset]) -> xr.Dataset:
    """A result from its file, or made and written there."""
    if path.exists() and not anew:
        return read_dataset(path)
    made = make()
    write_dataset(made, path)
    return made
