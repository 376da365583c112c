"""Start all of it: LinuxCNC without a screen, the cut beside it, the controller; then say whether they agree.

    python run.py OUT [--result DIR] [--lost stop|programmed] [--kill-at MM | --kill-stopped] [--hang]
                      [--overload-nm T] [--seconds S] [--fault KIND --fault-at MM]

The program, its path and the controller are those of the job beside this folder: `DIR` is what `chipload run` made of
it; without it the job is run first, into `OUT/job`.

OUT gets `machine.csv` (what the machine did), `control.csv` (what the controller saw and sent), `linuxcnc.log` and
`summary.json`: time and greatest torque here and in our own closed loop, the greatest feed over the programmed one, how
closely the feed follows the override. With `--kill-at` the controller is killed when the machine has come so far, with
`--kill-stopped` when it has stopped the machine (SIGKILL: it cannot say goodbye; with `--hang` SIGSTOP: it is there and
does nothing). The machine then has two seconds more, and the summary says what it did with them.

With `--fault` the torque is told from pins of current and speed, those of a simulated spindle beside LinuxCNC, whose
sensor fails at that place: it reads 0 (`lost`), no number (`nan`), its last value (`stuck`), or 0.1 A more or less.

LinuxCNC refuses to run as root; where this is root, it runs as nobody. It ends in every case: `drive.py` is told to,
then HAL is unloaded, then what is left of our own processes (they bear our mark in their environment) is killed.
"""

from __future__ import annotations

import argparse
import fcntl
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import uuid
from collections.abc import Callable
from contextlib import nullcontext, suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

if sys.platform == "win32":
    sys.exit("LinuxCNC runs on Linux alone")

from chipload.control.hal import COLUMNS, HalJob
from chipload.control.hal_file import load_hal
from chipload.control.linuxcnc.path import locate
from chipload.control.override import STATUS
from chipload.control.plant import Loop, run

HERE = Path(__file__).parent
FILES = ("tube.ini", "tube.hal", "tube.tbl", "drive.py")
#: of the result: the program that takes the override, and what the controller reads
PROGRAM, CONTROL = "0-override.ngc", ("hal.toml", "path.csv", "controller.toml")
NOBODY = 65534
#: HAL's own shared memory; it is there while a controller runs
HAL_KEY = "0x48414c32"
LOST = {"stop": "0", "programmed": "1"}
MARK = "CHIPLOAD_RUN"
#: until an override acts here [s]: the next period
LATENCY_S = 0.01
#: what the machine is watched for after its controller is killed [s]
AFTER_S = 2.0


class Failed(Exception):
    """LinuxCNC did not start or did not end well."""


def hal_in_use() -> bool:
    """Whether a HAL is loaded on this machine; there is room for one."""
    return HAL_KEY in subprocess.run(["ipcs", "-m"], capture_output=True, text=True, check=True).stdout


def wait(what: str, done: Callable[[], bool], seconds: float) -> None:
    """Until ``done``."""
    end = time.monotonic() + seconds
    while not done():
        if time.monotonic() > end:
            raise Failed(f"{what}: not within {seconds:g} s")
        time.sleep(0.02)


