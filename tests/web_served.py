"""A page that is served by the command, as a person starts it."""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path


class Served:
    """A page that is served: its address, its token, the folder, the process."""

    def __init__(self, folder: Path, *options: str) -> None:
        self.folder = folder
        words = [sys.executable, "-c", "from chipload.cli import main; main()", "view", str(folder), "--no-open"]
        self.process = subprocess.Popen(
            [*words, *options], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env={**os.environ}
        )
        assert self.process.stdout is not None
        self.said = []
        for line in self.process.stdout:
            self.said.append(line)
            if found := re.search(r"(http://127\.0\.0\.1:(\d+)/)\?token=(\S+)", line):
                self.url, self.port, self.token = found[1], int(found[2]), found[3]
                self.cookie = f"chipload-{self.port}={self.token}"
                return
        raise AssertionError("".join(self.said))

    def end(self) -> int:
        """Ctrl-C; the exit code."""
        self.process.send_signal(signal.SIGINT)
        try:
            return self.process.wait(30)
        finally:
            if self.process.poll() is None:
                self.process.kill()
            assert self.process.stdout is not None
            self.process.stdout.close()

    def address(self, rest: str = "") -> str:
        """The address with its token, as the command prints it; ``rest`` is a query that begins with `?`."""
        return f"{self.url}?token={self.token}{rest.replace('?', '&')}"
