"""What tools/fuzz.py damages: for each reader of chipload its seeds, and how a file is read.

A seed is made from the examples that come with chipload, or written here; none is taken from elsewhere. A reader gets
the path of a damaged file and says how many findings there were; arrays that it made are checked to be finite.
"""

from __future__ import annotations

import io
import json
import struct
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Reader:
    """A reader: the ending of its files, its seeds, and what reads one and counts findings."""

    suffix: str
    seeds: Callable[[], list[bytes]]
    read: Callable[[Path], int]


class Nonsense(Exception):
    """A reader gave numbers that are not finite."""


def finite(*arrays: Any) -> None:
    """Refuse what a reader must not give."""
    for array in arrays:
        if not np.isfinite(np.asarray(array, dtype=np.float64)).all():
            raise Nonsense("a number that was read is not finite")


def example(*names: str) -> list[bytes]:
    """Files of the examples."""
    root = resources.files("chipload.examples")
    return [root.joinpath(name).read_bytes() for name in names]


def shipped(*names: str) -> list[bytes]:
    """Tables that come with chipload."""
    root = resources.files("chipload")
    return [root.joinpath(name).read_bytes() for name in names]


# -- programs ---------------------------------------------------------------------------------------------------
GCODE = {
    "linuxcnc": (
        "G21 G90 G17 F200|T1 M6 G43|S1000 M3|G0 X1 Y2 Z5|G1 Z-1|X10 F300|G2 X12 Y4 I2|G3 X10 Y6 R2 Z-2|G0 Z5|M2",
        "G98 G0 Z5|F100|S9 M3|G81 X1 Y1 Z-3 R1|X2|G83 X3 Z-4 R1 Q.5 L2|G91 X1 L3|G90 G80|M2",
        "o<a> sub|#1=[#1-1]|o1 if [#1 gt 0]|o<a> call [#1]|o1 else|G0 X[#1+SIN[30]]|o1 endif|o<a> endsub [#1]|"
        "o<a> call [5]|#<n>=0|o2 while [#<n> lt 4]|#<n>=[#<n>+1]|G1 Y#<n> F50|o2 endwhile|o3 repeat [3]|G91 G0 X1|"
        "o3 endrepeat|G90|M2",
        "G10 L2 P1 X5 R30|G10 L20 P2 Z1|G55 G0 X1|G52 X3|G92 Y1|G92.2|G92.3|G28 Z5|G53 G0 Z0|G49|G0 X5|M2",
        "F100|G0 X0 Y0|G5 X10 Y0 I0 J3 P0 Q-3|G5.1 X20 Y0 I5 J5|G5.2 P1 L3 X21 Y1|X22 Y2 P2|X23 Y0 P1|G5.3|G0 X0|M2",
    ),
    "fanuc": (
        "%|O0001|G21 G90 G17 G54|T1 M6|S2000 M3|G0 G43 H1 Z5.|G0 X0. Y0.|G83 X1. Y1. Z-5. R1. Q1. F100.|G80|"
        "G1 X10. F200.|G2 X12. Y2. R2.|G28 Z0.|M30|%",
        "O2|G21 G90|S100 M3|G0 X0. Y0. Z5.|G1 X10. Y30. F100.|G52 X1.|G1 X5.|G4 P100|G0 Z5.|M30",
    ),
    "sinumerik": (
        "; pocket|G21 G90 G17|G54|S2000 M3|G0 X0 Y0 Z5|G1 Z-1 F100|X10 Y=5+2*3|G2 X12 Y11 CR=3|"
        "G3 X10 Y13 CR=1.5|R1=5|X=R1|TRANS X5 Y1|ROT Z30|G0 X0|M30",
        'G710 G90 G94|S100 M3|G1 X1 F10|MSG("a")|G4 F1|G1 X=IC(5)|M30',
        "S100 M3 F100|R1=0|AGAIN: G1 X=R1|R1=R1+1|IF (R1<3) AND NOT (R1==7) GOTOB AGAIN|FOR R2=1 TO 3|IF R2==2|G1 Y=R2|"
        "ELSE|G1 Y0|ENDIF|ENDFOR|WHILE R1>0|R1=R1-1|ENDWHILE|PART: X9|REPEAT PART P=2|REPEATB PART P2|GOTOF OUT|X1|"
        "OUT: M30",
    ),
    "heidenhain": (
        "BEGIN PGM A MM|1 TOOL CALL 1 Z S2000 F500|2 L X+0 Y+0 Z+5 R0 FMAX M3|3 L Z-1 F100|4 L X+10|5 CC X+10 Y+5|"
        "6 C X+15 Y+5 DR+|7 L X+30 Y+0|8 Q1 = 5 + 2|9 L X+Q1 FMAX|10 LBL 1|11 L IX+1 F100|12 LBL 0|13 CALL LBL 1 REP2|"
        "14 L Z+50 FMAX M30|END PGM A MM",
        "BEGIN PGM B MM|TOOL DEF 1 L+0 R+1|TOOL CALL 1 Z S1000 F500|L X+0 Y+0 Z+0 R0 FMAX M3|L X+20 RL|RND R3|L Y+20|"
        "CHF 2|L X+0|RND R2 F50|CC X+0 Y+10|C X+0 Y+0 DR+|Q1 = 4|FN 9: IF Q1 EQU 4 GOTO LBL 2|L X+5|LBL 2|"
        "L Z+5 R0 FMAX M30|END PGM B MM",
    ),
    "apt": (
        "PARTNO/A|UNITS/MM|LOADTL/1|SPINDL/1000,RPM,CLW|FEDRAT/100,MMPM|RAPID|GOTO/0,0,5|GOTO/0,0,-1,0,0,1|"
        "GOTO/10,0,-1|CYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,2|GOTO/10,5,0|CYCLE/OFF|FINI",
    ),
}


