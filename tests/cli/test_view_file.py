"""`chipload view FILE`: the job is written beside a program, and the page opens it."""

from __future__ import annotations

from pathlib import Path

import pytest

from command import call


def test_a_program_is_drafted_and_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Oracle: the folder that is served, what is asked, and that a second call leaves the job as it was changed."""
    served: list[Path] = []
    monkeypatch.setattr("chipload.web.serve.serve", lambda path, port, opened, show: served.append(Path(path)))
    (tmp_path / "slot.nc").write_text("G21 G90 G94 G17\nT1 M6\nS3000 M3\nG0 X0 Y0 Z5\nG1 Z-2 F300\nX28\nG0 Z5\nM2\n")
    code, out, error = call("view", tmp_path / "slot.nc")
    assert code == 0, error
    job = tmp_path / "slot-job" / "job.toml"
    assert served == [job.parent]
    assert 0 < out.count("question: ") <= 5
    job.write_text(job.read_text() + "# mine\n")
    assert call("view", tmp_path / "slot.nc")[0] == 0
    assert served == [job.parent, job.parent]
    assert job.read_text().endswith("# mine\n")
    assert call("view", tmp_path)[0] == 0
    assert served[-1] == tmp_path
