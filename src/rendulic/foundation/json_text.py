"""JSON from files, which may be anyone's."""

from __future__ import annotations

import json
from typing import Any

__all__ = ["read_json_text"]

DEEPEST = 64  # lists and tables within each other


def read_json_text(text: str | bytes) -> Any:
    """What JSON says.

    Raises
    ------
    ValueError
        If it is no JSON, or lists and tables are nested more than 64 deep.

    >>> read_json_text('{"eta": 0.3}')
    {'eta': 0.3}
    >>> read_json_text("[" * 100000)
    Traceback (most recent call last):
        ...
    ValueError: expected JSON, found lists and tables more than 64 deep
    """
    try:
        value = json.loads(text)
    except RecursionError:
        raise _too_deep() from None
    except ValueError as error:
        raise ValueError(f"expected JSON: {error}") from None
    level = [value]
    for _ in range(DEEPEST):
        level = [inner for each in level if isinstance(each, dict | list)
                 for inner in (each.values() if isinstance(each, dict) else each)]  # fmt: skip
        if not level:
            return value
    raise _too_deep()


def _too_deep() -> ValueError:
    return ValueError(f"expected JSON, found lists and tables more than {DEEPEST} deep")
