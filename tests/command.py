"""A command of chipload in this process, as the shell would give it."""

from __future__ import annotations

import re

from typer.testing import CliRunner

from chipload.cli import app

TIME_LEFT = re.compile(r"^chipload: \d+ %, .*\n", re.MULTILINE)


def call(*words: object) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of ``chipload`` with these words; without the time left, told on a slow computer."""
    done = CliRunner().invoke(app, [str(word) for word in words])
    return done.exit_code, done.stdout, TIME_LEFT.sub("", done.stderr)
