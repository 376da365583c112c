"""Free memory is returned to the system."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from chipload.memory import return_free_memory

STATM = Path("/proc/self/statm")


def _resident() -> int:
    return int(STATM.read_text().split()[1])


@pytest.mark.skipif(sys.platform != "linux", reason="only glibc returns memory on request")
def test_what_is_free_between_what_is_kept_is_returned() -> None:
    blocks = [np.ones(1 << 13) for _ in range(2000)]  # 64 KiB each: of the heap
    kept = blocks[::50]
    kept.append(np.ones(1 << 13))
    del blocks
    before = _resident()
    return_free_memory()
    # 125 MB less two of a hundred
    assert before - _resident() > 100e6 / 4096
    assert all((b == 1.0).all() for b in kept)
