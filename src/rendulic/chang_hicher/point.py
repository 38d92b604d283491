"""A material point of the Chang-Hicher model: a `Specimen`. The face of the folder: nothing below imports it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from rendulic.chang_hicher.checking import check_state
from rendulic.chang_hicher.drive import controllability, following, refinement
from rendulic.chang_hicher.drive.integration import LEAST_RECORDS, TOLERANCE
from rendulic.chang_hicher.law.plane_model import PlaneModel
from rendulic.chang_hicher.measure.planes import plane_stresses
from rendulic.chang_hicher.state import ARRAYS, PointState
from rendulic.foundation.checks import finite_array
from rendulic.foundation.errors import CorruptFile, InvalidInput, one_of
from rendulic.foundation.progress import Progress, silent
from rendulic.foundation.whole_change import whole_change
from rendulic.loading.paths import Path
from rendulic.specimen.state import State

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["KIND", "MaterialPoint"]

KIND = "Chang-Hicher point"


class MaterialPoint(PointState):
    """One state of a sand, made by `ChangHicher.at`, and what can be done with it; parameters as for `PointState`."""

    def planes(self) -> dict[str, np.ndarray]:
        """Normal stress, shear stress (Pa) and normalised obliquity x of every plane, (n,) each."""
        return plane_stresses(self)

    @whole_change
    def load(
        self,
        path: Path,
        *,
        tolerance: float = TOLERANCE,
        least_records: int = LEAST_RECORDS,
        progress: Progress = silent,
        on_record: Callable[[MaterialPoint], None] | None = None,
    ) -> xr.Dataset:
        """Follow a path, in place, with every event on the way.

        1. Stresses that the path holds at other values are brought there first, driven strains at rest.
        2. The driven strains advance; each step is as long as the tolerance admits, and ends where a
           plane begins or ceases to load.
        3. The path ends at its strain, stress ratio or peak, or where no quasi-static continuation
           exists: `stopped_by` then says "loss of controllability", "plastic limit" (only formulations
           that are not defined beyond), "no stress left", "no voids left" or "no critical void ratio left" (Eq. 34
           gives none at a mean stress so high). The point stays there. The
           bound of strain (`Until`) holds for any axis while stresses are brought to their places.

        Cycles of loading are beyond the model: within the elastic range a closed one gains or loses energy, and undrained ones
        neither build up pore pressure nor degrade the sand.

        Parameters
        ----------
        path : Path
            E.g. `rd.paths.constant_volume(0.2)`.
        tolerance : float
            Error per step, relative to the stress, and to the elastic strain of that stress.
        least_records : int
            At least so many along the path; short steps add more.
        progress, on_record : callable, optional
            Called now and then.

        Returns
        -------
        xarray.Dataset
            Dimension `record` (two records at one strain where a plane changes sides): the curve
            (`rendulic.specimen.curve`), with `w2` per squared axial strain rate in Pa, determinants and Hill's
            eigenvalue; `plane`: local stresses, strains and W2; `event`: what happened where. See `drive.point_curve`.

        Raises
        ------
        InvalidInput
            If the control is impossible from the first step on, or an option is out of range.
        """
        return following.load(self, path, tolerance, least_records, progress, on_record)

    @whole_change
    def probe(
        self,
        increment: np.ndarray,
        n_steps: int = 1,
        *,
        kind: str = "strain",
        marks: tuple[float, ...] = (1.0,),
        on_mark: Callable[[float], None] | None = None,
    ) -> None:
        """Impose a principal strain or stress increment (3,), in place.

        Each part between two marks is integrated to `TOLERANCE` with steps that the integration chooses. A stress
        increment that the point cannot carry is followed as far as it goes; the remaining marks are called there.

        Parameters
        ----------
        increment : (3,) array
            Of strain, or of stress in Pa.
        n_steps : int
            Taken because every specimen takes it: for grains it sets the rate. The model has no rate, so that any
            number gives the same bits and costs the same.
        kind : {"strain", "stress"}
            What is imposed.
        marks : tuple of float
            Increasing shares of the increment, the last one 1.
        on_mark : callable, optional
            Called at every mark with the share.

        Raises
        ------
        InvalidInput
            If kind, increment or marks are not of these.
        """
        one_of(kind, ("strain", "stress"), "kind of probe")
        following.probe(self, finite_array("increment", increment, (3,)), kind, marks, on_mark)

    @whole_change
    def burst(
        self,
        direction: np.ndarray,
        norm: float,
        n_steps: int = 1,
        *,
        hold_steps: int = 1,
        on_window: Callable[..., None] | None = None,
    ) -> xr.Dataset:
        """Increase the load conjugate to a direction a little, in place; see `drive.controllability.burst`.

        Parameters
        ----------
        direction, norm
            As there.
        n_steps, hold_steps, on_window
            Taken because every specimen takes them: without inertia there is no push of a duration, no motion and no window to
            watch, and all of them change nothing.
        """
        return controllability.burst(self, direction, norm)

    def clone(self) -> MaterialPoint:
        """An independent point in the same state."""
        return MaterialPoint(self.model, self.void_ratio_0, **self.arrays())

    def refined(self) -> MaterialPoint:
        """This state on at least 2.5 times as many contact planes; what the error of the sphere rule is measured with.

        Stress, strain and void ratio are the same; see `drive.refinement.refined`.
        """
        other = refinement.refined(self)
        return MaterialPoint(other.model, other.void_ratio_0, **other.arrays())

    def save(self) -> State:
        """The whole state, exact to the bit, with the model."""
        attributes, arrays = self.model.save()
        return State(KIND, self.arrays() | arrays, attributes | {"void_ratio_0": self.void_ratio_0})

    @whole_change
    def restore(self, state: State) -> None:
        """Return to a saved state of this or of any other point, exactly; the model comes with it."""
        self.__dict__.update(MaterialPoint.from_state(state).__dict__)

    @classmethod
    def from_state(cls, state: State) -> MaterialPoint:
        """The point that a state describes; the state is all that is needed.

        Raises
        ------
        InvalidInput
            If it is not the state of such a point.
        CorruptFile
            If something is missing or impossible in it: the field and the row are named.
        """
        state.expect_kind(KIND)
        check_state(state.arrays, state.attributes)
        try:
            model = PlaneModel.from_saved(state.attributes, state.arrays)
        except InvalidInput as error:
            raise CorruptFile(f"the state of a Chang-Hicher point: {error}") from None
        return cls(model, state.attributes["void_ratio_0"], **{name: state.arrays[name].copy() for name in ARRAYS})
