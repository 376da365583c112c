"""Files beside the page: the proof."""

from __future__ import annotations

from chipload.report.impeller.outcome import Milled
from chipload.report.impeller.summary import proof_bytes


def program_files(milled: Milled) -> dict[str, bytes]:
    """Every further file by name."""
    return {"proof.npz": proof_bytes(milled)}
