"""A whole study in its folder: its units, then files under names that people know."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rendulic import __version__
from rendulic.foundation.errors import CorruptFile, InvalidInput
from rendulic.study.execution.executor import Executor
from rendulic.study.execution.local import LocalWorkers
from rendulic.study.execution.run import Outcome, Watch, run_units
from rendulic.study.language.study import Study
from rendulic.study.language.study_file import study_from
from rendulic.study.plan import Plan, plan_of
from rendulic.study.products import write_products
from rendulic.study.results import Results
from rendulic.study.store.store import Store
from rendulic.study.store.unit import RESULTS, Unit

__all__ = ["StudyRun", "results_in", "run_study"]

RECORD = "study.json"


@dataclass(frozen=True)
class StudyRun:
    """What a run of a study has done.

    Parameters
    ----------
    results : Results
        To read from.
    outcome : Outcome
        Which units are finished, failed, blocked.
    products : list of Path
        States and tables.
    repaired : dict of str to CorruptFile
        Units that were damaged and made again.
    damaged : dict of str to CorruptFile
        Units that were finished and are damaged now; they count as missing.
    """

    results: Results
    outcome: Outcome
    products: list[Path]
    repaired: dict[str, CorruptFile]
    damaged: dict[str, CorruptFile]


def run_study(
    study: Study,
    folder: str | os.PathLike,
    *,
    only: Callable[[Plan], Iterable[Unit]] | None = None,
    executor: Callable[[Path], Executor] = LocalWorkers,
    retry: bool = False,
    repair: bool = False,
    watch: Watch | None = None,
) -> StudyRun:
    """Do all that a study asks for and that its folder does not hold yet.

    Parameters
    ----------
    study : Study
        From `read_study` or `preset`.
    folder : path
        Made if absent. Units found there are not repeated, whatever else has changed in the study.
    only : callable, optional
        Gives the units of the plan that are wanted; they and what they need are done. By default all units.
    executor : callable
        Gives the workers for a folder.
    retry, watch
        As for `run_units`.
    repair : bool
        Whether finished units whose files are damaged are made again. All are read first in any case; without `repair`
        they stay as they are, and are named in the result.

    Raises
    ------
    InvalidInput
        If the folder cannot be written to, or another process works on it.
    CorruptFile
        If a finished result is damaged while the study runs.
    RendulicError
        If a result cannot be kept; see `run_units`.
    """
    plan = plan_of(study)
    units = plan.units if only is None else plan.needed_for(only(plan))
    store = Store(folder)
    with store.claimed():
        about: dict[str, Any] = {"rendulic": __version__, "results": RESULTS}
        about["wanted"] = None if only is None else list(units)
        store.write_json(RECORD, about | {"study": study.model_dump(mode="json", exclude_unset=True)})
        damaged = store.damaged(store.keys() & set(units))
        repaired, damaged = (damaged, {}) if repair else ({}, damaged)
        for key in repaired:
            store.remove(key)
        outcome = run_units(units, store, executor(store.folder), retry=retry, watch=watch)
        results = Results(plan, store, units)
        results.done -= set(damaged)
        products = write_products(results) if study.figures.tables else []
    return StudyRun(results, outcome, products, repaired, damaged)


def results_in(folder: str | os.PathLike) -> Results:
    """The results of the study that a folder was last run with; `wanted` are the units that were asked for then.

    Raises
    ------
    InvalidInput
        If the folder holds no study, or one that this version does not read.
    """
    store = Store(folder)
    found: Any = store.read_json(RECORD)
    if not isinstance(found, dict) or not isinstance(found.get("study"), dict):
        raise InvalidInput(f"{store.folder} is not the folder of a study: it has no {RECORD} that can be read")
    if found.get("results") != RESULTS:
        raise InvalidInput(
            f"{store.folder} was written by rendulic {found.get('rendulic')}, whose results this version ({__version__}) does "
            "not read: use that version, or run the study again"
        )
    plan = plan_of(study_from(found["study"], str(store.folder / RECORD)))
    wanted = found.get("wanted")
    chosen = plan.units if wanted is None else {key: plan.units[key] for key in wanted if key in plan.units}
    return Results(plan, store, chosen)