def _program(dialect: str, machine: str) -> Callable[[Path], int]:
    def read(path: Path) -> int:
        from chipload.machine.machine import machine_named
        from chipload.program.read import read_program

        done = read_program(path, machine_named(machine), dialect=dialect, feed=10.0)
        finite(done.program.p_work, done.program.axis, done.program.feed)
        return len(done.findings) + len(done.violations)

    return read


def _programs(dialect: str, *names: str) -> Callable[[], list[bytes]]:
    return lambda: [*((text.replace("|", "\n") + "\n").encode() for text in GCODE[dialect]), *example(*names)]


# -- bodies and drawings ----------------------------------------------------------------------------------------
def _stl() -> list[bytes]:
    p = np.array([(x, y, z) for x in (0, 4) for y in (0, 3) for z in (0, 2)], dtype=np.float32)
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6),
             (0, 6, 4), (1, 5, 7), (1, 7, 3)]  # fmt: skip
    binary = bytes(80) + struct.pack("<I", len(faces))
    text = ["solid box"]
    for f in faces:
        binary += struct.pack("<3f", 0.0, 0.0, 0.0) + p[list(f)].tobytes() + bytes(2)
        text += [
            "facet normal 0 0 0",
            "outer loop",
            *(f"vertex {x:g} {y:g} {z:g}" for x, y, z in p[list(f)]),
            "endloop",
        ]
        text += ["endfacet"]
    return [binary, "\n".join([*text, "endsolid box", ""]).encode(), *example("bracket/clamp.stl")]


def _mesh(path: Path) -> int:
    from chipload.geometry.mesh import read_mesh, sections

    mesh = read_mesh(path, unit="mm", chord_mm=0.1)
    finite(mesh.vertices, mesh.volume)
    low, high = mesh.bounds[:, 2]
    finite([s.area for s in sections(mesh, np.linspace(low, high, 5)[1:-1])])
    return 0


def _step() -> list[bytes]:
    return [Path(__file__).with_name("plate.step").read_bytes()]


def _model(path: Path) -> int:
    from chipload.geometry.step import read_step_face, step_triangles
    from chipload.geometry.step_faces import read_faces

    model = read_faces(path)
    finite([f.area for f in model.faces], [f.low for f in model.faces])
    finite(step_triangles(path, 0.1)[0])
    drawing = read_step_face(path)
    finite(*(c.segments for c in drawing.contours))
    return len(drawing.findings)


