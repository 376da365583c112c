"""The mutation run: what it changes, and that it names files and tests that exist."""

import importlib.util
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
spec = importlib.util.spec_from_file_location("mutate", ROOT / "tools" / "mutate.py")
assert spec is not None
mutate = importlib.util.module_from_spec(spec)
sys.modules["mutate"] = mutate
spec.loader.exec_module(mutate)

SOURCE = b'''"""a + b"""
def f(x: float = 0.5) -> float:
    """x * 2."""
    if x >= 3:
        raise ValueError(f"{x + 1} - 2")
    return -np.sin(x) * 2.0 + x
'''


def test_every_change_once_and_no_text():
    found = [(m.line, m.before, m.after) for m in mutate.mutants_of("a.py", SOURCE)]
    assert found == [
        (4, ">=", "<"), (6, "-", "+"), (6, "sin", "cos"), (6, "*", "/"), (6, "2.0", "2.2"), (6, "+", "-"),
    ]  # fmt: skip


def test_a_mutant_changes_its_place_alone():
    last = mutate.mutants_of("a.py", SOURCE)[-1].applied(SOURCE)
    assert last == SOURCE.replace(b"2.0 + x", b"2.0 - x")


def test_files_and_tests_exist_and_a_seed_gives_one_sample():
    for file, tests in mutate.FILES.items():
        assert (ROOT / mutate.SOURCE / file).is_file(), file
        assert all((ROOT / t).is_file() for t in tests), file
    one, two = (mutate.sample(60, 7, list(mutate.FILES)) for _ in range(2))
    assert one == two
    assert {m.file for m in one} == set(mutate.FILES)
    assert len(one) == 60
