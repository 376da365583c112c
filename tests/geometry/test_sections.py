"""Blade sections: files, what is refused, and the loft through sections whose surface is known."""

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.geometry.sections import check_sections, loft, read_meridian, read_sections


def section(z, count=160, radius=50.0, length=40.0, thick=4.0):
    """An ellipse across the radius at the height z, which rises along it."""
    t = np.linspace(0.0, 2.0 * np.pi, count)
    return np.stack(
        [radius + 0.5 * thick * np.sin(t), 0.5 * length * np.cos(t), z + 0.25 * length * np.cos(t)], axis=-1
    )


def blade(n=5, **how):
    return tuple(section(z, **how) for z in np.linspace(0.0, 30.0, n))


def write(path, points, header=None):
    lines = [" ".join(f"{x:.10f}" for x in row) for row in points]
    path.write_text("\n".join(([header] if header else []) + lines) + "\n")
    return path


def test_loft_goes_through_the_sections():
    made = loft(blade(), count=81)
    v = np.linspace(0.0, 1.0, 5)
    for k in range(5):
        for patch in (made.plus, made.minus):
            at = patch.at(np.linspace(0.05, 0.95, 30), v[k])
            y, x, z = at[:, 1], at[:, 0] - 50.0, at[:, 2]
            np.testing.assert_allclose((y / 20.0) ** 2 + (x / 2.0) ** 2, 1.0, atol=2e-4)
            np.testing.assert_allclose(z, 7.5 * k + 0.5 * y, atol=1e-3)


def test_sides_face_their_theta():
    # a blade along the radius, its faces turned to theta
    turned = tuple(p[:, [1, 0, 2]] + np.array([80.0, -50.0, 0.0]) for p in blade())
    made = loft(turned)
    at, N = made.plus.at(0.5, 0.5)[0], made.plus.normal(0.5, 0.5)[0]
    assert N @ np.array([-at[1], at[0], 0.0]) > 0.0
    assert at[1] > 0.0
    other = made.minus.at(0.5, 0.5)[0]
    assert other[1] < 0.0
    assert made.minus.normal(0.5, 0.5)[0] @ np.array([-other[1], other[0], 0.0]) < 0.0
    assert made.turned(0.5).plus.at(0.5, 0.5)[0] @ at > 0.0


def test_a_section_may_begin_at_the_other_edge():
    """Two of five sections begin at their trailing edge: each side is one face all the way up."""
    rolled = tuple(np.roll(p[:-1], 79, axis=0) if k in (0, 3) else p[:-1] for k, p in enumerate(blade()))
    made, same = loft(rolled), loft(blade())
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0.05, 0.95, 19), np.linspace(0.0, 1.0, 9), indexing="ij"))
    np.testing.assert_allclose(made.plus.at(u, v), same.plus.at(u, v), atol=0.05)
    np.testing.assert_allclose(made.minus.at(u, v), same.minus.at(u, v), atol=0.05)


def test_a_section_across_the_axis_may_begin_at_the_other_edge():
    """Which edge leads is not told by its height: the second of three sections runs as the others."""
    t = np.linspace(0.0, 2.0 * np.pi, 81)[:-1]
    flat = [np.stack([50.0 + 10.0 * np.cos(t), 1.5 * np.sin(t), np.full(80, z)], axis=-1) for z in (40.0, 50.0, 60.0)]
    made, same = loft((flat[0], np.roll(flat[1], 40, axis=0), flat[2])), loft(tuple(flat))
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0.0, 1.0, 19), np.linspace(0.0, 1.0, 9), indexing="ij"))
    np.testing.assert_allclose(made.plus.at(u, v), same.plus.at(u, v), atol=1e-3)
    np.testing.assert_allclose(made.minus.at(u, v), same.minus.at(u, v), atol=1e-3)


