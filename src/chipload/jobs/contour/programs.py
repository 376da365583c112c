"""The programs of a result in RS-274 and as APT CL data, and the stock that remains; the first line of a program states
the verdict of the job.
"""

from __future__ import annotations

from chipload.cutter.cutter import Cutter
from chipload.jobs.contour.outcome import ContourResult
from chipload.machine.machine import Machine
from chipload.planning.result import OperationResult
from chipload.program.apt.writer import write_apt
from chipload.program.gcode.writer import write_gcode
from chipload.program.release import Release
from chipload.report.programs import ENDINGS, program_name
from chipload.result import Result, release_of


def program_files(outcome: ContourResult, result: Result) -> dict[str, bytes]:
    """All programs by file name: each strategy of each operation for the controller and as CL data; and the stock that
    a contour of one operation leaves.
    """
    out: dict[str, bytes] = {}
    ending = ENDINGS[outcome.machine.dialect]
    for k, op in enumerate(outcome.operations):
        for name, strategy in op.result.strategies.items():
            stem = program_name(k, name)
            release = release_of(result, f"{stem}.{ending}")
            text = program_text(outcome.title, outcome.machine, k, op.result, name, op.cutter, op.top, release)
            out[f"{stem}.{ending}"] = text.encode("ascii")
            release, title = release_of(result, f"{stem}.apt"), _title(outcome.title, k, op.result, name)
            cl = write_apt(strategy.program, {op.cutter.number: op.cutter}, title=title, release=release)
            out[f"{stem}.apt"] = cl.encode("ascii")
        name, text = op.inserted
        if text:
            out[inserted_name(k, name)] = text.encode("utf-8")
    if len(outcome.operations) == 1 and outcome.operations[0].result.kind != "pocket":
        (op,) = outcome.operations
        used = op.simulations.get(op.result.use)
        if used is not None and used.stock is not None:
            out["stock.npz"] = used.stock.to_bytes()
    return out


def inserted_name(operation: int, name: str) -> str:
    """Name of the file of a program with inserted semi-finish passes."""
    return f"{operation}-semifinish-{name}"


def program_text(
    title: str, machine: Machine, k: int, result: OperationResult, name: str, c: Cutter, top: float, release: Release
) -> str:
    """The text of the program of a strategy of operation ``k``; its lines do not depend on ``release``."""
    return write_gcode(
        result.strategies[name].program,
        machine,
        title=_title(title, k, result, name),
        release=release,
        comments=[
            f"T{c.number}: D {c.diameter:g} mm, {c.flutes} flutes, overhang {c.overhang:g} mm",
            f"Z 0 as in the job: top of stock {top:g} mm; machine {machine.name}",
        ],
        number=min(9999, 100 * (k + 1) + list(result.strategies).index(name)),
    )


def _title(title: str, k: int, result: OperationResult, name: str) -> str:
    return f"{title}, operation {k}, {result.kind}, {name}"
