"""The pages of docs/ that are made from the source are current."""

from __future__ import annotations

import json
import re
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest

from chipload.result import COLUMNS, Summary
from chipload.result.columns import BOUNDED

ROOT = Path(__file__).parents[1]


def _reference():
    spec = spec_from_file_location("docs_reference", ROOT / "tools" / "docs_reference.py")
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


PAGES = _reference().PAGES


@pytest.mark.parametrize("name", sorted(PAGES))
def test_the_page_is_current(name):
    assert (ROOT / "docs" / name).read_text(encoding="utf-8") == PAGES[name](), "run make reference"


def test_the_schema_describes_every_key_of_the_summary():
    schema = json.loads((ROOT / "docs" / "summary.schema.json").read_text())
    assert set(schema["properties"]) == set(schema["required"]) == set(Summary.model_fields)
    for definition in schema["$defs"].values():
        if definition.get("type") == "object":
            assert definition["additionalProperties"] is False
            assert set(definition["required"]) == set(definition["properties"])


def test_the_table_of_columns_names_each_once():
    text = (ROOT / "docs" / "columns.md").read_text()
    names = re.findall(r"^\| `(\w+)` \|", text, re.MULTILINE)
    assert sorted(names) == sorted([*COLUMNS, *BOUNDED])
