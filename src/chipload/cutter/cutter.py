"""A cutter: the seven parameters of APT, its teeth and its overhang.

Notation (APT): d diameter where bottom and flank lines meet, r corner radius, e radial and f axial distance of the
corner circle's centre from the tip, alpha [rad] angle of the bottom with the plane normal to the axis, beta [rad] angle
of the flank with the axis (wider upwards), h height of the cutting part. rho [mm] distance from the axis, z [mm] height
above the tip. A flat end mill has r = 0, e = d/2, f = 0; a ball has r = d/2, e = 0, f = r.

Bottom line z = rho tan(alpha), flank line rho = d/2 + (z - d/2 tan(alpha)) tan(beta); the corner circle touches both:
e (1 - tan(alpha) tan(beta)) = d/2 (1 - tan(alpha) tan(beta)) + r tan(beta) / cos(alpha) - r / cos(beta),
f = e tan(alpha) + r / cos(alpha).

A barrel cutter has an arc of large radius between corner and flank (:mod:`chipload.cutter.barrel`). Its corner touches
the bottom and that arc, so that e is free: 0 for a round tip.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.barrel import FlankArc, flank_arc
from chipload.cutter.bodies import Profile, check_body
from chipload.cutter.profile import UPRIGHT, ProfileSegment, apt_segments, chords_of, radius_of
from chipload.cutter.strength import ToolStrength, check_material
from chipload.errors import InputError
from chipload.units import rpm_from_rad_s

#: strength of a cutter of which only the modulus is stated
ORDINARY = ToolStrength()
#: equivalent diameter of the fluted part over the cutter's diameter [Kops1990]
FLUTED_FACTOR = 0.8
#: an end mill with more teeth or a greater diameter [mm] may have none that reach its axis
CENTRE_FLUTES, CENTRE_MM = 4, 25.0
#: limits of a cutter: least and greatest diameter [mm], greatest overhang [mm], greatest number of teeth
THINNEST, WIDEST, LONGEST, MOST_FLUTES = 0.01, 1000.0, 3000.0, 200


@dataclass(frozen=True)
class Cutter:
    """A milling cutter.

    Parameters
    ----------
    diameter : d > 0 [mm]
    flutes : number of teeth, >= 1
    helix : helix angle [rad], 0 <= helix < 80 deg, of the same hand as the cutter
    flute_length : length that cuts [mm]
    overhang : length out of the holder [mm], >= flute_length
    modulus : Young's modulus of the cutter [MPa]
    corner_radius : r [mm], r >= 0 and e >= 0: without taper and bottom angle r <= d / 2
    corner_e, corner_f : APT e and f [mm]; None: where the corner touches bottom and flank, as e = d/2 - r, f = r of a
        bull nose. A given one must agree with that within 1e-3 mm. With ``barrel_radius`` e is free, None: 0
    barrel_radius : radius of the flank arc of a barrel cutter [mm]; None: no such arc
    bottom : alpha [rad], 0 <= alpha, alpha + beta < 90 deg
    taper : beta [rad], 0 <= beta
    runout : offset of the cutter's axis from that of the spindle [mm], and its direction from tooth 0 [rad]
    runout_size : [mm] of a runout whose direction is not known: loads are those without it, their errors have it; None:
        it is as ``runout`` states, and not known where that is 0
    pitch : angle [rad] between each tooth and the tooth that cuts before it, beginning with tooth 0, which follows the
        last one; their sum is a revolution; empty: all equal
    shank_diameter : [mm]; None: equal to the diameter
    holder : (length, diameter) [mm] of its parts, upwards from the overhang; empty: not known
    tip_stiffness : [N/mm] of the tip across the axis under a slow force, measured in the machine; None: not known
    gullet : area between two teeth in a section across the axis [mm^2]; None: not known
    chip_ratio : volume of loose chips over the volume cut, >= 1; with ``gullet`` or not at all
    fluted_factor : equivalent diameter of the fluted part over the diameter, in bending and torsion, (0, 1]
    strength : of its material
    body : (rho, z) [mm] of the profile from the tip to ``flute_length`` of a tool of another shape, which is compared
        with part, stock and fixtures but not simulated; empty: the seven APT numbers are its shape
    shape : segments of the profile of a shape beside those of APT and barrels, of :mod:`chipload.cutter.shapes`; the
        numbers of APT are then left out; one that is undercut has ``shank_diameter``, its neck
    tooth_rows : rows of teeth of ``shape`` one above the other along the axis, as of a thread mill; 1 to 100
    number : tool number, >= 0; 0: the tool of a program that names no tool
    name : name in the shop
    centre_cutting : whether its teeth reach its axis, so that it can plunge; None: not stated
    ramp_angle : greatest angle [rad] at which it may descend into solid material, up to pi/2; None: not known
    left_hand : cuts while the spindle turns counter-clockwise (M4); its helix is left-handed then
    max_speed : greatest spindle speed [rad/s], > 0; None: not known
    thread_pitch : of the thread that a tap, or a thread mill by its ``shape``, cuts [mm], > 0; None: not known, or none
    hole_depth : greatest depth [mm] that it drills without a retraction, > 0; None: not known
    web : thickness [mm] of the web of a drill at its point, > 0; None: of standard design

    Raises
    ------
    InputError
        A number is out of range; the message names it, its value and its limit.
    """

    diameter: float
    flutes: int
    helix: float
    flute_length: float
    overhang: float
    modulus: float
    corner_radius: float = 0.0
    corner_e: float | None = None
    corner_f: float | None = None
    bottom: float = 0.0
    taper: float = 0.0
    runout: tuple[float, float] = (0.0, 0.0)
    pitch: tuple[float, ...] = ()
    shank_diameter: float | None = None
    holder: tuple[tuple[float, float], ...] = ()
    tip_stiffness: float | None = None
    gullet: float | None = None
    chip_ratio: float | None = None
    fluted_factor: float = FLUTED_FACTOR
    strength: ToolStrength = ORDINARY
    body: Profile = ()
    number: int = 1
    name: str = ""
    barrel_radius: float | None = None
    left_hand: bool = False
    centre_cutting: bool | None = None
    ramp_angle: float | None = None
    max_speed: float | None = None
    thread_pitch: float | None = None
    hole_depth: float | None = None
    runout_size: float | None = None
    web: float | None = None
    shape: tuple[ProfileSegment, ...] = ()
    tooth_rows: int = 1

    def __post_init__(self) -> None:
        def need(ok: bool, key: str, value: float, limit: str) -> None:
            if not ok:
                raise InputError(f"cutter.{key} = {value:g}: {limit}")

        optional = (self.corner_e, self.corner_f, self.barrel_radius, self.shank_diameter)
        numbers = (self.diameter, self.helix, self.flute_length, self.overhang, self.modulus, self.corner_radius)
        more = (self.bottom, self.taper, *self.runout, *(x for x in optional if x is not None))
        if not all(math.isfinite(x) for x in (*numbers, *more)):
            raise InputError("cutter: a number is not finite")
        need(self.diameter > 0.0, "diameter_mm", self.diameter, "must be above 0")
        need(
            THINNEST <= self.diameter <= WIDEST,
            "diameter_mm",
            self.diameter,
            f"must be from {THINNEST:g} to {WIDEST:g}",
        )
        need(self.flutes >= 1, "flutes", self.flutes, "must be at least 1")
        need(self.flutes <= MOST_FLUTES, "flutes", self.flutes, f"must be at most {MOST_FLUTES}")
        need(
            0.0 <= self.helix < math.radians(80.0), "helix_deg", math.degrees(self.helix), "must be from 0 to below 80"
        )
        need(self.flute_length > 0.0, "flute_length_mm", self.flute_length, "must be above 0")
        need(
            self.overhang >= self.flute_length,
            "overhang_mm",
            self.overhang,
            f"must be at least flute_length_mm = {self.flute_length:g}",
        )
        need(self.overhang <= LONGEST, "overhang_mm", self.overhang, f"must be at most {LONGEST:g}")
        need(
            1e4 <= self.modulus <= 1e6,
            "modulus_gpa",
            self.modulus / 1000.0,
            "must be from 10 to 1000 (steel 210, carbide 580)",
        )
        right = 0.5 * math.pi - 1e-9
        need(0.0 <= self.bottom < right, "bottom_deg", math.degrees(self.bottom), "must be from 0 to below 90")
        need(
            self.taper >= 0.0 and self.taper + self.bottom < right,
            "taper_deg",
            math.degrees(self.taper),
            f"must be from 0 to below 90 - bottom_deg = {90.0 - math.degrees(self.bottom):g}",
        )
        need(self.corner_radius >= 0.0, "corner_radius_mm", self.corner_radius, "must be at least 0")
        self._check_corner()
        need(self.runout[0] >= 0.0, "runout_mm", self.runout[0], "must be at least 0")
        size = self.runout_size or 0.0
        need(0.0 <= size <= self.diameter / 2.0, "runout_mm", size, "must be from 0 to diameter_mm / 2")
        self._check_pitch()
        if self.body:
            wide = check_body(self.body, self.flute_length)
            limit = f"must be {2.0 * wide:g}, as of body_mm; leave it out"
            need(abs(wide - self.radius) <= 1e-6, "diameter_mm", self.diameter, limit)
        shank = self.shank_diameter
        need(shank is None or shank > 0.0, "shank_diameter_mm", shank or 0.0, "must be above 0")
        for k, part in enumerate(self.holder):
            for key, size in zip(("length", "diameter"), part, strict=True):
                need(0.0 < size <= 3000.0, f"holder.{k}.{key}_mm", size, "must be above 0 and at most 3000")
        tip = self.tip_stiffness
        need(tip is None or 0.0 < tip < math.inf, "tip_n_um", (tip or 0.0) / 1000.0, "must be above 0")
        if (self.gullet is None) != (self.chip_ratio is None):
            lacks, has = ("gullet_mm2", "chip_ratio") if self.gullet is None else ("chip_ratio", "gullet_mm2")
            raise InputError(f"cutter.{lacks} is missing: give it with {has} or leave both out")
        room = 0.25 * math.pi * self.diameter**2 / self.flutes
        limit = f"must be above 0 and below the tooth's share of the section, {room:.4g}"
        need(self.gullet is None or 0.0 < self.gullet < room, "gullet_mm2", self.gullet or 0.0, limit)
        ratio = self.chip_ratio
        need(ratio is None or 1.0 <= ratio < math.inf, "chip_ratio", ratio or 0.0, "must be at least 1")
        factor = self.fluted_factor
        need(0.0 < factor <= 1.0, "fluted_factor", factor, "must be above 0 and at most 1 (0.8 is usual for end mills)")
        check_material(self.strength, self.modulus)
        ramp = self.ramp_angle
        limit = "must be above 0 and at most 90 (a plunge)"
        need(ramp is None or 0.0 < ramp <= 0.5 * math.pi + 1e-9, "ramp_angle_deg", math.degrees(ramp or 0.0), limit)
        for key, value, unit in (
            ("max_rpm", self.max_speed, rpm_from_rad_s(1.0)),
            ("thread_pitch_mm", self.thread_pitch, 1.0),
            ("hole_depth_mm", self.hole_depth, 1.0),
        ):
            need(value is None or 0.0 < value < math.inf, key, unit * (value or 0.0), "must be above 0")
        limit = f"must be above 0 and at most 0.35 diameter_mm = {0.35 * self.diameter:g}"
        need(self.web is None or 0.0 < self.web <= 0.35 * self.diameter + 1e-9, "web_mm", self.web or 0.0, limit)
        need(self.number >= 0, "number", self.number, "must be at least 0")
        need(1 <= self.tooth_rows <= 100, "tooth_rows", self.tooth_rows, "must be from 1 to 100")
        limit = "must be 1: only teeth of a shape that is undercut, such as a thread mill, stand in several rows"
        need(self.tooth_rows == 1 or (bool(self.shape) and self.undercut), "tooth_rows", self.tooth_rows, limit)

    def _check_corner(self) -> None:
        """Check the corner against bottom and flank, or against the arc of a barrel."""
        if self.shape:
            self._check_shape()
            return
        r, e, touching = self.corner_radius, self.corner_e or 0.0, self.apt[2:4]
        slack = 1e-9 * self.diameter
        if self.barrel_radius is None:
            largest = self._largest_corner
            limit = f"must be at most diameter_mm / 2 = {self.radius:g}"
            if self.bottom > 0.0 or self.taper > 0.0:
                limit = f"must be at most {largest:.6g}, where the corner's centre is on the axis"
            if r > largest + slack:
                raise InputError(f"cutter.corner_radius_mm = {r:g}: {limit}")
        else:
            if self.body:
                raise InputError(
                    f"cutter.barrel_radius_mm = {self.barrel_radius:g}: with body_mm nothing cuts: leave one out"
                )
            if not 0.0 <= e < self.radius:
                raise InputError(
                    f"cutter.corner_e_mm = {e:g}: must be from 0, a round tip, to below diameter_mm / 2 = "
                    f"{self.radius:g}"
                )
            if self.flank_arc is not None and self.flute_length <= self.flank_arc.z_from + slack:
                raise InputError(
                    f"cutter.flute_length_mm = {self.flute_length:g}: must be above {self.flank_arc.z_from:.6g}, where "
                    "the arc of barrel_radius_mm begins"
                )
        for key, others, where in zip(("e", "f"), (self.corner_e, self.corner_f), touching, strict=True):
            if others is not None and abs(others - where) > 1e-3:
                raise InputError(
                    f"cutter.corner_{key}_mm = {others:g}: must be {where:.6g}, where the corner touches bottom and "
                    f"flank; leave it out"
                )

    def _check_shape(self) -> None:
        """Check a shape against the numbers beside it."""
        wide, end = max(segment.widest for segment in self.shape), self.shape[-1]
        others = (self.corner_radius, self.corner_e, self.corner_f, self.barrel_radius, self.bottom, self.taper)
        if any(others) or self.body:
            raise InputError("cutter.shape: it has its own corner, bottom, flank and body: leave the other ones out")
        for key, value, own in (
            ("diameter_mm", self.diameter, 2.0 * wide),
            ("flute_length_mm", self.flute_length, self.tooth_rows * end.z[1]),
        ):
            if abs(value - own) > 1e-6:
                raise InputError(f"cutter.{key} = {value:g}: must be {own:.6g}, as of its shape")
        neck = self.shank_diameter
        if self.undercut and not (neck is not None and 0.0 < neck <= 2.0 * end.rho[1] + 1e-9):
            raise InputError(
                f"cutter.shank_diameter_mm = {neck or 0.0:g}: must be above 0 and at most {2.0 * end.rho[1]:.6g}, as "
                "wide as its teeth end: the neck of an undercut cutter"
            )

    def _check_pitch(self) -> None:
        if not self.pitch:
            return
        degrees = [math.degrees(x) for x in self.pitch]
        if (
            len(degrees) != self.flutes
            or not all(5.0 <= x < 360.0 for x in degrees)
            or abs(sum(degrees) - 360.0) > 0.01
        ):
            raise InputError(
                f"cutter.pitch_deg = {[round(x, 6) for x in degrees]}: must be {self.flutes} angles of at least 5, one "
                f"a tooth, that add up to 360: they add up to {sum(degrees):g}"
            )

    @property
    def teeth_alike(self) -> bool:
        """Whether all teeth cut equally: no runout, and one pitch."""
        return self.flutes == 1 or (self.runout[0] == 0.0 and not self.pitch)

    @property
    def tooth_angles(self) -> NDArray[np.float64]:
        """Angle (N,) [rad] of each tooth behind tooth 0.

        >>> mill = Cutter(10.0, 3, 0.5, 20.0, 30.0, 6e5, pitch=tuple(np.radians([130.0, 110.0, 120.0])))
        >>> np.degrees(mill.tooth_angles).round(9).tolist()
        [0.0, 110.0, 230.0]
        """
        pitch = np.array(self.pitch) if self.pitch else np.full(self.flutes, math.tau / self.flutes)
        return np.asarray(np.concatenate([[0.0], np.cumsum(pitch[1:])]))

    @property
    def plunges(self) -> bool | None:
        """Whether it can plunge into solid material: ``centre_cutting`` where that is stated; None: not known.

        A tip that is round or pointed at the axis reaches it, and so do by custom the teeth of end mills up to
        ``CENTRE_FLUTES`` teeth and ``CENTRE_MM``.

        >>> [Cutter(d, n, 0.5, 20.0, 30.0, 6e5).plunges for d, n in ((10.0, 4), (10.0, 6), (50.0, 4))]
        [True, None, None]
        """
        if self.centre_cutting is not None:
            return self.centre_cutting
        if self.undercut:
            return None
        first = self.segments[0]
        pointed = not first.straight or first.kappa[0] > 0.0
        return True if pointed or (self.flutes <= CENTRE_FLUTES and self.diameter <= CENTRE_MM) else None

    @property
    def radius(self) -> float:
        """R = d / 2 [mm]."""
        return 0.5 * self.diameter

    @property
    def resolved_diameter(self) -> float:
        """Reference diameter [mm] for lengths in a simulation: d, or a tenth of the widest of a pointed cutter.

        >>> engraver = Cutter(0.01, 1, 0.0, 3.0, 30.0, 6e5, taper=math.radians(45.0))
        >>> round(engraver.resolved_diameter, 9)  # 6.01 mm wide at its top
        0.601
        """
        return max(self.diameter, 0.2 * float(self.radius_at([self.flute_length])[0]))

    @property
    def _largest_corner(self) -> float:
        """Corner radius at which e = 0 [mm]."""
        ta, tb = math.tan(self.bottom), math.tan(self.taper)
        return self.radius * (1.0 - ta * tb) / (1.0 / math.cos(self.taper) - tb / math.cos(self.bottom))

    @property
    def apt(self) -> tuple[float, float, float, float, float, float, float]:
        """(d, r, e, f, alpha, beta, h) [mm, rad]; of a barrel e, f are those of its corner.

        >>> bull = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5, corner_radius=1.0)
        >>> bull.apt
        (10.0, 1.0, 4.0, 1.0, 0.0, 0.0, 20.0)

        Raises
        ------
        InputError
            Its shape has no such numbers.
        """
        if self.shape:
            raise InputError(
                f"cutter {self.number}: its shape of {len(self.shape)} segments has no seven numbers of APT, which are "
                "needed here: state another cutter"
            )
        r, ta, tb = self.corner_radius, math.tan(self.bottom), math.tan(self.taper)
        pull = r / math.cos(self.taper) - r * tb / math.cos(self.bottom)
        e = max(self.radius - pull / (1.0 - ta * tb), 0.0)
        if self.barrel_radius is not None:
            e = self.corner_e or 0.0
        f = e * ta + r / math.cos(self.bottom)
        return (self.diameter, r, e, f, self.bottom, self.taper, self.flute_length)

    @cached_property
    def flank_arc(self) -> FlankArc | None:
        """The flank arc of a barrel cutter; None: it has none."""
        return None if self.barrel_radius is None else flank_arc(self.apt, self.barrel_radius)

    @cached_property
    def segments(self) -> tuple[ProfileSegment, ...]:
        """Lines and arcs of the profile from the tip to the end of the teeth."""
        return self.shape or apt_segments(self.apt, self.flank_arc)

    @property
    def one_row(self) -> Cutter:
        """The lowest row of its teeth as a cutter of its own; itself where it has no other.

        >>> from chipload.cutter.shapes import thread_mill
        >>> teeth = thread_mill(10.0, 1.5, math.radians(30.0), 0.1875, 6.0)
        >>> mill = Cutter(10.0, 3, 0.1, 6.0, 30.0, 6e5, shank_diameter=6.0, shape=teeth, tooth_rows=4)
        >>> mill.one_row.flute_length, mill.radius_at([0.75, 2.25]).tolist()
        (1.5, [5.0, 5.0])
        """
        if self.tooth_rows == 1:
            return self
        return replace(self, tooth_rows=1, flute_length=self.shape[-1].z[1])

    @property
    def undercut(self) -> bool:
        """Whether it is narrower above its widest place."""
        return self.segments[-1].kappa[1] > UPRIGHT

    @property
    def straight(self) -> bool:
        """Whether it is a flat end mill: a flat bottom, a sharp corner, an upright flank."""
        return self.corner_radius == self.taper == self.bottom == 0.0 and self.barrel_radius is None and not self.shape

    @property
    def flat_radius(self) -> float:
        """Radius of the flat bottom [mm]; 0: it has none.

        >>> Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5, corner_radius=1.0).flat_radius
        4.0
        """
        first = self.segments[0]
        return first.rho[1] if first.straight and first.kappa[0] == 0.0 else 0.0

    @property
    def outline(self) -> tuple[float, ...]:
        """The seven numbers of :attr:`apt`; of a barrel then E, F, R of its flank arc and the kappa where it begins."""
        arc = self.flank_arc
        return self.apt if arc is None else (*self.apt, arc.e, arc.f, arc.radius, arc.kappa_from)

    @property
    def finishing_arc(self) -> tuple[float, float, float]:
        """(r, e, f) [mm] of the arc of the profile that finishes a surface: a barrel's flank arc, else the corner."""
        arc = self.flank_arc
        return self.apt[1:4] if arc is None else (arc.radius, arc.e, arc.f)

    @property
    def corner_end(self) -> float:
        """Kappa [rad] at which the corner ends: pi/2 - beta, or where the arc of a barrel begins."""
        return 0.5 * math.pi - self.taper if self.flank_arc is None else self.flank_arc.kappa_from

    def radius_at(self, z: ArrayLike) -> NDArray[np.float64]:
        """Return the radius rho of the envelope at heights z above the tip; at z = 0 that of the flat bottom.

        Bottom line up to z = f - r cos(alpha), corner circle e + sqrt(r^2 - (f - z)^2) up to z = f - r sin(beta), flank
        line above, on beyond the flutes; of a barrel its arc between corner and flank line.

        Parameters
        ----------
        z : (n,) float [mm], z >= 0

        Returns
        -------
        (n,) float [mm]

        Raises
        ------
        InputError
            A height is below the tip or not a number.

        Examples
        --------
        >>> ball = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=5.0)
        >>> ball.radius_at([0.0, 2.0, 5.0, 9.0]).tolist()
        [0.0, 4.0, 5.0, 5.0]
        """
        z = np.asarray(z, dtype=np.float64)
        if not (z >= 0.0).all():
            raise InputError("cutter: radius_at: a height is below the tip: must be at least 0 mm")
        if self.body:
            radii, heights = np.array(self.body).T
            return np.asarray(np.interp(z, heights, radii))
        if self.shape:
            row = self.shape[-1].z[1]
            below = np.minimum(np.floor(z / row), self.tooth_rows - 1)
            return radius_of(self.shape, z - below * row)
        _, r, e, f, alpha, beta, _ = self.apt
        low, high = f - r * math.cos(alpha), f - r * math.sin(beta)
        bottom = np.where(z < low, z, 0.0) / math.tan(alpha) if alpha > 0.0 else e
        circle = e + np.sqrt(np.clip(r * r - (f - z) ** 2, 0.0, None))
        flank = e + r * math.cos(beta) + (z - high) * math.tan(beta)
        arc = self.flank_arc
        if arc is not None:
            high = arc.z_from
            bow = arc.e + np.sqrt(np.clip(arc.radius**2 - (arc.f - z) ** 2, 0.0, None))
            flank = np.where(z < arc.z_to, bow, arc.e + arc.radius * math.cos(beta) + (z - arc.z_to) * math.tan(beta))
        return np.asarray(np.where(z < low, bottom, np.where(z < high, circle, flank)))

    def profile(self, chord_mm: float) -> NDArray[np.float64]:
        """Return the envelope (m, 2) as (rho, z) [mm] from the tip to h, its arcs by chords within ``chord_mm``.

        >>> Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5).profile(0.01).tolist()
        [[0.0, 0.0], [5.0, 0.0], [5.0, 20.0]]
        """
        if self.body:
            return np.array([(0.0, 0.0), *self.body] if self.body[0][0] > 0.0 else self.body)
        if self.shape:
            row = chords_of(self.shape, chord_mm)
            upper = row[row[:, 1] > 0.0]
            return np.vstack([row, *(upper + np.array([0.0, k * row[-1, 1]]) for k in range(1, self.tooth_rows))])
        _, r, e, f, alpha, _, h = self.apt
        points = [(0.0, 0.0)]

        def chords(e: float, f: float, r: float, first: float, last: float) -> list[tuple[float, float]]:
            n = max(1, math.ceil((last - first) / (2.0 * math.acos(1.0 - min(chord_mm / r, 1.0)))))
            angles = [first + (last - first) * i / n for i in range(n + 1)]
            return [(e + r * math.sin(a), f - r * math.cos(a)) for a in angles]

        points += chords(e, f, r, alpha, self.corner_end) if r > 0.0 else [(e, f)]
        arc = self.flank_arc
        if arc is not None:
            points += chords(arc.e, arc.f, arc.radius, arc.kappa_from, arc.kappa_at(min(h, arc.z_to)))
        points.append((float(self.radius_at(h)), h))
        p: NDArray[np.float64] = np.array(points)
        keep = np.hypot(*np.diff(p, axis=0).T) > 1e-9
        return np.vstack([p[:1], p[1:][keep]])
