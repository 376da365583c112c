"""Print the sizes that docs/design/results.md states: lines, longest functions, large records, names.

The counts are those that tests/test_records.py and tests/test_words.py hold.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))

import test_records as records  # noqa: E402
import test_words as words  # noqa: E402


def main() -> None:
    """One line for each number."""
    files = {path: len(path.read_text().splitlines()) for path in records.SOURCE.rglob("*.py")}
    functions = sorted(records.functions().items(), key=lambda x: -x[1])
    large = [name for name, count in records.records().items() if count > records.FIELDS]
    classes = Counter(n.rsplit(":", 1)[1] for n in words.names_of_source() if n.startswith("class "))
    print(f"lines of Python in src/: {sum(files.values())} in {len(files)} files, the longest {max(files.values())}")
    print("longest functions: " + ", ".join(f"{name} {lines}" for name, lines in functions[:5]))
    print(f"functions over {records.LINES} lines: {sum(lines > records.LINES for _, lines in functions)}")
    print(f"records over {records.FIELDS} fields: {len(large)}")
    print(f"class names that two files define: {sum(count > 1 for count in classes.values())}")
    print(f"names with private words: {len(words.private())}, standard terms: {len(words.STANDARD)}")


if __name__ == "__main__":
    main()
