"""Circular diagrams of the normalised second-order work (Fig. 3 of the paper)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rendulic.foundation.errors import InvalidInput
from rendulic.tensors.rendulic_plane import AXIAL_COMPRESSION, ISOCHORIC_COMPRESSION, ISOTROPIC_COMPRESSION
from rendulic.views.view import Mark, Table, View

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["CENTRE", "LANDMARKS", "Around", "CircularDiagram", "CircularPanels", "circular_diagram", "circular_panels"]

CENTRE = -1.0  # W2n at the centre of a diagram; the rim is at 1, the dashed circle at 0
LANDMARKS = {
    "isotropic compression": ISOTROPIC_COMPRESSION,
    "axial compression": AXIAL_COMPRESSION,
    "undrained compression": ISOCHORIC_COMPRESSION,
    "isotropic extension": ISOTROPIC_COMPRESSION + 180.0,
    "axial extension": AXIAL_COMPRESSION + 180.0,
    "undrained extension": ISOCHORIC_COMPRESSION + 180.0,
}
CAPTION = (
    "Normalised second-order work W2n by direction of the imposed increment in the Rendulic plane: -1 at the centre, 0 on the "
    "dashed circle, 1 at the rim. Second-order work is negative within the dashed circle. The sign of an open dot is not sure."
)


@dataclass(frozen=True, eq=False)
class Around:
    """The answer of one state in all directions.

    Parameters
    ----------
    label : str
        Of the curve.
    alpha : (n,) array
        Directions in degrees, increasing.
    w2_normalised : (n,) array
        In [-1, 1].
    is_significant : (n,) array of bool
        Whether the sign is larger than its error.
    state : str
        Which state it is, for figures that move together; the label if empty.
    """

    label: str
    alpha: np.ndarray
    w2_normalised: np.ndarray
    is_significant: np.ndarray
    state: str = ""

    @property
    def smallest(self) -> int:
        """Index of the smallest value."""
        return int(np.nanargmin(self.w2_normalised))


@dataclass(frozen=True, kw_only=True, eq=False)
class CircularDiagram(View):
    """One closed curve for each state, light to dark in their order."""

    curves: tuple[Around, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class CircularPanels(View):
    """Diagrams side by side."""

    panels: Mapping[str, CircularDiagram]
    columns: int = 2


def circular_diagram(
    probes: Mapping[str, xr.Dataset], title: str = "", states: Mapping[str, str] | None = None
) -> CircularDiagram:
    """The diagram of probes at one norm.

    Parameters
    ----------
    probes : mapping of label to xarray.Dataset
        From `rd.probe` at one norm, directions all around, in the order to be drawn.
    title : str
        Above.
    states : mapping of label to str, optional
        The state of each label, where the label does not name it.

    Raises
    ------
    InvalidInput
        If there are no probes, or they are of several norms or not in the Rendulic plane.
    """
    curves = tuple(_around(label, data, (states or {}).get(label, label)) for label, data in probes.items())
    if not curves:
        raise InvalidInput("a circular diagram needs the probes of at least one state, got none")
    return CircularDiagram(
        title=title, caption=CAPTION, verdict=_verdict(curves), tables=(_table(curves),), curves=curves
    )


def circular_panels(
    panels: Mapping[str, Mapping[str, xr.Dataset]], title: str = "", columns: int = 2
) -> CircularPanels:
    """Diagrams side by side, each with its heading and its own states; see `circular_diagram`."""
    made = {heading: circular_diagram(probes, heading) for heading, probes in panels.items()}
    return CircularPanels(title=title, caption=CAPTION, panels=made, columns=columns)


def _around(label: str, data: xr.Dataset, state: str) -> Around:
    if data.w2_normalised.dims != ("alpha",):
        raise InvalidInput(
            "a circular diagram needs probes in the Rendulic plane at one norm, got dimensions "
            f"{', '.join(map(str, data.w2_normalised.dims))}: select a norm with probes.sel(norm=...)"
        )
    data = data.sortby("alpha")
    return Around(label, data.alpha.values, data.w2_normalised.values, data.is_significant.values, state)


def _verdict(curves: tuple[Around, ...]) -> str:
    """Which states have a direction of surely negative work."""
    sure = [one.label for one in curves if ((one.w2_normalised < 0.0) & one.is_significant).any()]
    if not sure:
        return "Second-order work is not surely negative in any direction that was probed."
    return f"Second-order work is negative in some directions at {', '.join(sure)}."


def _table(curves: tuple[Around, ...]) -> Table:
    rows: list[tuple[str, ...]] = []
    marks: list[Mark] = []
    for one in curves:
        work, sure = float(one.w2_normalised[one.smallest]), bool(one.is_significant[one.smallest])
        rows.append((
            one.label, f"{work:+.3f}", f"{one.alpha[one.smallest]:g}", str(int((one.w2_normalised < 0.0).sum())),
            "yes" if sure else "no",
        ))  # fmt: skip
        marks.append("doubtful" if not sure else "bad" if work < 0.0 else "")
    heads = ("state", "smallest W2n", "at α [°]", "directions with W2 < 0", "sign is sure")
    states = [one.state or one.label for one in curves]
    return Table("Smallest normalised second-order work", heads, rows, goes_to=states, marks=marks)
