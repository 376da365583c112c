"""chipload plans and proves CNC milling of the parts that are hard to mill.

``chipload.simulate`` runs a program from plain values and gives a ``chipload.History`` back; both are imported when
they are asked for, so that ``import chipload`` stays light.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from chipload.run.given import simulate
    from chipload.run.history import History

__all__ = ["History", "simulate"]


def __getattr__(name: str) -> Any:
    """Import what is asked for."""
    if name == "simulate":
        from chipload.run.given import simulate

        return simulate
    if name == "History":
        from chipload.run.history import History

        return History
    raise AttributeError(f"module 'chipload' has no attribute {name!r}")