class LinuxCNC:
    """LinuxCNC in a folder of its own, to be used in a ``with``."""

    def __init__(self, program: Path, lost: str, seconds: float) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="tube-"))
        self.mark = uuid.uuid4().hex
        for name in FILES:
            shutil.copy(HERE / name, self.folder / name)
        shutil.copy(program, self.folder / "program.ngc")
        ini = (self.folder / "tube.ini").read_text().replace("LOST_FEED = 0", f"LOST_FEED = {LOST[lost]}")
        (self.folder / "tube.ini").write_text(ini)
        (self.folder / "drive.py").chmod(0o755)
        self.user: list[str] = []
        if os.geteuid() == 0:
            self.user = ["setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups"]
            for path in (self.folder, *self.folder.iterdir()):
                os.chown(path, NOBODY, NOBODY)
        self.environment = {
            "HOME": str(self.folder), "PATH": "/usr/bin:/bin:/usr/sbin:/sbin", "TERM": "xterm", MARK: self.mark,
            "PROGRAM": str(self.folder / "program.ngc"), "SECONDS": f"{seconds:g}",
        }  # fmt: skip
        self.process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> LinuxCNC:
        # its start script throws its output away where there is no terminal
        self.process = subprocess.Popen(
            [*self.user, "script", "-qfec", "linuxcnc tube.ini", "linuxcnc.log"],
            cwd=self.folder, env=self.environment, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL, start_new_session=True,
        )  # fmt: skip
        try:
            wait("LinuxCNC is up", lambda: (self.folder / "up").exists() or self.ended(), 40.0)
            if self.ended():
                raise Failed("LinuxCNC: ended at once: see linuxcnc.log")
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def ended(self) -> bool:
        """Whether LinuxCNC has gone down."""
        return self.process is None or self.process.poll() is not None

    def close(self) -> None:
        """End it: politely, by unloading HAL, by force; each only if need be."""
        if not self.folder.exists():
            return
        (self.folder / "end").touch()
        with suppress(Failed):
            wait("LinuxCNC ends", self.ended, 20.0)
        if not self.ended() or self.left() or hal_in_use():
            subprocess.run(
                [*self.user, "halrun", "-U"], cwd=self.folder, env=self.environment, capture_output=True, timeout=20.0,
                check=False,
            )  # fmt: skip
            for pid in self.left():
                try:
                    os.kill(pid, signal.SIGKILL)
                except ProcessLookupError:
                    continue
        if self.process is not None:
            self.process.wait(5.0)

    def left(self) -> list[int]:
        """Our processes that still run, by the mark in their environment."""
        mark, found = f"{MARK}={self.mark}".encode(), []
        for entry in Path("/proc").iterdir():
            try:
                if entry.name.isdigit() and mark in (entry / "environ").read_bytes().split(b"\0"):
                    found.append(int(entry.name))
            except OSError:
                continue
        return found


def rows_of(file: Path) -> np.ndarray:
    """A CSV whose last line may be half written."""
    lines = file.read_text().split("\n")[1:-1] if file.exists() else []
    return np.array([[float(x) for x in line.split(",")] for line in lines])


def place_along_path(job: HalJob, rows: np.ndarray) -> np.ndarray:
    """(n,) place along the path of the rows of `machine.csv` [mm]."""
    s, found = 0.0, np.empty(len(rows))
    for k, row in enumerate(rows):
        at, away = locate(job.path, row[1:4], s, job.window)
        s = at if away <= job.away else s
        found[k] = s
    return found


def play(args: argparse.Namespace) -> dict[str, object]:
    """Run the program once; see the head of this file."""
    out, lost, seconds = args.out, args.lost, args.seconds
    result = args.result or result_folder(out)
    for name in CONTROL:
        shutil.copyfile(result / name, out / name)
    limit = 1e3 * json.loads((result / "summary.json").read_text())["operations"][0]["torque_limit_nm"]
    text = re.sub(r"(?m)^latency_s = .*$", f"latency_s = {LATENCY_S!r}", (out / "hal.toml").read_text())
    if args.overload_nm is not None:
        text = re.sub(r"(?m)^overload_nm = .*$", f"overload_nm = {args.overload_nm!r}", text)
    (out / "hal.toml").write_text(text)
    job = load_hal(out / "hal.toml")
    if hal_in_use():
        raise Failed("HAL: a controller runs on this machine already, and only one can: end it first")
    killed = None
    with LinuxCNC(result / PROGRAM, lost, seconds) as cnc:
        command = [sys.executable, "-c", "from chipload.cli import main; main()", "hal", str(out / "hal.toml")]
        from sensor_fault import PINS, SensorWithFault  # type: ignore[import-not-found]

        sensor = None if args.fault is None else SensorWithFault(job, args.fault, args.fault_at)
        pins = () if sensor is None else PINS
        controller = subprocess.Popen([*command, *pins, "--out", str(out / "control.csv")], env=os.environ.copy())
        machine = cnc.folder / "machine.csv"
        try:
            with sensor or nullcontext():
                wait("the program starts", lambda: len(rows_of(machine)) > 0 or controller.poll() is not None, 60.0)
                end = time.monotonic() + seconds + 10.0
                while not cnc.ended() and time.monotonic() < end:
                    rows = rows_of(machine)
                    if killed is None and (args.kill_at is not None or args.kill_stopped):
                        s = place_along_path(job, rows)
                        stopped = args.kill_stopped and s[-1] > 20.0 and (rows[-5:, 4] == 0.0).all()
                        if stopped or (args.kill_at is not None and s[-1] >= args.kill_at):
                            controller.send_signal(signal.SIGSTOP if args.hang else signal.SIGKILL)
                            killed = time.monotonic()
                    if killed is not None and time.monotonic() > killed + AFTER_S:
                        (cnc.folder / "end").touch()
                    time.sleep(0.05)
        finally:
            if killed is not None:
                controller.kill()
            elif controller.poll() is None:
                controller.terminate()
            try:
                controller.wait(10.0)
            except subprocess.TimeoutExpired:
                controller.kill()
            cnc.close()
            for name in ("machine.csv", "linuxcnc.log"):
                if (cnc.folder / name).exists():
                    shutil.copyfile(cnc.folder / name, out / name)
            left = cnc.left()
            shutil.rmtree(cnc.folder)
    rows = rows_of(out / "machine.csv")
    control = rows_of(out / "control.csv")
    if sensor is not None:
        summary = common(job, rows) | {"fault": after_fault(job, rows, control, sensor.at, limit)}
    else:
        summary = sum_up_run(job, rows, control, killed, limit)
    summary |= {"lost": lost, "processes_left": len(left), "hal_left": hal_in_use()}
    (out / "summary.json").write_text(json.dumps(summary, indent=1) + "\n")
    return summary


