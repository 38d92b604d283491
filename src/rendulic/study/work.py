"""What each kind of unit does: from its inputs and the results it needs to its own."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rendulic.dem.assembly import Assembly
from rendulic.dem.drive.growth import pack
from rendulic.dem.drive.rest import bring_to_rest
from rendulic.foundation.errors import DidNotConverge, InvalidInput
from rendulic.foundation.progress import Progress, silent
from rendulic.loading import directions, paths
from rendulic.probing.anatomy import anatomy
from rendulic.probing.burst import bursts
from rendulic.probing.cone import cone_of, probe_to_edges
from rendulic.probing.probe import probe
from rendulic.study.language.config import Contact, Loading, ProbeSet
from rendulic.study.language.element import ElementStudy, follow_test
from rendulic.study.sands import around_and_within, sand_bursts, sand_map
from rendulic.study.store.store import Store
from rendulic.tensors.rendulic_plane import increment_along

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["carry_out", "merged", "part_of_directions"]

Parts = dict[str, Any]  # of State or xarray.Dataset
SOFTER = 0.2  # share of the directions of strain that stress probes should not go beyond
SAND_PRESSURE = 200e3  # Pa, of sands beside no grains


def carry_out(order: Mapping[str, Any], folder: str | Path, progress: Progress = silent, threads: int = 1) -> Parts:
    """The result of a unit, computed from what its folder holds; it is not written.

    Parameters
    ----------
    order : dict
        From `Unit.order`.
    folder : path
        Of the study.
    threads : int
        That probes may use; no result depends on it.

    Raises
    ------
    CorruptFile
        If a result it starts from is damaged.
    RendulicError
        If the mechanics does not get there.
    """
    store = Store(folder)
    needs = {role: store.read(key) for role, key in order["needs"].items()}
    return WORK[order["kind"]](order["inputs"], needs, progress, threads)


def _packing(inputs: Mapping, _needs: Mapping, progress: Progress, _threads: int) -> Parts:
    recipe = inputs["recipe"]
    sample = pack(
        recipe["n_grains"], (recipe["radius_min_m"], recipe["radius_max_m"]), recipe["pressure_pa"], seed=inputs["seed"],
        law=Contact(**inputs["contact"]).law(), density=recipe["density_kg_m3"], growth_friction=recipe["growth_friction"],
        porosity=recipe["porosity"], speed=Loading(**inputs["loading"]).speed(), progress=progress,
    )  # fmt: skip
    return {"state": sample.save()}


def _state(inputs: Mapping, needs: Mapping, progress: Progress, _threads: int) -> Parts:
    """Load to a stress ratio and bring it to rest."""
    sample = Assembly.from_state(needs["before"]["state"])
    speed, eta = Loading(**inputs["loading"]).speed(), inputs["eta"]
    left = _left(sample, inputs)
    path = paths.drained_triaxial(left, until_eta=eta, lateral_stress=inputs["lateral_stress_pa"])
    curve = sample.load(path, speed=speed, progress=progress)
    if curve.attrs["stopped_by"] != "eta":
        raise DidNotConverge(
            f"eta = {eta:g} was not reached within {inputs['axial_strain']:g} of axial strain (the largest was "
            f"{float(curve.eta.max()):.3f}): ask for smaller stress ratios or a larger strain"
        )
    rest = bring_to_rest(sample, "stress", speed, progress=progress)
    curve.attrs |= {"rest": "test paused, then constant stress", "crept": rest.crept.tolist()}
    return {"state": sample.save(), "curve": curve}


def _end(inputs: Mapping, needs: Mapping, progress: Progress, _threads: int) -> Parts:
    """The compression from the last state to the final strain."""
    sample = Assembly.from_state(needs["before"]["state"])
    path = paths.drained_triaxial(_left(sample, inputs), lateral_stress=inputs["lateral_stress_pa"])
    return {"curve": sample.load(path, speed=Loading(**inputs["loading"]).speed(), progress=progress)}


def _left(sample: Assembly, inputs: Mapping) -> float:
    left = inputs["axial_strain"] - float(sample.strain[0, 0])
    if left <= 0.0:
        raise DidNotConverge(
            f"axial_strain = {inputs['axial_strain']:g} ends before the last state, which is at {sample.strain[0, 0]:.4f}"
        )
    return left


def at_rest(needs: Mapping, damping: float) -> Assembly:
    """The state a unit starts from, damped as probes are."""
    sample = Assembly.from_state(needs["state"]["state"])
    sample.damping = damping
    return sample


def _probes(inputs: Mapping, needs: Mapping, progress: Progress, threads: int) -> Parts:
    """A batch of directions."""
    every = ProbeSet.model_validate(
        {"name": "batch", "step_deg": inputs["step_deg"], "sphere_directions": inputs["sphere_directions"]}
    ).directions()
    around = part_of_directions(every, inputs["first"], inputs["count"])
    return {
        "probes": probe(
            at_rest(needs, inputs["damping"]), around, inputs["norms"], inputs["n_steps"], kind=inputs["kind"],
            anatomy=inputs["anatomy"], workers=threads, progress=progress,
        )
    }  # fmt: skip


def part_of_directions(every: directions.Directions | directions.SphereDirections, first: int, count: int):
    """Some of the directions; weights on a sphere are shares of these."""
    chosen = slice(first, first + count)
    if isinstance(every, directions.Directions):
        return directions.Directions(every.alpha[chosen])
    weight = every.weight[chosen]
    return directions.SphereDirections(every.unit[chosen], weight / weight.sum())


def merged(
    every: directions.Directions | directions.SphereDirections, kind: str, batches: list[xr.Dataset]
) -> xr.Dataset:
    """Batches of probes as the one table that all directions together give."""
    import xarray as xr

    table = xr.concat(batches, every.dimension, data_vars="minimal", coords="minimal", compat="override")
    return table.assign_coords({name: coordinate for name, coordinate in every.coordinates(kind).items()})


def _cone(inputs: Mapping, needs: Mapping, progress: Progress, threads: int) -> Parts:
    """Probes that bracket the edges of a cone at all norms."""
    return {
        "probes": probe_to_edges(
            at_rest(needs, inputs["damping"]), directions.rendulic(inputs["step_deg"]), inputs["norms"], inputs["n_steps"],
            tolerance=inputs["tolerance_deg"], refine_smallest=True, workers=threads, progress=progress,
        )
    }  # fmt: skip


def _stress_probes(inputs: Mapping, needs: Mapping, progress: Progress, threads: int) -> Parts:
    """Stress probes as large as the stresses that answer strain probes in their softer directions."""
    answers = np.linalg.norm(needs["cone"]["probes"].d_sigma.sel(norm=inputs["norm"]).values, axis=-1)
    return {
        "probes": probe(
            at_rest(needs, inputs["damping"]), directions.rendulic(inputs["step_deg"]),
            float(np.quantile(answers, SOFTER)), inputs["n_steps"], kind="stress", workers=threads, progress=progress,
        )
    }  # fmt: skip


def _bursts(inputs: Mapping, needs: Mapping, progress: Progress, threads: int) -> Parts:
    """The table of bursts, and the curve of each, named by its number."""
    cone = cone_of(needs["cone"]["probes"].sel(norm=inputs["norm"]))
    around = around_and_within(cone, inputs["step_deg"])
    curves: Parts = {}

    def keep(alpha: float, curve: xr.Dataset) -> None:
        curves[f"burst_{len(curves)}"] = curve.assign_attrs(alpha=alpha)

    table = bursts(
        at_rest(needs, inputs["damping"]), around, inputs["norm"], inputs["n_steps"], cone=cone, workers=threads,
        progress=progress, on_burst=keep,
    )  # fmt: skip
    return {"bursts": table} | curves


def _dissection(inputs: Mapping, needs: Mapping, _progress: Progress, _threads: int) -> Parts:
    """The anatomy of a state's most unstable direction of those probed, with every contact."""
    batches = [needs[f"probes_{k}"]["probes"].sel(norm=inputs["norm"]) for k in range(len(needs) - 1)]
    w2n = np.concatenate([batch.w2_normalised.values for batch in batches])
    alpha = float(np.concatenate([batch.alpha.values for batch in batches])[int(np.nanargmin(w2n))])
    before = at_rest(needs, inputs["damping"])
    after = before.clone()
    after.probe(increment_along(alpha, inputs["norm"]), inputs["n_steps"])
    return {"anatomy": anatomy(before.snapshot(), after.snapshot()).assign_attrs(alpha=alpha)}


