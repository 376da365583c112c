"""Completion of the names that a command takes, in the shell: `chipload --install-completion` sets it up."""

from __future__ import annotations

from collections.abc import Iterable


def machine_completions(incomplete: str) -> list[str]:
    """The shipped machines whose names begin so."""
    return _shipped("machine", incomplete)


def material_completions(incomplete: str) -> list[str]:
    """The shipped materials whose names begin so."""
    return _shipped("material", incomplete)


def example_completions(incomplete: str) -> list[tuple[str, str]]:
    """The examples whose names begin so, with what they show."""
    from chipload.examples import example_titles

    return [(name, title) for name, title in example_titles().items() if name.startswith(incomplete)]


def control_completions(incomplete: str) -> list[str]:
    """The controls whose names begin so."""
    from chipload.program.control import CONTROLS

    return _beginning(CONTROLS, incomplete)


# -- parts ------------------------------------------------------------------------------------------------------
def _shipped(kind: str, incomplete: str) -> list[str]:
    from chipload.tables import shipped_names

    return _beginning(shipped_names(kind), incomplete)


def _beginning(names: Iterable[str], incomplete: str) -> list[str]:
    return [name for name in names if name.startswith(incomplete)]
