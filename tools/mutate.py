"""Mutation run: small changes of physics files, each of which a test should notice.

    python tools/mutate.py --mutants 80 --seed 1 --table docs/design/mutations.md

A mutant changes one operator, comparison, function or number of one file. A sample is drawn at random with a seed, from
each file in proportion to its possible changes, at least one. Each mutant runs in a copy of the repository, against the
tests that :data:`FILES` names for its file and the examples of its docstrings, with a time limit. A mutant that ends in
a failure or beyond the limit is killed; one that survives is listed with its line, unless :data:`EQUIVALENT` says why
it changes nothing.
"""

from __future__ import annotations

import argparse
import ast
import multiprocessing
import os
import random
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy  # noqa: F401
import pytest
import scipy.interpolate
import scipy.linalg
import scipy.sparse.linalg  # noqa: F401
import shapely  # noqa: F401

ROOT = Path(__file__).resolve().parents[1]
SOURCE = "src/chipload/"

#: physics files and the tests that map to each
FILES: dict[str, tuple[str, ...]] = {
    "structure/shell.py": ("tests/structure/test_shell.py", "tests/structure/test_shell_stress.py"),
    "structure/stress.py": ("tests/structure/test_stress.py",),
    "structure/hexa.py": ("tests/structure/test_hexa.py",),
    "structure/beam.py": ("tests/structure/test_beam.py",),
    "structure/modes.py": ("tests/structure/test_modes.py",),
    "structure/receptance.py": ("tests/structure/test_receptance.py",),
    "structure/removal.py": ("tests/structure/test_removal.py",),
    "structure/grid.py": ("tests/structure/test_grid.py",),
    "structure/places.py": ("tests/structure/test_grid.py", "tests/structure/test_removal.py"),
    "structure/spindle.py": ("tests/structure/test_spindle.py",),
    "cutting/force.py": ("tests/cutting/test_force.py", "tests/cutting/test_general.py"),
    "cutting/wall_error.py": ("tests/cutting/test_wall_error.py",),
    "cutting/material.py": ("tests/cutting/test_material.py", "tests/cutting/test_size_effect.py"),
    "engagement/contact.py": ("tests/engagement/test_contact.py",),
    "engagement/tooth_engagement.py": ("tests/engagement/test_tooth_engagement.py",),
    "control/limit.py": ("tests/control/test_limit.py",),
    "control/override.py": ("tests/control/test_override.py",),
    "control/spindle.py": ("tests/control/test_spindle.py",),
    "control/wall.py": ("tests/control/test_wall.py",),
    "planning/thinwall/depth.py": ("tests/planning/thinwall/test_depth.py",),
    "planning/thinwall/plane_stock.py": ("tests/planning/thinwall/test_depth.py",),
    "planning/thinwall/threshold.py": ("tests/planning/thinwall/test_threshold.py",),
    "stock/layers.py": ("tests/stock/test_layers.py",),
    "stock/planar.py": ("tests/stock/test_planar.py",),
    "stock/rings.py": ("tests/stock/test_rings.py",),
    "machine/feed.py": ("tests/machine/test_feed.py",),
}

#: (file, the line as changed, stripped): why no test can notice it
EQUIVALENT: dict[tuple[str, str], str] = {
    (
        "planning/thinwall/depth.py",
        "d = np.where(last[o] >= 0, d - 0.4 * tolerance, d + 0.44000000000000006 * tolerance)",
    ): "how fast the bracket shuts, not where",
    ("structure/shell.py", "stiffness[held, held] = 1.1"): "what is held has no load",
    (
        "stock/planar.py",
        "reach = h / math.sqrt(0.5) + 0.5 * radius * piece",
    ): "more candidates are looked at, the same are found",
}

OPERATORS: dict[type[ast.operator], tuple[str, str]] = {
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"),
    ast.Div: ("/", "*"),
}
COMPARISONS: dict[type[ast.cmpop], tuple[str, str]] = {
    ast.Lt: ("<", ">="),
    ast.LtE: ("<=", ">"),
    ast.Gt: (">", "<="),
    ast.GtE: (">=", "<"),
}
NAMES = {"sin": "cos", "cos": "sin", "min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum"}


