"""Columns as Arrow arrays: as Arrow's own conversion makes them, without its import of pandas."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pyarrow as pa
import pytest

from chipload.arrow import arrow_array

BITS = np.arange(19) % 3 == 0


@pytest.mark.parametrize(
    "values",
    [np.arange(5.0)[::2], np.array([-1, 2]), np.array([3], dtype=np.int32), BITS, BITS[:0], np.float32([0.1, np.nan])],
    ids=lambda values: f"{values.dtype}-{len(values)}",
)
def test_numbers_are_those_of_arrow(values: np.ndarray):
    made, known = arrow_array(values), pa.array(values, from_pandas=False)
    assert made.type == known.type
    assert made.null_count == 0
    made.validate(full=True)
    assert made.equals(known) or (np.isnan(values).any() and np.array_equal(made.to_numpy(), values, equal_nan=True))


@pytest.mark.parametrize("texts", [["cut", "ä link", "cut", ""], []])
def test_texts_are_a_dictionary_in_the_order_in_which_they_come(texts: list[str]):
    made = arrow_array(np.array(texts, dtype=object))
    made.validate(full=True)
    assert made.equals(pa.array(texts, type=pa.string()).dictionary_encode())


def test_pandas_is_not_imported():
    code = (
        "import sys, numpy as np; from chipload.arrow import arrow_array; arrow_array(np.zeros(2)); "
        "arrow_array(np.array(['cut'], dtype=object)); print('pandas' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