def test_units_and_columns(tmp_path):
    p = section(10.0)
    r, theta = np.hypot(p[:, 0], p[:, 1]), np.arctan2(p[:, 1], p[:, 0])
    rows = np.stack([p[:, 2], r * theta, r], axis=-1) / 25.4
    path = write(tmp_path / "one.txt", rows, "X R*THETA R")
    np.testing.assert_allclose(read_sections([path], "inch")[0], p, atol=1e-7)
    np.testing.assert_allclose(read_sections([path], "inch", over=True)[0], p * [1, -1, -1], atol=1e-7)
    xyz = write(tmp_path / "two.txt", p / 10.0, "x y z")
    np.testing.assert_allclose(read_sections([xyz], "cm")[0], p, atol=1e-7)
    bare = write(tmp_path / "three.txt", p)
    with pytest.raises(InputError, match="no line names the columns"):
        read_sections([bare], "mm")
    np.testing.assert_allclose(read_sections([bare], "mm", columns="X Y Z")[0], p, atol=1e-7)
    with pytest.raises(InputError, match=r"columns X R\*THETA R: must be X Y Z as stated"):
        read_sections([path], "mm", columns="X Y Z")


def test_turbogrid_file_holds_all(tmp_path):
    path = tmp_path / "blade.curve"
    text = ["# Profile 1 at 0%", *(" ".join(map(str, row)) for row in section(0.0))]
    text += ["# Profile 2 at 100%", *(" ".join(map(str, row)) for row in section(9.0))]
    path.write_text("\n".join(text))
    got = read_sections([path], "mm")
    assert len(got) == 2
    np.testing.assert_array_equal(got[1], section(9.0))


def test_meridian(tmp_path):
    path = tmp_path / "hub.txt"
    path.write_text("x\tr\n-1.0\t2.0\n0.5\t3.0\n")
    np.testing.assert_allclose(read_meridian(path, "inch", over=True), [[50.8, 25.4], [76.2, -12.7]])
    curve = tmp_path / "hub.curve"
    curve.write_text("3 4 1\n6 8 2\n")
    np.testing.assert_allclose(read_meridian(curve, "mm"), [[5.0, 1.0], [10.0, 2.0]])


def test_refused_sections():
    good = blade()
    assert check_sections(good) is good
    with pytest.raises(InputError, match="sections: 1: must be at least 2"):
        check_sections(good[:1])
    with pytest.raises(InputError, match="section 2: 8 points: must be at least 12"):
        check_sections((good[0], good[1][::20]))
    with pytest.raises(InputError, match="section 2: is not between sections 1 and 3"):
        check_sections((good[0], good[3], good[1], good[4]))
    crossed = good[1].copy()
    crossed[20:60] = crossed[20:60][::-1]
    with pytest.raises(InputError, match="section 2: crosses itself"):
        check_sections((good[0], crossed, good[2]))


def test_wrong_unit_is_found_by_the_outer_diameter():
    as_inch = tuple(p / 25.4 for p in blade())
    outer = 2.0 * np.hypot(blade()[0][:, 0], blade()[0][:, 1]).max()
    with pytest.raises(
        InputError, match=r"outer diameter .* must be .* as stated: smaller by 25.4, as inch read as mm"
    ):
        check_sections(as_inch, outer)
    check_sections(blade(), outer)


def test_refused_files(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_sections([tmp_path / "none.txt"], "mm")
    bad = tmp_path / "bad.txt"
    bad.write_text("X Y Z\n1 2 3\n1 2 q\n")
    with pytest.raises(InputError, match="line 3: not numbers"):
        read_sections([bad], "mm")
    bad.write_text("X Y Z\n1 2 3\n1 2\n")
    with pytest.raises(InputError, match="line 3: 2 numbers: must be 2 or 3, the same in every line"):
        read_sections([bad], "mm")
    bad.write_text("X Y Z\n0 1 2 3 4 5 6\n")
    with pytest.raises(InputError, match=r"7 numbers: .*: write each section to a file of its own, a line X Y Z for"):
        read_sections([bad], "mm")
    with pytest.raises(InputError, match="unit = 'yard': must be one of"):
        read_sections([bad], "yard")
