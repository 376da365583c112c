"""The command ``chipload learn-wall``: force coefficients and stiffness from the form error of a measured wall."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chipload.cli.app import Debug, app
from chipload.errors import Severity
from chipload.number_text import number_text
from chipload.terminal import EXCEEDED, run_guarded, show

if TYPE_CHECKING:
    from chipload.cutting.wall_evidence import WallKnowledge


@app.command("learn-wall")
def learn_wall(
    file: Annotated[Path, typer.Argument(metavar="WALLS", help="cutter, cuts and measured form errors (TOML)")],
    out: Annotated[
        Path, typer.Option("--out", metavar="FILE", help="the material (TOML), for [material] file of a job")
    ],
    name: Annotated[str, typer.Option("--name", help="name of the material; default: the file's, with -learned")] = "",
    debug: Debug = False,
) -> None:
    """Learn force coefficients and the stiffness of a tool from the form error of walls that were measured.

    The error of a wall is that of the bending cutter: force times compliance. All six coefficients are updated, from
    what is known of the material and of the compliance. Exit code 3: the walls contradict the model.
    """

    def work() -> int:
        from chipload.cutting.material import material_text
        from chipload.files import write_whole
        from chipload.jobs.wall_measurement import learn_from_wall_file

        found = learn_from_wall_file(file, name)
        write_whole(out, material_text(found.material).encode("utf-8"))
        for line in wall_lines(found):
            show(line)
        show(f'written: {out}; name it in the job: [material] file = "{out.name}"')
        return EXCEEDED if any(f.severity is not Severity.NOTE for f in found.findings) else 0

    run_guarded(work, debug)


def wall_lines(found: WallKnowledge) -> list[str]:
    """Return what was learned, a line each."""
    from chipload.cutting.wall_evidence import NAMES

    out = []
    for key, old, new in zip(NAMES, *found.deviations, strict=True):
        before, after = getattr(found.prior, key), getattr(found.material, key)
        unit = "MPa" if key.endswith("c") else "N/mm"
        out.append(
            f"{key}: {number_text(after)} {unit} +- {number_text(200.0 * new, 2)} %; before {number_text(before)} +- "
            f"{number_text(200.0 * old, 2)} % (two standard deviations)"
        )
    ratio, sd = found.compliance
    out.append(f"compliance of cutter and holder: {number_text(ratio, 3)} +- {number_text(2.0 * sd, 2)} of the stated")
    for key, (place, spread) in found.place_um.items():
        out.append(f"{key}: the whole wall lies {number_text(place, 3)} +- {number_text(2.0 * spread, 2)} um off")
    return [*out, *map(str, found.findings)]
