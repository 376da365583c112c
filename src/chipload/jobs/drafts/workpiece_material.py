"""Elastic constants of the workpiece of a draft whose file names no material: those of aluminium 7075, as guesses."""

from __future__ import annotations

from chipload.jobs.drafts.draft import Entry

#: Young's modulus [GPa] and Poisson's ratio of aluminium 7075-T6 (MIL-HDBK-5)
MODULUS_GPA, POISSON = 71.7, 0.33


def elastic_entries(reason: str = "aluminium 7075") -> tuple[Entry, Entry]:
    """Return modulus and Poisson's ratio as guesses with the reason of the first.

    >>> [(e.key, e.value) for e in elastic_entries()]
    [('modulus_gpa', 71.7), ('poisson', 0.33)]
    """
    return Entry("modulus_gpa", MODULUS_GPA, reason, True), Entry("poisson", POISSON, reason, True)
