"""The conversational programs of real parts beside the CL data that the same CAM system wrote for them."""

import os
import re
from pathlib import Path

import numpy as np
import pytest

from chipload.errors import Severity
from chipload.program.commands import ARC
from chipload.program.heidenhain.reader import read_heidenhain_file

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[3] / "shared" / "data")) / "nc" / "apt_dmu50"
FILES = sorted((DATA / "heidenhain").rglob("*.h")) if DATA.is_dir() else []
PARTS = [p for p in FILES if p.name == "11.h"]
pytestmark = pytest.mark.skipif(not FILES, reason="no real programs: set CHIPLOAD_DATA")


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(DATA)))
def test_read_or_left_out(path):
    """Programs that measure ask for what only the controller knows; two begin where the operator has put the tool."""
    text = path.read_text(errors="replace")
    commands, findings = read_heidenhain_file(path)
    assert np.isfinite(commands.position).all()
    jumps = [f for f in findings if f.code == "heidenhain-jump"]
    if re.search(r"^\s*FN\s*(9|10|11|12):", text, re.M) and "SYSREAD" in text:
        # a jump may depend on what is measured: it is not made, and the program is not proved
        assert any(re.match(r"Q\d+ comes from the controller", f.text) for f in jumps)
    assert all(f.severity == Severity.UNPROVEN and f.line > 0 for f in jumps)
    left_out = [f for f in findings if f.code == "heidenhain-left-out"]
    assert left_out or "SYSREAD" in text or path.name != "RECTIFI.h"
    assert all(f.severity == Severity.UNPROVEN for f in left_out)


@pytest.mark.parametrize("path", PARTS, ids=lambda p: p.parent.name)
def test_the_path_is_that_of_the_cl_data(path):
    """Every end of an arc and a line lies on a GOTO, in order; the poles are the centres of CIRCLE."""
    commands, _ = read_heidenhain_file(path)
    text = (DATA / "apt" / f"{path.parent.name}.apt").read_text(errors="replace")
    goto = np.array([[float(x) for x in m.split(",")[:2]] for m in re.findall(r"^GOTO/\s*([^\n]+)", text, re.M)])
    at = missed = 0
    for point in commands.position[:, :2]:
        near = np.flatnonzero(np.abs(goto[at:] - point).max(axis=1) < 2e-3)
        if len(near):
            at += int(near[0])
        else:
            missed += 1
    assert missed <= 0.02 * len(commands) + 3
    assert at >= min(0.95 * len(goto), len(goto) - 2)
    centres = np.array([[float(x) for x in m.split(",")[:2]] for m in re.findall(r"^CIRCLE/\s*([^\n]+)", text, re.M)])
    arcs = commands.motion == ARC
    if arcs.any() and len(centres):
        gap = np.abs(commands.centre[arcs][:, None] - centres[None]).max(axis=2).min(axis=1)
        assert gap.max() < 0.03  # of short arcs three decimals fix the centre no better
