"""How results show themselves in notebooks."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

__all__ = ["Shown"]


class Shown:
    """A result that notebooks show as a table, and that has a figure."""

    def _facts(self) -> Mapping[str, object]:
        """What there is to say, by its name."""
        raise NotImplementedError

    def _repr_html_(self) -> str:
        """A table of facts; whatever is in them is text."""
        rows = "".join(
            f'<tr><th style="text-align:left">{escape(name)}</th><td style="text-align:left">{escape(str(value))}</td></tr>'
            for name, value in self._facts().items()
        )
        return f"<table><caption>{escape(type(self).__name__)}</caption><tbody>{rows}</tbody></table>"

    def plot(self, title: str = "") -> Any:
        """The figure of this result; see `rd.plot`, which this asks: results know no figures.

        Returns
        -------
        matplotlib.figure.Figure
        """
        import rendulic

        return rendulic.plot(self, title)
