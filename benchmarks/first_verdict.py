"""How long a stranger waits: from a clone to the first verdict, and to the end of `make demo`.

    python benchmarks/first_verdict.py

The checkout is cloned into an empty folder without its environment and its compiled loops; pip may have its downloads
kept. Times are by the clock, on a computer that does nothing else; tests do not assert them.
"""

from __future__ import annotations

import os
import re
import subprocess
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
#: first word of the line that ends a run
VERDICT = re.compile(r"^(Holds|Exceeds|Unproven): ")
#: variables of the environment that the clone may have
KEPT = ("HOME", "LANG", "PATH", "PIP_INDEX_URL", "PIP_EXTRA_INDEX_URL", "PIP_CONFIG_FILE", "SSL_CERT_FILE", "TERM")


def events() -> list[tuple[str, float]]:
    """What happens from the clone on, and after how many seconds; the first is the end of the installation, the last
    that of `make demo`.
    """
    path = os.pathsep.join(p for p in os.environ["PATH"].split(os.pathsep) if not p.startswith(str(ROOT)))
    env = {name: os.environ[name] for name in KEPT if name in os.environ} | {"PATH": path}
    with tempfile.TemporaryDirectory() as folder:
        begun = time.time()
        subprocess.run(["git", "clone", "--quiet", str(ROOT), folder], check=True)
        verdicts = list[tuple[str, float]]()
        words = ["make", "--directory", folder, "demo"]
        with subprocess.Popen(words, env=env, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as demo:
            assert demo.stdout is not None
            for line in demo.stdout:
                if VERDICT.match(line):
                    verdicts.append((line.strip()[:60], time.time() - begun))
        ready = (Path(folder) / ".venv" / ".run").stat().st_mtime - begun
        return [
            ("packages installed", ready),
            *verdicts,
            (f"make demo ends with {demo.returncode}", time.time() - begun),
        ]


def main() -> None:
    """Print a row for each event."""
    print("| event | seconds |\n|---|---:|")
    for name, seconds in events():
        print(f"| {name} | {seconds:.0f} |")


if __name__ == "__main__":
    main()
