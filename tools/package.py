"""Build the wheel and the source archive, and try both where no checkout is: each in a fresh environment runs a job.

Usage: ``python tools/package.py [--out DIR]``
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

ROOT = Path(__file__).parents[1]


def build(out: Path) -> list[Path]:
    """The archives of the checkout."""
    for target in ("wheel", "sdist"):
        subprocess.run([sys.executable, "-m", "hatchling", "build", "-t", target, "-d", str(out)], cwd=ROOT, check=True)
    return sorted([*out.glob("*.whl"), *out.glob("*.tar.gz")])


def tried(archive: Path) -> str:
    """Install an archive with its dependencies in an environment of its own and run an example there; its last line."""
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        venv.create(home / "env", with_pip=True)
        python = home / "env" / "bin" / "python"
        words = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", str(archive)]
        subprocess.run(words, check=True, cwd=home)
        chipload = str(home / "env" / "bin" / "chipload")
        subprocess.run([chipload, "example", "contour", "job"], check=True, cwd=home, stdout=subprocess.DEVNULL)
        done = subprocess.run(
            [chipload, "run", "job/job.toml", "--out", "result"], check=True, cwd=home, capture_output=True, text=True
        )
        absent = subprocess.run([chipload, "view", "result"], cwd=home, capture_output=True, text=True, check=False)
        if absent.returncode != 2 or "chipload[web]" not in absent.stderr:
            raise SystemExit(f"{archive.name}: the missing extra is not named: {absent.stderr}")
        return done.stdout.splitlines()[0]


def main() -> None:
    """Build, try, and say what came out."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=ROOT / "dist")
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    for archive in build(out):
        print(f"{archive.name}: {archive.stat().st_size / 1e6:.1f} MB: {tried(archive)[:60]}")


if __name__ == "__main__":
    main()