def _dxf() -> list[bytes]:
    import ezdxf

    doc = ezdxf.new("R2010")
    doc.units = 4
    space, block = doc.modelspace(), doc.blocks.new("B")
    block.add_lwpolyline([(0, 0), (3, 0, 0.5), (3, 3)], format="xyb", close=True)
    space.add_line((0, 0), (10, 0))
    space.add_arc((10, 5), 5, 270, 90)
    space.add_circle((30, 0), 4)
    space.add_ellipse((50, 0), (5, 0), 0.5)
    space.add_spline([(0, 20, 0), (5, 25, 0), (10, 20, 0), (15, 25, 0)])
    space.add_polyline2d([(0, 40), (5, 40), (5, 45)], close=True)
    space.add_blockref("B", (70, 0), dxfattribs={"xscale": 2.0, "rotation": 30.0})
    out = io.StringIO()
    doc.write(out)
    return [out.getvalue().encode(), *example("contour/corner.dxf", "pocket/housing.dxf")]


def _drawing(path: Path) -> int:
    from chipload.geometry.dxf import read_dxf

    drawing = read_dxf(path, units="mm")
    finite(*(c.segments for c in drawing.contours))
    return len(drawing.findings)


def _sections(path: Path) -> int:
    from chipload.geometry.sections import check_sections, loft, read_sections

    one = read_sections([path], "mm", columns=None)
    finite(*one)
    some = [p + np.array([0.0, 0.0, 0.0]) for p in one] + [1.1 * one[-1]]
    finite(loft(check_sections(tuple(some))).plus.control)
    return 0


def _meridian(path: Path) -> int:
    from chipload.geometry.sections import read_meridian

    finite(read_meridian(path, "mm"))
    return 0


# -- tables -----------------------------------------------------------------------------------------------------
def _machine(path: Path) -> int:
    from chipload.machine.machine import read_machine

    read_machine(path)
    return 0


def _ini(path: Path) -> int:
    from chipload.machine.ini import read_ini

    machine, findings = read_ini(path)
    finite(
        machine.rapid, machine.feed_max, machine.spindle_min, *((a.rate, a.acceleration) for a in machine.chain.axes)
    )
    if machine.planner is not None:
        finite(machine.planner.cycle, machine.planner.kink_ratio, machine.planner.override)
    return len(findings)


def _material(path: Path) -> int:
    from chipload.cutting.material import read_material

    found = read_material(path)
    finite(found.coefficients, found.exponents, found.peak_excess, found.chip or 0.0, found.speed or 0.0)
    if found.has_band:
        finite(found.variances)
    return 0


def _catalogue(path: Path) -> int:
    from chipload.cutter.catalogue import read_catalogue

    read_catalogue(path)
    return 0


def _fuzzy(path: Path) -> int:
    from chipload.control.fuzzy import read_fuzzy

    read_fuzzy(path)
    return 0


def _tools(path: Path) -> int:
    from chipload.cutter.tooltable import read_tool_table
    from chipload.errors import InputError
    from chipload.program.read import read_tools

    try:
        read_tools(path)
    finally:
        read_tool_table(path, 1, "mm")
    if path.stat().st_size < 0:
        raise InputError("never")
    return 0


def _fctb(path: Path) -> int:
    from chipload.cutter.fctb import read_fctb

    finite([v for v in read_fctb(path).values() if isinstance(v, float)])
    return 0


def _job(path: Path) -> int:
    from chipload.jobs import load_job

    load_job(path)
    return 0


def _jobs() -> list[bytes]:
    root = resources.files("chipload.examples")
    return [
        f.joinpath("job.toml").read_bytes() for f in sorted(root.iterdir(), key=str) if f.joinpath("job.toml").is_file()
    ]


# -- measured values --------------------------------------------------------------------------------------------
def _forces() -> list[bytes]:
    rows = "\n".join(f"{k / 1000:g},{np.sin(k):.4f},{np.cos(k):.4f},{0.1 * k:.4f}" for k in range(60))
    return [
        f"time_s,fx_n,fy_n,fz_n\n{rows}\n".encode(),
        f"Time;Fx;Fy;Fz\ns;N;N;N\n{rows.replace(',', ';')}\n".encode(),
        f"time_s,fx_n,fy_n,fz_n\n{rows}\n".replace("\n", "\r").encode(),
    ]