def result_folder(out: Path) -> Path:
    """The result of the job beside this folder."""
    command = [sys.executable, "-c", "from chipload.cli import main; main()", "run", str(HERE.parent / "job.toml")]
    done = subprocess.run([*command, "--out", str(out / "job")], check=False)
    if done.returncode not in (0, 3):
        raise Failed(f"the job of the example: exit code {done.returncode}")
    return out / "job"


def common(job: HalJob, rows: np.ndarray) -> dict[str, object]:
    """What every run says: the programmed feed, and the greatest feed over it and override on the path."""
    s, programmed = place_along_path(job, rows), float(job.path.model.feed[0])
    # rapids go at the machine's own speed
    on = (s > 0.0) & (s < job.path.model.s[-1])
    return {
        "programmed_mm_s": programmed,
        "feed_over_programmed_max": float(rows[on, 4].max() / programmed),
        "override_max": float(rows[:, 5].max()),
    }


def after_fault(
    job: HalJob, rows: np.ndarray, control: np.ndarray, at: float | None, limit: float
) -> dict[str, object]:
    """What the controller and the machine did from the fault of the sensor on."""
    if at is None:
        raise Failed("the sensor: its fault was not reached")
    c = dict(zip(COLUMNS, control.T, strict=True))
    s, last = place_along_path(job, rows), float(job.path.model.s[-1])
    later = (c["t_s"] >= at) & (c["s_mm"] < last - 1e-3)
    stands = (rows[:, 0] > at) & (rows[:, 4] == 0.0) & (s < last - 1e-3)
    load = c["torque_nmm"] / c["relief"] / limit
    return {
        "at_mm": float(np.interp(at, rows[:, 0], s)),
        "override_before": float(np.interp(at, rows[:, 0], rows[:, 5])),
        "status_after": STATUS[int(c["status"][-1])].value,
        "stopped_after_s": float(rows[stands, 0][0] - at) if stands.any() else None,
        "moved_after_mm": float(s[-1] - np.interp(at, rows[:, 0], s)),
        "override_max_after": float(rows[rows[:, 0] >= at, 5].max()),
        "torque_over_limit_max_after": float(np.nanmax(load[later])),
        "torque_over_limit_max_before": float(np.nanmax(load[c["t_s"] < at])),
    }


