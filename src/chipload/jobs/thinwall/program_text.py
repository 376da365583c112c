"""The texts of the programs of a thin wall, and what keeps them from being released: each is read back."""

from __future__ import annotations

from dataclasses import replace

from chipload.jobs.thinwall.outcome import ThinWallResult, Variant
from chipload.jobs.thinwall.part_shape import PartShape
from chipload.program.gcode.writer import write_commands
from chipload.program.read_back import text_findings
from chipload.program.release import NOT_SIMULATED, Release
from chipload.report.programs import ENDINGS, program_name


def program_text(walled: ThinWallResult, one: Variant, release: Release) -> str:
    """The text of the program of a variant for the machine; its lines do not depend on ``release``."""
    cutters = walled.planning.cutters
    comments = [
        f"T{c.number}: D {c.diameter:g} mm, corner {c.corner_radius:g} mm, {c.flutes} flutes, overhang "
        f"{c.overhang:g} mm"
        for c in cutters.values()
    ]
    comments += [f"{_frame(walled)}; machine {walled.planning.machine.name}"]
    comments += [
        f"G43 H{c.number} must be the overhang of {c.overhang:g} mm: the rotary axes turn about it"
        for c in cutters.values()
    ]
    return write_commands(
        one.commands, walled.planning.machine, title=program_title(walled, one), release=release, comments=comments,
        number=100 + list(walled.variants).index(one.name),
    )  # fmt: skip


def program_title(walled: ThinWallResult, one: Variant) -> str:
    """The title of the program of a variant."""
    return f"{walled.title}, operation 0, thinwall, {one.name}"


def program_file(walled: ThinWallResult, one: Variant) -> str:
    """The name of the file of the program of a variant."""
    return f"{program_name(0, one.name)}.{ENDINGS[walled.planning.machine.dialect]}"


def with_texts_read_back(walled: ThinWallResult) -> ThinWallResult:
    """A result whose variants have the findings of their texts, read back with the machine and compared with the
    simulated program.
    """
    planning, made = walled.planning, {}
    for name, one in walled.variants.items():
        text = program_text(walled, one, NOT_SIMULATED)
        found = text_findings(
            text, program_file(walled, one), planning.machine, planning.cutters, one.program, lengths=True
        )
        made[name] = replace(one, beyond=(*one.beyond, *(f for f in found if f not in one.beyond)))
    return replace(walled, variants=made)


def _frame(walled: ThinWallResult) -> str:
    """The coordinates of the program, in words."""
    if isinstance(walled.geometry.shape, PartShape):
        return "coordinates are those of the part's model"
    return "Z 0 is the clamp, X along the wall, its sides towards Y+ and Y-"
