"""Audits: independent numbers of one increment, held against each other, so that wrong data are noticed."""

from rendulic.probing.audits.audit import Audit, Audits
from rendulic.probing.audits.asking import audits

__all__ = ["Audit", "Audits", "audits"]
