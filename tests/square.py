"""A result written by hand: the cutter goes round a square, and every number of it is known."""

import hashlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import trimesh

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.engagement.tooth_engagement import engagement_of_arcs
from chipload.errors import Finding, Severity
from chipload.report.engagement import engagement_bytes
from chipload.report.presentation import Blank
from chipload.report.removal import removal_bytes, removal_meshes
from chipload.report.scene import legend
from chipload.result import LimitCheck, Provenance, Result, SurfaceMap, Track, TrackKind, Verdict, in_memory
from chipload.result.history import maps_bytes, write_history
from chipload.result.summary import summary_bytes
from chipload.simulation.engagement_samples import engagement_samples

ROWS = 200
#: hand-made history: the cutter goes round a square of 40 mm, 0.1 s a step, one line of the program a side
SIDE = np.repeat(np.arange(4), ROWS // 4)
ALONG = np.tile(np.arange(1, ROWS // 4 + 1), 4) * 0.8
X = np.select([SIDE == 0, SIDE == 1, SIDE == 2], [ALONG, np.full(ROWS, 40.0), 40.0 - ALONG], 0.0)
Y = np.select([SIDE == 0, SIDE == 1, SIDE == 2], [np.zeros(ROWS), ALONG, np.full(ROWS, 40.0)], 40.0 - ALONG)
T = 0.1 * np.arange(1, ROWS + 1)
#: force rises to 900 N at row 120 and falls again, feed is 480 mm/min but for the last side
FORCE = 900.0 - 7.0 * np.abs(np.arange(ROWS) - 120.0)
FEED = np.where(SIDE == 3, 240.0, 480.0)
#: line of the program of each side
LINE = np.array([7, 8, 9, 10])[SIDE]
PROGRAM = "(square)\nG21 G90\nT1 M6\nS3000 M3\nG0 X0 Y0 Z5\nG1 Z-2 F480\nX40\nY40\nX0\nY0 F240\nM2\n"
CL = (
    "UNITS/MM\nCUTTER/8,1\nLOADTL/1\nRAPID\nGOTO/0,0,-2\nFEDRAT/480,MMPM\n"
    "GOTO/40,0,-2\nGOTO/40,40,-2\nGOTO/0,40,-2\nGOTO/0,0,-2\nFINI\n"
)


def square_result(job: str = "square", program: bytes = PROGRAM.encode()) -> Result:
    """The result of the program; its numbers are stated, not calculated from the history."""
    columns = {
        "pass": np.array(["square"] * ROWS, dtype=object),
        "line": LINE,
        "tool": np.ones(ROWS, dtype=np.int64),
        "s_mm": 0.8 * np.arange(1, ROWS + 1),
        "t_s": T,
        "duration_s": np.full(ROWS, 0.1),
        "x_mm": X,
        "y_mm": Y,
        "z_mm": np.full(ROWS, -2.0),
        "feed_mm_min": FEED,
        "force_n": FORCE,
        "torque_nm": FORCE / 100.0,
    }
    at = (23.2, 40.0, -2.0)
    limits = (
        LimitCheck("force_n", 800.0, 900.0, Verdict.EXCEEDS, "program", 120, 9, at, 12.1),
        LimitCheck("torque_nm", 12.0, 9.0, Verdict.HOLDS, "program", None, 9, at, resolution_error=0.0),
    )
    found = (Finding("rapid-in-stock", 8, "a rapid goes through material", Severity.EXCEEDS),)
    track = Track(
        "program", TrackKind.PROGRAM, True, 20.0, limits, found, ("0-program.apt",), blocks=in_memory(columns)
    )  # fmt: skip
    return Result(
        "program",
        job,
        (track,),
        ({"kind": "simulate"},),
        (Finding("no-tool-table", 3, "no tool table"),),
        ("limit power_w: not stated",),
        Provenance({"program": f"square.ngc sha256 {hashlib.sha256(program).hexdigest()}"}, (), "vmc", {}, {}),
    )


def two_variants() -> Result:
    """Two tracks: half the force in half the time is in use, the other exceeds its limit and has a finding."""
    one = square_result()
    columns = dict(one.tracks[0].columns)
    half = {**columns, "force_n": FORCE / 2.0}
    twice = {**columns, "t_s": 2.0 * T, "duration_s": np.full(ROWS, 0.2)}
    at = (23.2, 40.0, -2.0)
    holds = LimitCheck("force_n", 800.0, 450.0, Verdict.HOLDS, "variable", 120, 9, at, 12.1, 0.0)
    exceeds = LimitCheck("force_n", 800.0, 900.0, Verdict.EXCEEDS, "constant", 120, 9, at, 24.2)
    found = (Finding("off-part", 8, "the path leaves the workpiece", Severity.EXCEEDS),)
    kind, program = TrackKind.VARIANT, ("0-program.apt",)
    constant = Track("constant", kind, False, 40.0, (exceeds,), found, program, 0, {"depth_mm": 1.0}, in_memory(twice))
    variable = Track("variable", kind, True, 20.0, (holds,), (), program, 0, {"depth_mm": 2.0}, in_memory(half))
    return replace(one, tracks=(variable, constant))


def write_by_hand(result: Result, folder: Path) -> Path:
    """Summary and history of a result, its CL data, and a report of one line."""
    folder.mkdir(parents=True)
    with (folder / "history.parquet").open("wb") as file:
        rows = write_history(result, file)
    (folder / "summary.json").write_bytes(summary_bytes(result, rows))
    (folder / "0-program.apt").write_text(CL)
    (folder / "report.html").write_text("<p>the report</p>")
    return folder


def make_result(folder: Path, job: str = "square", program: bytes = PROGRAM.encode(), scene: bool = True) -> Path:
    """The folder of :func:`square_result`."""
    write_by_hand(square_result(job, program), folder)
    if scene:
        box = trimesh.creation.box(extents=(60.0, 60.0, 10.0))
        box.apply_translation((20.0, 20.0, -7.0))
        box.visual.face_colors = (168, 122, 58, 255)
        box.metadata["legend"] = legend(
            "gouge and excess [mm]", [(-0.2, (178, 24, 43)), (0.0, (236, 236, 232)), (0.2, (33, 102, 172))],
            [("not looked for", (250, 246, 225))],
        )  # fmt: skip
        made = trimesh.Scene()
        made.add_geometry(box, node_name="stock", geom_name="stock")
        (folder / "scene.glb").write_bytes(made.export(file_type="glb", extension_webp=False))
    return folder


#: the cutter of :func:`make_cut_result`, with a holder, and the stock that it goes round in, 2 mm deep
MILL = Cutter(8.0, 2, 0.5, 12.0, 20.0, 6e5, holder=((20.0, 24.0),))
STOCK = trimesh.creation.box(bounds=[[-10.0, -10.0, -12.0], [50.0, 50.0, 0.0]])
#: what a corner of the path adds to the strips along its sides: a quarter disc outside less a square inside [mm^2]
CORNER = 4.0 * np.pi - 16.0
#: volume of the stock [mm^3] before the first row, at the middle of the path, at its end
VOLUMES = (
    43_200.0,
    43_200.0 - 2.0 * (79.2 * 8.0 + 16.0 * np.pi + CORNER),
    43_200.0 - 2.0 * (160.0 * 8.0 + 4.0 * CORNER),
)


#: what its teeth cut: a slot, feed per tooth of 0.08 mm (0.04 on the last side), from row 10 on
SLOT = replace(
    engagement_of_arcs(np.zeros(ROWS - 10), np.full(ROWS - 10, np.pi), FEED[10:] / 6000.0, MILL, 2.0),
    frame=np.array(
        [[[x, y, 0.0], [-y, x, 0.0], [0.0, 0.0, 1.0]] for x, y in ((1, 0), (0, 1), (-1, 0), (0, -1))], dtype=np.float64
    )[SIDE[10:]],
)
METAL = Material("plain", 1000.0, 300.0, 0.0, 10.0, 5.0, 0.0, source="made up for a test")
SAMPLES = engagement_samples(SLOT, MILL, METAL, np.arange(10, ROWS), 1)


#: mean torque [N m], spindle speed and stability margin of its rows, and the chart of its tool
TORQUE, RPM = np.full(ROWS, 2.0), np.where(SIDE == 3, 2400.0, 3000.0)
MARGIN = np.where(SIDE == 1, 0.8, 2.0)
CHART = {"tool": 1, "speed_rpm": [1000.0, 2000.0, 3000.0, 6000.0], "margin": [0.5, 1.5, 0.8, 2.5]}


def sheet() -> SurfaceMap:
    """A surface map of 40 x 40 mm: torque of 0.4 N m for each mm along x, of which 12 are allowed; it bends upwards."""
    x, y = (v.ravel() for v in np.meshgrid(np.linspace(0.0, 40.0, 41), np.linspace(0.0, 40.0, 41)))
    corner = (np.arange(40)[:, None] * 41 + np.arange(40)).ravel()
    faces = np.concatenate([np.column_stack([corner + k for k in (0, 1, 42)]),
                            np.column_stack([corner + k for k in (0, 42, 41)])])  # fmt: skip
    points, up = np.column_stack([x, y, 0.0 * x]), 0.01 * (x / 40.0) ** 2
    moved = np.column_stack([0.0 * x, 0.0 * x, up])
    return SurfaceMap("sheet", "torque_nm", points, 0.4 * x, faces, displacement=moved)


SHEET = sheet()


def make_cut_result(folder: Path) -> Path:
    """The square cut into a block, its stock at every row, and a clamp that the holder runs into at row 60."""
    one = square_result("cut")
    track = one.tracks[0]
    at = (float(X[60]), float(Y[60]), -2.0)
    hit = Finding("collision", 8, "shank or holder goes 1.5 mm into fixture 0", Severity.EXCEEDS, at, 60)
    listed = {"what": "shank or holder", "into": "fixture 0", "depth_mm": 1.5, "line": 8, "place": list(at), "t_s": 6.1}
    operating = {**track.columns, "torque_mean_nm": TORQUE, "power_w": TORQUE * RPM * np.pi / 30.0}
    result = replace(
        one,
        tracks=(
            replace(
                track, limits=track.limits[1:], findings=(hit,),
                blocks=in_memory({**operating, "stability_margin": MARGIN}),
            ),
        ),
        operations=({
            "kind": "simulate", "collisions": [{**listed, "tool": 1}],
            "stability": {"margin_wanted": 1.2, "chart": [CHART]},
        },),
        maps=(SHEET,),
    )  # fmt: skip
    write_by_hand(result, folder)
    (folder / "maps.npz").write_bytes(maps_bytes(result))
    made = trimesh.Scene()
    for name, low, high, colour in (
        ("stock", (-10.0, -10.0, -12.0), (50.0, 50.0, -2.0), (168, 122, 58, 255)),
        ("fixture 0", (46.0, 2.0, 0.0), (56.0, 16.0, 24.0), (92, 122, 150, 255)),
    ):
        box = trimesh.creation.box(bounds=[low, high])
        box.visual.face_colors = colour
        made.add_geometry(box, node_name=name, geom_name=name)
    (folder / "scene.glb").write_bytes(made.export(file_type="glb", extension_webp=False))
    blanks = {"program": Blank(STOCK, {1: MILL})}
    (folder / "removal.npz").write_bytes(removal_bytes(result, removal_meshes(result, blanks), blanks))
    (folder / "engagement.npz").write_bytes(engagement_bytes(result, {"program": SAMPLES}))
    return folder
