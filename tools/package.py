"""Build the wheel and the source archive, and try each where no checkout is: it runs a job in its own environment.

Usage: ``python tools/package.py [--out DIR] [--here]``

Each archive is installed with its dependencies from the package index. With ``--here`` the dependencies are those of
the Python that runs this file: no network is needed, the source archive is first built into a wheel, and the job is one
that compiles little.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import venv
from pathlib import Path

ROOT = Path(__file__).parents[1]
#: a path to the checkout would be looked at before what is installed
CLEAN = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
PIP = ("-m", "pip", "--quiet", "--disable-pip-version-check")


def build(source: Path, out: Path, *targets: str) -> list[Path]:
    """The archives of a source folder."""
    out.mkdir(parents=True, exist_ok=True)
    for target in targets:
        words = [sys.executable, "-m", "hatchling", "build", "-t", target, "-d", str(out)]
        subprocess.run(words, cwd=source, check=True)
    return sorted([*out.glob("*.whl"), *out.glob("*.tar.gz")])


def wheel_of(archive: Path, home: Path) -> Path:
    """The wheel that the unpacked source archive builds."""
    shutil.unpack_archive(archive, home / "source")
    (source,) = (home / "source").iterdir()
    (wheel,) = build(source, home / "wheel", "wheel")
    return wheel


def tried(archive: Path, here: bool) -> str:
    """Install an archive in an environment of its own and run an example there; its last line."""
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        venv.create(home / "env", with_pip=not here)
        python = home / "env" / "bin" / "python"
        if here:
            # a .pth file in a folder that a .pth file names is not read: the checkout's own is none of its packages
            own = Path(_said(python, "import sysconfig; print(sysconfig.get_path('purelib'))", home))
            (own / "dependencies.pth").write_text(f"{sysconfig.get_path('purelib')}\n", encoding="utf-8")
            wheel = archive if archive.suffix == ".whl" else wheel_of(archive, home)
            words = [str(python), *PIP, "install", "--no-index", "--no-deps", "--force-reinstall", str(wheel)]
        else:
            words = [str(python), *PIP, "install", str(archive)]
        subprocess.run(words, check=True, cwd=home, env=CLEAN)
        if ROOT in (place := Path(_said(python, "import chipload; print(chipload.__file__)", home))).parents:
            raise SystemExit(f"{archive.name}: {place} is run, which is the checkout")
        chipload = str(home / "env" / "bin" / "chipload")
        example = "trunnion" if here else "contour"
        words = [chipload, "example", example, "job"]
        subprocess.run(words, check=True, cwd=home, env=CLEAN, stdout=subprocess.DEVNULL)
        words = [chipload, "run", "job/job.toml", "--out", "result"]
        done = subprocess.run(words, check=False, cwd=home, env=CLEAN, capture_output=True, text=True)
        if done.returncode != (3 if here else 0):
            raise SystemExit(f"{archive.name}: the job ended with {done.returncode}: {done.stderr}")
        if not here:
            words = [chipload, "view", "result"]
            absent = subprocess.run(words, cwd=home, env=CLEAN, capture_output=True, text=True, check=False)
            if absent.returncode != 2 or "chipload[web]" not in absent.stderr:
                raise SystemExit(f"{archive.name}: the missing extra is not named: {absent.stderr}")
        return done.stdout.splitlines()[0]


def _said(python: Path, code: str, home: Path) -> str:
    """What a line of Python prints in an environment, with no other place to import from."""
    done = subprocess.run([str(python), "-I", "-c", code], check=True, cwd=home, capture_output=True, text=True)
    return done.stdout.strip()


def main() -> None:
    """Build, try, and state the result."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=ROOT / "dist")
    parser.add_argument("--here", action="store_true", help="with the dependencies of this Python, without a network")
    given = parser.parse_args()
    for archive in build(ROOT, given.out.resolve(), "wheel", "sdist"):
        print(f"{archive.name}: {archive.stat().st_size / 1e6:.1f} MB: {tried(archive, given.here)[:60]}")


if __name__ == "__main__":
    main()
