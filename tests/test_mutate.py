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
    files = [*mutate.FILES, *mutate.KERNELS]
    assert all((ROOT / mutate.SOURCE / file).is_file() for file in files)
    assert all((ROOT / t).exists() for t in mutate.TESTS)
    one, two = (mutate.sample(60, 7, files) for _ in range(2))
    assert one == two
    assert {m.file for m in one} == set(files)
    assert len(one) == 60


LIVE = """import functools
LIMIT = 2.0
def plain(x):
    return x + 1.0
class Thing:
    @property
    def value(self):
        return 3.0 * LIMIT
    @functools.lru_cache
    def kept(self):
        return 5.0 - 1.0
"""


def test_a_changed_function_is_put_in_place_of_the_live_one(tmp_path):
    """Functions, properties and methods under decorators change; what is outside every function does not."""
    path = tmp_path / "live.py"
    path.write_text(LIVE)
    found = importlib.util.spec_from_file_location("live", path)
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    held = module.plain, module.Thing()
    for before, after in (("x + 1.0", "x - 1.0"), ("3.0 * L", "3.0 / L"), ("5.0 - 1", "5.0 + 1")):
        source = LIVE.replace(before, after).encode()
        line = LIVE[: LIVE.index(before)].count("\n") + 1
        assert mutate.function_at(source, line) is not None
        assert mutate.put_in_place(module, source, line)
    assert (held[0](4.0), held[1].value, held[1].kept()) == (3.0, 1.5, 6.0)
    assert mutate.function_at(LIVE.encode(), 2) is None
