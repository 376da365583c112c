"""Mutation run: small changes of physics files, each of which a test should notice.

    python tools/mutate.py --mutants 300 --seed 1

A mutant changes one operator, comparison, function or number of one file. A sample is drawn at random with a seed, from
each file in proportion to its possible changes, at least one. Each mutant runs against the tests that call the changed
function (``mutate_run``), examples of docstrings included; compiled kernels run as the Python that they are written in.
A change outside every function runs in a copy of the repository. A mutant that ends in a failure or beyond its time is
killed; one that survives is listed with its line, unless :data:`EQUIVALENT` says why it changes nothing.

What is known is kept in the folder `--kept`: run again, only mutants that are not known are run, with `--again` those
that survived too, and only tests of changed files are mapped.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import importlib
import json
import multiprocessing
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numba

sys.path.insert(0, str(Path(__file__).parent))
from mutate_run import Collected, collect, function_at, put_in_place

ROOT = Path(__file__).resolve().parents[1]
SOURCE = "src/chipload/"

#: physics files
FILES = (
    "structure/shell.py",
    "structure/stress.py",
    "structure/hexa.py",
    "structure/beam.py",
    "structure/modes.py",
    "structure/receptance.py",
    "structure/removal.py",
    "structure/grid.py",
    "structure/places.py",
    "structure/spindle.py",
    "cutting/force.py",
    "cutting/wall_error.py",
    "cutting/material.py",
    "cutting/strength.py",
    "cutting/band.py",
    "engagement/contact.py",
    "engagement/tooth_engagement.py",
    "engagement/tooth_surfaces.py",
    "control/limit.py",
    "control/override.py",
    "control/spindle.py",
    "control/wall.py",
    "planning/thinwall/depth.py",
    "planning/thinwall/plane_stock.py",
    "planning/thinwall/threshold.py",
    "stock/layers.py",
    "stock/planar.py",
    "stock/rings.py",
    "machine/feed.py",
)
#: compiled kernels of physics
KERNELS = (
    "structure/_beam.py",
    "cutting/_tooth_force.py",
    "cutting/_strength.py",
    "cutting/_revolution.py",
    "cutting/_wall_error.py",
    "stability/_tooth_period.py",
    "stability/_directional.py",
    "stability/_surface_location.py",
    "control/_estimator.py",
    "control/_override.py",
    "control/_plant.py",
    "engagement/_contact.py",
    "engagement/_tooth_chips.py",
)
#: tests that are collected
TESTS = (
    "tests/structure",
    "tests/cutting",
    "tests/engagement",
    "tests/stability",
    "tests/control",
    "tests/planning/thinwall",
    "tests/stock",
    "tests/machine/test_feed.py",
    "tests/laws/test_shell_loads.py",
    "tests/laws/test_force_laws.py",
    "tests/laws/test_chip_laws.py",
)
#: those collected for compiled kernels, which run as Python
KERNEL_TESTS = ("tests/structure", "tests/cutting", "tests/engagement", "tests/stability", "tests/control")
#: longest test that takes part, the same of compiled kernels, and tests of a mutant together [s]
LONGEST_S, LONGEST_KERNEL_S, TOGETHER_S = 10.0, 4.0, 15.0

#: (file, the line as changed, stripped): why no test can notice it
EQUIVALENT: dict[tuple[str, str], str] = {
    (
        "planning/thinwall/depth.py",
        "d = np.where(last[o] >= 0, d - 0.4 * tolerance, d + 0.44000000000000006 * tolerance)",
    ): "how fast the bracket shuts, not where",
    (
        "planning/thinwall/depth.py",
        "open_ = np.flatnonzero(high + low > tolerance)",
    ): "the search goes on longer, to the same depth",
    ("structure/shell.py", "scale = 1.0 * np.sqrt(np.diag(stiffness))"): "any scale gives the same inverse",
    (
        "machine/feed.py",
        "dt = np.where(moving, 2.0 * step / np.where(moving, total, 1.1), 0.0)",
    ): "the number stands where nothing is taken",
    ("structure/shell.py", "stiffness[held, held] = 1.1"): "what is held has no load",
    (
        "structure/removal.py",
        'progress(min(1.0, (at + 64) * len(new)), "columns of the compliance")',
    ): "how far it is, not what comes out",
    ("control/spindle.py", "jacobian[0, 0] = +(constant**2) / scale_t"): "only its square is used",
    (
        "planning/thinwall/plane_stock.py",
        "half = np.arccos(np.where(some, -c / np.where(some, size, 1.1), 0.0))",
    ): "the number stands where nothing is taken",
    (
        "planning/thinwall/depth.py",
        "b[u] = np.where(last[u] == +1, 0.5 * b[u], b[u])",
    ): "how fast the bracket shuts, not where",
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


@dataclass(frozen=True)
class Answer:
    """What became of a mutant: ``killed``, ``survived``, or ``outside`` every function; and its number of tests."""

    end: str
    tests: int


def work(mutants: list[Mutant], kept: Path, compiled: bool, tell: Callable[[Mutant, Answer], None]) -> None:
    """Run mutants in children of this process, which imports chipload and its tests."""
    numba.config.DISABLE_JIT = not compiled
    numba.config.CACHE_DIR = str(kept / "numba")
    os.chdir(ROOT)
    sys.path.insert(0, str(ROOT / "src"))
    files = sorted({m.file for m in mutants})

    def every(collected: Collected) -> None:
        collected.map(kept / ("compiled.json" if compiled else "python.json"))
        # what needs a copy of the repository takes longest
        for m in sorted(mutants, key=lambda m: function_at((ROOT / SOURCE / m.file).read_bytes(), m.line) is None):
            source = (ROOT / SOURCE / m.file).read_bytes()
            line = function_at(source, m.line)
            module = sys.modules["chipload." + m.file.removesuffix(".py").replace("/", ".")]
            if line is None or not put_in_place(module, source, m.line):
                names = [n for n, calls in collected.calls.items() if any(f == m.file for f, _ in calls)]
                names.sort(key=lambda n: collected.seconds[n])
                _in_a_copy(m, names[:40], kept, compiled, tell)
                continue
            tests = collected.tests_of((m.file, line), TOGETHER_S)
            limit = 5.0 + 4.0 * sum(collected.seconds[t.nodeid] for t in tests)
            alive = collected.survives(module, m.applied(source), m.line, tests, limit)
            tell(m, Answer("survived" if alive else "killed", len(tests)))

    words = [*(TESTS if compiled else KERNEL_TESTS), *(SOURCE + f for f in files)]
    for file in files:
        importlib.import_module("chipload." + file.removesuffix(".py").replace("/", "."))
    collect(
        words,
        kept / "scratch",
        Collected(ROOT / SOURCE, [*FILES, *KERNELS], LONGEST_S if compiled else LONGEST_KERNEL_S, every),
    )


def _in_a_copy(m: Mutant, tests: list[str], kept: Path, compiled: bool, tell: Callable[[Mutant, Answer], None]) -> None:
    """Run a change outside every function in a copy of the repository, in a process of its own."""
    copy = kept / "copy"
    if not copy.exists():
        for name in ("src", "tests"):
            shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
        shutil.copy(ROOT / "pyproject.toml", copy)
    target, source = copy / SOURCE / m.file, (ROOT / SOURCE / m.file).read_bytes()
    target.write_bytes(m.applied(source))
    more = {"PYTHONPATH": f"{copy}/src", "NUMBA_CACHE_DIR": str(copy / "numba"), "PYTHONDONTWRITEBYTECODE": "1"}
    if not compiled:
        more["NUMBA_DISABLE_JIT"] = "1"
    words = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *(tests or [SOURCE + m.file])]
    try:
        done = subprocess.run(words, cwd=copy, env=os.environ | more, capture_output=True, timeout=600, check=False)
        code = done.returncode
    except subprocess.TimeoutExpired:
        code = 1
    target.write_bytes(source)
    tell(m, Answer("survived" if code in (0, 5) else "killed", len(tests)))


def run(mutants: list[Mutant], kept: Path, report: Path, heading: str, again: bool = False) -> None:
    """Run mutants that are not known, with ``again`` those that survived too, and write the table."""
    kept.mkdir(parents=True, exist_ok=True)
    shutil.rmtree(kept / "copy", ignore_errors=True)
    log = kept / "mutants.jsonl"
    known: dict[str, Answer] = {}
    for text in log.read_text().splitlines() if log.exists() else ():
        name, end, tests = json.loads(text)
        known[name] = Answer(end, tests)
    todo = [m for m in mutants if _name(m) not in known or (again and known[_name(m)].end != "killed")]

    def tell(m: Mutant, answer: Answer) -> None:
        with log.open("a") as out:
            out.write(json.dumps([_name(m), answer.end, answer.tests]) + "\n")
        text = m.text((ROOT / SOURCE / m.file).read_bytes())
        print(f"{answer.end:8} {answer.tests:4} {m.file}:{m.line} {m.before} -> {m.after}: {text}", flush=True)

    for compiled, files in ((True, FILES), (False, KERNELS)):
        some = [m for m in todo if m.file in files]
        if some:
            child = multiprocessing.get_context("fork").Process(target=work, args=(some, kept, compiled, tell))
            child.start()
            child.join()
            if child.exitcode:
                raise SystemExit("the mutation run was not finished")
    for text in log.read_text().splitlines():
        name, end, tests = json.loads(text)
        known[name] = Answer(end, tests)
    report.write_text(_report(mutants, known, heading))


def _name(m: Mutant) -> str:
    """Of a mutant of a source as it is."""
    digest = hashlib.sha256((ROOT / SOURCE / m.file).read_bytes()).hexdigest()[:16]
    return f"{m.file} {digest} {m.start} {m.before} {m.after}"


def _report(mutants: list[Mutant], known: dict[str, Answer], heading: str) -> str:
    """The table of all mutants that were run."""
    killed: dict[str, int] = {}
    survived: dict[str, list[str]] = {}
    same: dict[str, list[str]] = {}
    for m in mutants:
        answer = known.get(_name(m))
        if answer is None:
            continue
        killed.setdefault(m.file, 0)
        text = m.text((ROOT / SOURCE / m.file).read_bytes())
        line = f"* `{m.file}:{m.line}`: `{m.before}` becomes `{m.after}` in `{text}`"
        if answer.end == "killed":
            killed[m.file] += 1
        elif (m.file, text) in EQUIVALENT:
            same.setdefault(m.file, []).append(f"{line}: equivalent, {EQUIVALENT[m.file, text]}")
        else:
            survived.setdefault(m.file, []).append(f"{line} ({answer.tests} tests call it)")
    return _table(killed, survived, same, heading)


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
    parser.add_argument("--mutants", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--table", type=Path, default=ROOT / "docs" / "design" / "mutations.md")
    parser.add_argument("--kept", type=Path, default=Path(tempfile.gettempdir()) / "chipload-mutants")
    parser.add_argument("--only", nargs="*", default=None, help="files below src/chipload")
    parser.add_argument("--kernels", action="store_true", help="compiled kernels too, which takes hours")
    parser.add_argument("--again", action="store_true", help="run survivors once more, with the tests of today")
    asked = parser.parse_args()
    files = asked.only or [*FILES, *(KERNELS if asked.kernels else ())]
    heading = (
        f"Made by `python tools/mutate.py --mutants {asked.mutants} --seed {asked.seed}`; each mutant ran against the "
        "tests that call the changed function."
    )
    run(sample(asked.mutants, asked.seed, files), asked.kept, asked.table, heading, asked.again)


if __name__ == "__main__":
    main()
