"""Paths in the folders of the server, and the files that its process may open."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from chipload.errors import InputError
from chipload.mcp.folders import NamedFolders
from chipload.mcp.opening import OpenedFiles
from chipload.mcp.picture import columns_picture
from slot_job import slot_job


@pytest.fixture
def shop(tmp_path) -> NamedFolders:
    (tmp_path / "shop").mkdir()
    (tmp_path / "other").mkdir()
    slot_job(tmp_path / "shop" / "slot")
    slot_job(tmp_path / "other" / "slot")
    (tmp_path / "shop" / "file").symlink_to(tmp_path / "other" / "slot" / "slot.ngc")
    return NamedFolders.of([tmp_path / "shop"])


def test_a_path_is_relative_to_a_folder_or_lies_in_it(shop):
    want = shop.roots[0] / "slot" / "job.toml"
    assert shop.existing("slot/job.toml") == want
    assert shop.existing(str(want)) == want
    assert shop.new("a/b/result") == shop.roots[0] / "a" / "b" / "result"
    assert shop.source("vmc") == "vmc"


def test_the_first_folder_that_has_a_file_counts(tmp_path, shop):
    both = NamedFolders.of([tmp_path / "other", tmp_path / "shop"])
    (tmp_path / "shop" / "own.nc").write_text("M2\n")
    assert both.existing("own.nc") == tmp_path.resolve() / "shop" / "own.nc"
    assert both.existing("slot/job.toml") == tmp_path.resolve() / "other" / "slot" / "job.toml"


@pytest.mark.parametrize(
    "name", ["../other/slot/job.toml", "slot/../../other", "/etc/passwd", "file", "", "a\0b", "..\\other"]
)
def test_what_lies_outside_is_refused(shop, name):
    for ask in (shop.existing, shop.new):
        with pytest.raises(InputError, match="lies outside the folders of this server"):
            ask(name)


def test_a_folder_of_the_server_is_not_replaced(shop):
    with pytest.raises(InputError, match="is a folder of this server itself"):
        shop.new(str(shop.roots[0]))


def test_folders_that_are_not_there_are_refused(tmp_path):
    for folders, message in (([], "no folder is named"), ([tmp_path / "none"], "is not a folder")):
        with pytest.raises(InputError, match=message):
            NamedFolders.of(folders)


@pytest.mark.parametrize("value", ["../../other/slot/slot.ngc", "/etc/hostname", "../file"])
def test_a_job_that_names_a_file_outside_is_refused(shop, value):
    job = shop.roots[0] / "slot" / "job.toml"
    shop.require_job(job)
    job.write_text(job.read_text().replace('"slot.ngc"', f'"{value}"'))
    with pytest.raises(InputError, match=r"job.toml: program.file = '.*': lies outside the folders of this server"):
        shop.require_job(job)


# -- the process ------------------------------------------------------------------------------------------------
def test_the_process_opens_the_folders_and_python_alone(shop, tmp_path):
    files = OpenedFiles(shop, [tmp_path / "cache"])
    own, other = shop.roots[0] / "slot" / "slot.ngc", tmp_path / "other" / "slot" / "slot.ngc"
    assert files.allows(own, True)
    assert files.allows(Path(os.__file__), False)
    assert not files.allows(Path(os.__file__), True)
    assert not files.allows(other, False)
    assert not files.allows(str(shop.roots[0] / "file"), False)
    assert not files.allows("/etc/passwd", False)
    assert not files.allows(str(shop.roots[0]) + "-more", False)
    assert files.allows(3, True)


@pytest.mark.parametrize(
    ("event", "args"),
    [
        ("open", ("OTHER", "r", 0)),
        ("open", ("OTHER", None, os.O_RDONLY)),
        ("open", ("OTHER", "w", os.O_WRONLY | os.O_CREAT)),
        ("os.remove", ("OTHER", -1)),
        ("os.rename", ("OWN", "OTHER", -1, -1)),
        ("os.symlink", ("OTHER", "OWN", -1)),
    ],
)
def test_an_event_outside_is_refused(shop, tmp_path, event, args):
    files = OpenedFiles(shop, [])
    places = {"OTHER": str(tmp_path / "other" / "slot" / "slot.ngc"), "OWN": str(shop.roots[0] / "new")}
    with pytest.raises(PermissionError, match="lies outside the folders of this server"):
        files.hook(event, tuple(places.get(a, a) if isinstance(a, str) else a for a in args))
    files.hook(event, tuple(places["OWN"] if a in places else a for a in args))
    files.hook("import", ("OTHER",))


# -- the picture ------------------------------------------------------------------------------------------------
def test_a_picture_draws_the_line_and_the_limit():
    """Two colours beside white, grey and black: those of the line and of the limit, at the heights of their values."""
    import io

    import numpy as np
    from PIL import Image

    data = columns_picture(np.arange(3.0), {"force_n": np.full(3, 50.0)}, {"force_n": 100.0})
    pixels = np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(int)
    line = np.argwhere((pixels == (52, 87, 166)).all(axis=2))
    limit = np.argwhere((pixels == (179, 38, 30)).all(axis=2))
    # 0 to 100 N between y = 192 and 28: 50 N in the middle, the limit at the upper end
    assert abs(np.median(line[:, 0]) - 110) <= 1
    assert abs(np.median(limit[limit[:, 0] > 20][:, 0]) - 28) <= 1


def test_a_picture_of_nothing_is_refused():
    import numpy as np

    with pytest.raises(InputError, match="nothing of the columns is known"):
        columns_picture(np.arange(3.0), {"force_n": np.full(3, np.nan)}, {})
