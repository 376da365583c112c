from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.machine.ini import read_ini
from chipload.machine.kinematics import forward
from chipload.machine.trajectory import TrajectoryPlanner

TRT = """\
# a comment
[EMC]
MACHINE = mine
[KINS]
KINEMATICS = xyzac-trt-kins sparm=identityfirst
JOINTS = 5
[HAL]
HALFILE = LIB:basic_sim.tcl
HALFILE = offsets.hal
HALCMD = net  :y-offset     xyzac-trt-kins.y-offset    gui.y-offset
HALCMD = net  :z-offset     xyzac-trt-kins.z-offset <= gui.z-offset
HALCMD = sets :y-offset     2
[TRAJ]
COORDINATES = XYZAC
LINEAR_UNITS = inch
ANGULAR_UNITS = deg
MAX_LINEAR_VELOCITY = 3
[AXIS_A]
MIN_LIMIT = -36000
MAX_LIMIT = 36000
[JOINT_0]
MIN_LIMIT = -8
MAX_LIMIT = \\
  8
MAX_VELOCITY = 1 # fast
MAX_ACCELERATION = 20
[JOINT_1]
MIN_LIMIT = -8
MAX_LIMIT = 8
MAX_VELOCITY = 1
MAX_ACCELERATION = 20
[JOINT_2]
MIN_LIMIT = -8
MAX_LIMIT = 8
MAX_VELOCITY = 1
MAX_ACCELERATION = 20
[JOINT_3]
MIN_LIMIT = -100
MAX_LIMIT = 50
MAX_VELOCITY = 30
MAX_ACCELERATION = 300
[JOINT_4]
WRAPPED_ROTARY = 1
MAX_VELOCITY = 30
MAX_ACCELERATION = 300
[SPINDLE_0]
MAX_FORWARD_VELOCITY = 6000
"""


def written(folder, text=TRT):
    path = folder / "mine.ini"
    path.write_text(text)
    (folder / "offsets.hal").write_text("sets :z-offset 1  # of A above C\nsetp xyzac-trt-kins.x-rot-point 0.5\n")
    return path


def test_a_trunnion_in_inches(tmp_path):
    machine, findings = read_ini(written(tmp_path))
    assert (machine.name, machine.chain.letters, machine.rapid) == ("mine", "CAXYZ", 3 * 25.4)
    a, c, x = (machine.chain.axis(letter) for letter in "ACX")
    assert (x.low, x.high, x.rate, x.acceleration) == pytest.approx((-203.2, 203.2, 25.4, 508.0))
    assert (a.low, a.high) == pytest.approx((math.radians(-100), math.radians(50)))
    assert (c.low, c.high, c.rate) == (-math.inf, math.inf, pytest.approx(math.radians(30)))
    assert a.pivot == pytest.approx((12.7, 50.8, 25.4))
    assert c.pivot == pytest.approx((12.7, 0.0, 0.0))
    assert (a.direction, c.direction) == ((-1.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    assert machine.spindle_max == pytest.approx(6000 * math.tau / 60)
    assert [f.text for f in findings] == [
        "LIB:basic_sim.tcl is not read: only .hal files beside the .ini are",
        "xyzac-trt-kins.y-rot-point is not set to a number: 0 is taken",
        "xyzac-trt-kins.z-rot-point is not set to a number: 0 is taken",
    ]


def test_conventional_directions(tmp_path):
    hal = "HALCMD = setp xyzac-trt-kins.conventional-directions 1\n[TRAJ]"
    machine, _ = read_ini(written(tmp_path, TRT.replace("[TRAJ]", hal)))
    assert machine.chain.axis("C").direction == (0.0, 0.0, 1.0)


TRIVIAL = """\
[KINS]
KINEMATICS = trivkins
[TRAJ]
COORDINATES = X Y Z A
LINEAR_UNITS = mm
ANGULAR_UNITS = degree
MAX_LINEAR_ACCELERATION = 900
[AXIS_X]
MIN_LIMIT = -10
MAX_LIMIT = 10
MAX_VELOCITY = 50
[JOINT_0]
MIN_LIMIT = -5
MAX_LIMIT = 20
MAX_VELOCITY = 60
[AXIS_Y]
MAX_LIMIT = 10
MAX_VELOCITY = 50
[AXIS_Z]
MIN_LIMIT = -10
MAX_LIMIT = 10
MAX_VELOCITY = 50
[AXIS_A]
MAX_VELOCITY = 10
MAX_ACCELERATION = 10
"""


def test_trivial_kinematics_say_what_is_not_said(tmp_path):
    machine, findings = read_ini(written(tmp_path, TRIVIAL))
    x, y = machine.chain.axis("X"), machine.chain.axis("Y")
    assert (x.low, x.high, x.rate, x.acceleration, y.low) == (-5.0, 10.0, 50.0, 900.0, -math.inf)
    assert (machine.name, machine.rapid, machine.spindle_max) == ("mine", 50.0, math.inf)
    assert sorted(f.code for f in findings) == [
        *["ini-acceleration"] * 3,
        "ini-kinematics",
        *["ini-limit"] * 3,
        "ini-spindle",
        "ini-velocity",
    ]
    assert findings[0].text == "A: trivkins do not state its position: taken as a table about X through the origin"
    axes = np.zeros((1, 9))
    axes[0, 3] = math.pi / 2
    np.testing.assert_allclose(forward(machine, axes)[1], [[0.0, -1.0, 0.0]], atol=1e-15)  # right-handed about +X


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "LINEAR_UNITS = inch",
            "",
            "[TRAJ] LINEAR_UNITS is missing: must be one of mm, metric, in, inch, imperial, cm",
        ),
        (
            "ANGULAR_UNITS = deg",
            "ANGULAR_UNITS = turns",
            "[TRAJ] ANGULAR_UNITS = turns: must be one of deg, degree, rad, radian, grad, gon",
        ),
        (
            "xyzac-trt-kins sparm",
            "genhexkins sparm",
            "KINEMATICS = genhexkins: must be trivkins, xyzac-trt-kins, xyzbc-trt-kins, xyzab_tdr_kins, 5axiskins",
        ),
        ("KINEMATICS = xyzac-trt-kins sparm=identityfirst", "", "[KINS] KINEMATICS is missing: must be given"),
        ("sparm=identityfirst", "coordinates=xyzc", "coordinates XYZC: A: must be letters of XYZABCUVW, all of CAXYZ"),
        ("MIN_LIMIT = -100", "MIN_LIMIT = low", "[JOINT_3] MIN_LIMIT = low: must be a finite number"),
        ("MIN_LIMIT = -100", "MIN_LIMIT = 60", "machine.axis.a.max_deg = 50: must be above min_deg = 60"),
        ("MAX_VELOCITY = 1 # fast\nMAX_ACCELERATION = 20", "", "[AXIS_X] MAX_ACCELERATION is missing: must be given"),
    ],
)
def test_refused(tmp_path, old, new, message):
    assert old in TRT
    path = written(tmp_path, TRT.replace(old, new, 1))
    with pytest.raises(InputError) as err:
        read_ini(path)
    assert str(err.value) == f"machine {path}: {message}"


