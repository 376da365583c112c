"""Servo cycles that a real LinuxCNC, without a screen, needs for programs: the oracle of the cycle time."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

HERE = Path(__file__).parent
NOBODY = 65534
#: HAL's own shared memory; it is there while a controller runs
HAL_KEY = "0x48414c32"
#: velocity and acceleration of each axis [mm, s] or [deg, s]
LIMITS = {"X": (200, 1000), "Y": (150, 800), "Z": (100, 500), "A": (60, 300), "C": (90, 400)}

_HAL = """loadrt [KINS]KINEMATICS
loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS
loadrt mux2 count=1
loadrt integ count=1
addf motion-command-handler servo-thread
addf motion-controller servo-thread
addf mux2.0 servo-thread
addf integ.0 servo-thread
setp mux2.0.in0 1
setp mux2.0.in1 0
net rest motion.in-position => mux2.0.sel
net busy mux2.0.out => integ.0.in
net estop iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in
net tp iocontrol.0.tool-prepare => iocontrol.0.tool-prepared
net tc iocontrol.0.tool-change => iocontrol.0.tool-changed
"""


def installed() -> bool:
    """Whether LinuxCNC is there."""
    return shutil.which("linuxcnc") is not None and shutil.which("script") is not None


def hal_in_use() -> bool:
    """Whether a HAL is loaded on this machine; there is room for one."""
    return HAL_KEY in subprocess.run(["ipcs", "-m"], capture_output=True, text=True, check=True).stdout


def ini_text(letters: str = "XYZ") -> str:
    """The configuration of a machine with the axes ``letters``, limits as in :data:`LIMITS`."""
    head = f"""[EMC]
MACHINE = headless-{letters.lower()}
DEBUG = 0
VERSION = 1.1
[DISPLAY]
DISPLAY = ./count.py
[TASK]
TASK = milltask
CYCLE_TIME = 0.001
[RS274NGC]
PARAMETER_FILE = headless.var
[EMCMOT]
EMCMOT = motmod
COMM_TIMEOUT = 4.0
BASE_PERIOD = 0
SERVO_PERIOD = 1000000
[EMCIO]
EMCIO = io
CYCLE_TIME = 0.100
TOOL_TABLE = headless.tbl
[HAL]
HALFILE = headless.hal
[TRAJ]
COORDINATES = {" ".join(letters)}
LINEAR_UNITS = mm
ANGULAR_UNITS = degree
DEFAULT_LINEAR_VELOCITY = 50
MAX_LINEAR_VELOCITY = 200
MAX_ANGULAR_VELOCITY = 100
DEFAULT_LINEAR_ACCELERATION = 500
MAX_LINEAR_ACCELERATION = 1000
NO_FORCE_HOMING = 1
[KINS]
KINEMATICS = trivkins coordinates={letters.lower()}
JOINTS = {len(letters)}
"""
    for k, letter in enumerate(letters):
        velocity, acceleration = LIMITS[letter]
        both = f"MIN_LIMIT = -9999\nMAX_LIMIT = 9999\nMAX_VELOCITY = {velocity}\nMAX_ACCELERATION = {acceleration}\n"
        kind = "ANGULAR" if letter in "ABC" else "LINEAR"
        head += f"[AXIS_{letter}]\n{both}[JOINT_{k}]\nTYPE = {kind}\n{both}FERROR = 50\nMIN_FERROR = 10\n"
        head += "HOME_SEQUENCE = 0\n"
    return head


def servo_cycles(programs: Sequence[tuple[str, str]], letters: str = "XYZ", most_s: float = 300.0) -> list[int]:
    """Servo cycles of 1 ms in which the axes of a real LinuxCNC move, for each (name, text) of ``programs``.

    Raises
    ------
    RuntimeError
        It does not start, or a program ends with an error.
    """
    folder = Path(tempfile.mkdtemp(prefix="cycles-"))
    try:
        hal = _HAL + "".join(
            f"net j{k} joint.{k}.motor-pos-cmd => joint.{k}.motor-pos-fb\n" for k in range(len(letters))
        )
        (folder / "headless.ini").write_text(ini_text(letters))
        (folder / "headless.hal").write_text(hal)
        (folder / "headless.tbl").write_text("".join(f"T{k} P{k} D6\n" for k in range(1, 21)))
        shutil.copy(HERE / "count.py", folder / "count.py")
        (folder / "count.py").chmod(0o755)
        names = [f"{k:03d}.ngc" for k in range(len(programs))]
        for name, (_, text) in zip(names, programs, strict=True):
            (folder / name).write_text(text)
        (folder / "programs.txt").write_text("".join(f"{folder / name}:{most_s:g}\n" for name in names))
        results = _played(folder, 60.0 + most_s * len(programs))
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    for found, (name, _) in zip(results, programs, strict=False):
        if found["error"]:
            raise RuntimeError(f"{name}: LinuxCNC: {found['error']}")
    if len(results) != len(programs):
        raise RuntimeError(f"LinuxCNC: {len(results)} of {len(programs)} programs were run")
    return [int(found["cycles"]) for found in results]


def _played(folder: Path, seconds: float) -> list[dict[str, object]]:
    user: list[str] = []
    if os.geteuid() == 0:
        user = ["setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups"]
        for path in (folder, *folder.iterdir()):
            os.chown(path, NOBODY, NOBODY)
    process = subprocess.Popen(
        [*user, "script", "-qfec", "linuxcnc headless.ini", "linuxcnc.log"],
        cwd=folder,
        env={"HOME": str(folder), "PATH": "/usr/bin:/bin:/usr/sbin:/sbin", "TERM": "xterm"},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    end = time.monotonic() + seconds
    try:
        while time.monotonic() < end and process.poll() is None:
            time.sleep(0.1)
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGTERM)
            process.wait(30.0)
    counts = folder / "counts.json"
    if not counts.exists():
        log = folder / "linuxcnc.log"
        raise RuntimeError("LinuxCNC: no program was run: " + (log.read_text()[-2000:] if log.exists() else "no log"))
    return json.loads(counts.read_text())
