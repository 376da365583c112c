"""The `[[cutter]]` table of a job: the dimensions of a cutter, or a file that states them.

A value in the job overrides that of the file. A value that neither states is an error; it is never guessed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from chipload.cutter.camotics import read_camotics_tool
from chipload.cutter.cutter import (
    CENTRE_FLUTES,
    CENTRE_MM,
    FLUTED_FACTOR,
    LONGEST,
    MOST_FLUTES,
    THINNEST,
    WIDEST,
    Cutter,
)
from chipload.cutter.fctb import read_fctb
from chipload.cutter.fusion import read_fusion_tool
from chipload.cutter.iso13399 import read_iso13399
from chipload.cutter.profile import ProfileSegment
from chipload.cutter.shapes import dovetail, lens, lollipop, reamer, thread_mill
from chipload.cutter.strength import ToolMaterial, ToolStrength
from chipload.cutter.tooltable import read_tool_table
from chipload.errors import InputError, InputErrors
from chipload.tables import nearest
from chipload.units import rad_s_from_rpm

#: endings of files with tool data
ENDINGS = (".fctb", ".json", ".tools", ".p21", ".camotics", ".tbl")
#: keys that every cutter requires
NEEDED = ("number", "diameter_mm", "flutes", "helix_deg", "flute_length_mm", "overhang_mm", "modulus_gpa")


#: other names of ``barrel_radius_mm`` in shops and tool libraries
BARREL_NAMES = ("profile_radius_mm", "side_radius_mm", "segment_radius_mm")
BARREL = "the radius of the flank arc of a barrel cutter is barrel_radius_mm: state that"


def _rows(value: Any) -> Any:
    """A list of lists as tuples."""
    return tuple(tuple(row) if isinstance(row, list) else row for row in value) if isinstance(value, list) else value


class CutterTable(BaseModel):
    """A cutter: its dimensions, or a file that states them.

    ``file`` is a FreeCAD tool bit (`.fctb`), a tool library of Fusion 360 or HSMWorks (`.json`, `.tools`), tool data of
    ISO 13399 (`.p21`), a CAMotics project (`.camotics`) or a LinuxCNC tool table (`.tbl`), with ``tool`` the number in
    it and ``file_unit`` the unit of the lengths of a tool table, which does not state its unit.
    """

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)

    number: int | None = Field(None, ge=0, description="tool number in the program")
    name: str | None = Field(None, description="name shown in the report")
    diameter_mm: float | None = Field(None, description=f"diameter, from {THINNEST:g} to {WIDEST:g}")
    flutes: int | None = Field(None, description=f"number of teeth, at most {MOST_FLUTES}")
    helix_deg: float | None = Field(None, description="helix angle, of the hand of the cutter, below 80")
    left_hand: bool | None = Field(
        None, description="whether it cuts with the spindle counter-clockwise (M4); default false"
    )
    centre_cutting: bool | None = Field(
        None,
        description="whether its teeth reach its axis, so that it can plunge (ISO 13399 CCC); default: true of round "
        f"and pointed tips and up to {CENTRE_FLUTES} teeth and {CENTRE_MM:g} mm, else not known",
    )
    ramp_angle_deg: float | None = Field(
        None, description="greatest angle at which it may descend into solid material (ISO 13399 RMPX), at most 90"
    )
    max_rpm: float | None = Field(None, description="greatest spindle speed (ISO 13399 RPMX)")
    thread_pitch_mm: float | None = Field(
        None, description="of a tap: pitch of its thread (ISO 13399 TP); a tap also has body_mm"
    )
    hole_depth_mm: float | None = Field(
        None, description="greatest depth that it drills without a retraction; default: not known above 5 diameters"
    )
    web_mm: float | None = Field(
        None,
        description="of a drill: thickness of its web at the point, after thinning, for thrust and torque; default: "
        "0.155 diameters, a standard point; a split point has about 0.025",
    )
    flute_length_mm: float | None = Field(None, description="length of the cutting edges along the axis")
    overhang_mm: float | None = Field(None, description=f"length from the holder to the tip, at most {LONGEST:g}")
    modulus_gpa: float | None = Field(None, description="Young's modulus of the cutter: carbide 580, steel 210")
    corner_radius_mm: float | None = Field(None, description="corner radius; half the diameter: ball nose; default 0")
    corner_e_mm: float | None = Field(
        None, description="APT parameter e: radial position of the centre of the corner; default: tangent corner"
    )
    corner_f_mm: float | None = Field(
        None, description="APT parameter f: axial position of the centre of the corner; default: tangent corner"
    )
    barrel_radius_mm: float | None = Field(
        None,
        description="barrel cutter: radius of the arc between corner and flank, tangent to both; with it "
        "corner_e_mm is free, default 0, a round tip",
    )
    shape: Literal["lens", "lollipop", "dovetail", "thread mill", "reamer"] | None = Field(
        None,
        description="shape of its own: `lens` with tip_radius_mm, `lollipop`, a ball on a neck of shank_diameter_mm, "
        "`dovetail` with flank_deg and a neck, `thread mill` with thread_pitch_mm and a neck, `reamer` with lead_mm; "
        "default: that of the corner, flank and bottom",
    )
    tip_radius_mm: float | None = Field(None, description="lens: radius of the arc at the tip")
    flank_deg: float | None = Field(
        None,
        description="angle between flank and bottom: dovetail from 10 to below 90; thread mill from 5 to 60, default "
        "30, as of ISO and inch threads",
    )
    tooth_width_mm: float | None = Field(
        None, description="thread mill: width of the tooth at its diameter; default: an eighth of the pitch, ISO 68-1"
    )
    tooth_rows: int | None = Field(
        None, description="thread mill: rows of teeth along its axis, one pitch apart; default 1"
    )
    lead_mm: float | None = Field(None, description="reamer: length along the axis of the lead that cuts")
    lead_deg: float | None = Field(None, description="reamer: angle of its lead with the axis; default 45")
    bottom_deg: float | None = Field(None, description="angle of the bottom, APT parameter alpha; default 0")
    taper_deg: float | None = Field(None, description="half angle of a tapered flank, APT parameter beta; default 0")
    runout_mm: float | None = Field(
        None,
        description="offset of the cutter's axis from the spindle's axis, half the reading of a dial gauge; default: "
        "none in the loads, 0.010 (above 10 mm of diameter 0.0125) in their error",
    )
    runout_deg: float | None = Field(
        None, description="direction of the runout, from tooth 0; default: not known, runout_mm counts as an error"
    )
    pitch_deg: Annotated[tuple[float, ...] | None, BeforeValidator(_rows)] = Field(
        None, description="angle from the previous tooth to each tooth, tooth 0 first, 360 in all; default: equal"
    )
    shank_diameter_mm: float | None = Field(None, description="diameter of the shank; default: diameter_mm")
    holder_mm: Annotated[tuple[tuple[float, float], ...] | None, BeforeValidator(_rows)] = Field(
        None, description="length and diameter of each section of the holder, upwards from the overhang"
    )
    body_mm: Annotated[tuple[tuple[float, float], ...] | None, BeforeValidator(_rows)] = Field(
        None,
        description="profile of a tool whose chips are not simulated: radius and height above the tip of each corner",
    )
    tip_n_um: float | None = Field(
        None, description="measured stiffness of the tip across the axis; replaces grip, holder and spindle stiffness"
    )
    gullet_mm2: float | None = Field(None, description="area between two teeth in a section across the axis")
    chip_ratio: float | None = Field(None, description="volume of loose chips over the volume cut, at least 1")
    fluted_factor: float | None = Field(None, description="equivalent diameter of the fluted part over diameter_mm")
    tool_material: Literal["carbide", "hss"] | None = Field(
        None, description="material of the cutter; default: by modulus_gpa, steel below 350"
    )
    strength_mpa: float | None = Field(None, description="rupture strength of carbide, yield strength of steel")
    safety_factor: float | None = Field(None, description="strength over allowable stress")
    stress_concentration: float | None = Field(None, description="stress at a notch over that of a smooth bar")
    file: str | None = Field(None, description=f"file with tool data: {', '.join(ENDINGS)}")
    tool: int | None = Field(None, description="number of the tool in a file of several tools")
    file_unit: Literal["mm", "inch"] | None = Field(
        None, description="unit of a tool table (.tbl), which does not state its unit"
    )

    def cutter(self, folder: str | Path = ".") -> Cutter:
        """The cutter; ``file`` is relative to ``folder``.

        Raises
        ------
        InputError
            A key is missing, a number out of range, the file cannot be read or is of another kind.
        """
        given = self.model_dump(exclude_none=True)
        values = {**self._from_file(Path(folder)), **given}
        if body := values.get("body_mm"):
            # nothing cuts with it: teeth and modulus have no effect
            sizes = {"diameter_mm": 2.0 * max(r for r, _ in body), "flute_length_mm": body[-1][1]}
            values = {"flutes": 1, "helix_deg": 0.0, "modulus_gpa": 210.0, **sizes, **values}
        if values.get("shape") == "lollipop" and "diameter_mm" in values and "shank_diameter_mm" in values:
            values = {
                "flute_length_mm": lollipop(values["diameter_mm"], values["shank_diameter_mm"])[-1].z[1],
                **values,
            }
        if values.get("shape") == "thread mill" and "thread_pitch_mm" in values:
            values = {"flute_length_mm": values.get("tooth_rows", 1) * values["thread_pitch_mm"], **values}
        where = f": {self.file} does not state it" if self.file else ""
        missing = [
            f"cutter.{key} is missing{where}: state it; dimensions of a cutter are never guessed"
            for key in NEEDED
            if key not in values
        ]
        if missing:
            raise InputErrors(*missing) if len(missing) > 1 else InputError(missing[0])
        if "runout_deg" in values and "runout_mm" not in values:
            raise InputError("cutter.runout_mm is missing: state it with runout_deg, or leave both out")
        shape = _shape(values)
        runout = float(values.get("runout_mm", 0.0))
        offset = runout if "runout_deg" in values else 0.0
        return Cutter(
            diameter=values["diameter_mm"],
            flutes=values["flutes"],
            helix=math.radians(values["helix_deg"]),
            flute_length=values["flute_length_mm"],
            overhang=values["overhang_mm"],
            modulus=values["modulus_gpa"] * 1000.0,
            corner_radius=0.0 if shape else values.get("corner_radius_mm", 0.0),
            corner_e=values.get("corner_e_mm"),
            corner_f=values.get("corner_f_mm"),
            barrel_radius=values.get("barrel_radius_mm"),
            bottom=math.radians(values.get("bottom_deg", 0.0)),
            taper=math.radians(values.get("taper_deg", 0.0)),
            runout=(offset, math.radians(values.get("runout_deg", 0.0))),
            runout_size=runout if "runout_mm" in values and offset == 0.0 else None,
            pitch=tuple(math.radians(x) for x in values.get("pitch_deg", ())),
            shank_diameter=values.get("shank_diameter_mm"),
            holder=tuple(tuple(part) for part in values.get("holder_mm", ())),
            tip_stiffness=1000.0 * values["tip_n_um"] if "tip_n_um" in values else None,
            gullet=values.get("gullet_mm2"),
            chip_ratio=values.get("chip_ratio"),
            fluted_factor=values.get("fluted_factor", FLUTED_FACTOR),
            strength=_strength(values),
            body=values.get("body_mm", ()),
            number=values["number"],
            name=values.get("name", ""),
            left_hand=values.get("left_hand", False),
            centre_cutting=values.get("centre_cutting"),
            ramp_angle=math.radians(values["ramp_angle_deg"]) if "ramp_angle_deg" in values else None,
            max_speed=rad_s_from_rpm(values["max_rpm"]) if "max_rpm" in values else None,
            thread_pitch=values.get("thread_pitch_mm"),
            hole_depth=values.get("hole_depth_mm"),
            web=values.get("web_mm"),
            shape=shape,
            tooth_rows=values.get("tooth_rows", 1),
        )

    def _from_file(self, folder: Path) -> dict[str, Any]:
        """Values of ``file`` by the keys of the job."""
        if self.file is None:
            for key in ("tool", "file_unit"):
                if getattr(self, key) is not None:
                    raise InputError(f"cutter.{key} is stated without cutter.file: state the file, or leave it out")
            return {}
        path = folder / self.file
        kind = path.suffix.lower()
        if kind not in ENDINGS:
            raise InputError(f"cutter.file = {self.file}: must end in {', '.join(ENDINGS)}")
        if kind in (".fctb", ".p21") and self.tool is not None:
            raise InputError(f"cutter.tool applies to a file of several tools: leave it out for {self.file}")
        if self.file_unit is not None and kind != ".tbl":
            raise InputError(f"cutter.file_unit applies to a tool table (.tbl): leave it out for {self.file}")
        if kind == ".fctb":
            return self._checked(read_fctb(path))
        if kind == ".p21":
            return read_iso13399(path)
        if kind in (".json", ".tools"):
            return self._checked(read_fusion_tool(path, self.tool))
        if self.tool is None:
            raise InputError(f"cutter.tool is missing: {self.file} holds several tools; state the number of one")
        if kind == ".camotics":
            return read_camotics_tool(path, self.tool)
        if self.file_unit is None:
            raise InputError(f"cutter.file_unit is missing: {self.file} does not state its unit; state mm or inch")
        return dict(read_tool_table(path, self.tool, self.file_unit))

    @staticmethod
    def _checked(values: dict[str, Any]) -> dict[str, Any]:
        """Values of a file as this table has them: tuples for lists."""
        return {key: _rows(value) for key, value in values.items()}


#: keys of shapes: those that need it, and those that may have it; none: every cutter
_OF_SHAPES = (
    ("tip_radius_mm", ("lens",), ("lens",)),
    ("flank_deg", ("dovetail",), ("dovetail", "thread mill")),
    ("shank_diameter_mm", ("lollipop", "thread mill"), ()),
    ("thread_pitch_mm", ("thread mill",), ()),
    ("tooth_width_mm", (), ("thread mill",)),
    ("tooth_rows", (), ("thread mill",)),
    ("lead_mm", ("reamer",), ("reamer",)),
    ("lead_deg", (), ("reamer",)),
)


def _shape(values: Mapping[str, Any]) -> tuple[ProfileSegment, ...]:
    """The segments of a shape of its own; empty: it has none."""
    kind = values.get("shape")
    for key, needed, allowed in _OF_SHAPES:
        if kind in needed and key not in values:
            raise InputError(f"cutter.{key} is missing: state it with shape = {kind!r}")
        if key in values and allowed and kind not in allowed:
            raise InputError(f"cutter.{key} is stated without shape = {allowed[0]!r}: state the shape, or leave it out")
    d, r, height = values["diameter_mm"], values.get("corner_radius_mm", 0.0), values["flute_length_mm"]
    if kind == "lens":
        return lens(d, values["tip_radius_mm"], r, height)
    if kind == "dovetail":
        return dovetail(d, math.radians(values["flank_deg"]), r, height)
    if kind == "lollipop":
        if r not in (0.0, 0.5 * d):
            raise InputError(f"cutter.corner_radius_mm = {r:g}: must be {0.5 * d:g} with shape = 'lollipop'")
        return lollipop(d, values["shank_diameter_mm"])
    if kind is not None and r:
        raise InputError(f"cutter.corner_radius_mm = {r:g}: must be 0 with shape = {kind!r}; leave it out")
    if kind == "thread mill":
        pitch = values["thread_pitch_mm"]
        flank, width = math.radians(values.get("flank_deg", 30.0)), values.get("tooth_width_mm", 0.125 * pitch)
        return thread_mill(d, pitch, flank, width, values["shank_diameter_mm"])
    if kind == "reamer":
        return reamer(d, values["lead_mm"], math.radians(values.get("lead_deg", 45.0)), height)
    return ()


def _strength(values: Mapping[str, Any]) -> ToolStrength:
    """The strength of the cutter; values that are not stated are the defaults of :class:`ToolStrength`."""
    names = {"strength_mpa": "mpa", "safety_factor": "safety_factor", "stress_concentration": "concentration"}
    stated = {field: values[key] for key, field in names.items() if key in values}
    material = ToolMaterial(values["tool_material"]) if "tool_material" in values else None
    return ToolStrength(material, **stated)


def cutter_from_table(table: Mapping[str, Any], folder: str | Path = ".") -> Cutter:
    """The cutter of a ``[[cutter]]`` table.

    Raises
    ------
    InputError
        As :meth:`CutterTable.cutter`; a key is unknown or its value of the wrong kind.

    Examples
    --------
    >>> mill = {"number": 1, "diameter_mm": 10.0, "flutes": 4, "helix_deg": 30.0, "flute_length_mm": 22.0}
    >>> cutter_from_table({**mill, "overhang_mm": 35.0, "modulus_gpa": 580.0}).radius
    5.0
    """
    try:
        checked = CutterTable.model_validate(dict(table))
    except ValidationError as err:
        raise InputError(_first(err, table)) from None
    return checked.cutter(folder)


def _first(err: ValidationError, table: Mapping[str, Any]) -> str:
    """The message of the first error in a table."""
    row = err.errors()[0]
    key = ".".join(str(x) for x in row["loc"])
    if row["type"] == "extra_forbidden":
        near = nearest(key, list(CutterTable.model_fields))
        return f"cutter.{key}: {BARREL if key in BARREL_NAMES else f'unknown key: the nearest known one is {near}'}"
    wanted = {
        "float_type": "must be a number",
        "finite_number": "must be a finite number",
        "int_type": "must be a whole number",
        "string_type": "must be a text",
        "literal_error": "must be " + str(row.get("ctx", {}).get("expected", "")).replace("'", ""),
        "greater_than_equal": f"must be at least {row.get('ctx', {}).get('ge')}",
    }
    value = table[str(row["loc"][0])]
    return f"cutter.{key} = {value!r}: {wanted.get(row['type'], row['msg'])}"
