"""Receptances by others: the modes that they were made with, as their authors' files have them."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from chipload.jobs.program.tap import tap

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[2].parent / "shared" / "data"))
FOLDER = DATA / "measured" / "li_frf" / "TimeDomain" / "SemiDis" / "Milling"
#: frequency [Hz], damping, stiffness [N/mm] of the two modes of each
KNOWN = {
    "X.frf": ([369.85, 1146.36], [0.0316, 0.0114], [5400.0, 51880.0]),
    "Y.frf": ([411.21, 1069.21], [0.0168, 0.0155], [6676.0, 45132.0]),
}


@pytest.mark.skipif(not FOLDER.is_dir(), reason="the receptances are not there")
def test_two_modes_in_two_directions():
    found = tap([FOLDER / name for name in KNOWN], ["x", "y"])
    for one, (frequency, damping, stiffness) in zip(found, KNOWN.values(), strict=True):
        assert one.fit.frequency == pytest.approx(frequency, abs=0.01)
        assert one.fit.damping == pytest.approx(damping, abs=1e-4)
        assert one.fit.stiffness == pytest.approx(stiffness, rel=1e-3)
        assert one.fit.left < 1e-9