def _force(path: Path) -> int:
    from chipload.cutting.measured import read_forces

    measured, findings = read_forces(path)
    finite(measured.force)
    return len(findings)


def _log_text() -> list[bytes]:
    rows = "\n".join(f"{k / 10:g},{1000 + k},{2.0 + 0.01 * k:g},a" for k in range(50))
    return [f"t,n,i,what\n{rows}\n".encode()]


def _log(path: Path) -> int:
    from chipload.control.logs import read_log

    table = {"time": {"column": "t", "unit": "s"}, "speed": {"column": "n", "unit": "rpm"},
             "current": {"column": "i", "unit": "A"}, "label": {"column": "what"}}  # fmt: skip
    log, findings = read_log(path, table)
    finite(log.time, log.current)
    return len(findings)


def _path_text() -> list[bytes]:
    from chipload.control.linuxcnc.path import COLUMNS

    rows = "\n".join(",".join(f"{1.0 + k + j:g}" for j in range(len(COLUMNS))) for k in range(20))
    return [f"{','.join(COLUMNS)}\n{rows}\n".encode()]


def _path(path: Path) -> int:
    from chipload.control.linuxcnc.path import read_path

    read_path(path)
    return 0


def _cuts() -> list[bytes]:
    head = "cut,site,repeat,u,v,x_mm,y_mm,z_mm,depth_mm,expected_normal_force_n,normal_force_n,deflection_um,too_much"
    rows = [f"{k},{k},0,{0.1 * k:g},{(0.3 * k) % 1:g},0,0,0,0.5,{50 + k},{52 + k},{10 + k},no" for k in range(8)]
    return ["\n".join([head, *rows, ""]).encode()]


def _cut(path: Path) -> int:
    from chipload.planning.thinwall.table import read_cuts

    read, findings = read_cuts(path, 0.05)
    finite(read.force)
    return len(findings)


# -- binary results ---------------------------------------------------------------------------------------------
def _npz() -> list[bytes]:
    import shapely

    from chipload.cutter.cutter import Cutter
    from chipload.stock.earlier_moves import EarlierMoves, cutter_fields
    from chipload.stock.layers import LayeredStock

    stock = LayeredStock.block((0, 0, 0), (20, 10, 4), 2.0, 5.0)
    stock.remove(1, shapely.box(4, 4, 6, 30))
    rows = np.array([[0.0, 5.0, 2.0, 20.0, 0.0, 0.0], [0.0, 3.0, 3.0, 20.0, 0.0, 0.0]])
    mill = Cutter(2.0, 2, 0.5, 6.0, 20.0, 6e5, number=1, corner_radius=0.5)
    stock.earlier = EarlierMoves(rows, np.zeros(2, dtype=np.int64), (cutter_fields(mill),))
    data = stock.to_bytes()
    plain = io.BytesIO()
    with np.load(io.BytesIO(data)) as held:
        np.savez(plain, allow_pickle=False, **{key: held[key] for key in held.files})
    return [data, plain.getvalue()]


def _stock(path: Path) -> int:
    from chipload.simulation.initial_stock import cutters_of_moves
    from chipload.stock.layers import LayeredStock

    stock = LayeredStock.load(path)
    finite(stock.volume(), stock.bounds)
    if stock.earlier is not None:
        finite(stock.earlier.rows, *(c.radius for c in cutters_of_moves(stock.earlier)))
    return 0


def _parquet() -> list[bytes]:
    import pyarrow as pa
    import pyarrow.parquet as pq

    n = 200
    columns = {name: np.arange(n, dtype=np.float64) for name in ("t_s", "s_mm", "x_mm", "y_mm", "z_mm", "force_n")}
    table = pa.table({"operation": np.zeros(n, dtype=np.int64), "strategy": ["a"] * n, **columns})
    out = []
    for compression in ("none", "zstd"):
        sink = pa.BufferOutputStream()
        pq.write_table(table, sink, compression=compression)
        out.append(sink.getvalue().to_pybytes())
    return out