@dataclass(frozen=True)
class Mutant:
    """One change: ``before`` at byte ``start`` of the file becomes ``after``; ``line`` counts from 1."""

    file: str
    line: int
    start: int
    before: str
    after: str

    def text(self, source: bytes) -> str:
        """The line as changed, stripped."""
        return self.applied(source).decode().splitlines()[self.line - 1].strip()

    def applied(self, source: bytes) -> bytes:
        """The changed source."""
        old = self.before.encode()
        assert source[self.start : self.start + len(old)] == old
        return source[: self.start] + self.after.encode() + source[self.start + len(old) :]


def mutants_of(file: str, source: bytes) -> list[Mutant]:
    """Every possible change of a file, in the order of its text; text of messages and annotations is left alone."""
    starts = [0]
    for text in source.split(b"\n"):
        starts.append(starts[-1] + len(text) + 1)

    def at(line: int, column: int) -> int:
        return starts[line - 1] + column

    def between(left: ast.expr, right: ast.expr, before: str, after: str) -> Iterator[Mutant]:
        low, high = at(left.end_lineno or 0, left.end_col_offset or 0), at(right.lineno, right.col_offset)
        k = source.find(before.encode(), low, high)
        if k >= 0:
            yield Mutant(file, source.count(b"\n", 0, k) + 1, k, before, after)

    def of(node: ast.AST) -> Iterator[Mutant]:
        if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
            yield from between(node.left, node.right, *OPERATORS[type(node.op)])
        elif isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in COMPARISONS:
            yield from between(node.left, node.comparators[0], *COMPARISONS[type(node.ops[0])])
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in NAMES:
            name, end = node.func.attr, at(node.func.end_lineno or 0, node.func.end_col_offset or 0)
            yield Mutant(file, node.func.end_lineno or 0, end - len(name), name, NAMES[name])
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            yield Mutant(file, node.lineno, at(node.lineno, node.col_offset), "-", "+")
        elif isinstance(node, ast.Constant) and isinstance(node.value, float) and 0.1 <= abs(node.value) <= 100.0:
            text = ast.get_source_segment(source.decode(), node)
            if text is not None:
                yield Mutant(file, node.lineno, at(node.lineno, node.col_offset), text, repr(1.1 * node.value))

    out: list[Mutant] = []

    def walk(node: ast.AST) -> None:
        if isinstance(node, (ast.Raise, ast.JoinedStr, ast.Assert)):
            return
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            for child in node.body:
                walk(child)
            return
        if isinstance(node, ast.AnnAssign):
            if node.value is not None:
                walk(node.value)
            return
        out.extend(of(node))
        for child in ast.iter_child_nodes(node):
            walk(child)

    walk(ast.parse(source))
    return sorted(set(out), key=lambda m: (m.start, m.after))


def sample(count: int, seed: int, files: list[str]) -> list[Mutant]:
    """Mutants of all files in random order: one a file, the rest in proportion to the possible changes of each."""
    rng = random.Random(seed)
    every = {f: mutants_of(f, (ROOT / SOURCE / f).read_bytes()) for f in files}
    chosen: list[Mutant] = []
    rest: list[Mutant] = []
    for file in files:
        mixed = rng.sample(every[file], len(every[file]))
        chosen += mixed[:1]
        rest += mixed[1:]
    chosen += rng.sample(rest, max(0, min(count - len(chosen), len(rest))))
    return rng.sample(chosen, min(count, len(chosen)))


def _child(copy: str, tests: tuple[str, ...]) -> None:
    """Run tests in the copy and end with pytest's code; their output is dropped."""
    sink = os.open(os.devnull, os.O_WRONLY)
    os.dup2(sink, 1)
    os.dup2(sink, 2)
    os.chdir(copy)
    sys.dont_write_bytecode = True
    sys.path.insert(0, f"{copy}/src")
    os.environ["PYTHONPATH"] = f"{copy}/src"
    os._exit(int(pytest.main(["-x", "-q", "-p", "no:cacheprovider", *tests])))


