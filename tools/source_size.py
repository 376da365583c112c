"""Print the size and the structure of a source tree, and what a run of an example enters.

    python tools/source_size.py                             # this tree
    python tools/source_size.py --tree ../before            # another checkout
    python tools/source_size.py --run chips tube            # also files and functions that these examples enter

The counts are of the syntax tree: a function is a ``def``, a method included; an argument is a parameter but ``self``
and ``cls``. A name is a bare participle where it is one word, without a leading underscore, that ends in -ed or -ing or
is one of :data:`IRREGULAR`. A constant is a name in capitals at the top of a module. A representation counts where one
of its files exists. A run is traced with ``sys.setprofile`` in its own process; functions of processes that it starts,
and compiled ones, are not counted.
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import re
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[1]
#: most arguments of a function that is not counted
ARGUMENTS = 8
IRREGULAR = frozenset({
    "begun", "bent", "bound", "broken", "built", "chosen", "drawn", "driven", "fallen", "found", "given", "gone",
    "ground", "grown", "held", "kept", "known", "led", "left", "lost", "made", "met", "seen", "sent", "shown",
    "stuck", "taken", "thrown", "told", "torn", "wound", "worn", "written",
})  # fmt: skip
PREPOSITIONS = frozenset({
    "above", "across", "after", "against", "along", "among", "around", "at", "before", "behind", "below",
    "beneath", "beside", "between", "beyond", "by", "down", "for", "from", "in", "inside", "into", "of", "off",
    "on", "onto", "out", "outside", "over", "past", "per", "round", "through", "to", "toward", "under", "until",
    "up", "upon", "with", "within", "without",
})  # fmt: skip
#: what represents the stock, and a cutter: the files or folders of each
STOCK = {
    "layers": ("stock/layers.py",), "moves": ("engagement/moves",), "bricks": ("engagement/bricks",),
    "dexels": ("stock/*dexel*.py",), "plane": ("stock/*planar*.py",), "channel": ("jobs/impeller/blanks.py",),
    "rings": ("stock/*ring*.py",),
}  # fmt: skip
CUTTER = {
    "table": ("cutter/table.py",), "profile": ("cutter/cutter.py",), "rows for layers": ("engagement/immersion",),
    "rows for moves": ("engagement/moves",), "rows for chips": ("engagement/chips",),
}  # fmt: skip

TRACER = """
import json, sys, threading
source, out = sys.argv[1:3]
sys.argv = ["chipload", *sys.argv[3:]]
seen = set()
def entered(frame, event, arg):
    if event == "call":
        seen.add(frame.f_code)
threading.setprofile(entered)
sys.setprofile(entered)
from chipload.cli import main
try:
    main()
except SystemExit:
    pass
finally:
    sys.setprofile(None)
    own = {(c.co_filename, c.co_qualname) for c in seen if c.co_filename.startswith(source) and c.co_name[0] != "<"}
    with open(out, "w") as file:
        json.dump([len({f for f, _ in own}), len(own)], file)
