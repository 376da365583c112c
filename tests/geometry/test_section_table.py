"""Tables with all sections of a blade, as pyturbo-aero writes them: against a blade that is known."""

from pathlib import Path

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.geometry.sections import check_sections, loft, read_meridian, read_sections

HALF = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 40))


def place(height, s, across):
    """x along the axis, r, th of a blade that goes from axial to radial, ``across`` [mm] its middle surface."""
    turn = 0.5 * np.pi * s
    x, r = (40.0 - height) * np.sin(turn), 60.0 - (40.0 - height) * np.cos(turn)
    return np.stack([x, r, 0.5 * s + across / r], axis=-1)


def table(kind, spans=(0.0, 5.0, 10.0)):
    """Lines of a table of columns `xrth` or `xyz`, in m."""
    names = {"xrth": "x r th", "xyz": "x y z"}[kind].split()
    lines = ["span_index," + ",".join(f"{side}_{name}" for side in ("ss", "ps") for name in names)]
    thick = 3.0 * np.sqrt(HALF * (1.0 - HALF))
    for k, height in enumerate(spans):
        sides = []
        for across in (-thick, thick):
            p = place(height, HALF, across)
            if kind == "xyz":
                p = np.stack([p[:, 0], p[:, 1] * np.sin(p[:, 2]), p[:, 1] * np.cos(p[:, 2])], axis=-1)
                p *= 1e-3
            else:
                p *= np.array([1e-3, 1e-3, 1.0])
            sides.append(p)
        lines += [f"{k}, " + ", ".join(f"{x:.9f}" for x in row) for row in np.concatenate(sides, axis=1)]
    return lines


def write(path: Path, lines: list[str]) -> Path:
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize("kind", ["xrth", "xyz"])
def test_a_table_is_its_sections_and_their_surfaces_of_revolution(tmp_path, kind):
    path = write(tmp_path / "blade.csv", table(kind))
    sections = read_sections([path], "m")
    assert [len(p) for p in sections] == [78, 78, 78]
    for height, p in zip((0.0, 5.0, 10.0), sections, strict=True):
        # on its surface of revolution, a quarter of a circle round x = 0, r = 60
        away = np.hypot(p[:, 2], 60.0 - np.hypot(p[:, 0], p[:, 1]))
        np.testing.assert_allclose(away, 40.0 - height, atol=1e-5)
        # first the side of the smaller th, from z towards y
        th = np.arctan2(p[:, 0], p[:, 1])
        assert (th[1:39] < th[:39:-1]).all()
    assert loft(check_sections(sections, 120.0)).plus.at(0.5, 0.5)[0][0] > 0.0
    for shroud, radius in ((False, 40.0), (True, 30.0)):
        r, z = read_meridian(path, "m", shroud=shroud).T
        np.testing.assert_allclose(np.hypot(z, 60.0 - r), radius, atol=1e-5)
        assert z[0] == pytest.approx(0.0, abs=1e-5)
        assert r[-1] == pytest.approx(60.0, abs=1e-5)
        # points are not so near that the rounding of the file bends the curve
        assert np.linalg.norm(np.diff(np.stack([r, z]), axis=1), axis=0).min() > 0.009 * radius * 0.5 * np.pi
        np.testing.assert_allclose(read_meridian(path, "m", over=True, shroud=shroud).T, [r, -z])


def test_both_tables_of_a_blade_are_the_same(tmp_path):
    one, two = (read_sections([write(tmp_path / f"{kind}.csv", table(kind))], "m") for kind in ("xrth", "xyz"))
    for a, b in zip(one, two, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-4)


def test_refused_tables(tmp_path):
    lines = table("xyz")
    path = tmp_path / "blade.csv"
    write(path, [lines[0].replace("ss_y", "ss_q"), *lines[1:]])
    with pytest.raises(InputError, match=r"columns ss_x ss_q ss_z .* after span_index: must be ss_x ss_y ss_z"):
        read_sections([path], "m")
    write(path, [*lines[:5], "0, 1, 2, 3", *lines[5:]])
    with pytest.raises(InputError, match="line 6: must be seven finite numbers: '0 1 2 3'"):
        read_sections([path], "m")
    write(path, [*lines[:5], "0, 1, 2, 3, q, 4, 5", *lines[5:]])
    with pytest.raises(InputError, match="line 6: not numbers"):
        read_meridian(path, "m")
    write(path, [lines[0], *lines[41:], *lines[1:41]])
    with pytest.raises(InputError, match="span_index: must ascend from hub to shroud"):
        read_sections([path], "m")
    with pytest.raises(InputError, match="columns X Y Z: must not be stated: the table names its own"):
        read_sections([write(path, lines)], "m", columns="X Y Z")


def blade3d(folder: Path, sections: int = 4, points: int = 41) -> tuple[Path, np.ndarray]:
    """A blade along x by formula as T-Blade3 writes it, about the axis x, and its points (k, m, 3)."""
    turn = np.linspace(0.0, 2.0 * np.pi, points)
    rows = []
    for k in range(sections):
        r, th = 40.0 + 10.0 * k, 0.02 * np.sin(turn) + (0.4 + 0.1 * k) * np.cos(turn)
        rows.append(np.stack([20.0 - 20.0 * np.cos(turn), r * np.sin(th), r * np.cos(th)], axis=-1))
    p = np.array(rows)
    p[:, -1] = p[:, 0]
    lines = [f"{points} {sections}", *(" ".join(f"{x:.12f}" for x in q) for q in p.reshape(-1, 3))]
    path = folder / "blade3d.case.dat"
    path.write_text("\n".join(lines) + "\n")
    return path, p


def test_a_blade3d_file_has_its_sections_hub_and_shroud(tmp_path: Path) -> None:
    path, p = blade3d(tmp_path)
    found = read_sections([path], "mm")
    assert [len(q) for q in found] == [40] * 4
    for a, b in zip(found, p, strict=True):
        assert a == pytest.approx(b[:-1, [1, 2, 0]], abs=1e-11)
    for shroud, radius in ((False, 40.0), (True, 70.0)):
        meridian = read_meridian(path, "mm", shroud=shroud)
        assert meridian[:, 0] == pytest.approx(radius, abs=1e-9)
        assert meridian[[0, -1], 1] == pytest.approx([40.0, 0.0], abs=1e-9)


def test_a_blade3d_file_without_a_point_is_refused(tmp_path: Path) -> None:
    path, _ = blade3d(tmp_path)
    path.write_text("\n".join(path.read_text().splitlines()[:-1]))
    with pytest.raises(InputError, match=r"case\.dat: 163 points: must be 164: line 1 states 41 points of 4 sections$"):
        read_sections([path], "mm")
