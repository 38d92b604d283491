"""Every kind of specimen that a study can have, and how each follows a path; a new kind has one entry in both."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from rendulic.foundation.progress import Progress, silent
from rendulic.loading.paths import Path
from rendulic.study.specimens.chang_hicher import SandSpecimen
from rendulic.study.specimens.grains import GrainsSpecimen, Loading

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["AnySpecimen", "follow"]

AnySpecimen = Annotated[GrainsSpecimen | SandSpecimen, Field(discriminator="kind")]


def follow(specimen: Any, path: Path, options: Mapping[str, Any], progress: Progress = silent) -> xr.Dataset:
    """Load a specimen along a path, in place; `options` are those of `load_options` of its section."""
    own = dict(options)
    if "loading" in own:
        own["speed"] = Loading(**own.pop("loading")).speed()
    return specimen.load(path, progress=progress, **own)
