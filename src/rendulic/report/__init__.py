"""One self-contained page of a study: what was run, how far to trust it, what came out."""

from rendulic.report.page import write_report

__all__ = ["write_report"]
