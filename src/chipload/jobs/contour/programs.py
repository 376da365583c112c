"""The programs of a result in RS-274 and as APT CL data; the first line states whether a program is verified."""

from __future__ import annotations

from chipload.jobs.contour.outcome import ContourResult, Operation
from chipload.jobs.contour.result import failures_of
from chipload.program.apt.writer import write_apt
from chipload.program.gcode.writer import write_gcode
from chipload.report.programs import ENDINGS, program_name


def program_files(outcome: ContourResult) -> dict[str, bytes]:
    """All programs by file name: each strategy of each operation for the controller and as CL data."""
    out: dict[str, bytes] = {}
    ending = ENDINGS[outcome.machine.dialect]
    for k, op in enumerate(outcome.operations):
        for name, strategy in op.result.strategies.items():
            stem, verified = program_name(k, name), name == op.result.use and not failures_of(outcome.machine, op, name)
            title = f"{outcome.title}, operation {k}, {op.result.kind}, {name}"
            text = write_gcode(
                strategy.program,
                outcome.machine,
                title=title,
                verified=verified,
                comments=_comments(outcome, op, name),
                number=min(9999, 100 * (k + 1) + list(op.result.strategies).index(name)),
            )
            out[f"{stem}.{ending}"] = text.encode("ascii")
            cl = write_apt(strategy.program, {op.cutter.number: op.cutter}, title=title, verified=verified)
            out[f"{stem}.apt"] = cl.encode("ascii")
        name, text = op.inserted
        if text:
            out[inserted_name(k, name)] = text.encode("utf-8")
    return out


def inserted_name(operation: int, name: str) -> str:
    """Name of the file of a program with inserted semi-finish passes."""
    return f"{operation}-semifinish-{name}"


def _comments(outcome: ContourResult, op: Operation, name: str) -> list[str]:
    """Comments for the machine operator: why not to run it, the tool, the zero."""
    c = op.cutter
    bad = failures_of(outcome.machine, op, name)
    out = [] if name == op.result.use else [f"not released: the job uses {op.result.use}"]
    out += [f"does not hold: {bad[0]}"] if bad else []
    out.append(f"T{c.number}: D {c.diameter:g} mm, {c.flutes} flutes, overhang {c.overhang:g} mm")
    out.append(f"Z 0 as in the job: top of stock {op.top:g} mm; machine {outcome.machine.name}")
    return out
