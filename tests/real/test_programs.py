"""Every real program on a machine: read or clearly refused; written again and read back, it is the same."""

import os
from pathlib import Path

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.machine.machine import machine_named
from chipload.program.convert import convert_program
from chipload.program.gcode.reader import read_gcode
from chipload.program.motions import lengths
from chipload.program.program import RAPID
from chipload.program.read import ENDINGS, read_program
from chipload.program.to_work import to_work

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[3] / "shared" / "data")) / "nc"
FILES = sorted(p for p in DATA.rglob("*") if p.suffix.lower() in ENDINGS) if DATA.is_dir() else []
pytestmark = pytest.mark.skipif(not FILES, reason="no real programs: set CHIPLOAD_DATA")


def machine_of(path: Path):
    """A machine that has the axes of the file."""
    if "xyzac" in path.name:
        return machine_named("xyzac-trunnion")
    if "xyzbc" in path.name:
        return machine_named("xyzbc-trunnion")
    return machine_named("dmu50" if path.suffix in (".apt", ".clt", ".h", ".txt") else "vmc")


def on_its_machine(path: Path):
    return read_program(path, machine_of(path), feed=10.0)


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(DATA)))
def test_read_or_refused(path):
    """A refusal is one line that names the file or the line in it."""
    try:
        reading = on_its_machine(path)
    except InputError as err:
        text = str(err)
        assert len(text.splitlines()) == 1
        assert path.name in text or "line" in text or "row" in text
        return
    assert len(reading.program) >= 1
    assert np.isfinite(reading.program.p_work).all()


@pytest.mark.parametrize(
    "path",
    [
        p
        for p in FILES
        if p.parent.name in ("linuxcnc_3axis", "XYtests", "performance", "heart", "cat", "wave", "quick-tests")
    ],
    ids=lambda p: p.name,
)
def test_written_and_read_back(path):
    machine = machine_of(path)
    try:
        first = on_its_machine(path).program
    except InputError:
        pytest.skip("refused by its controller")
    if first.motion[0] != RAPID:
        with pytest.raises(InputError, match="begins with a cutting motion"):
            convert_program(first, (), machine, ".ngc", title="again")
        return
    text, _ = convert_program(first, (), machine, ".ngc", title="again")
    again, _ = to_work(read_gcode(text)[0], machine)
    one, two = (lengths(p)[1:][p.motion[1:] != RAPID].sum() for p in (first, again))
    assert two == pytest.approx(one, rel=1e-6, abs=1e-3)
    for bound in ("min", "max"):
        # a motion of an axis that the machine lacks has no length and is not written
        one, two = (
            getattr(p.p_work[1:][(p.motion[1:] != RAPID) & (lengths(p)[1:] > 0.0)], bound)(axis=0, initial=0.0)
            for p in (first, again)
        )
        np.testing.assert_allclose(two, one, atol=1e-5)


@pytest.mark.parametrize("name", ["xyzac", "xyzbc"])
@pytest.mark.parametrize("tcp", [True, False])
def test_boats(name, tcp):
    """Every programmed place is on the path that is read back, the tool's axis with it, in its order."""
    machine = machine_named(f"{name}-trunnion")
    first = read_program(DATA / "linuxcnc_5axis" / f"boat-{name}.ngc", machine).program
    text, _ = convert_program(first, (), machine, ".ngc", title="again", tcp=tcp)
    again, _ = to_work(read_gcode(text)[0], machine)
    at = 0
    for point, axis in zip(first.p_work, first.axis, strict=True):
        gap = np.linalg.norm(again.p_work[at:] - point, axis=1) + np.linalg.norm(again.axis[at:] - axis, axis=1)
        near = np.flatnonzero(gap < 5e-6)
        assert len(near), point
        at += int(near[0])
