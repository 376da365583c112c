"""A command of chipload in this process, as the shell would give it."""

from __future__ import annotations

from typer.testing import CliRunner

from chipload.cli import app


def call(*words: object) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of ``chipload`` with these words."""
    done = CliRunner().invoke(app, [str(word) for word in words])
    return done.exit_code, done.stdout, done.stderr
