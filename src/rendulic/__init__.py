"""Does a granular material fail, in which loading directions, and through which grains?

The workflow in five steps (a packing far too small for physics, so that it runs in seconds):

1. Make a packing at rest under an isotropic pressure.

>>> import rendulic as rd
>>> sample = rd.dem.pack(n_grains=60, radius=(8e-3, 12e-3), pressure=200e3, seed=1)
>>> round(sample.stress[0, 0] / 1e3)
200

2. Load it; the curve is an `xarray.Dataset`.

>>> curve = sample.load(rd.paths.drained_triaxial(until_strain=2e-3))
>>> curve.eta.units, curve.attrs["stopped_by"]
('1', 'strain')

3. Bring it to rest and keep the state; it reloads exactly.

>>> rest = rd.dem.bring_to_rest(sample)
>>> state = sample.save()

4. Probe it in all directions, each from that same state.

>>> probes = rd.probe(sample, rd.directions.rendulic(step=60), norm=1e-5, n_steps=200)
>>> probes.w2_normalised.sizes["alpha"]
6

5. Read the second-order work, macroscopic and at the contacts: an identity, to rounding.

>>> bool((probes.identity_residual < 1e-12).all())
True
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import lazy_loader

__version__ = "0.1.0"

# loaded on first use, so that importing is quick
_load, _, _public = lazy_loader.attach(
    __name__,
    submodules={"chang_hicher", "dem", "figures", "io", "micro", "tensors"},
    submod_attrs={
        "chang_hicher.model": ["ChangHicher"],
        "figures.plot": ["plot"],
        "foundation": ["errors"],
        "foundation.errors": ["RendulicError"],
        "loading": ["directions", "paths"],
        "loading.control": ["Control"],
        "probing.agreement": ["agreement"],
        "probing.amplitude": ["cones_by_amplitude"],
        "probing.anatomy": ["anatomy"],
        "probing.anatomy_controls": ["cluster_controls"],
        "probing.audits": ["audits"],
        "probing.bifurcation": ["bifurcation_map", "states_along"],
        "probing.burst": ["burst", "bursts"],
        "probing.cone": ["Cone", "cone_of", "instability_cone"],
        "probing.ensemble": ["cone_ensemble"],
        "probing.ensemble_response": ["ensemble_response"],
        "probing.of_snapshots": ["probes_of_snapshots"],
        "probing.path_work": ["w2_along"],
        "probing.probe": ["probe"],
        "probing.second_order_work": ["second_order_work"],
        "specimen.protocol": ["Specimen"],
        "specimen.snapshot": ["Snapshot"],
        "specimen.state": ["State"],
    },
)
__all__ = [*_public, "__version__"]


def __getattr__(name: str) -> Any:
    if name not in _public:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'; public names: {', '.join(_public)}")
    return _load(name)


def __dir__() -> list[str]:
    return __all__


if TYPE_CHECKING:
    from rendulic import chang_hicher, dem, figures, io, micro, tensors
    from rendulic.chang_hicher.model import ChangHicher
    from rendulic.figures.plot import plot
    from rendulic.foundation import errors
    from rendulic.foundation.errors import RendulicError
    from rendulic.loading import directions, paths
    from rendulic.loading.control import Control
    from rendulic.probing.agreement import agreement
    from rendulic.probing.amplitude import cones_by_amplitude
    from rendulic.probing.anatomy import anatomy
    from rendulic.probing.anatomy_controls import cluster_controls
    from rendulic.probing.audits import audits
    from rendulic.probing.bifurcation import bifurcation_map, states_along
    from rendulic.probing.burst import burst, bursts
    from rendulic.probing.cone import Cone, cone_of, instability_cone
    from rendulic.probing.ensemble import cone_ensemble
    from rendulic.probing.ensemble_response import ensemble_response
    from rendulic.probing.of_snapshots import probes_of_snapshots
    from rendulic.probing.path_work import w2_along
    from rendulic.probing.probe import probe
    from rendulic.probing.second_order_work import second_order_work
    from rendulic.specimen.protocol import Specimen
    from rendulic.specimen.snapshot import Snapshot
    from rendulic.specimen.state import State