#: a summary of one track of 200 rows, after docs/summary.schema.json
SUMMARY: Mapping[str, Any] = {
    "schema_version": 1, "capability": "program", "job": "x", "verdict": "unproven", "message": "nothing was checked",
    "note": "", "limits": [], "findings": [], "unchecked": [], "maps": [], "operations": [{"use": "plain"}],
    "tracks": [
        {
            "name": "a", "kind": "program", "operation": 0, "in_use": True, "verdict": "unproven", "time_s": 1.0,
            "time_high_s": None, "times": None, "parameters": {}, "programs": [], "rows": 200, "energy_balance": {},
            "limits": [], "findings": [],
        }
    ],
    "provenance": {"inputs": {}, "overrides": [], "machine": "vmc", "materials": {}, "versions": {}},
    "history_sha256": "",
}  # fmt: skip


def _result(path: Path) -> int:
    from chipload.web.result import open_result

    folder = path.parent / f"{path.stem}-result"
    folder.mkdir(exist_ok=True)
    (folder / "summary.json").write_text(json.dumps(SUMMARY))
    (folder / "history.parquet").write_bytes(path.read_bytes())
    result = open_result(path.parent.resolve(), folder.name)
    for track in result.tracks:
        result.column(track, "force_n")
    return 0


def _summary(path: Path) -> int:
    from chipload.result.load import read_summary

    folder = path.parent / f"{path.stem}-summary"
    folder.mkdir(exist_ok=True)
    (folder / "summary.json").write_bytes(path.read_bytes())
    read_summary(folder)
    return 0


def _removal_parts() -> list[bytes]:
    sink = io.BytesIO()
    rows = np.array([2, 5], dtype=np.int64)
    np.savez_compressed(
        sink, **{
            "0-low": np.zeros(3), "0-high": np.ones(3), "0-cell": np.full(3, 0.1), "0-rows": rows,
            "0-volumes": np.array([3.0, 2.0, 1.0]), "0-corners": np.zeros((4, 4, 3), dtype=np.uint16),
            "0-seen": np.array([[0, 65535]] * 4, dtype=np.uint16),
            "0-cutter-1-0-flutes": np.array([[0.0, 0.0], [5.0, 0.0], [5.0, 20.0]]),
            "1-refused": np.frombuffer(b"the blank is not closed", dtype=np.uint8),
        },
    )  # fmt: skip
    return [sink.getvalue()]


def _removal(path: Path) -> int:
    from chipload.report.removal import read_cutter_parts, read_refused, read_removal

    stock = read_removal(path, 0)
    if stock is not None:
        finite(stock.low, stock.high, stock.cell, stock.volumes, stock.volume(1))
    for parts in read_cutter_parts(path, 0).values():
        finite(*(profile for _, profile in parts))
    read_refused(path, 1)
    return 0


def _engagement_parts() -> list[bytes]:
    sink = io.BytesIO()
    n, m = 2, 3
    arrays = {
        "row": np.array([0, 4]), "tool": np.ones(n), "flutes": np.full(n, 3), "periods": np.full(n, 3),
        "frame": np.broadcast_to(np.eye(3), (n, 3, 3)), "start": np.array([0, 1, 3]), "ranges": np.ones((3, 12)),
        "turn": np.ones((n, m, 4)), "stride": np.array(1),
    }  # fmt: skip
    np.savez_compressed(sink, **{f"0-{name}": values for name, values in arrays.items()})
    return [sink.getvalue()]


def _engagement(path: Path) -> int:
    from chipload.report.engagement import read_engagement

    found = read_engagement(path, 0)
    if found is not None:
        finite(found.frame, found.ranges, found.turn)
    return 0


# -- logs of machines and spindles --------------------------------------------------------------------------------
def _streams() -> list[bytes]:
    samples = "".join(
        f'<RotaryVelocity timestamp="2026-03-01T10:00:{k:02d}.25Z" sequence="{2 * k + 1}">{3000 + k}</RotaryVelocity>'
        f'<Amperage timestamp="2026-03-01T10:00:{k:02d}.25Z" sequence="{2 * k + 2}">{2.0 + 0.1 * k}</Amperage>'
        for k in range(20)
    )
    return [
        (
            '<MTConnectStreams><Header nextSequence="41" lastSequence="40"/><Streams><DeviceStream name="mill">'
            f'<ComponentStream component="Rotary" name="S"><Samples>{samples}</Samples></ComponentStream>'
            "</DeviceStream></Streams></MTConnectStreams>"
        ).encode()
    ]


