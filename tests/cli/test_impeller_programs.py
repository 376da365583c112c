"""Finishing programs of an impeller by the command line: what is written against what the summary says of it."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from chipload import examples
from chipload.cli import app
from chipload.machine.kinematics import forward
from chipload.machine.machine import machine_named
from chipload.planning.sectional.parametric import Shape, impeller_of

SURFACE = """[[surface]]
body = "blade"
side = "plus"
along = [0.30, 0.45]
up = [0.50, 0.70]
points = [4, 4]

"""


def job(folder, **changes):
    text = (Path(examples.__file__).parent / "impeller" / "job.toml").read_text()
    text = text[: text.index("[[surface]]")] + SURFACE + text[text.index("[[operation]]") :]
    for key, value in ({"most_cutters": "1", "check_mm": "2.0"} | changes).items():
        text, n = re.subn(rf"^{key} = .*$", f"{key} = {value}", text, flags=re.MULTILINE)
        assert n
    folder.mkdir()
    (folder / "job.toml").write_text(text)
    return folder / "job.toml"


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    root = tmp_path_factory.mktemp("programs")
    path = job(root / "one", scallop_mm="0.1")
    done = CliRunner().invoke(app, ["run", str(path), "--out", str(root / "out")])
    assert done.exit_code in (0, 3), done.output
    return done, root / "out", json.loads((root / "out" / "summary.json").read_bytes())


def test_exit_code_and_first_lines_say_whether_it_is_verified(result):
    done, out, summary = result
    (op,) = summary["operations"]
    assert (done.exit_code == 0) == summary["holds"] == (not op["fails"])
    texts = sorted(out.glob("*.ngc"))
    assert len(texts) == len(op["programs"]) > 0
    for text, program in zip(texts, op["programs"], strict=True):
        first = text.read_text().splitlines()[0]
        said = "(chipload: verified by independent simulation)" if program["verified"] else "NOT VERIFIED"
        assert said in first
        assert program["verified"] == (
            program["gouge_mm"] <= 0.05 and all(x["scallop_greatest_mm"] <= 0.1 for x in program["patches"])
        )
        assert text.with_suffix(".apt").is_file()


def test_the_scallop_is_as_asked(result):
    *_, summary = result
    for program in summary["operations"][0]["programs"]:
        for patch in program["patches"]:
            assert patch["scallop_greatest_mm"] <= 0.1
            assert patch["scallop_mean_share"] >= 0.6
            assert patch["crests"] > 0


def test_the_axes_lead_the_cutter_along_the_blade(result):
    """The index table stands, and at the feed the cutter touches the blade: by distances to a fine cloud of it."""
    _, out, summary = result
    machine, impeller = machine_named("horizontal-b"), impeller_of(Shape())
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0.25, 0.5, 300), np.linspace(0.4, 0.8, 200), indexing="ij"))
    cloud = impeller.blade.plus.at(u, v)
    for text, program in zip(sorted(out.glob("*.ngc")), summary["operations"][0]["programs"], strict=True):
        q, rows, finish = np.zeros(9), [], False
        for line in text.read_text().splitlines():
            if line.startswith("("):
                finish = line == "(finish)"
            elif re.search(r"[XYZAB]-?[\d.]", line):
                for letter, value in re.findall(r"([XYZAB])(-?[\d.]+)", line):
                    q["XYZAB".index(letter)] = float(value) * (math.pi / 180.0 if letter in "AB" else 1.0)
                rows.append((q.copy(), finish))
        axes = np.array([r for r, _ in rows])
        cut = np.array([f for _, f in rows])
        assert np.degrees(axes[:, 3]) == pytest.approx(90.0 - program["table_deg"])
        tips, T = forward(machine, axes[cut][::7])
        R, r = 0.5 * program["diameter_mm"], program["corner_radius_mm"]
        for p, a in zip(tips, T, strict=True):
            d = cloud - p
            h = d @ a
            away = np.linalg.norm(d - h[:, None] * a, axis=1)
            profile = R - r + np.where(h < r, np.sqrt(np.clip(r * r - (r - h) ** 2, 0.0, None)), r)
            gap = np.where(h < 0.0, np.inf, away - profile).min()
            # the cloud is 0.15 mm wide: it misses the contact by its sagitta
            assert -0.03 <= gap <= 0.03
