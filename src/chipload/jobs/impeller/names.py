"""Names of the program files of an impeller."""

from __future__ import annotations

import numpy as np

from chipload.cutter.catalogue import CatalogueCutter
from chipload.jobs.impeller.five_axis_outcome import CheckedFlank, CheckedPoints, FiveAxisProgram
from chipload.jobs.impeller.outcome import Checked, CheckedPartition, ImpellerResult

#: end of the name of a program for all channels
ALL = "-all"


def rough_names(milled: ImpellerResult) -> list[str]:
    """File names of the roughing programs without their endings."""
    return [f"{k}-rough-{_size(r.rough.cutter, r.rough.table)}" for k, r in enumerate(milled.roughs or (), 1)]


def program_name(milled: ImpellerResult, k: int) -> str:
    """File name of the k-th finishing program, from 1, without its ending; its first number is that of the tool."""
    return _finish_name(milled, k, (milled.programs or ())[k - 1])


def finish_names(milled: ImpellerResult) -> list[tuple[str, Checked]]:
    """File names of the finishing programs without endings: of the partition that is milled, then of all others."""
    used = milled.used_checked
    out = [(program_name(milled, k), p) for k, p in enumerate(milled.programs or (), 1)]
    for partition in milled.checked or ():
        if partition is not used:
            stem = stem_of(partition)
            out += [(f"{stem}-{_finish_name(milled, k, p)}", p) for k, p in enumerate(partition.programs, 1)]
    return out


def flank_names(milled: ImpellerResult) -> list[tuple[str, CheckedFlank]]:
    """File names of the flank passes without their endings."""
    return [
        (_five_axis_name("flank", k, p), p) for k, p in enumerate(milled.flanks or (), 1) if isinstance(p, CheckedFlank)
    ]


def points_names(milled: ImpellerResult) -> list[tuple[str, CheckedPoints]]:
    """File names of the point milling on five axes without their endings."""
    return [
        (_five_axis_name("points", k, p), p)
        for k, p in enumerate(milled.points or (), 1)
        if isinstance(p, CheckedPoints)
    ]


def _five_axis_name(kind: str, k: int, p: FiveAxisProgram) -> str:
    return f"{kind}-{k}-{p.name.replace(' ', '-')}-{p.cutter.stem}"


def stem_of(partition: CheckedPartition) -> str:
    """Start of the file names of a partition that is not milled."""
    return f"way-{partition.name.replace(' ', '-')}"


def _finish_name(milled: ImpellerResult, k: int, p: Checked) -> str:
    return f"{len(milled.roughs or ()) + k}-{_size(p.setting.cutter, p.setting.table)}"


def _size(cutter: CatalogueCutter, table: float) -> str:
    return f"{cutter.stem}-{np.degrees(table):.6g}deg"
