"""Files that several tests of commands read."""

from __future__ import annotations

from pathlib import Path

import pytest

from fusion_text import FUSION


@pytest.fixture
def program(tmp_path: Path) -> Path:
    path = tmp_path / "slot.nc"
    path.write_text(FUSION)
    return path
