"""A whole study in its folder: units, then files under names that people know, then figures."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rendulic import __version__
from rendulic.foundation.errors import CorruptFile, InvalidInput
from rendulic.study.draw import draw, needed_by
from rendulic.study.execution.executor import Executor
from rendulic.study.execution.local import LocalWorkers
from rendulic.study.execution.run import Outcome, Watch, run_units
from rendulic.study.language.config import Study
from rendulic.study.language.study_file import study_from, with_figures
from rendulic.study.plan import Plan, plan_of
from rendulic.study.products import write_products
from rendulic.study.results import Results
from rendulic.study.store.store import Store
from rendulic.study.store.unit import RESULTS, Unit

__all__ = ["Report", "recorded", "recorded_plan", "run_study"]

RECORD = "study.json"


@dataclass(frozen=True)
class Report:
    """What a run of a study has done.

    Parameters
    ----------
    results : Results
        To read from.
    outcome : Outcome
        Which units are finished, failed, blocked.
    products : list of Path
        States and tables.
    figures : dict of str to list of Path
        The files of each figure that could be drawn.
    not_drawn : list of str
        Figures that need units which are not finished.
    repaired : dict of str to CorruptFile
        Units that were damaged and made again.
    """

    results: Results
    outcome: Outcome
    products: list[Path]
    figures: dict[str, list[Path]]
    not_drawn: list[str]
    repaired: dict[str, CorruptFile]


def run_study(
    study: Study,
    folder: str | os.PathLike,
    *,
    figures: Iterable[str] | None = None,
    executor: Callable[[Path], Executor] = LocalWorkers,
    retry: bool = False,
    repair: bool = False,
    watch: Watch | None = None,
) -> Report:
    """Do all that a study asks for and that its folder does not hold yet.

    Parameters
    ----------
    study : Study
        From `read_study` or `preset`.
    folder : path
        Made if absent. Units found there are not repeated, whatever else has changed in the study.
    figures : iterable of str, optional
        Only what these need is done; by default all units, and the figures of the study.
    executor : callable
        Gives the workers for a folder.
    retry, watch
        As for `run_units`.
    repair : bool
        Whether finished units are read first, and those whose files are damaged made again.

    Raises
    ------
    InvalidInput
        If the folder cannot be written to, or another process works on it.
    CorruptFile
        If a finished result that a table or figure needs is damaged.
    RendulicError
        If a result cannot be kept; see `run_units`.
    """
    wanted = None if figures is None else list(figures)
    if wanted is not None:
        study = with_figures(study, wanted)
    plan = plan_of(study)
    units = _units(plan, wanted)
    store = Store(folder)
    with store.claimed():
        about = {"rendulic": __version__, "results": RESULTS, "figures": wanted}
        store.write_json(RECORD, about | {"study": study.model_dump(mode="json", exclude_unset=True)})
        repaired = store.damaged(store.keys() & set(units)) if repair else {}
        for key in repaired:
            store.remove(key)
        outcome = run_units(units, store, executor(store.folder), retry=retry, watch=watch)
        results = Results(plan, store)
        products = write_products(results, outcome.done) if study.figures.tables else []
        can = [name for name in study.figures.draw if all(unit.key in outcome.done for unit in needed_by(plan, name))]
        drawn = draw(results, can, store.folder)
    left = [name for name in study.figures.draw if name not in can]
    return Report(results, outcome, products, drawn, left, repaired)


def _units(plan: Plan, wanted: list[str] | None) -> dict[str, Unit]:
    if wanted is None:
        return plan.units
    return plan.needed_for(unit for name in wanted for unit in needed_by(plan, name))


def recorded(folder: str | os.PathLike) -> tuple[dict[str, Unit], Store]:
    """The units of the study that a folder was last run with, and its store; raises as `recorded_plan`."""
    _, units, store = recorded_plan(folder)
    return units, store


def recorded_plan(folder: str | os.PathLike) -> tuple[Plan, dict[str, Unit], Store]:
    """The plan of the study that a folder was last run with, those of its units that were asked for, and the store.

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
    return plan, _units(plan, found.get("figures")), store
