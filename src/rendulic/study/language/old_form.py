"""Files of studies as they were written before version 0.2, in today's words; read for one version, with a warning."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import tomlkit

from rendulic.foundation.errors import InvalidInput
from rendulic.loading.rate import NORM

__all__ = ["had_steps", "is_old_form", "new_form", "new_text", "with_rates"]

OLD_SECTIONS = ("packing", "test", "material", "model", "contact", "loading")
SETS = ("probes", "cones", "bursts")
HAD_STEPS = (*SETS, "stress_probes")


def is_old_form(table: Mapping[str, Any]) -> bool:
    """Whether a study's table is written in the old way.

    >>> is_old_form({"specimen": {"n_grains": 100}}), is_old_form({"specimen": [{"kind": "grains"}]})
    (True, False)
    """
    sets = [one for name in SETS for one in table.get(name, ()) if isinstance(one, dict)]
    return (
        any(name in table for name in OLD_SECTIONS)
        or isinstance(table.get("specimen"), dict)
        or any("packings" in one or "answering" in one for one in sets)
    )


def new_form(table: Mapping[str, Any], what: str) -> dict[str, Any]:
    """The same study in today's words.

    Raises
    ------
    InvalidInput
        If the old file is not well formed.
    """
    try:
        return _new_form(table)
    except (TypeError, KeyError, AttributeError, ValueError) as error:
        raise InvalidInput(
            f"{what}: this file is written as for rendulic 0.1 ([[packing]], [[test]], ...), and cannot be translated "
            f"({type(error).__name__}: {error}): write it anew, see rendulic init"
        ) from None


def _new_form(table: Mapping[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = {
        key: value for key, value in table.items() if key not in (*OLD_SECTIONS, *SETS, "specimen", "figures")
    }
    shared = table.get("specimen", {})
    specimens: list[dict[str, Any]] = []
    if isinstance(shared, list):
        specimens += shared
        shared = {}
    grains = {name: dict(table[name]) for name in ("contact", "loading") if name in table}
    for packing in table.get("packing", ()):
        own = dict(packing)
        specimens.append({"name": own.pop("name"), "kind": "grains", **shared, **own, **grains})
    sets: dict[str, list[dict[str, Any]]] = {}
    for name in SETS:
        for one in table.get(name, ()):
            own = {("specimens" if key == "packings" else key): value for key, value in one.items()}
            if "answering" in own:
                kept = {key: own[key] for key in ("name", "n_steps", "damping", "step_deg", "norm") if key in own}
                sets.setdefault("stress_probes", []).append({**kept, "cones": own["answering"]})
            else:
                sets.setdefault(name, []).append(own)
    sands, tests = _sands(table)
    found["specimen"] = specimens + sands
    found |= sets
    if tests:
        found["path"] = tests
    if "figures" in table:
        found["figures"] = dict(table["figures"])
    return {key: value for key, value in found.items() if value != []}


def _sands(table: Mapping[str, Any]) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """A sand for each pressure of the tests, and the tests as paths of these sands."""
    given, how = dict(table.get("material", {})), dict(table.get("model", {}))
    about: dict[str, Any] = {}
    if "preset" in given:
        about["preset"] = given.pop("preset")
    if given:
        about["material"] = given
    sands: dict[float, dict[str, Any]] = {}
    paths = []
    for test in table.get("test", ()):
        own = dict(test)
        pressure, void_ratio = float(own.pop("pressure_pa")), float(own.pop("void_ratio"))
        name = f"sand_{pressure / 1e3:g}kPa".replace(".", "_").replace("+", "")
        sand = sands.setdefault(
            pressure,
            {"name": name, "kind": "chang_hicher", **about, **how, "pressure_pa": pressure, "void_ratios": []},
        )
        if void_ratio not in sand["void_ratios"]:
            sand["void_ratios"].append(void_ratio)
        own["name"] = str(own.pop("name")).replace(".", "_")
        paths.append({"name": own.pop("name"), "specimens": [name], "void_ratios": [void_ratio], **own})
    return list(sands.values()), paths


def with_rates(table: Mapping[str, Any]) -> dict[str, Any]:
    """A study's table in which probes have a rate where they had `n_steps` up to the smallest of their norms.

    Entries that are wrong in other ways stay as they are: they are refused by name later.
    """
    cones = {one.get("name"): one for one in table.get("cones", ()) if isinstance(one, dict)}

    def with_rate(one: Any, name: str) -> Any:
        steps = one.get("n_steps") if isinstance(one, dict) else None
        if not isinstance(steps, int) or steps < 1:
            return one
        rest = {key: value for key, value in one.items() if key != "n_steps"}
        own = cones.get(one.get("cones"), {}) if name == "bursts" else one
        sizes = one.get("norm") if name == "bursts" and "norm" in one else own.get("norms", own.get("norm", NORM))
        smallest = sizes[0] if isinstance(sizes, list | tuple) and sizes else sizes
        # stress probes of cones have a size in Pa that is known only when they run
        return {**rest, "rate": smallest / steps} if isinstance(smallest, float) and name != "stress_probes" else rest

    return {
        key: [with_rate(one, key) for one in value] if key in HAD_STEPS and isinstance(value, list) else value
        for key, value in table.items()
    }


def had_steps(table: Mapping[str, Any]) -> bool:
    """Whether a study says how fast its probes are by a number of steps."""
    sets = [one for name in HAD_STEPS if isinstance(table.get(name), list) for one in table[name]]
    return any(isinstance(one, dict) and "n_steps" in one for one in sets)


def new_text(table: Mapping[str, Any]) -> str:
    """A study's table as the text of a TOML file."""
    document = tomlkit.document()
    for key, value in table.items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            tables = tomlkit.aot()
            for one in value:
                tables.append(_inlined(one))
            document.append(key, tables)
        elif isinstance(value, dict):
            document.append(key, _inlined(value))
        else:
            document.append(key, value)
    return tomlkit.dumps(document)


def _inlined(table: Mapping[str, Any]) -> tomlkit.items.Table:
    """A table whose own tables stand in one line each."""
    made = tomlkit.table()
    for key, value in table.items():
        if isinstance(value, dict):
            inner = tomlkit.inline_table()
            inner.update(value)
            made.append(key, inner)
        else:
            made.append(key, list(value) if isinstance(value, tuple) else value)
    return made
