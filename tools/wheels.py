"""Ask pip whether each locked dependency has a wheel for Windows and macOS.

    python tools/wheels.py [LOCK ...] [--python 3.11]

LOCK is requirements-run.lock unless stated. Nothing is installed: pip resolves the versions of the lock whose markers
hold on each system, without dependencies and from wheels alone. Exit code 1: a package has none, and is named.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from packaging.requirements import Requirement

ROOT = Path(__file__).parent.parent
#: name of a system, platform tags of its wheels, and what markers see there
SYSTEMS = {
    "Windows": (
        ["win_amd64"],
        {"sys_platform": "win32", "platform_system": "Windows", "os_name": "nt", "platform_machine": "AMD64"},
    ),
    "macOS": (
        [f"macosx_{v}_{m}" for v in ("11_0", "12_0", "13_0", "14_0") for m in ("arm64", "universal2")],
        {"sys_platform": "darwin", "platform_system": "Darwin", "os_name": "posix", "platform_machine": "arm64"},
    ),
}  # fmt: skip


def locked(text: str, seen: dict[str, str]) -> list[str]:
    """Return ``name==version`` of each requirement of a lock whose marker holds; ``seen`` is what markers see."""
    lines = [line.rstrip(" \\") for line in text.splitlines() if re.match(r"[A-Za-z0-9]", line)]
    wanted = [Requirement(line) for line in lines]
    return [f"{r.name}{r.specifier}" for r in wanted if r.marker is None or r.marker.evaluate(dict(seen))]


def without_wheel(names: list[str], tags: list[str], python: str) -> list[str]:
    """Return the requirements for which pip finds no wheel."""
    missing: list[str] = []
    while True:
        asked = [name for name in names if name not in missing]
        with tempfile.TemporaryDirectory() as folder:
            listed = Path(folder) / "asked.txt"
            listed.write_text("\n".join(asked), encoding="utf-8")
            words = [sys.executable, "-m", "pip", "install", "--dry-run", "--quiet", "--no-deps", "--ignore-installed"]
            words += ["--only-binary", ":all:", "--python-version", python, "--implementation", "cp"]
            words += [word for tag in tags for word in ("--platform", tag)]
            words += ["--target", folder, "-r", str(listed)]
            done = subprocess.run(words, check=False, capture_output=True, text=True)
        if done.returncode == 0:
            return missing
        found = re.search(r"No matching distribution found for (\S+)", done.stderr)
        name = next((n for n in asked if found and n.split("==")[0].lower() == found[1].split("==")[0].lower()), None)
        if name is None:
            raise SystemExit(done.stderr)
        missing.append(name)


def main() -> None:
    """Ask for each lock and system."""
    parser = argparse.ArgumentParser(description="Ask pip for wheels of all locked dependencies.")
    parser.add_argument("locks", nargs="*", metavar="LOCK", default=["requirements-run.lock"])
    parser.add_argument("--python", default="3.11", help="version of Python")
    given = parser.parse_args()
    bad = False
    for lock in given.locks:
        text = (ROOT / lock).read_text(encoding="utf-8")
        for system, (tags, seen) in SYSTEMS.items():
            names = locked(text, {**seen, "python_version": given.python, "python_full_version": f"{given.python}.0"})
            missing = without_wheel(names, tags, given.python)
            bad = bad or bool(missing)
            rest = f"none for {', '.join(missing)}" if missing else "all have one"
            print(f"{lock}: {system}: {len(names)} packages: {rest}", flush=True)
    sys.exit(bad)


if __name__ == "__main__":
    main()