def _stream(path: Path) -> int:
    from chipload.machine.mtconnect import samples

    text, findings = samples(str(path))
    finite(np.loadtxt(io.StringIO(text), delimiter=",", skiprows=1, ndmin=2))
    return len(findings)


def _devices() -> list[bytes]:
    return [
        b'<MTConnectDevices><Devices><Device name="mill 7"><Components><Axes><Components><Linear name="X"><DataItems>'
        b'<DataItem type="POSITION"><Constraints><Minimum>-305.5</Minimum><Maximum>305.5</Maximum></Constraints>'
        b'</DataItem></DataItems></Linear><Rotary name="S"><DataItems><DataItem type="ROTARY_VELOCITY"><Constraints>'
        b"<Maximum>12000</Maximum></Constraints></DataItem></DataItems></Rotary></Components></Axes></Components>"
        b"</Device></Devices></MTConnectDevices>"
    ]


def _device(path: Path) -> int:
    from chipload.machine.mtconnect import describe_device, document, machine_text

    found = describe_device(document(str(path)))
    finite([x for pair in found.travel.values() for x in pair if x is not None])
    machine_text(found)
    return 0


def _modes_text() -> list[bytes]:
    mode = b"[[mode]]\nfrequency_hz = 812.0\ndamping_ratio = 0.03\nstiffness_n_um = 12.5\ndirection = 'x'\n"
    return [b"source = 'hammer'\n" + mode + mode.replace(b"'x'", b"[0.6, 0.8]") + b"residual_percent = 2.0\n"]


def _modes(path: Path) -> int:
    from chipload.jobs.simulation.modes_file import read_modes

    finite([(mode.frequency_hz, mode.stiffness_n_um or 0.0) for mode in read_modes(path)])
    return 0


def _spindle_logs() -> list[bytes]:
    t = np.arange(600) / 50.0
    speed = np.clip(np.interp(t, [0, 2, 4, 6, 12], [0, 3000, 3000, 6000, 6000]), 10.0, None)
    torque = np.where((t > 7.0) & (t < 9.0), 0.8, 0.0)
    current = 1.5 + 2e-4 * speed + 2.0 * torque + 0.01 * np.sin(37.0 * t)
    rows = "\n".join(f"{a:.3f},{b:.6g},{c:.6g},{d:.6g}" for a, b, c, d in zip(t, speed, current, torque, strict=True))
    return [f"time_s,speed_rpm,current_a,torque_nm\n{rows}\n".encode()]


def _spindle_log(path: Path) -> int:
    from chipload.control.identification import identify_spindle, run_of
    from chipload.control.logs import read_log
    from chipload.control.spindle_file import write_spindle

    log, findings = read_log(path)
    found = identify_spindle((run_of(log, "log", "current"),), ("log",), "current", None, None)
    if "nan" in write_spindle(found, {}):
        raise Nonsense("the file of the spindle has a number that is not one")
    return len(findings)


def _spindle_files() -> list[bytes]:
    from chipload.control.identification import identify_spindle, run_of
    from chipload.control.logs import read_log
    from chipload.control.spindle_file import write_spindle

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        path.write_bytes(_spindle_logs()[0])
        run = run_of(read_log(path)[0], "log", "current")
    return [write_spindle(identify_spindle((run,), ("log",)), {"log": "sha256 0"}).encode()]


def _spindle_file(path: Path) -> int:
    from chipload.control.spindle_file import read_spindle

    found = read_spindle(path, 600.0)
    for value in found.values.values():
        finite(value)
    finite(found.torque[0], found.speed)
    return 0


