"""Audits: independent numbers of one increment, held against each other, so that wrong data are noticed."""

from rendulic.probing.audits.asking import audits
from rendulic.probing.audits.audit import Audit, Audits

__all__ = ["Audit", "Audits", "audits"]
