"""Write the table of `docs/validation.md` from real runs: ``python docs/hooks/validation.py``.

Runs the checks against closed forms, invariants, second implementations and other codes, listens to every comparison that
they make, and notes the one that came closest to its tolerance.
"""

from __future__ import annotations

import datetime
import importlib
import inspect
import platform
import re
import sys
import tempfile
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "validation.md"
START, END = "<!-- table: made by `make validation` -->", "<!-- end of the table -->"
KINDS = {
    "analytic": "Against closed forms",
    "invariants": "Against what must be conserved, or the same",
    "convergence": "Against the order of the method",
    "parity": "Against second, plain implementations",
    "reference": "Against other codes",
}
LARGEST_TOLERANCE = 0.1  # what is compared with more than that is a bound, not an error
NUMBER = r"(?:np\.\w+\()?([-+]?[0-9.]+(?:e[-+]?\d+)?)\)?"
LESS = re.compile(rf"^(?:abs\([^()]*\) )?{NUMBER} <=? {NUMBER}(?:\s|$)")


@dataclass
class Check:
    """One test function: all of its cases."""

    kind: str
    about: str
    claim: str
    cases: int = 0
    skipped: str = ""
    failed: bool = False
    reached: float = 0.0
    allowed: float = 0.0

    def compare(self, reached: float, allowed: float) -> None:
        """Keep the comparison that used most of its tolerance."""
        if (
            0.0 < allowed <= LARGEST_TOLERANCE
            and reached >= 0.0
            and (not self.allowed or reached / allowed > self.reached / self.allowed)
        ):
            self.reached, self.allowed = reached, allowed


class Listener:
    """A pytest plugin that hears every numerical comparison."""

    def __init__(self) -> None:
        self.checks: dict[str, Check] = {}
        self.lines: list[str] = []
        self.now: Check | None = None
        self.listen_to_numpy()

    def listen_to_numpy(self) -> None:
        """Note how far `assert_allclose` was from its tolerance, before the tests import it."""
        import numpy as np

        plain = np.testing.assert_allclose

        def assert_allclose(actual: Any, desired: Any, rtol: float = 1e-7, atol: float = 0.0, **options: Any) -> None:
            plain(actual, desired, rtol=rtol, atol=atol, **options)
            found, wanted = np.broadcast_arrays(np.asarray(actual, float), np.asarray(desired, float))
            error, limit = abs(found - wanted), atol + rtol * abs(wanted)
            usable = np.isfinite(error) & (limit > 0.0)
            if self.now is None or not usable.any():
                return
            worst = np.argmax(np.where(usable, error / np.where(usable, limit, 1.0), -1.0))
            # relative where the tolerance is, so that numbers of any unit can stand in one table
            scale = abs(wanted.flat[worst]) if rtol * abs(wanted.flat[worst]) > atol else 1.0
            self.now.compare(float(error.flat[worst] / scale), float(limit.flat[worst] / scale))

        np.testing.assert_allclose = assert_allclose

    def pytest_runtest_setup(self, item: Any) -> None:
        """The check that is spoken of from now on."""
        name = item.nodeid.split("[")[0]
        if name not in self.checks:
            module = inspect.getdoc(item.module) or ""
            named = item.name.split("[")[0].removeprefix("test_").replace("_", " ")
            claim = " ".join((inspect.getdoc(item.function) or named).split("\n\n")[0].split())
            self.checks[name] = Check(item.path.parent.name, module.split("\n")[0].rstrip("."), claim)
        self.now = self.checks[name]

    def pytest_assertion_pass(self, item: Any, lineno: int, orig: str, expl: str) -> None:
        """A plain `assert a < b` with numbers."""
        found = LESS.match(expl)
        if self.now is not None and found:
            self.now.compare(float(found[1]), float(found[2]))

    def pytest_runtest_logreport(self, report: Any) -> None:
        """What came of one case."""
        check = self.checks.get(report.nodeid.split("[")[0])
        if check is None:
            return
        if report.failed:
            check.failed = True
        elif report.skipped:
            check.skipped = str(report.longrepr[2]).removeprefix("Skipped: ") if report.longrepr else "skipped"
        elif report.when == "call":
            check.cases += 1

    def pytest_terminal_summary(self, terminalreporter: Any, config: Any) -> None:
        """The lines that tests say about other codes."""
        conftest = next(
            p
            for p in config.pluginmanager.get_plugins()
            if hasattr(p, "pytest_terminal_summary") and hasattr(p, "_LINES")
        )
        self.lines = list(config.stash[conftest._LINES])


def table(listener: Listener) -> str:
    """Markdown: one table for each kind, one row for each check."""
    checks = list(listener.checks.values())
    held = sum(not check.failed and check.cases > 0 for check in checks)
    python = f"Python {platform.python_version()} on {platform.machine()}"
    libraries = ", ".join(f"{name} {version(name)}" for name in ("numpy", "numba", "scipy", "xarray"))
    parts = [
        f"{datetime.date.today():%d %B %Y}, rendulic {importlib.import_module('rendulic').__version__}, {python}, {libraries}: "
        f"{sum(check.cases for check in checks)} cases of {len(checks)} checks, {held} hold.\n\n"
    ]
    if listener.lines:
        parts.append("In numbers, against other codes:\n\n" + "".join(f"- {line}\n" for line in listener.lines) + "\n")
    for kind, heading in KINDS.items():
        parts.append(f"## {heading}\n\n| what is claimed | cases | reached | allowed |\n|---|---|---|---|\n")
        about = ""
        for check in (one for one in checks if one.kind == kind):
            if check.about != about:
                about = check.about
                parts.append(f"| **{_cell(about)}** | | | |\n")
            parts.append(f"| {_cell(check.claim)} | {check.cases or ''} | {_reached(check)} |\n")
        parts.append("\n")
    return "".join(parts)


def _reached(check: Check) -> str:
    if check.failed:
        return "**fails** | "
    if not check.cases:
        return f"not run: {_cell(check.skipped)} | "
    if not check.allowed:
        return "holds | "
    return f"{check.reached:.1e} | {check.allowed:.1e}" if check.reached else f"0 | {check.allowed:.1e}"


def _cell(text: str) -> str:
    return text.replace("|", r"\|").replace("$", r"\$")


def main() -> int:
    """Run, and write the table into the page."""
    import pytest

    # assertions are heard only where pytest has compiled the tests to tell
    sys.pycache_prefix = tempfile.mkdtemp()
    listener = Listener()
    folders = [str(ROOT / "tests" / kind) for kind in KINDS]
    options = [
        "-q",
        "-p",
        "no:cacheprovider",
        "-o",
        "enable_assertion_pass_hook=true",
        f"--rootdir={ROOT}",
    ]
    outcome = pytest.main([*options, *folders], plugins=[listener])
    text = PAGE.read_text(encoding="utf-8")
    before, after = text.split(START)[0], text.split(END)[1]
    PAGE.write_text(f"{before}{START}\n\n{table(listener)}{END}{after}", encoding="utf-8")
    return int(outcome)


if __name__ == "__main__":
    sys.exit(main())
