"""The result of a part that is cut in several setups: one operation and one track for each."""

from __future__ import annotations

from dataclasses import replace

from chipload.checking.result import checked_result
from chipload.errors import Finding, Severity
from chipload.jobs.program.outcome import SetupsProgram
from chipload.number_text import number_text
from chipload.result import Provenance, Result, SurfaceMap, Track, Verdict


def setup_name(number: int) -> str:
    """Return the name of a setup, from 0, and of its track.

    >>> setup_name(0)
    'setup 1'
    """
    return f"setup {number + 1}"


def setup_file(number: int) -> str:
    """Return the name of the CL data of a setup."""
    return f"{number}-program.apt"


def result_of_setups(program: SetupsProgram) -> Result:
    """Return the result of all setups. What is cut from an unproven stock is unproven."""
    own = [checked_result(one) for one in program.setups]
    tracks: list[Track] = []
    maps: list[SurfaceMap] = []
    findings: list[Finding] = []
    unchecked: list[str] = []
    files: dict[str, str] = {}
    sure = True
    for k, result in enumerate(own):
        name = setup_name(k)
        for track in result.tracks:
            before = (
                Finding("setup-before", 0, "an earlier setup is not proven, and so is the stock", Severity.UNPROVEN),
            )
            tracks.append(
                replace(
                    track, name=name, operation=k, programs=(setup_file(k),),
                    limits=tuple(replace(check, track=name) for check in track.limits),
                    findings=(*track.findings, *(() if sure else before)),
                )
            )  # fmt: skip
        sure = sure and result.verdict is Verdict.HOLDS
        maps += [replace(one, name=f"{name}, {one.name}", track=name) for one in result.maps]
        findings += [replace(f, text=f"{name}: {f.text}") for f in result.findings]
        for text in result.unchecked:
            # what no setup checks needs no name
            own_text = text if all(text in one.unchecked for one in own) else f"{name}: {text}"
            unchecked += [own_text] if own_text not in unchecked else []
        for what, of in result.provenance.inputs.items():
            if files.setdefault(what, of) != of:
                files[f"{name}, {what}"] = of
    first = own[0]
    times = ", ".join(f"{setup_name(k)} {number_text(one.seconds.sum())} s" for k, one in enumerate(program.setups))
    return Result(
        capability="program",
        title=first.title,
        tracks=tuple(tracks),
        operations=tuple({**numbers, "setup": k + 1} for k, one in enumerate(own) for numbers in one.operations),
        findings=tuple(findings),
        unchecked=tuple(unchecked),
        provenance=Provenance(
            files,
            first.provenance.overrides,
            first.provenance.machine,
            first.provenance.materials,
            first.provenance.versions,
        ),
        maps=tuple(maps),
        note=f"Time: {times}.",
    )
