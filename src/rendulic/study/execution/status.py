"""How far a study is, told from its folder while it runs or later."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rendulic.study.execution.campaign import results_in
from rendulic.study.store.unit import Unit

__all__ = ["Status", "status_of"]


@dataclass(frozen=True)
class Status:
    """What of a study is done, running, failed and missing.

    Parameters
    ----------
    title : str
        Of the study, or the name of its folder.
    kinds : dict of str to (int, int)
        For each kind of unit how many are done, and how many there are.
    running : dict of Unit to list or None
        What a process works on now, with how much is done, of how much, and a note.
    failed : dict of Unit to str
        Why they failed.
    missing : list of Unit
        All others that are not done.
    others : int
        Results in the folder that belong to other versions of the study.
    """

    title: str
    kinds: Mapping[str, tuple[int, int]]
    running: Mapping[Unit, Sequence[Any] | None]
    failed: Mapping[Unit, str]
    missing: Sequence[Unit]
    others: int

    @property
    def done(self) -> int:
        """Units that are done."""
        return sum(done for done, _ in self.kinds.values())

    @property
    def total(self) -> int:
        """Units of the study."""
        return sum(total for _, total in self.kinds.values())


def status_of(folder: str | os.PathLike) -> Status:
    """How far the study of a folder is.

    Raises
    ------
    InvalidInput
        If the folder holds no study that this version reads.
    """
    results = results_in(folder)
    units, store = results.wanted, results.store
    found = store.keys()
    shares = (store.read_json("running.json") or {}) if store.is_claimed() else {}
    running = {units[key]: shares[key] for key in units if key in shares and key not in found}
    notes = store.failures()
    failed = {units[key]: note["error"] for key, note in notes.items() if key in units and key not in found}
    total = Counter(unit.kind for unit in units.values())
    done = Counter(unit.kind for key, unit in units.items() if key in found)
    return Status(
        title=results.study.title or store.folder.resolve().name,
        kinds={kind: (done[kind], count) for kind, count in total.items()},
        running=running,
        failed=failed,
        missing=[
            unit for key, unit in units.items() if key not in found and unit not in running and unit not in failed
        ],
        others=len(found - set(units)),
    )
