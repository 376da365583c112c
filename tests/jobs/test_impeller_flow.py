"""The direction of the flow of an impeller: stated and refused, or found by hub, blade and faces."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.geometry.revolve import Revolved
from chipload.geometry.sections import read_meridian
from chipload.geometry.step_faces import read_faces
from chipload.jobs.impeller.flow import flow_of_faces, flow_of_sections, require_narrow_end_up
from chipload.jobs.impeller.tables import ImpellerTable
from step_files import turned, written

HUB = [[20.0, 40.0], [24.0, 15.0], [60.0, 0.0]]


def impeller_table(over: bool | None) -> ImpellerTable:
    sections = {
        "blade": ("b.curve",), "hub": "h.csv", "shroud": "s.csv", "unit": "mm", "flow_along_x": over,
        "hub_ahead_mm": 1.0,
    }  # fmt: skip
    return ImpellerTable.model_validate({"blades": 7, "outer_diameter_mm": 120.0, "sections": sections})


def test_a_stated_flow_that_contradicts_the_hub_is_refused() -> None:
    """A hub that widens towards the table is milled from above; turned over it is refused, with the value to state."""
    upright, over = Revolved(np.array(HUB), 1), Revolved(np.array(HUB) * (1.0, -1.0), 1)
    require_narrow_end_up(upright, impeller_table(True))
    with pytest.raises(InputError, match=r"flow_along_x = true: the hub would be 60 mm .* 20 mm .*: state false"):
        require_narrow_end_up(over, impeller_table(True))
    with pytest.raises(InputError, match=r"flow_along_x = false: .*: state true"):
        require_narrow_end_up(over, impeller_table(False))


@pytest.mark.parametrize("over", [True, False])
def test_the_flow_that_is_not_stated_is_found(tmp_path: Path, over: bool) -> None:
    """The file's axis goes down from the narrow end where the flow comes along it."""
    given = impeller_table(None).sections
    assert given is not None
    (tmp_path / "h.csv").write_text("".join(f"{-z if over else z} {r}\n" for r, z in HUB))
    found, text = flow_of_sections(tmp_path, given)
    assert found is over
    assert "narrow end" in text


def drop(thick_at_top: bool, thicker: float = 0.8) -> str:
    """Two sections of an axial blade: a drop, round at one end of its chord, along z at radii of 20 and 30 mm."""
    t = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    z, y = 10.0 * np.cos(t), np.sin(t) * (1.0 + thicker * np.cos(t))
    z = z if thick_at_top else -z
    lines = []
    for r in (20.0, 30.0):
        lines.append("# section")
        lines += [f"{r * np.cos(a / r)} {r * np.sin(a / r)} {b}" for a, b in zip(y, z, strict=True)]
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("over", [True, False])
def test_of_a_straight_hub_the_thick_edge_tells_the_flow(tmp_path: Path, over: bool) -> None:
    given = impeller_table(None).sections
    assert given is not None
    (tmp_path / "h.csv").write_text("-20.0 20.0\n20.0 20.1\n")
    (tmp_path / "b.curve").write_text(drop(thick_at_top=not over))
    found, text = flow_of_sections(tmp_path, given)
    assert found is over
    assert "thicker edge" in text


def test_a_straight_hub_and_blades_alike_at_both_edges_do_not_tell_it(tmp_path: Path) -> None:
    given = impeller_table(None).sections
    assert given is not None
    (tmp_path / "h.csv").write_text("-10 20\n10 20\n")
    (tmp_path / "b.curve").write_text(drop(True, 0.0))
    with pytest.raises(InputError, match=r"flow_along_x: missing: .*: state true or false"):
        flow_of_sections(tmp_path, given)


def test_a_straight_hub_in_a_step_file_does_not_tell_it(tmp_path: Path) -> None:
    tube = Revolved(np.array([[20.0, 40.0], [20.0, 0.0]]), 1)
    faces = read_faces(written(tmp_path / "tube.step", turned(tube))).faces
    with pytest.raises(InputError, match=r"impeller.step.flow: missing: the hub is 20 and 20 mm .*: state \+z or -z"):
        flow_of_faces(faces, "impeller.step.hub")


@pytest.mark.parametrize("backwards", [True, False])
def test_a_meridian_begins_at_its_inlet_however_the_file_is_ordered(tmp_path: Path, backwards: bool) -> None:
    """The normal of the hub is by the order of its points: out of the metal for either order of the file."""
    rows = HUB[::-1] if backwards else HUB
    (tmp_path / "h.csv").write_text("".join(f"{z} {r}\n" for r, z in [*rows, rows[-1]]))
    found = read_meridian(tmp_path / "h.csv", "mm")
    assert found.tolist() == HUB
    assert (Revolved(found, 1).normal([0.0, 0.5], [0.0, 0.0])[:, 0] > 0.0).all()
