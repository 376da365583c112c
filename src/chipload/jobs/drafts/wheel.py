"""Drafts of jobs that plan an impeller out of a model of the whole wheel: a closed mesh (STL), or STEP.

The faces of the model do not matter: blades in several patches, or blade and hub in one face, are cut alike. Hub,
shroud and sections are written beside the job, in the frame of the model and in mm.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.geometry.bladegen import BladeRow
from chipload.geometry.mesh import read_mesh
from chipload.geometry.sections import AXES
from chipload.geometry.wheel_sections import WheelBlades, wheel_blades
from chipload.jobs.drafts.draft import Draft
from chipload.jobs.drafts.impeller import RowNotes, draft_row
from chipload.lazy import trimesh
from chipload.number_text import number_text
from chipload.units import MM_PER

Floats = NDArray[np.float64]

#: [mm] greatest deviation of a triangle from a surface of STEP
CHORD = 0.02
#: a wheel about an axis: greatest relative difference of its two other moments of inertia, and how far its centre lies
#: from the axis over its size
ALIKE, CENTRED = 0.01, 0.005
#: an STL file states no unit: a wheel has at least this outer diameter [mm] in the one that is guessed
LEAST_MM, UNITS = 30.0, ("mm", "inch", "m")
#: names of the files beside the job
PROFILE, HUB, SHROUD = "blade.curve", "hub.curve", "shroud.curve"


def wheel_axis(mesh: trimesh.Trimesh) -> str | None:
    """The axis of a file, x, y or z through its origin, about which a mesh may be a wheel; None if about none.

    A body with three equal parts or more round an axis has equal moments of inertia about all lines across it, and its
    centre of mass on it.
    """
    moments = np.asarray(mesh.moment_inertia)
    size = float(np.ptp(np.asarray(mesh.vertices), axis=0).max())
    for axis, order in AXES.items():
        M = moments[np.ix_(order, order)]
        across, centre = 0.5 * (M[0, 0] + M[1, 1]), np.asarray(mesh.center_mass)[list(order)]
        unequal = max(abs(M[0, 0] - M[1, 1]), abs(M[0, 1]), abs(M[0, 2]), abs(M[1, 2])) / across
        if unequal < ALIKE and float(np.hypot(*centre[:2])) < CENTRED * size:
            return axis
    return None


def draft_wheel(file: Path, folder: Path, machine: str | None = None) -> Draft | None:
    """The draft of an impeller job for a model of a wheel with blades; None where the model is no such wheel.

    Raises
    ------
    InputError
        The file cannot be read, or the model is a wheel whose blades cannot be cut into sections.
    """
    mesh, why = _read(file)
    axis = None if mesh is None else wheel_axis(mesh)
    if mesh is None or axis is None:
        return None
    order = list(AXES[axis])
    turned = trimesh.Trimesh(np.asarray(mesh.vertices)[:, order], mesh.faces, process=False)
    try:
        wheel = wheel_blades(turned)
    except InputError as err:
        raise InputError(f"{file.name}: a wheel about {axis}: {err}") from None
    return None if wheel is None else _draft_of(file, wheel, axis, why, machine)


def _read(file: Path) -> tuple[trimesh.Trimesh | None, str]:
    """The closed mesh of a model in mm, and where its unit comes from; no mesh where faces of STEP do not close."""
    if file.suffix.lower() != ".stl":
        try:
            return read_mesh(file, chord_mm=CHORD, key="part.file"), ""
        except InputError:
            return None, ""
    mesh = read_mesh(file, unit="mm", key="part.file")
    size = float(np.ptp(np.asarray(mesh.vertices), axis=0).max())
    unit = next((u for u in UNITS if MM_PER[u] * size >= LEAST_MM), UNITS[0])
    mesh.apply_scale(MM_PER[unit])
    return mesh, f"an STL file states no unit; its wheel was read in {unit}"


def _draft_of(file: Path, wheel: WheelBlades, axis: str, why: str, machine: str | None) -> Draft:
    """The draft of the blades of a wheel."""
    back = np.argsort(AXES[axis])
    files = {
        PROFILE: _profile(wheel, back),
        HUB: _curve(wheel.meridian.hub.points, back),
        SHROUD: _curve(wheel.meridian.shroud.points, back),
    }
    with tempfile.TemporaryDirectory(prefix="chipload-") as name:
        paths = {key: Path(name) / key for key in files}
        for key, data in files.items():
            paths[key].write_bytes(data)
        row = BladeRow(
            wheel.count, len(wheel.bodies) == 2, "mm", axis, paths[PROFILE], paths[HUB], paths[SHROUD]
        )  # fmt: skip
        notes = RowNotes("of the model", why, False, bool(why), _deviation_lines(wheel, axis))
        return draft_row(file, row, {path: key for key, path in paths.items()}, notes, machine, files)


def _deviation_lines(wheel: WheelBlades, axis: str) -> tuple[str, ...]:
    """How well the sections are those of the model."""
    out = [
        f"a wheel about {axis}, cut into {len(wheel.bodies[0])} sections: the blade through them leaves the vertices "
        f"of the model by at most {number_text(wheel.off, 2)} mm, 95 % of them by {number_text(wheel.usual, 2)} mm, "
        f"the hub by {number_text(wheel.meridian.hub_off, 2)} mm; edges are not compared",
    ]
    if wheel.others > 2.0 * wheel.off:
        out.append(
            f"the blades of the model differ: another one, turned onto the first, is up to "
            f"{number_text(wheel.others, 2)} mm from it; all are milled as the first one"
        )
    return tuple(out)


def _profile(wheel: WheelBlades, back: NDArray[np.intp]) -> bytes:
    """The sections of all bodies as TurboGrid has them."""
    lines = []
    for name, body in zip(("blade", "splitter"), wheel.bodies, strict=False):
        lines += [f"## {name}"] * (len(wheel.bodies) > 1)
        for k, section in enumerate(body, 1):
            lines += [f"# section {k}", *(_row(p) for p in section[:, back])]
    return ("\n".join(lines) + "\n").encode()


def _curve(meridian: Floats, back: NDArray[np.intp]) -> bytes:
    """A meridian, in the half-plane of a growing first axis, with every sixth of its points."""
    rows = np.stack([meridian[::6, 0], np.zeros(len(meridian[::6])), meridian[::6, 1]], axis=-1)
    return ("\n".join(_row(p) for p in rows[:, back]) + "\n").encode()


def _row(p: Floats) -> str:
    return " ".join(f"{x:.6f}" for x in p)