def test_not_a_configuration(tmp_path):
    path = tmp_path / "x.ini"
    path.write_text("hello")
    with pytest.raises(InputError, match=r"no \[section\]: must be a configuration of LinuxCNC"):
        read_ini(path)
    path.write_bytes(b"[A]\n" + b"#" * (1 << 20))
    with pytest.raises(InputError, match="must be at most 1048576 bytes"):
        read_ini(path)
    with pytest.raises(InputError, match="cannot be read: No such file"):
        read_ini(tmp_path / "none.ini")


def test_no_file_outside_the_folder_is_opened(tmp_path):
    (tmp_path / "in").mkdir()
    (tmp_path / "out.hal").write_text("setp xyzac-trt-kins.x-rot-point 9\n")
    (tmp_path / "in" / "link.hal").symlink_to(tmp_path / "out.hal")
    text = TRT.replace("HALFILE = offsets.hal", "HALFILE = ../out.hal\nHALFILE = link.hal\nHALFILE = /etc/passwd")
    path = written(tmp_path / "in", text)
    machine, findings = read_ini(path)
    assert machine.chain.axis("C").pivot == (0.0, 0.0, 0.0)
    assert [f.text.split()[0] for f in findings if f.code == "ini-hal"] == [
        "LIB:basic_sim.tcl",
        "../out.hal",
        "link.hal",
        "/etc/passwd",
    ]


def test_settings_of_the_trajectory_planner(tmp_path):
    """Defaults of LinuxCNC, then what the configuration says."""
    assert read_ini(written(tmp_path, TRIVIAL))[0].planner == TrajectoryPlanner()
    more = TRIVIAL.replace(
        "[TRAJ]\n",
        "[EMCMOT]\nSERVO_PERIOD = 2000000\n[DISPLAY]\nMAX_FEED_OVERRIDE = 1.5\n[TRAJ]\nARC_BLEND_ENABLE = 0\n"
        "ARC_BLEND_OPTIMIZATION_DEPTH = 80\nARC_BLEND_GAP_CYCLES = 3\nARC_BLEND_RAMP_FREQ = 50\n"
        "ARC_BLEND_KINK_RATIO = 0.2\n",
    )
    wanted = TrajectoryPlanner(2e-3, False, 80, 3.0, 50.0, 0.2, 1.5)
    assert read_ini(written(tmp_path, more))[0].planner == wanted


def test_a_machine_without_linear_axes_is_refused(tmp_path):
    text = TRIVIAL.replace("coordinates=XYZ", "coordinates=A").replace("COORDINATES = X Y Z", "COORDINATES = A")
    with pytest.raises(InputError, match="no linear axis: X, Y and Z are needed"):
        read_ini(written(tmp_path, text))
