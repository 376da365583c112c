"""Blade rows as BladeGen and CFturbo write them: what is read, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.geometry.bladegen import BladeRow, is_blade_row, read_blade_row
from chipload.geometry.sections import read_sections

TEXT = """!======  CFX-BladeGen Export  ========
Axis of Rotation: X
Number of Blade Sets: 9
Number of Blades Per Set: 2
Geometry Units: MM
Blade 0 LE: EllipseEnd
Hub Data File: hub.curve
Shroud Data File: C:\\wheel\\shroud.curve
Profile Data File: profile.curve
"""


def row(folder: Path, text: str = TEXT) -> Path:
    for name in ("hub", "shroud", "profile"):
        (folder / f"{name}.curve").write_text("0 0 0\n")
    (folder / "BladeGen.inf").write_text(text)
    return folder / "BladeGen.inf"


def test_a_row(tmp_path: Path) -> None:
    path = row(tmp_path)
    assert is_blade_row(path)
    files = [tmp_path / f"{name}.curve" for name in ("profile", "hub", "shroud")]
    assert read_blade_row(path) == BladeRow(9, True, "mm", "x", *files)
    short = row(tmp_path, "".join(x + "\n" for x in TEXT.splitlines() if "Axis" not in x and "Per Set" not in x))
    assert read_blade_row(short) == BladeRow(9, False, "mm", "z", *files)


@pytest.mark.parametrize(("old", "new", "message"), [
    ("Geometry Units: MM", "Geometry Units: MILES", r"Geometry Units: MILES: must be one of M, CM, MM"),
    ("Rotation: X", "Rotation: Q", r"Axis of Rotation: q: must be X, Y or Z"),
    ("Sets: 9", "Sets: 0", r"Number of Blade Sets: 0: must be a whole number from 1 to 1000"),
    ("Set: 2", "Set: 3", r"Number of Blades Per Set: 3: must be 1, or 2"),
    ("Hub Data File: hub.curve", "", r"Hub Data File: missing"),
    ("shroud.curve", "cover.curve", r"Shroud Data File: cover.curve: is not beside it"),
])  # fmt: skip
def test_what_is_refused(tmp_path: Path, old: str, new: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_blade_row(row(tmp_path, TEXT.replace(old, new)))


def test_blades_of_one_file_and_another_axis(tmp_path: Path) -> None:
    """Main blade and splitter in one file, about x: each with its own sections, z along the axis."""
    rng = np.random.default_rng(3)
    points = rng.uniform(1.0, 9.0, size=(2, 2, 15, 3))
    lines: list[str] = []
    for name, blade in zip(("Main Blade", "Splitter Blade 1"), points, strict=True):
        lines.append(f"## {name}")
        for k, section in enumerate(blade, 1):
            lines += [f"# Profile {k} at {100 * (k - 1)}%", *(" ".join(map(str, p)) for p in section)]
    path = tmp_path / "profile.curve"
    path.write_text("\n".join(lines) + "\n")
    for body in range(2):
        found = read_sections([path], "mm", axis="x", body=body)
        np.testing.assert_array_equal(np.array(found), points[body][..., [1, 2, 0]])
    np.testing.assert_array_equal(np.array(read_sections([path], "mm", axis="y"))[..., 2], points[0][..., 1])
    with pytest.raises(InputError, match=r"2 blades \(lines that begin with ##\): must have at least 3"):
        read_sections([path], "mm", body=2)
