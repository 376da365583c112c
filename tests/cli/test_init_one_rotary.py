"""`chipload init` of a program with one rotary axis: a machine with that axis alone, no travel of a trunnion."""

import tomllib
from pathlib import Path

import pytest

from command import call


@pytest.mark.parametrize(("axis", "machine"), [("A", "vmc-a"), ("B", "hmc-b")])
def test_the_machine_of_a_draft(tmp_path: Path, axis, machine) -> None:
    path = tmp_path / "part.ngc"
    turns = "".join(f"G0 Z30\n{axis}{angle}\nG1 Z10 F200\nX10\n" for angle in (0, 90, 180, 270, 720))
    path.write_text(f"(T1 D=6 FLAT END MILL)\nG21 G90 G54\nT1 M6\nS6000 M3\nG43 H1\nG0 X0 Y0 Z30\n{turns}G0 Z30\nM30\n")
    code, said, _ = call("init", path, tmp_path / "job")
    assert code == 0
    assert "machine-limit" not in said
    assert "nc-length-unknown" not in said
    assert tomllib.loads((tmp_path / "job" / "job.toml").read_text())["machine"]["name"] == machine