"""


def trees_of(source: Path) -> dict[Path, ast.Module]:
    """The syntax tree of every file below a folder."""
    return {path: ast.parse(path.read_text("utf-8")) for path in sorted(source.rglob("*.py"))}


def arguments(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """The number of parameters of a function, without ``self`` and ``cls``."""
    own = node.args
    names = [x.arg for x in (*own.posonlyargs, *own.args, *own.kwonlyargs, own.vararg, own.kwarg) if x is not None]
    return sum(name not in ("self", "cls") for name in names)


def takes_job(node: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    """Whether the annotation of a parameter names a job or a table of its file."""
    own = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
    texts = [ast.unparse(x.annotation) for x in own if x.annotation is not None]
    return any(re.search(r"\b\w+(Job|Table)\b", text.replace("MachineTable", "")) for text in texts)


def is_participle(name: str) -> bool:
    """Whether a name is one word that is a participle.

    >>> is_participle("_turned"), is_participle("turn_to_axis"), is_participle("speed")
    (True, False, False)
    """
    word = name.strip("_")
    if "_" in word:
        return False
    not_verbs = {"speed", "feed", "need", "seed", "ring", "string", "bearing", "embed"}
    return word not in not_verbs and (word.endswith(("ed", "ing")) or word in IRREGULAR)


def constants(tree: ast.Module) -> int:
    """The number of names in capitals at the top of a module."""
    count = 0
    for node in tree.body:
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        for target in targets if isinstance(node, (ast.Assign, ast.AnnAssign)) else ():
            names = target.elts if isinstance(target, ast.Tuple) else [target]
            count += sum(
                isinstance(x, ast.Name) and re.fullmatch(r"_?[A-Z][A-Z0-9_]*", x.id) is not None for x in names
            )
    return count


def representations(source: Path, kinds: dict[str, tuple[str, ...]]) -> list[str]:
    """Those of which a file exists, with their lines."""
    out = []
    for name, places in kinds.items():
        found = [p for place in places for p in source.glob(place)]
        files = [f for p in found for f in ([p] if p.is_file() else p.rglob("*.py"))]
        if files:
            out.append(f"{name} ({sum(len(f.read_text().splitlines()) for f in files)} lines)")
    return out


def entered_by(tree: Path, example: str) -> tuple[int, int]:
    """Files and functions of the source that a run of an example enters."""
    source = tree / "src" / "chipload"
    with tempfile.TemporaryDirectory() as place:
        out, found = Path(place) / "out", Path(place) / "found.json"
        job = source / "examples" / example / "job.toml"
        environment = {**os.environ, "PYTHONPATH": str(tree / "src")}
        command = [sys.executable, "-c", TRACER, str(source), str(found), "run", str(job), "--out", str(out)]
        subprocess.run(command, env=environment, check=True, stdout=subprocess.DEVNULL)
        files, functions = json.loads(found.read_text())
        return files, functions


def main() -> None:
    """One line for each number."""
    options = argparse.ArgumentParser(description="size and structure of a source tree")
    options.add_argument("--tree", type=Path, default=ROOT, help="checkout that is measured")
    options.add_argument("--run", nargs="*", default=[], metavar="EXAMPLE", help="examples that are run and traced")
    given = options.parse_args()
    source = given.tree.resolve() / "src" / "chipload"
    trees = trees_of(source)
    lines = {path: len(path.read_text("utf-8").splitlines()) for path in trees}
    nodes = [(path, node) for path, tree in trees.items() for node in ast.walk(tree)]
    functions = [(p, n) for p, n in nodes if isinstance(n, (ast.FunctionDef, ast.AsyncFunctionDef))]
    classes = Counter(n.name for _, n in nodes if isinstance(n, ast.ClassDef))
    names = [n.name for _, n in functions if not n.name.startswith("__")]
    longest = sorted(functions, key=lambda x: x[1].lineno - (x[1].end_lineno or 0))[:3]
    bare, total = sum(map(is_participle, names)), sum(lines.values())
    values = sum(map(constants, trees.values()))
    rows = {
        "lines of Python": f"{total} in {len(trees)} files, the longest {max(lines.values())}",
        "functions": f"{len(functions)}, of classes {sum(classes.values())}",
        "longest functions": ", ".join(f"{n.name} {(n.end_lineno or 0) - n.lineno + 1}" for _, n in longest),
        f"functions with over {ARGUMENTS} arguments": sum(arguments(n) > ARGUMENTS for _, n in functions),
        "functions named by a bare participle": f"{bare} ({100.0 * bare / len(names):.1f} %)",
        "functions named by a bare preposition": sum(name.strip("_") in PREPOSITIONS for name in names),
        "constants of modules": f"{values} ({1000.0 * values / total:.1f} a thousand lines)",
        "class names of two classes": sum(count > 1 for count in classes.values()),
        "folders of one file": sum(
            len(list(p.parent.glob("*.py"))) == 2 and p.name != "__init__.py" for p in trees if p.parent != source
        ),
        "functions that take a job or a table of one": sum(takes_job(n) for _, n in functions),
        "representations of the stock": ", ".join(representations(source, STOCK)),
        "representations of a cutter": ", ".join(representations(source, CUTTER)),
    }
    for name, value in rows.items():
        print(f"{name}: {value}")
    for example in given.run:
        files, count = entered_by(given.tree.resolve(), example)
        print(f"a run of {example} enters {files} files, {count} functions")


if __name__ == "__main__":
    main()
