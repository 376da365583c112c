"""Arrays of numbers from .npz files: written by NumPy, read back equal; damaged, foreign and large ones are refused."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest

from chipload.arrays import read_arrays
from chipload.errors import InputError


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A file of three arrays, as NumPy writes it."""
    path = tmp_path / "a.npz"
    np.savez_compressed(path, points=np.arange(6.0).reshape(2, 3), rows=np.array([1, 5]), one=np.array(2.5))
    return path


def test_arrays_as_numpy_wrote_them(file: Path):
    found = read_arrays(file)
    with np.load(file) as held:
        assert found.keys() == set(held.files)
        assert all((found[name] == held[name]).all() and found[name].dtype == held[name].dtype for name in found)
    assert read_arrays(file, wanted="rows".__eq__).keys() == {"rows"}


@pytest.mark.parametrize("at", [10, 40, 60, 120, 200, 300])
def test_a_changed_byte_is_refused_or_changes_nothing(file: Path, at: int):
    data = bytearray(file.read_bytes())
    whole = {name: values.copy() for name, values in read_arrays(file).items()}
    data[at] ^= 0x5A
    file.write_bytes(data)
    try:
        found = read_arrays(file)
    except InputError as err:
        text = str(err)
    else:
        text = "a.npz: damaged: : run the job again"
        assert all((found[name] == whole[name]).all() for name in found)
    assert text.startswith("a.npz: damaged: ")
    assert text.endswith(": run the job again")


def test_texts_and_objects_are_refused(tmp_path: Path):
    for k, values in enumerate((np.array("a text"), np.array([{"a": 1}], dtype=object))):
        path = tmp_path / f"{k}.npz"
        np.savez(path, x=values)
        with pytest.raises(InputError, match="damaged: "):
            read_arrays(path)


def test_a_size_beyond_its_bytes_is_refused(tmp_path: Path):
    sink = io.BytesIO()
    np.save(sink, np.zeros(4))
    with zipfile.ZipFile(tmp_path / "b.npz", "w") as archive:
        archive.writestr("x.npy", sink.getvalue().replace(b"(4,)", b"(9,)"))
    with pytest.raises(InputError, match=r"b.npz: damaged: x: its size is not that of its header: run the job again"):
        read_arrays(tmp_path / "b.npz")
