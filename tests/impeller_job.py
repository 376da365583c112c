"""An impeller job of two small sides with programs, and what two runs of it must have alike."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from chipload import examples
from chipload.jobs import FinishedJob
from chipload.jobs.impeller.checkpoint import part_bytes
from chipload.result.summary import summary_bytes

#: a piece of each side of a blade
SIDES = "".join(
    f'[[surface]]\nbody = "blade"\nside = "{side}"\nalong = [0.30, 0.34]\nup = [0.50, 0.56]\npoints = [2, 2]\n\n'
    for side in ("plus", "minus")
)

#: material that stands on both pieces, the blade between them
STOCK = """[stock]
low_mm = [70.0, -4.5, 30.0]
high_mm = [74.5, -0.7, 34.0]

"""


def impeller_job(folder: Path) -> Path:
    """Pieces of two sides, with programs."""
    text = (Path(examples.__file__).parent / "impeller" / "job.toml").read_text()
    text = text[: text.index("[[surface]]")] + STOCK + SIDES + text[text.index("[[operation]]") :]
    text = text[: text.index("[operation.rough]")] + text[text.index("[operation.paths]") :]
    text = re.sub(r"^hand_picked.*\n", "", text, flags=re.MULTILINE)
    # with changes for nothing each side has its own cutter and table angle
    changes = {"most_cutters": "2", "cutter_change_s": "0.0", "table_change_s": "0.0"}
    changes |= {"check_mm": "4.0", "chord_mm": "0.02", "scallop_mm": "0.2"}
    text = text.replace("check_mm = 3.0\n", "check_mm = 3.0\ntolerance_mm = 0.3\ntable_deg = [20.0, 70.0, 90.0]\n")
    for key, value in changes.items():
        text, n = re.subn(rf"^{key} = .*$", f"{key} = {value}", text, flags=re.MULTILINE)
        assert n
    (folder / "job.toml").write_text(text)
    return folder / "job.toml"


def impeller_outcome(done: FinishedJob) -> tuple[Any, ...]:
    """Moves and checks of all programs as bytes, and the summary but for the time that the search took."""

    def timeless(value: Any) -> Any:
        if isinstance(value, dict):
            return {k: timeless(v) for k, v in value.items() if k != "search_s"}
        return [timeless(v) for v in value] if isinstance(value, list) else value

    programs, covered = done.outcome.programs, done.outcome.covered
    moves = [part_bytes((p.setting.linked, p.gouge)) for p in programs]
    return moves, [c.left.rest.tobytes() for c in covered], timeless(json.loads(summary_bytes(done.result, {})))
