"""The report of a simulated program, in one setup or in several."""

from __future__ import annotations

from collections.abc import Mapping

import plotly.graph_objects as go

from chipload.checking.figures import program_presentation
from chipload.checking.outcome import ProgramResult
from chipload.checking.result import APT, changed_name
from chipload.jobs.program.outcome import SetupsProgram, SpeedsProgram
from chipload.jobs.program.result import result_of
from chipload.jobs.program.setups_result import setup_file, setup_name
from chipload.number_text import number_text
from chipload.program.apt.writer import write_apt
from chipload.report.presentation import Blank, Content, Presentation
from chipload.report.sheet import table
from chipload.result import Result
from chipload.result.release import release_of
from chipload.simulation.engagement_samples import EngagementSamples


def presentation_of(program: ProgramResult) -> Presentation:
    """The presentation of a program's result."""
    if isinstance(program, SetupsProgram):
        return _of_setups(program)
    changed = {changed_name(program, "speeds"): program.speeds} if isinstance(program, SpeedsProgram) else {}
    return program_presentation(program, result_of(program), changed)


def _of_setups(program: SetupsProgram) -> Presentation:
    """The presentation of several setups: figures and scene of the last, CL data, blank and samples of each."""
    last, count = program.setups[-1], len(program.setups)

    def files(result: Result) -> Mapping[str, Content]:
        out = dict(program_presentation(last, result).files(result))
        out.pop(APT, None)
        for k, one in enumerate(program.setups):
            path = one.reading.program
            known = one.cutters if set(path.tool.tolist()) - {0} <= set(one.cutters) else None
            title = f"{one.title}, {one.name}, {setup_name(k)}"
            text = write_apt(path, known, title=title, release=release_of(result, setup_file(k)))
            out[setup_file(k)] = text.encode("ascii")
        return out

    def blanks() -> dict[str, Blank]:
        found = {k: one.simulated for k, one in enumerate(program.setups) if one.simulated is not None}
        return {setup_name(k): Blank(s.collisions.stock.blank, program.cutters) for k, s in found.items()}

    def samples() -> dict[str, EngagementSamples]:
        found = [one.simulated.removal.samples if one.simulated is not None else None for one in program.setups]
        return {setup_name(k): one for k, one in enumerate(found) if one is not None}

    def sections(figures: dict[str, go.Figure]) -> list[str]:
        rows = []
        for k, one in enumerate(program.setups):
            removal = None if one.simulated is None else one.simulated.removal
            removed = "" if removal is None else number_text(removal.volume_before - removal.volume_after)
            rows.append((setup_name(k), one.name, number_text(float(one.seconds.sum())), removed))
        head = ("setup", "program", "time [s]", "removed [mm\u00b3]")
        shown = f"<p>The figures are those of {setup_name(count - 1)}.</p>"
        own = program_presentation(last, result_of(last))
        return ["<h2>Setups</h2>", table(head, rows, (2, 3)), shown, *own.sections(figures)]

    return Presentation(sections, program_presentation(last, result_of(last)).scene, files, blanks, samples)
