"""Write the pages of docs/ that are made from the source: schema, columns, jobs, materials and controls.

Run it after a change of the schema, of the table of columns or of the tables of a job: ``make reference``. With
``--check`` nothing is written; the exit code is 1 if a page is not current.
"""

from __future__ import annotations

import json
import sys
from functools import partial
from pathlib import Path

from chipload.jobs.control_reference import control_page, control_pages
from chipload.jobs.reference import reference
from chipload.jobs.shipped import materials
from chipload.result import COLUMNS, SCHEMA_VERSION, Summary
from chipload.result.columns import BOUNDED

DOCS = Path(__file__).parents[1] / "docs"
HEAD = """# Columns and limits

Every quantity of a result has one name, with the unit in it. A limit in `[limits]` of a job has the name of the column
that it bounds. The fields of `history.parquet` carry unit, label and meaning as metadata. The last column states where
the error of a quantity comes from: it is exact, or as that of other columns, or the calculation states it. A limit on a
quantity whose error nothing states is unproven.

This page is made from `src/chipload/result/columns.py` by `make reference`.
"""

MATERIALS = """# Shipped materials

`[material] name` names one of these. Each holds in the range of chip thickness that is shown: in steps with thicker or
thinner chips its loads are unproven. The spread is the relative standard deviation of the coefficients, where three are
stated of the tangential, radial and axial ones; limits are held with it ([how](how-to/confidence.md)).

* `group-*`: a group of VDI 3323. It has the tangential force alone and proves torque and power; force direction,
  deflection and stability are unproven.
* `ALLOY-from-*`: six coefficients by a rule from a group or a sister alloy, with the spread of the rule
  ([which](design/materials.md)). They prove all loads, with much room: the last column but one is the share of a limit
  that the nominal value may reach.
* the others: six measured coefficients. Measure your own by `chipload fit` ([how](how-to/material.md)).

This page is made from `src/chipload/data/materials` by `make reference`; `chipload materials` prints it.
"""


def schema_text() -> str:
    """The JSON Schema of summary.json."""
    schema = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **Summary.model_json_schema(mode="serialization"),
    }
    schema["title"] = f"summary.json of chipload, schema version {SCHEMA_VERSION}"
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"


def columns_text() -> str:
    """The table of columns, and the limits of another name."""
    rows = ["| column | unit | label | meaning | error |", "|---|---|---|---|---|"]
    for c in COLUMNS.values():
        signed = " (a limit bounds its size)" if c.signed else ""
        rows.append(f"| `{c.name}` | {c.unit} | {c.label} | {c.meaning}{signed} | {c.error.text} |")
    others = ["| limit | column that it bounds | label |", "|---|---|---|"]
    others += [f"| `{limit}` | `{column}` | {label} |" for limit, (column, label) in BOUNDED.items()]
    return "\n".join([HEAD, *rows, "", "## Limits that bound a column of another name", "", *others, ""])


def materials_text() -> str:
    """The table of the shipped materials."""
    listing = materials()
    lines = ["| " + " | ".join(listing.head) + " |", "|" + "---|" * len(listing.head)]
    lines += ["| " + " | ".join((f"`{name}`", *rest)) + " |" for name, *rest in listing.rows]
    return "\n".join([MATERIALS, *lines, ""])


PAGES = {
    "summary.schema.json": schema_text,
    "columns.md": columns_text,
    "jobs.md": reference,
    "materials.md": materials_text,
    **{name: partial(control_page, Path(name).stem) for name in control_pages()},
}


def main(check: bool) -> int:
    """Write the pages, or name those that are not current."""
    stale = [name for name, text in PAGES.items() if not current(name, text())]
    for name in stale:
        if check:
            print(f"docs/{name}: is not current: run make reference")
        else:
            (DOCS / name).parent.mkdir(exist_ok=True)
            (DOCS / name).write_text(PAGES[name](), encoding="utf-8")
            print(f"written: docs/{name}")
    return 1 if check and stale else 0


def current(name: str, text: str) -> bool:
    """Whether a page of docs/ has this text."""
    path = DOCS / name
    return path.exists() and path.read_text(encoding="utf-8") == text


if __name__ == "__main__":
    sys.exit(main("--check" in sys.argv[1:]))