def _passes(copy: Path, tests: tuple[str, ...], limit_s: float) -> bool:
    """Whether the tests of a file pass in the copy within the time limit; the libraries are imported once for all."""
    child = multiprocessing.get_context("fork").Process(target=_child, args=(str(copy), tests))
    child.start()
    child.join(limit_s)
    if child.is_alive():
        child.kill()
        child.join()
    return child.exitcode == 0


def run(mutants: list[Mutant], report: Path, heading: str, seconds: float) -> None:
    """Run mutants until the time is over and write the table after each file."""
    killed: dict[str, int] = {}
    survived: dict[str, list[str]] = {}
    same: dict[str, list[str]] = {}
    begun = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="mutate-") as folder:
        copy = Path(folder)
        numba.config.CACHE_DIR = str(copy / "numba")
        for name in ("src", "tests"):
            shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
        shutil.copy(ROOT / "pyproject.toml", copy)
        limits: dict[str, float] = {}
        for m in mutants:
            if time.monotonic() - begun > seconds:
                break
            tests = (*FILES[m.file], SOURCE + m.file)  # with the examples of its docstrings
            if m.file not in limits:
                start = time.monotonic()
                if not _passes(copy, tests, 600.0):
                    raise SystemExit(f"{m.file}: its tests fail without a mutant: {' '.join(tests)}")
                limits[m.file] = 30.0 + 4.0 * (time.monotonic() - start)
            target = copy / SOURCE / m.file
            source = target.read_bytes()
            text = m.text(source)
            target.write_bytes(m.applied(source))
            alive = _passes(copy, tests, limits[m.file])
            target.write_bytes(source)
            killed.setdefault(m.file, 0)
            line = f"* `{m.file}:{m.line}`: `{m.before}` becomes `{m.after}` in `{text}`"
            if not alive:
                killed[m.file] += 1
            elif (m.file, text) in EQUIVALENT:
                same.setdefault(m.file, []).append(f"{line}: equivalent, {EQUIVALENT[m.file, text]}")
            else:
                survived.setdefault(m.file, []).append(line)
            print(f"{'survived' if alive else 'killed':8} {line}", flush=True)
            report.write_text(_table(killed, survived, same, heading))


def _table(killed: dict[str, int], survived: dict[str, list[str]], same: dict[str, list[str]], heading: str) -> str:
    """The result as Markdown."""
    rows, lines = [], []
    total = [0, 0, 0, 0]
    for file, dead in sorted(killed.items()):
        left, equal = survived.get(file, []), same.get(file, [])
        numbers = [dead + len(left) + len(equal), dead, len(left), len(equal)]
        total = [a + b for a, b in zip(total, numbers, strict=True)]
        rows.append(f"| `{file}` | " + " | ".join(map(str, numbers)) + " |")
        lines += left + equal
    rows.append("| all | " + " | ".join(map(str, total)) + " |")
    share = total[1] / (total[0] - total[3]) if total[0] > total[3] else 1.0
    return "\n".join(
        [
            "# Mutation run over the physics files",
            "",
            heading,
            f"{share:.0%} of the mutants that are not equivalent were killed.",
            "",
            "| file | mutants | killed | survived | equivalent |",
            "|---|---|---|---|---|",
            *rows,
            "",
            "## Survivors and equivalent mutants",
            "",
            *(lines or ["None."]),
            "",
        ]
    )


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Mutation run over the physics files.")
    parser.add_argument("--mutants", type=int, default=80)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=1e9, help="no mutant is begun after this time")
    parser.add_argument("--table", type=Path, default=ROOT / "docs" / "design" / "mutations.md")
    parser.add_argument("--only", nargs="*", default=None, help="files below src/chipload")
    asked = parser.parse_args()
    files = asked.only if asked.only else list(FILES)
    mutants = sample(asked.mutants, asked.seed, files)
    heading = (
        f"Made by `python tools/mutate.py --mutants {asked.mutants} --seed {asked.seed}`; each mutant ran against the "
        "tests of its file alone."
    )
    run(mutants, asked.table, heading, asked.seconds)


if __name__ == "__main__":
    main()
