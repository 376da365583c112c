"""A job that holds, and changes of it of which each is one thing that a shop would call wrong.

The base job mills a slot 2 mm deep through a block of 60 x 40 x 20 mm of aluminium with an end mill of 10 mm. A
:class:`Case` changes one thing in it; :func:`end_of` runs the job and returns how it ends. A capability with a job of
its own states it as ``base``.

To add cases, make ``tests/adversary/<subject>_cases.py`` with a tuple ``CASES``, name it in ``subjects.py``, and run
``python benchmarks/adversary.py --page``.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import chipload
from chipload.errors import InputError
from chipload.result import Result, Verdict

#: ``unchecked``: the verdict may be `holds`, and the list of what was not checked names it
State = Literal["exceeds", "unproven", "refused", "unchecked", "holds"]

SLOT = """G21 G90 G17 G94
G54
T1 M6
G43 H1
S6000 M3
G0 X-10 Y20 Z10
G0 Z-2
G1 X70 F900
G0 Z10
M5
M2
"""
END_MILL: dict[str, Any] = {
    "number": 1, "diameter_mm": 10.0, "flutes": 3, "helix_deg": 30.0, "flute_length_mm": 26.0, "overhang_mm": 40.0,
    "modulus_gpa": 580.0,
}  # fmt: skip
DRILL: dict[str, Any] = {
    "number": 1, "diameter_mm": 6.0, "flutes": 2, "helix_deg": 30.0, "flute_length_mm": 60.0, "overhang_mm": 80.0,
    "modulus_gpa": 580.0, "bottom_deg": 31.0,
}  # fmt: skip
#: a machine table 10 mm below the block
TABLE = {"low_mm": (-200.0, -200.0, -60.0), "high_mm": (200.0, 200.0, -30.0)}


@dataclass
class Job:
    """Tables of a job and texts of the files beside it, which a case changes.

    Parameters
    ----------
    tables : of the job file
    files : text by name
    """

    tables: dict[str, Any] = field(default_factory=dict)
    files: dict[str, str | bytes] = field(default_factory=dict)

    @property
    def program(self) -> str:
        """Text of the program."""
        text = self.files["p.ngc"]
        assert isinstance(text, str)
        return text

    @program.setter
    def program(self, text: str) -> None:
        self.files["p.ngc"] = text

    @property
    def cutter(self) -> dict[str, Any]:
        """Keys of the first cutter."""
        keys: dict[str, Any] = self.tables["cutter"][0]
        return keys


Change = Callable[[Job], object]


def slot_job() -> Job:
    """The base job, which holds."""
    tables = {
        "program": {"file": "p.ngc"},
        "machine": {"name": "vmc"},
        "stock": {"low_mm": (0.0, 0.0, -20.0), "high_mm": (60.0, 40.0, 0.0)},
        "material": {"name": "al7075-t6"},
        "cutter": [dict(END_MILL)],
        "operation": [{"kind": "simulate", "step_mm": 2.0}],
        "limits": {"force_n": 1500.0, "torque_nm": 9.0},
    }
    return Job(tables, {"p.ngc": SLOT})


@dataclass(frozen=True)
class Case:
    """A job with one thing wrong, and how it must end.

    Parameters
    ----------
    name : of the case, unique
    wrong : what a shop would call wrong, in a sentence
    change : of the job
    state : of the result
    found : code of a finding, name of a limit, or words of the refusal or of what was not checked
    base : the job that is changed
    """

    name: str
    wrong: str
    change: Change
    state: State
    found: str
    base: Callable[[], Job] = slot_job


def program(text: str) -> Change:
    """Replace the program."""
    return lambda job: setattr(job, "program", text)


def replaced(old: str, new: str) -> Change:
    """Replace a piece of the program, which must be there."""

    def change(job: Job) -> None:
        assert old in job.program, old
        job.program = job.program.replace(old, new)

    return change


def cutter(**keys: Any) -> Change:
    """State keys of the cutter."""
    return lambda job: job.cutter.update(keys)


def stated(table: str, **keys: Any) -> Change:
    """State keys of a table of the job."""
    return lambda job: job.tables.setdefault(table, {}).update(keys)


def file(name: str, text: str | bytes) -> Change:
    """Put a file beside the job."""
    return lambda job: job.files.__setitem__(name, text)


def changes(*several: Change) -> Change:
    """Several changes, one after the other."""

    def change(job: Job) -> None:
        for one in several:
            one(job)

    return change


def end_of(case: Case, folder: Path) -> tuple[Result | None, str]:
    """The result of a case and no message, or no result and the message of the refusal."""
    job = copy.deepcopy(case.base())
    case.change(job)
    for name, content in job.files.items():
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    try:
        return chipload.run_job(job.tables, folder=folder).result, ""
    except InputError as refusal:
        return None, str(refusal)


def require_end(case: Case, folder: Path) -> None:
    """Assert that a case ends as it must."""
    result, refusal = end_of(case, folder)
    if case.state == "refused":
        assert case.found in refusal, refusal or (result and result.message)
        return
    assert result is not None, refusal
    if case.state == "unchecked":
        assert any(case.found in item for item in result.unchecked), result.unchecked
        return
    assert result.verdict.value == case.state, result.message
    if case.state != "holds":
        assert case.found in _causes(result, Verdict(case.state)), (result.message, _causes(result))


def _causes(result: Result, state: Verdict | None = None) -> set[str]:
    """Codes of findings and names of limits with a state; all without one."""
    findings = [*result.findings, *(f for track in result.in_use for f in track.findings)]
    codes = {f.code for f in findings if state is None or Verdict.of_finding(f) is state}
    return codes | {check.name for check in result.limits if state is None or check.state is state}
