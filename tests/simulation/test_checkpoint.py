"""What a run that is stopped says of what it has kept."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from chipload.simulation.checkpoint import Checkpoint


def test_an_interrupt_at_any_time_is_told_what_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C just after the file of a state was written, before the old ones are removed."""
    with Checkpoint(tmp_path / "out.unfinished") as kept:
        kept.begin("a job")
        assert kept.what_is_kept() == ""
        kept.add({"x": np.arange(3.0)})
        assert kept.what_is_kept() == ""
        kept.commit({"stock": b"first"})
        assert kept.what_is_kept() == "3 steps are kept"
        kept.add({"x": np.arange(4.0)})

        def interrupted(_file: Path, missing_ok: bool = False) -> None:
            raise KeyboardInterrupt

        monkeypatch.setattr(Path, "unlink", interrupted)
        with pytest.raises(KeyboardInterrupt):
            kept.commit({"stock": b"second"})
        monkeypatch.undo()
        assert kept.what_is_kept() == "7 steps are kept"
    with Checkpoint(tmp_path / "out.unfinished") as again:
        assert again.what_is_kept() == ""  # of another run, until it is known to be the same
        assert again.begin("a job") is not None
        assert again.safe == 7
        assert again.what_is_kept() == "7 steps are kept"
        again.discard()
        assert again.what_is_kept() == ""
