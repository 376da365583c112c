"""The programs of a result in RS-274 and as APT CL data; the first line states the verdict of the job."""

from __future__ import annotations

from chipload.jobs.contour.outcome import ContourResult, Operation
from chipload.program.apt.writer import write_apt
from chipload.program.gcode.writer import write_gcode
from chipload.report.programs import ENDINGS, program_name
from chipload.result import Result, release_of


def program_files(outcome: ContourResult, result: Result) -> dict[str, bytes]:
    """All programs by file name: each strategy of each operation for the controller and as CL data."""
    out: dict[str, bytes] = {}
    ending = ENDINGS[outcome.machine.dialect]
    for k, op in enumerate(outcome.operations):
        for name, strategy in op.result.strategies.items():
            stem = program_name(k, name)
            title = f"{outcome.title}, operation {k}, {op.result.kind}, {name}"
            text = write_gcode(
                strategy.program,
                outcome.machine,
                title=title,
                release=release_of(result, f"{stem}.{ending}"),
                comments=_comments(outcome, op),
                number=min(9999, 100 * (k + 1) + list(op.result.strategies).index(name)),
            )
            out[f"{stem}.{ending}"] = text.encode("ascii")
            release = release_of(result, f"{stem}.apt")
            cl = write_apt(strategy.program, {op.cutter.number: op.cutter}, title=title, release=release)
            out[f"{stem}.apt"] = cl.encode("ascii")
        name, text = op.inserted
        if text:
            out[inserted_name(k, name)] = text.encode("utf-8")
    return out


def inserted_name(operation: int, name: str) -> str:
    """Name of the file of a program with inserted semi-finish passes."""
    return f"{operation}-semifinish-{name}"


def _comments(outcome: ContourResult, op: Operation) -> list[str]:
    """Comments for the machine operator: the tool, the zero."""
    c = op.cutter
    return [
        f"T{c.number}: D {c.diameter:g} mm, {c.flutes} flutes, overhang {c.overhang:g} mm",
        f"Z 0 as in the job: top of stock {op.top:g} mm; machine {outcome.machine.name}",
    ]
