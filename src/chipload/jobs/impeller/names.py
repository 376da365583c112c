"""Names of the program files of an impeller."""

from __future__ import annotations

import numpy as np

from chipload.cutter.catalogue import CatalogueCutter
from chipload.jobs.impeller.outcome import ImpellerResult


def rough_names(milled: ImpellerResult) -> list[str]:
    """File names of the roughing programs without their endings."""
    return [f"{k}-rough-{_size(r.rough.cutter, r.rough.table)}" for k, r in enumerate(milled.roughs or (), 1)]


def program_name(milled: ImpellerResult, k: int) -> str:
    """File name of the k-th finishing program, from 1, without its ending; its first number is that of the tool."""
    s = (milled.programs or ())[k - 1].setting
    return f"{len(milled.roughs or ()) + k}-{_size(s.cutter, s.table)}"


def _size(cutter: CatalogueCutter, table: float) -> str:
    return f"D{cutter.diameter:g}r{cutter.corner_radius:g}-{np.degrees(table):.6g}deg"