def sum_up_run(
    job: HalJob, rows: np.ndarray, control: np.ndarray, killed: float | None, limit: float
) -> dict[str, object]:
    """What the run says; ``limit`` of torque [N mm] at the place where the wall bears least."""
    s, programmed = place_along_path(job, rows), float(job.path.model.feed[0])
    # rapids go at the machine's own speed
    on = (s > 0.0) & (s < job.path.model.s[-1])
    t, velocity, override = rows[:, 0], rows[:, 4], rows[:, 5]
    answer = common(job, rows)
    if killed is not None:
        # the one-shot runs out, then the axes take their time
        late = on & (t > killed + 1.0)
        answer["killed"] = {
            "at_mm": float(np.interp(killed, t, s)),
            "feed_before_mm_s": float(np.interp(killed, t, velocity)),
            "feed_after_mm_s": [float(velocity[late].min()), float(velocity[late].max())] if late.any() else [],
            "override_before": float(np.interp(killed, t, override)),
            "override_after": [float(override[late].min()), float(override[late].max())] if late.any() else [],
            "moved_after_mm": float(s[-1] - np.interp(killed + 1.0, t, s)),
            "feed_over_programmed_max": float(velocity[on & (t > killed)].max() / programmed),
        }
        return answer
    c = dict(zip(COLUMNS, control.T, strict=True))
    moving = (c["s_mm"] > 0.0) & (c["s_mm"] < job.path.model.s[-1] - 1e-3)
    first = int(np.flatnonzero(moving)[0])
    seconds = float(c["t_s"][moving][-1] - c["t_s"][first])
    # the controller waited in the air before the path: the simulation begins with the override of that moment
    begun = min(max(float(c["override"][max(first - 1, 0)]), job.override.floor), job.override.cap)
    held = replace(job.override, start=begun, air_override=max(job.override.air_override, begun))
    loop = Loop(job.acceleration, job.period, job.latency)
    same = run(
        job.path.truth, job.path.model, held, job.table, job.spindle, loop, limit, relief=job.path.relief,
        deviation=job.deviation,
    )  # fmt: skip
    load = c["torque_nmm"] / c["relief"]
    # steady: the override of 0.1 s is the same within a step; at a corner and at the ends the machine slows by itself
    goal, feed = c["in_force"] * programmed, c["feed_mm_s"]
    places = np.flatnonzero(moving)[10:]
    steady = np.array([k for k in places if np.ptp(c["in_force"][k - 10 : k + 1]) < 0.015])
    # velocity from places alone, over half a second
    t, at = c["t_s"][moving], c["s_mm"][moving]
    half = np.searchsorted(t, t + 0.5)
    whole = half < len(t)
    a, b = np.flatnonzero(whole), half[whole]
    by_place = (at[b] - at[a]) / (t[b] - t[a])
    sums = np.concatenate([[0.0], np.cumsum(0.5 * (goal[moving][1:] + goal[moving][:-1]) * np.diff(t))])
    asked = (sums[b] - sums[a]) / (t[b] - t[a])
    answer["torque_limit_nm"] = 1e-3 * limit
    answer["linuxcnc"] = {
        "time_s": seconds,
        "torque_nm_max": 1e-3 * float(load.max()),
        "torque_raw_nm_max": 1e-3 * float(c["torque_nmm"].max()),
        "torque_over_limit_s": float(np.diff(t)[load[moving][1:] > limit].sum()),
        "steps": len(control),
        "period_s": float(np.median(np.diff(t))),
        "period_s_max": float(np.diff(t).max()),
        "away_mm_max": float(c["away_mm"][moving].max()),
    }
    answer["simulated"] = {
        "time_s": same.time,
        "torque_nm_max": 1e-3 * same.load_max,
        "torque_raw_nm_max": 1e-3 * same.torque_max,
        "torque_over_limit_s": same.time_over,
        "start": begun,
    }
    answer["follows"] = {
        "steady_steps": len(steady),
        "steady_within_1_percent": float((np.abs(feed[steady] / goal[steady] - 1.0) < 0.01).mean()),
        "place_error_mean": float(np.abs(by_place / asked - 1.0).mean()),
        "place_error_max": float(np.abs(by_place / asked - 1.0).max()),
    }
    return answer


def main() -> int:
    """Parse, run, show."""
    # a script has the folder that it stands in on its path
    from sensor_fault import FAULTS

    parser = argparse.ArgumentParser(description="A round pass on a tube under LinuxCNC, torque held.")
    parser.add_argument("out", type=Path, help="folder for the results")
    parser.add_argument("--result", type=Path, metavar="DIR", help="result of the job; none: it is run first")
    parser.add_argument(
        "--lost", choices=tuple(LOST), default="stop", help="what the machine does without a controller"
    )
    kill = parser.add_mutually_exclusive_group()
    kill.add_argument("--kill-at", type=float, metavar="MM", help="kill the controller there along the path")
    kill.add_argument("--kill-stopped", action="store_true", help="kill it when it has stopped the machine")
    parser.add_argument("--hang", action="store_true", help="do not kill it, let it hang")
    parser.add_argument("--fault", choices=FAULTS, help="how the sensor of the spindle fails")
    parser.add_argument("--fault-at", type=float, default=260.0, metavar="MM", help="where, along the path")
    parser.add_argument("--overload-nm", type=float, help="torque that stops")
    parser.add_argument("--seconds", type=float, default=40.0, help="longest run of the program")
    args = parser.parse_args()
    if shutil.which("linuxcnc") is None:
        print("linuxcnc is not installed: apt-get install linuxcnc-uspace", file=sys.stderr)
        return 2
    args.out.mkdir(parents=True, exist_ok=True)
    with (Path(tempfile.gettempdir()) / "chipload-linuxcnc.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        try:
            summary = play(args)
        except Failed as err:
            print(err, file=sys.stderr)
            return 1
    print(json.dumps(summary, indent=1))
    return 0


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    sys.exit(main())
