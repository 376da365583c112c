"""Programs with one thing wrong that their machine, cutter and stock show."""

from __future__ import annotations

from adversary.base import Case, changes, cutter, replaced

CASES = (
    Case("slot", "nothing: the base job", lambda job: None, "holds", ""),
    Case("rapid-through", "a rapid goes through the block", replaced("G1 X70 F900", "G0 X70"), "exceeds", "rapid-cuts"),
    Case(
        "plunge-not-centre-cutting",
        "an end mill without teeth at its centre plunges into solid material",
        changes(cutter(centre_cutting=False), replaced("G0 Z-2", "G0 X30 Z1\nG1 Z-2 F100\nX-10 F900")),
        "exceeds",
        "plunge",
    ),
)
