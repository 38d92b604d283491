"""Whether carriers of negative second-order work cluster more than three controls do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rendulic.probing.anatomy_controls import CONTROLS, ClusterControls, cluster_controls
from rendulic.views.view import Table, View

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["COMPARED", "ControlsView", "cluster_controls_view", "controls_view"]

COMPARED = ("direction studied", *CONTROLS)
CAPTION = (
    "Do the contacts that carry half of the negative second-order work lie together? Left: Moran's I of contacts that share no grain "
    "but are joined by a third, in the direction studied and in three controls: the carriers of stable directions of the same "
    "state, contacts of positive work of like size, and carriers dealt out anew among contacts whose grains moved alike. Right: what "
    "each control leaves, with its interval, whose lower end chance exceeds in 5 % of cases. Carriers cluster where all three lie "
    "above zero."
)
HEADS = (
    "state",
    "packings",
    "α [°]",
    "Moran's I",
    *(f"less {name}" for name in CONTROLS),
    "left after all",
    "clustered",
)


@dataclass(frozen=True, kw_only=True, eq=False)
class ControlsView(View):
    """`rd.cluster_controls` by label of the state."""

    controls: Mapping[str, ClusterControls]

    def index_of(self, compared: str) -> np.ndarray:
        """(n_states,) Moran's I in the direction studied or in one of the controls."""
        own = np.array([one.index for one in self.controls.values()])
        if compared == COMPARED[0]:
            return own
        return own - self.left_by(compared)[:, 0]

    def left_by(self, control: str) -> np.ndarray:
        """(n_states, 3) what a control leaves, its lower and upper end."""
        k = CONTROLS.index(control)
        return np.array([(one.difference[k], one.low[k], one.high[k]) for one in self.controls.values()])


def cluster_controls_view(
    probes: Mapping[str, xr.Dataset | Sequence[xr.Dataset]], title: str = "", states: Mapping[str, str] | None = None
) -> ControlsView:
    """The view of probes with anatomy at one norm, of one packing or of several, by label; `states` names them for the table."""
    return controls_view({label: cluster_controls(one) for label, one in probes.items()}, title, states)


def controls_view(
    controls: Mapping[str, ClusterControls], title: str = "", states: Mapping[str, str] | None = None
) -> ControlsView:
    """The view of what is left by label of the state."""
    rows = [_row(label, one) for label, one in controls.items()]
    names = states or {}
    table = Table(
        "What is left of clustering", HEADS, rows, goes_to=[names.get(label, "") for label in controls] if names else ()
    )
    said = " ".join(f"{label}: {one.verdict}" if label else one.verdict for label, one in controls.items())
    return ControlsView(title=title, caption=CAPTION, verdict=said, tables=(table,), controls=dict(controls))


def _row(label: str, one: ClusterControls) -> tuple[str, ...]:
    ends = zip(one.difference, one.low, one.high, strict=True)
    asked = np.unique(np.round(one.alpha, 1))
    alpha = f"{asked[0]:g}" if len(asked) == 1 else f"{asked[0]:g} to {asked[-1]:g}"
    return (
        label, str(len(one.alpha)), alpha if np.isfinite(one.alpha).all() else "on the sphere", f"{one.index:.3f}",
        *(_interval(*each) for each in ends), _interval(*one.left),
        "undetermined" if one.least is None else "yes" if one.is_clustered else "not shown",
    )  # fmt: skip


def _interval(value: float, low: float, high: float) -> str:
    return f"{value:+.3f} [{low:+.3f}, {high:+.3f}]" if np.isfinite(low) else "missing"
