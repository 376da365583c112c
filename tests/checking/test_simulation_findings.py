"""What findings of a removal do to the verdict of a program."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from chipload.checking.outcome import CollisionCheck, StockCheck
from chipload.checking.result import simulation_findings
from chipload.errors import Finding, Severity


def test_a_rapid_that_cuts_exceeds_and_is_listed_once() -> None:
    findings = (Finding("rapid-cuts", 3, "a rapid goes through material"), Finding("comment", 6, "a note"))
    removal = SimpleNamespace(findings=findings, columns={"chip_max_mm": []})
    checks = SimpleNamespace(material=SimpleNamespace(chip=None, speed=None, learned=None), off=(), cutters={})
    # the columns of the stock have found the same rapid and one more
    again = tuple(Finding("rapid-cuts", line, "a rapid goes through material", Severity.EXCEEDS) for line in (3, 9))
    simulation: Any = SimpleNamespace(
        removal=removal,
        collisions=CollisionCheck(stock=StockCheck(again)),
        workpiece=None,
        checks=checks,
        skipped=None,
    )
    found = [(f.code, f.line, f.severity) for f in simulation_findings(simulation)]
    rapids = [("rapid-cuts", line, Severity.EXCEEDS) for line in (3, 9)]
    assert found == [rapids[0], ("comment", 6, Severity.NOTE), rapids[1]]
