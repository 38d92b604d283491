"""Values that the TOML file of a study may hold, each with its bounds."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated

from pydantic import AfterValidator, Field

from rendulic.foundation.validation import Positive, Whole
from rendulic.foundation.whole_file import is_reserved
from rendulic.loading import directions

__all__ = [
    "MOST",
    "Damping",
    "Friction",
    "Name",
    "Names",
    "Norms",
    "Porosity",
    "Seeds",
    "Step",
    "Steps",
    "StressRatios",
    "VoidRatios",
    "different",
]

MOST = 10_000  # seeds, sets, specimens: a study that needs more is several studies


def different(values: tuple) -> tuple:
    """The values, if no two are equal."""
    if len(set(values)) < len(values):
        raise ValueError(f"values must differ from each other, got {', '.join(map(str, values))}")
    return values


def _increasing(eta: tuple[float, ...]) -> tuple[float, ...]:
    if not all(0.0 <= value < 3.0 for value in eta):
        raise ValueError(
            "stress ratios q/p must be numbers from 0 to below 3, the value of a compression without confinement"
        )
    if any(later - earlier < 0.01 for earlier, later in pairwise(eta)):
        raise ValueError("stress ratios must increase by at least 0.01, twice the tolerance to which they are reached")
    return eta


def _increasing_norms(norms: tuple[float, ...]) -> tuple[float, ...]:
    if not norms or list(norms) != sorted(set(norms)):
        raise ValueError("norms must be increasing")
    return norms


def _divides_the_circle(step: float) -> float:
    directions.rendulic(step)
    return step


def _of_files(name: str) -> str:
    """The name, if all systems let files and folders have it."""
    if is_reserved(name):
        raise ValueError(f"{name} is the name of a device on Windows, where no file can have it: choose another one")
    return name


Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]*$", max_length=40), AfterValidator(_of_files)]
Names = Annotated[tuple[Name, ...], Field(max_length=MOST), AfterValidator(different)]
Seeds = Annotated[
    tuple[Annotated[Whole, Field(ge=0, lt=2**63)], ...], Field(max_length=MOST), AfterValidator(different)
]
VoidRatios = Annotated[tuple[Annotated[Positive, Field(le=3)], ...], Field(max_length=MOST), AfterValidator(different)]
StressRatios = Annotated[
    tuple[Annotated[float, Field(strict=True)], ...], Field(max_length=300), AfterValidator(_increasing)
]
Norms = Annotated[tuple[Positive, ...], Field(max_length=100), AfterValidator(_increasing_norms)]
Step = Annotated[Positive, Field(ge=0.1), AfterValidator(_divides_the_circle)]
Friction = Annotated[float, Field(ge=0, le=10, allow_inf_nan=False, strict=True)]
Damping = Annotated[float, Field(ge=0, lt=1, strict=True)]
Porosity = Annotated[float, Field(gt=0.2, lt=0.6, strict=True)]
Steps = Annotated[Whole, Field(ge=1, le=100_000_000)]
