"""Where in the grains the second-order work comes from, contact by contact: of [[probes]] with anatomy = true."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from rendulic.probing.anatomy import anatomy
from rendulic.probing.probe import probed_specimen
from rendulic.study.task import How, Parts, Task, at_rest
from rendulic.tensors.rendulic_plane import increment_along

__all__ = ["AnatomyOfState"]


class AnatomyOfState(Task):
    """The anatomy of a state's most unstable direction among those probed, with every contact."""

    work: ClassVar[str] = "anatomy"

    norm: float
    rate: float | None
    settle: bool
    damping: float

    def run(self, needs: Mapping[str, Parts], how: How) -> Parts:
        batches: list[Any] = [needs[f"probes_{k}"]["probes"].sel(norm=self.norm) for k in range(len(needs) - 1)]
        w2n = np.concatenate([batch.w2_normalised.values for batch in batches])
        alpha = float(np.concatenate([batch.alpha.values for batch in batches])[int(np.nanargmin(w2n))])
        before: Any = at_rest(needs, self.damping)
        after: Any = probed_specimen(before, increment_along(alpha, self.norm), self.rate, self.settle)
        return {"anatomy": anatomy(before.snapshot(), after.snapshot()).assign_attrs(alpha=alpha)}
