"""Docstrings as the page of the Python interface shows them: a griffe extension that mkdocs.yml names.

The source writes ``name : what it is`` in the lists of parameters, with the type in the signature; numpydoc would take
that text as the type. Roles and double backticks of reStructuredText become code of Markdown.
"""

from __future__ import annotations

import re
from typing import Any

import griffe

SECTIONS = re.compile(r"(?m)^(Parameters|Attributes|Returns)\n-+\n((?:.+\n|\n(?![A-Z]\w+\n-+))*)")
#: `name : text` at the margin, and lines of the text that go on
ENTRY = re.compile(r"(?m)^([A-Za-z_*][\w*, ]*) : (.+(?:\n {4}.+)*)$")


def as_markdown(text: str) -> str:
    r"""A docstring with descriptions below the names of parameters and with Markdown's code.

    >>> as_markdown("Parameters\n----------\nfeed : [mm/s], see :class:`~a.Feed`\n").splitlines()[2:]
    ['feed', '    [mm/s], see `Feed`']
    """
    text = re.sub(r":\w+:`~?(?:[\w.]*\.)?(\w+)`", r"`\1`", text).replace("``", "`")
    return SECTIONS.sub(lambda m: ENTRY.sub(r"\1\n    \2", m.group(0)) if m.group(1) != "Returns" else m.group(0), text)


class PlainDocstrings(griffe.Extension):
    """Rewrites each docstring before it is parsed."""

    def on_instance(self, *, obj: griffe.Object, **_: Any) -> None:
        """Called for every object of the package."""
        if obj.docstring:
            obj.docstring.value = as_markdown(obj.docstring.value)
