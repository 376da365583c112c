"""Names of result folders that the page cannot write are refused with a reason."""

from __future__ import annotations

from pathlib import Path

import pytest

from chipload.errors import InputError
from chipload.web.folder_access import target_in


@pytest.mark.parametrize("name", ["a" * 300, "a" * 5000])
def test_a_name_that_is_too_long(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError) as err:
        target_in(tmp_path.resolve(), name)
    assert str(err.value) == f"{name[:40]}: cannot be written: File name too long: name another folder"


def test_a_link_out_of_the_opened_folder(tmp_path: Path) -> None:
    root = (tmp_path / "root").resolve()
    root.mkdir()
    (root / "away").symlink_to(tmp_path)
    with pytest.raises(InputError, match=r"^away/new: must be the name of a folder in the opened one$"):
        target_in(root, "away/new")
    assert target_in(root, " new ") == root / "new"