def _element_test(inputs: Mapping, _needs: Mapping, progress: Progress, _threads: int) -> Parts:
    study = ElementStudy.model_validate(
        {"material": inputs["material"], "model": inputs["model"], "test": [inputs["test"]]}
    )
    return {"curve": follow_test(study, study.test[0], progress)}


def _sand_map(inputs: Mapping, _needs: Mapping, _progress: Progress, _threads: int) -> Parts:
    return {"map": sand_map(inputs["sand"], inputs.get("pressure_pa", SAND_PRESSURE))}


def _sand_bursts(inputs: Mapping, _needs: Mapping, _progress: Progress, _threads: int) -> Parts:
    made = sand_bursts(inputs["sand"], inputs.get("pressure_pa", SAND_PRESSURE), inputs["eta"], inputs["step_deg"])
    if made is None:
        raise InvalidInput(f"sand {inputs['sand']} does not reach eta = {inputs['eta']:g}")
    return {"bursts": made}


WORK: dict[str, Callable[[Mapping, Mapping, Progress, int], Parts]] = {
    "packing": _packing, "state": _state, "end": _end, "probes": _probes, "cone": _cone, "stress_probes": _stress_probes,
    "bursts": _bursts, "dissection": _dissection, "element_test": _element_test, "sand_map": _sand_map,
    "sand_bursts": _sand_bursts,
}  # fmt: skip