def _document() -> list[bytes]:
    import zipfile

    sink = io.BytesIO()
    value = '<Property name="Diameter" type="App::PropertyFloat"><Float value="6.0"/></Property>'
    part = '<Property name="Shape" type="Part::PropertyPartShape"><Part file="a.brp"/></Property>'
    with zipfile.ZipFile(sink, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(
            "Document.xml",
            '<Document><Objects><Object name="A" type="Part::Box"/></Objects><ObjectData><Object name="A"><Properties>'
            f"{value}{part}</Properties></Object></ObjectData></Document>",
        )
        archive.writestr("a.brp", "DBRep_DrawableShape\n" * 20)
    return [sink.getvalue()]


def _freecad(path: Path) -> int:
    from chipload.jobs.drafts.document import read_document

    for own in read_document(path).objects.values():
        number = own.number("Diameter")
        finite(0.0 if number is None else number)
    return 0


MACHINES: Sequence[str] = ("vmc", "vmc-fanuc", "dmu50", "xyzac-trunnion")
READERS: dict[str, Reader] = {
    "linuxcnc": Reader(
        ".ngc",
        _programs("linuxcnc", "bracket/bracket.nc", "feeds/pocket.nc"),
        _program("linuxcnc", "vmc"),
    ),
    "fanuc": Reader(".nc", _programs("fanuc"), _program("fanuc", "vmc-fanuc")),
    "sinumerik": Reader(".mpf", _programs("sinumerik"), _program("sinumerik", "vmc")),
    "heidenhain": Reader(".h", _programs("heidenhain"), _program("heidenhain", "vmc")),
    "apt": Reader(".apt", _programs("apt", "trunnion/cone.cls"), _program("apt", "xyzac-trunnion")),
    "stl": Reader(".stl", _stl, _mesh),
    "dxf": Reader(".dxf", _dxf, _drawing),
    "sections": Reader(".txt", lambda: example("hecc/main_01.txt", "hecc/splitter_03.txt"), _sections),
    "meridian": Reader(".txt", lambda: example("hecc/hub.txt", "hecc/shroud.txt"), _meridian),
    "machine": Reader(
        ".toml", lambda: shipped(*(f"data/machines/{m}.toml" for m in MACHINES)), _machine
    ),
    "ini": Reader(".ini", lambda: example("tube/linuxcnc/tube.ini"), _ini),
    "material": Reader(
        ".toml", lambda: shipped("data/materials/al7075-t6.toml", "data/materials/al6082-t6.toml"), _material
    ),
    "catalogue": Reader(".toml", lambda: shipped("data/catalogues/wu2019.toml"), _catalogue),
    "fuzzy": Reader(".toml", lambda: shipped("control/standard.toml"), _fuzzy),
    "tools": Reader(
        ".tbl",
        lambda: [b"T1 P1 D2 Z3 ;mill\nT2 P2 D4 Z5 X1\nT3 P3 D0.5 Q2\n", *example("tube/linuxcnc/tube.tbl")],
        _tools,
    ),
    "fctb": Reader(
        ".fctb",
        lambda: [json.dumps({
            "name": "mill", "shape": "bullnose.fcstd", "version": 2,
            "parameter": {"Diameter": "6,0 mm", "CuttingEdgeHeight": "1/2 in", "ShankDiameter": "6 mm", "Flutes": "3",
                          "FlatRadius": "1.5 mm"},
            "attribute": {"btl-stickout": "30 mm"},
        }).encode()],
        _fctb,
    ),
    "job": Reader(".toml", _jobs, _job),
    "forces": Reader(".csv", _forces, _force),
    "log": Reader(".csv", _log_text, _log),
    "path": Reader(".csv", _path_text, _path),
    "cuts": Reader(".csv", _cuts, _cut),
    "stock": Reader(".npz", _npz, _stock),
    "parquet": Reader(".parquet", _parquet, _result),
    "summary": Reader(".json", lambda: [json.dumps(SUMMARY).encode()], _summary),
    "step": Reader(".step", _step, _model),
    "removal": Reader(".npz", _removal_parts, _removal),
    "engagement": Reader(".npz", _engagement_parts, _engagement),
    "streams": Reader(".xml", _streams, _stream),
    "device": Reader(".xml", _devices, _device),
    "modes": Reader(".toml", _modes_text, _modes),
    "spindle-log": Reader(".csv", _spindle_logs, _spindle_log),
    "spindle-file": Reader(".toml", _spindle_files, _spindle_file),
    "freecad": Reader(".FCStd", _document, _freecad),
}  # fmt: skip
