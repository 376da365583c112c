"""A controller that makes rows: its state, its parameters, its tools and what it has noticed.

Notation: positions are nine numbers X Y Z A B C U V W [mm, deg]; F is a speed per minute, S in rpm.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, cast

from chipload.errors import InputError, Severity
from chipload.program.commands import ARC, DWELL, LINE, PLANE_AXES, RAPID, XY, YZ, ZX
from chipload.program.compensation import CentreMove, Compensation, ContourArc, ContourFeed, contour_arc
from chipload.program.control import Control, control_named
from chipload.program.corners import Corner, Piece, join_corner
from chipload.program.corners import turns as turns_at
from chipload.program.gcode import arcs
from chipload.program.gcode.cycles import PeckRule
from chipload.program.gcode.expression import integer_of
from chipload.program.gcode.parameters import Parameters
from chipload.program.gcode.plane_words import PlaneBlocks
from chipload.program.gcode.state import AXES, LINEAR, NO_MOTION, ZERO, Datum, Nine, PointMemory, State, nine
from chipload.program.gcode.tilted_plane import machine_of, position_of
from chipload.program.gcode.tool_rows import ToolRows
from chipload.program.gcode.tools import Tool, ToolTable
from chipload.program.gcode.track import Context, Findings, MotionRows, Row
from chipload.program.path_mode import PathControl
from chipload.units import MM_PER

if TYPE_CHECKING:
    from chipload.program.gcode.frames import ProgramFrame
    from chipload.program.gcode.interpolation import Interpolation
    from chipload.program.gcode.words import MacroCall
    from chipload.program.swivel import Swivel

PLANES = {170: XY, 180: ZX, 190: YZ, 171: XY, 181: ZX, 191: YZ}
#: from the centre of a turning tool's nose to its tip, in radii along X and Z, by orientation
TIPS = ((0, 0), (-1, 1), (-1, -1), (1, -1), (1, 1), (0, 1), (-1, 0), (0, -1), (1, 0), (0, 0))
#: an arc beside its contour may turn more than programmed by this [rad], in a text in mm and in one in inches
ARC_SLACK = {False: 0.0254, True: 0.001}
#: positions beyond this are refused [mm, deg]
FARTHEST = 1e9
#: a feed by G93 is at least this [units/min], as LinuxCNC does
LEAST_INVERSE = 0.1


class Controller:
    """State and outlets of one reading.

    Parameters
    ----------
    tools : entries by number, None where no table is known
    parameters : what numbered parameters hold before the program starts
    units, machine_units : mm in a unit of the text at its start, and of the machine (of parameters and offsets)
    start : (9,) position of the axes at the start [mm, deg]
    most_rows : rows that the text may make
    strict : what LinuxCNC refuses is refused; without it, it is a finding as far as the rest can be read
    control : its profile
    origins : (9,) [mm, deg] and rotation [deg] of work offsets, by number
    diameters : [mm] of the cutters by tool, for compensation where the table states none
    feed : [mm/min] of cuts before the text states one; None: such a cut is refused
    swivel : the machine, for tilted working planes; None: they are not read
    compensation : what an offset for G41 holds: ``control``, ``wear``, ``off``; None: not stated
    """

    def __init__(
        self,
        *,
        tools: ToolTable | None = None,
        parameters: Mapping[int | str, float] | None = None,
        units: str = "mm",
        machine_units: str = "mm",
        start: Nine = ZERO,
        most_rows: int = 10_000_000,
        strict: bool = True,
        control: Control | None = None,
        origins: Mapping[int, tuple[Nine, float]] | None = None,
        diameters: Mapping[int, float] | None = None,
        feed: float | None = None,
        swivel: Swivel | None = None,
        compensation: str | None = None,
    ):
        self.state = State(scale=MM_PER[units])
        self.control = control = control_named("linuxcnc") if control is None else control
        self.feed, self.swivel, self.compensation = feed, swivel, compensation
        self.state.motion = self.state.group_one = control.modal.motion_at_start
        self.state.old_level = control.modal.old_level_at_start
        self.origins, self.diameters = dict(origins or {}), dict(diameters or {})
        self.machine_scale = MM_PER[machine_units]
        self.tools: dict[int, Tool] | None = None if tools is None else dict(tools.tools)
        self.strict = strict
        self.strict_tools = control.offsets.names_tools
        self.findings = Findings()
        self.track = MotionRows(most_rows)
        self.parameters = Parameters(parameters, self._note_unproven, control.macros.highest_variable)
        self.line = 0
        #: least increments count where a number has no point; None: not yet decided
        self.turning_rule = "" if control.feed.rotary == "linear first" else control.feed.rotary
        self.increments = control.numbers.point == "increment"
        #: lines of the text that the fast way may not read, as their numbers have no point; None: all may
        self.pointless: re.Pattern[str] | None = None
        #: radius and angle [mm, deg] of polar coordinates (G16); None: they are off
        self.polar: tuple[float, float] | None = None
        #: the words that led there, and from where: a block may be read more than once
        self.polar_words: dict[str, float] | None = None
        self.polar_before = (0.0, 0.0)
        #: factors along X Y Z and the point [mm] that stays (G51, G51.1); None: none
        self.scaled: tuple[tuple[float, float, float], tuple[float, float, float]] | None = None
        #: plane in which a rotary axis takes the place of a linear one (G12.1, G7.1); None: none
        self.interpolation: Interpolation | None = None
        #: blocks of a tilted plane that is stated in several (G68.2 P2, P3)
        self.plane_blocks = PlaneBlocks()
        #: macro that is called after each motion (G66), and the level of calls at which it was stated
        self.modal_macro: tuple[MacroCall, int] | None = None
        self.label = 0
        self.returned = (0.0, 0.0)
        #: codes of a motion that is not read and lasts; empty: none
        self.unread = ""
        #: Fanuc: the cycle that lasts is fine boring (G76)
        self.fine = False
        #: level of G71 of an Okuma [units of the text], and whether its cycles go back to it
        self.return_level: float | None = None
        self.returns_to_level = False
        #: feeds before a tapping cycle that calculates its own (G77 of a Brother); None: there is none
        self.feed_of_cuts: tuple[float, float] | None = None
        #: Sinumerik: the drilling cycle behind each block (MCALL), its name and its arguments
        self.modal_hole: tuple[str, list[float | None]] | None = None
        #: Sinumerik: the subprogram behind each block (MCALL): name, repeats, arguments, and the level of calls
        self.modal_program: tuple[str, int, list[float | None], int] | None = None
        #: Sinumerik: texts by the names that stand for them (DEFINE)
        self.named_texts: dict[str, str] = {}
        #: Sinumerik: the pole, the last polar point, and whether CIP lasts
        self.points = PointMemory()
        #: Sinumerik: whether the spindle of the tapping block that is read turns against K; None: no such block
        self.reversed: bool | None = None
        self.named_tools: dict[str, int] = {}
        #: tools, and numbers of offsets, that a length offset was given for
        self.with_length: set[int] = set()
        #: turned and shifted coordinates of the program; None: those of the work offset
        self.program_frame: ProgramFrame | None = None
        #: where a retraction to where only the machine knows was left out
        self.retracted: Nine | None = None
        #: how the pecks of a hole change
        self.pecks = PeckRule()
        #: depth of a peck of tapping [units of the text]; 0: in one go
        self.tap_peck = 0.0
        #: rounds every corner (RNDM of a Sinumerik)
        self.rounding: Corner | None = None
        #: feed of roundings and chamfers [mm/s]: of that of a line, of all; None: that of the block
        self._corner_feed: tuple[int, float] | None = None
        self.corner_feeds: float | None = None
        #: arcs beside a contour whose feed is that of the contour
        self.contour_feed = ContourFeed.NONE
        #: whether outside corners are where the offsets cross; None: as the control does without a word
        self.crossing_corners: bool | None = None
        self._held: tuple[Piece, int, Corner, bool] | None = None
        self._requested: tuple[int, Corner] | None = None
        #: why motions are left out until further notice; empty: they are not
        self.left_out = ""
        self.level = 0
        #: word by which the block that is read names coordinates of the machine
        self.machine_word = "G53"
        self._contexts: dict[int, int] = {}
        #: linear axes that have been sent somewhere; whether the block sends another, before any feed
        self.placed: set[int] = set()
        self.unplaced = False
        self._beside: Compensation | None = None
        self._framed: Datum | None = None
        self._frame = 0
        #: work offsets that the parameters state or the text sets, and unset ones that the text selects
        self.stated_offsets = {
            n for n in range(1, 10) if any(5201 + 20 * n + k in self.parameters.numbered for k in range(10))
        } | set(self.origins)
        self.unset_offsets: dict[int, tuple[int, str]] = {}
        for number, (at, turn) in self.origins.items():
            if number < 10:
                self.store(5201 + 20 * number, at)
                self.parameters.numbered[5210 + 20 * number] = turn
        self._start(start)
        self.tool_rows = ToolRows(self)

    def increment(self, letter: str) -> float:
        """What a number without a decimal point counts in [units of the text]: 1 unless in least increments."""
        numbers = self.control.numbers
        if not self.increments or letter not in numbers.increment_letters:
            return 1.0
        inch = numbers.increment_inch if self.state.scale != 1.0 else numbers.increment_mm
        flat = self.interpolation is not None and self.interpolation.radius is None
        return numbers.increment_deg if letter in "abc" and not flat else inch

    def stated_tool_offset(self, kind: str, number: int) -> None:
        """An offset that the program sets counts from the next G43 or G41 of its number on."""
        if kind.startswith("length"):
            self.once("nc-tool-offset", f"the program sets the {kind} of offset {number}: it counts from its next G43")

    def _note_unproven(self, code: str, text: str) -> None:
        self.findings.once(code, self.line, text, Severity.UNPROVEN)

    def note(self, code: str, text: str) -> None:
        """A finding on the line that is read."""
        self.findings.add(code, self.line, text)

    def once(self, code: str, text: str, severity: Severity = Severity.NOTE) -> None:
        """A finding that is made a single time."""
        self.findings.once(code, self.line, text, severity)

    def leave_out(self, code: str, text: str) -> None:
        """A finding on something that is left out or assumed, so that the result is unproven."""
        self.findings.add(code, self.line, text, Severity.UNPROVEN)

    def refused(self, code: str, text: str) -> None:
        """A finding on what LinuxCNC refuses and other controllers take."""
        severity = Severity.UNPROVEN if self.control.text.refuses_unknown else Severity.NOTE
        self.findings.add(code, self.line, text, severity)

    # -- offsets ---------------------------------------------------------------------------------------------------

    def stored(self, first: int) -> Nine:
        """Nine parameters from number ``first`` on [mm, deg]."""
        get, scale = self.parameters.numbered.get, self.machine_scale
        return nine([get(first + k, 0.0) * (scale if k in LINEAR else 1.0) for k in range(9)])

    def store(self, first: int, values: Nine) -> None:
        """Keep nine numbers in parameters from number ``first`` on."""
        for k, value in enumerate(values):
            self.parameters.numbered[first + k] = value / (self.machine_scale if k in LINEAR else 1.0)

    def work_offset(self, number: int) -> tuple[Nine, float]:
        """Origin and rotation of a work offset."""
        if number > 9:
            return self.origins[number]
        return self.stored(5201 + 20 * number), self.parameters.numbered.get(5210 + 20 * number, 0.0)

    def set_origin(self, number: int, axes: Mapping[int, float]) -> None:
        """State the origin of a work offset beyond the nine, by axis [units of the text, deg]."""
        at, turn = self.origins.get(number, (ZERO, 0.0))
        placed = {k: value * (self.state.scale if k in LINEAR else 1.0) for k, value in axes.items()}
        self.origins[number] = nine([placed.get(k, at[k]) for k in range(9)]), turn
        self.stated_offsets.add(number)

    def _start(self, start: Nine) -> None:
        number = int(self.parameters.numbered.get(5220, 1.0))
        number = number if 1 <= number <= 9 else 1
        offset, rotation = self.work_offset(number)
        shift = self.stored(5211) if self.parameters.numbered.get(5210, 0.0) else ZERO
        self.state.datum = Datum(number, offset, rotation, shift, ZERO)
        self.state.at = self.state.datum.from_machine(start)

    def rebase(self, datum: Datum) -> None:
        """Other coordinates, the machine where it is."""
        state = self.state
        if datum != state.datum:
            self.end_corner()
            before = state.at
            state.at = position_of(self, datum, machine_of(self, state.datum, state.at))
            state.datum = datum
            if self.retracted == before:
                self.retracted = state.at
            self.changed()

    def machine_position(self) -> Nine:
        """Where the machine's axes stand [mm, deg]."""
        return machine_of(self, self.state.datum, self.state.at)

    def position(self, machine: Nine) -> Nine:
        """The text's position where the machine's axes stand at ``machine`` [mm, deg]."""
        return position_of(self, self.state.datum, machine)

    # -- tools -----------------------------------------------------------------------------------------------------

    def find_tool(self, number: int, what: str) -> Tool:
        """Entry of the table; an empty one where there is none and the text may go on."""
        if number == 0:
            return (self.tools or {}).get(0, Tool(0))
        tool = (self.tools or {}).get(number)
        if tool is not None:
            return tool
        if number < 0:
            raise InputError(f"{what}{number}: must be 0 or more")
        if self.tools is not None and self.strict_tools:
            raise InputError(f"{what}{number}: tool {number} is not in the tool table: add it there")
        if self.tools is None:
            assumed = "lengths" if number in self.diameters else "lengths and diameters"
            self.once("nc-tool-unknown", f"no tool table is given: {assumed} of the tools are taken as 0")
        else:
            assumed = "length is taken" if number in self.diameters else "length and diameter are taken"
            self.once("nc-tool-unknown", f"tool {number} is not in the tool table: its {assumed} as 0")
        return Tool(number)

    def compensation_diameter(self, name: str, number: int, stated: float) -> float:
        """Diameter [mm] that G41 and G42 compensate for: of the table, else of the job's cutter of that tool.

        Parameters
        ----------
        name, number : code and D word
        stated : diameter of the table's entry, 0 where it has none or there is no entry
        """
        if stated != 0.0 or number == 0:
            return stated
        known = number if number in self.diameters else self.state.tool
        if known not in self.diameters:
            self.leave_out(
                "nc-diameter-unknown",
                f"{name} D{number}: no diameter is known, the path is compensated by 0: state D of tool {number} in a "
                f"tool table (program.tools), or a [[cutter]] with number = {number}",
            )
            return 0.0
        diameter = self.diameters[known]
        assumed = f"the {diameter:g} mm of cutter {known} are taken"
        if number in (self.tools or {}):
            self.leave_out(
                "nc-diameter-missing",
                f"{name} D{number}: the tool table states no D for tool {number}, so the controller compensates by "
                f"0: {assumed}: write D{diameter:g} in the table",
            )
        elif known != number and self.control.offsets.names_tools:
            self.leave_out("nc-diameter-unknown", f"{name} D{number}: no diameter of tool {number} is known: {assumed}")
        else:
            self.once("nc-diameter-of-cutter", f"{name} D{number}: {assumed}")
        return diameter

    # -- compensation ----------------------------------------------------------------------------------------------

    def not_compensated(self, what: str) -> None:
        """Refuse what cutter compensation excludes."""
        if self.state.compensation != 400:
            raise InputError(f"{what}: not while cutter compensation is on: write G40 before")

    def compensate(self, code: int, d: float | None = None, orientation: float | None = None) -> None:
        """G40, or G41, G42 with the tool D, or G41.1, G42.1 with the diameter D and the orientation L."""
        state = self.state
        self.end_corner()
        if code == 400:
            if self._beside is not None:
                self._compensate_rows(self._beside, Compensation.finish, self.state.at)
                self._beside = None
            state.compensation = 400
            return
        name, rule = f"G{code / 10:g}", self.control.compensation
        if self.compensation == "off":
            self.once("nc-compensation-off", f"{name}: is left out: program.compensation = off")
            return
        if not rule.again:
            self.not_compensated(name)
        if state.plane not in rule.planes:
            planes = " and ".join(f"G{p // 10}" for p in rule.planes)
            raise InputError(f"{name}: compensation lies in the planes of {planes}")
        if code % 10:
            if d is None:
                raise InputError(f"{name}: D is missing: the diameter")
            if orientation is not None and state.plane != 180:
                raise InputError(f"{name}: L goes with a turning tool in the plane of G18")
            radius, turned = 0.5 * d * state.scale, integer_of(orientation or 0.0, f"{name}: L")
        else:
            number = state.tool if d is None else integer_of(d, f"{name}: D")
            if number < 0:
                raise InputError(f"{name}: D{number}: must be the number of a tool")
            tool = self.find_tool(number, "D")
            radius = self.offset_radius(name, number, tool.diameter)
            turned = tool.orientation
            if turned and state.plane != 180:
                raise InputError(f"{name}: tool {number} has an orientation for turning: it goes with G18")
        if not 0 <= turned <= 9:
            raise InputError(f"{name}: orientation {turned}: must be from 0 to 9")
        x, z = TIPS[turned]
        if self._beside is not None:
            if code != state.compensation:
                self.leave_out("nc-compensation-side", f"{name}: changes the side while the other one is on")
            self._emit(self._beside.again(1 if code < 420 else -1, radius))
            state.compensation = code
            return
        self._beside = Compensation(
            1 if code < 420 else -1,
            radius,
            PLANES[state.plane],
            state.at,
            shift=(radius * z, radius * x),
            slack=ARC_SLACK[state.scale != 1.0],
            square=rule.square_entry,
            sharp=(rule.outside_corner == "intersection") if self.crossing_corners is None else self.crossing_corners,
        )
        state.compensation = code

    def offset_radius(self, name: str, number: int, stated: float) -> float:
        """Radius [mm] of an offset of D: geometry and wear; ``stated``: diameter of the tool table, 0 for none."""
        rows = self.tool_rows
        wear, own = rows.wear(number), rows.radius(number)
        if own is not None:
            return own + wear
        if self.compensation == "wear":
            return wear
        radius = 0.5 * self.compensation_diameter(name, number, stated) + wear
        if self.control.offsets.offset_holds == "unknown" and stated == 0.0 and radius and self.compensation is None:
            self.once(
                "nc-compensation-unstated",
                f"{name} D{number}: whether offset {number} holds the cutter's radius, so that the path moves by "
                f"{radius:g} mm, or wear alone (0) is not stated: program.compensation = control or wear",
                Severity.UNPROVEN,
            )
        return radius

    def _compensate_arc(
        self, beside: Compensation, end: Nine, centre: tuple[float, float], turns: int, row: tuple[int, int]
    ) -> None:
        """Rows beside an arc; ``row``: its context and line."""
        contour = contour_arc(self.contour_feed, end, centre, PLANES[self.state.plane])
        self._compensate_rows(beside, lambda b: b.arc(end, centre, turns, (*row, contour)), end)

    def _compensate_rows(
        self, beside: Compensation, make: Callable[[Compensation], list[CentreMove]], end: Nine
    ) -> None:
        """Rows beside the contour; where the tool does not fit, it goes straight on to the next part of the contour."""
        try:
            moves = make(beside)
        except InputError as error:
            if self.strict:
                raise
            self.leave_out("nc-compensation", f"{error}: this part of the contour is left out")
            moves = beside.skip(end)
        self._emit(moves)

    def _row(self, row: Row) -> None:
        """A row that is no arc, of the axes of the machine."""
        self.track.rows.extend((row,) if self.interpolation is None else self.interpolation.rows(self.track, row))

    def _arc_row(self, row: Row, first: float, second: float, turns: int) -> None:
        """A row that is an arc, or the rows of the axes that make one."""
        if self.interpolation is None:
            self.track.arc(row, first, second, turns)
        else:
            self.track.rows.extend(self.interpolation.rows(self.track, row, (first, second), turns))

    def interpolate(self, interpolation: Interpolation | None) -> None:
        """Begin or end polar or cylindrical interpolation."""
        self.end_corner()
        before = self.interpolation
        if before is not None:
            self.state.at = before.stands
            self.state.plane = before.plane
        self.interpolation = interpolation
        if interpolation is not None:
            self.state.at = interpolation.last
        self.changed()

    def _emit(self, moves: list[CentreMove]) -> None:
        """Rows of motions beside the contour."""
        for move in moves:
            context, line, contour = cast(tuple[int, int, ContourArc | None], move.payload)
            if contour is not None:
                share = contour.feed_share(move, PLANES[self.state.plane])
                context = self.track.with_feed(context, share * self.track.feed_of(context))
            row = (move.motion, *nine(list(move.end)), context, line)
            if move.motion == ARC:
                self._arc_row(row, *move.centre, move.turns)
            else:
                self._row(row)

    # -- corners ---------------------------------------------------------------------------------------------------

    def round_off(self, corner: Corner) -> None:
        """Round or chamfer the corner after the motion of the block that is read."""
        self._requested = self.line, corner

    def round_all(self, corner: Corner | None) -> None:
        """Round every corner from the motion of the block that is read on; None: no more."""
        self.rounding = corner

    def feed_corner(self, feed: float) -> None:
        """Feed [mm/s] of the corner after the motion of the block that is read."""
        self._corner_feed = self.line, feed

    @property
    def in_corner(self) -> bool:
        """Whether motions wait for a corner, or ask for one."""
        return self._held is not None or self._requested is not None or self.rounding is not None

    def _piece(self, motion: int, end: Nine, centre: tuple[float, float], turns: int, context: int) -> None:
        """A motion of the contour: it waits where the corner after it is to be rounded."""
        piece = Piece(motion, list(self.state.at), list(end), centre, turns, 0.0, (context, self.line))
        held, requested = self._held, self._requested
        self._held = self._requested = None
        if requested is not None and requested[0] != self.line:
            self._sharp(*requested)
            requested = None
        if held is not None:
            before, line, corner, modal = held
            flat = PLANES[self.state.plane] == XY and self.state.feed_mode != 930
            made = join_corner(before, piece, corner) if flat else None
            # a modal rounding rounds what are corners of the contour
            if made is None and (not modal or (motion in (LINE, ARC) and turns_at(before, piece))):
                self._sharp(line, corner)
            if made is not None and corner.feed is not None:
                number = self.track.with_feed(cast(tuple[int, int], made[1].tail)[0], corner.feed)
                made = made[0], replace(made[1], tail=(number, line)), made[2]
            for some in (before,) if made is None else made[:-1]:
                self._carry(some)
            piece = piece if made is None else made[-1]
        own = requested[1] if requested is not None else self.rounding
        if own is not None:
            once = self._corner_feed
            own = replace(own, feed=once[1] if once is not None and once[0] == self.line else self.corner_feeds)
        if own is not None and motion in (LINE, ARC):
            self._held = piece, self.line, own, requested is None
        else:
            if requested is not None:
                self._sharp(*requested)
            self._carry(piece)

    def end_corner(self) -> None:
        """Carry out what waits for a corner that does not come."""
        held, requested = self._held, self._requested
        self._held = self._requested = None
        if held is not None:
            if not held[3]:
                self._sharp(held[1], held[2])
            self._carry(held[0])
        if requested is not None and requested[0] != self.line:
            self._sharp(*requested)
        elif requested is not None:
            self._requested = requested

    def _sharp(self, line: int, corner: Corner) -> None:
        text = f"{corner.text[:40]}: the corner stays sharp: its rounding or chamfer is left out"
        self.findings.add("nc-corner", line, text, Severity.UNPROVEN)

    def _carry(self, piece: Piece) -> None:
        end, (context, line) = nine(piece.end), cast(tuple[int, int], piece.tail)
        if self._beside is not None and piece.motion == ARC:
            self._compensate_arc(self._beside, end, piece.centre, piece.turns, (context, line))
        elif self._beside is not None:
            self._compensate_rows(self._beside, lambda b: b.line(piece.motion, end, (context, line, None)), end)
        elif piece.motion == ARC:
            self._arc_row((ARC, *end, context, line), *piece.centre, piece.turns)
        else:
            self._row((piece.motion, *end, context, line))

    # -- rows ------------------------------------------------------------------------------------------------------

    def place(self, axes: Iterable[int], motion: int) -> None:
        """Note which linear axes a block sends somewhere; ``motion`` its code, in tenths."""
        new = {k for k in axes if k < 3} - self.placed
        if new and not self.state.absolute and motion in (0, 10, 20, 30):
            axis = ", ".join(AXES[k].upper() for k in sorted(new))
            text = f"G91: {axis} moves before any position is stated: the program's zero is taken as its start: begin "
            self.once("nc-start-unknown", f"{text}with G90 and a position", Severity.UNPROVEN)
        unplaced = motion == 0 and bool(new)
        self.placed = {0, 1, 2} if motion > 0 and motion != NO_MOTION else self.placed | new
        if unplaced != self.unplaced:
            self.unplaced = unplaced
            self.changed()

    def changed(self) -> None:
        """Something that rows carry has changed."""
        self._contexts.clear()

    def context(self, kind: int) -> int:
        """Context of a row: 0 rapid, 1 feed of lengths, 2 feed of angles."""
        number = self._contexts.get(kind)
        if number is None:
            number = self._contexts[kind] = self.track.context(self.carried(self._feed(kind)))
        return number

    def carried(self, feed: float) -> Context:
        """What a row of this feed [mm/s, rad/s, s] carries."""
        state = self.state
        spindle = 0.0 if state.surface else state.sense * state.speed * math.tau / 60.0
        if state.datum is not self._framed:
            self._framed, self._frame = state.datum, self.track.frame(state.datum)
        frame = self._frame
        mode = (float(PathControl.UNPLACED), 0.0, 0.0) if self.unplaced and feed == 0.0 else state.path_mode
        tip = state.tcp or (state.datum.tilt is not None and self.swivel is not None and self.swivel.turns)
        return feed, spindle, state.tool, tip, frame, PLANES[state.plane], self.label, mode

    def _feed(self, kind: int) -> float:
        if kind == 0:
            return 0.0
        state = self.state
        per_minute = state.feed if kind == 1 else math.radians(state.feed_turning)
        if state.feed_mode == 950:
            per_minute *= abs(state.speed)
        return per_minute / 60.0

    def kind_of(self, end: Nine) -> int:
        """Whether a motion from here feeds lengths (1) or angles alone (2)."""
        x, y, z, a, b, c, u, v, w = self.state.at
        if (end[0], end[1], end[2], end[6], end[7], end[8]) != (x, y, z, u, v, w):
            return 1
        return 2 if (end[3], end[4], end[5]) != (a, b, c) else 1

    def straight_context(self, motion: int, end: Nine, rate: float | None) -> int:
        """Context of a straight motion; ``rate``: G93, 1/min."""
        if motion == RAPID:
            return self.context(0)
        kind = self.kind_of(end)
        a, b = self.state.at, end
        if rate is None and self.turning_rule and a[3:6] != b[3:6] and not self.state.tcp:
            return self._together(kind, a, b)
        if rate is None:
            return self.context(kind)
        span = math.dist(a[:3], b[:3]) or math.dist(a[6:], b[6:]) or math.dist(a[3:6], b[3:6])
        return self._inverse(kind, span, rate)

    def _together(self, kind: int, a: Nine, b: Nine) -> int:
        """Context of a cut whose F counts lengths and degrees together."""
        scale = self.state.scale
        straight = math.dist(a[:3] + a[6:], b[:3] + b[6:])
        turn, factor = math.dist(a[3:6], b[3:6]), scale
        if self.turning_rule == "diameter":
            diameter = self.control.settings.rotary_diameter_mm
            if diameter is None:
                self.once(
                    "nc-rotary-diameter",
                    "F of a cut with a rotary axis counts its degrees as lengths on a diameter that is a setting of "
                    "the control: degrees are taken as units: state program.settings.rotary_diameter_mm",
                    Severity.UNPROVEN,
                )
            else:
                factor = math.pi * diameter / 360.0
        path = math.hypot(straight, factor * turn)
        per_second = self._feed(1)
        share = (straight if kind == 1 else math.radians(turn)) / path
        return self.track.context(self.carried(per_second * share))

    def _inverse(self, kind: int, span: float, rate: float) -> int:
        unit = self.state.scale if kind == 1 else 1.0
        feed = max(span * rate, LEAST_INVERSE * unit) / 60.0
        return self.track.context(self.carried(feed if kind == 1 else math.radians(feed)))

    def straight(self, motion: int, end: Nine, rate: float | None = None) -> None:
        """RAPID, LINE or PROBE to ``end``."""
        self.check(end)
        context = self.straight_context(motion, end, rate)
        if self.in_corner:
            self._piece(motion, end, (0.0, 0.0), 0, context)
        elif self._beside is not None:
            self._compensate_rows(self._beside, lambda b: b.line(motion, end, (context, self.line, None)), end)
        else:
            self._row((motion, *end, context, self.line))
        self.state.at = end

    def check(self, end: Nine) -> None:
        """Refuse a position that no machine has."""
        for k, value in enumerate(end):
            if not -FARTHEST <= value <= FARTHEST:
                raise InputError(f"{AXES[k].upper()}{value:g} mm or deg: must be within {FARTHEST:g}")

    def arc_context(self, end: Nine, centre: tuple[float, float], turns: int, rate: float | None) -> int:
        """Context of an arc."""
        if rate is None:
            return self.context(1)
        first, second, along = PLANE_AXES[PLANES[self.state.plane]]
        at = self.state.at
        span = arcs.length(at[first], at[second], end[first], end[second], *centre, turns, end[along] - at[along])
        return self._inverse(1, span, rate)

    def arc(self, end: Nine, centre: tuple[float, float], turns: int, rate: float | None = None) -> None:
        """ARC to ``end`` in the active plane."""
        self.check(end)
        context = self.arc_context(end, centre, turns, rate)
        if self.in_corner:
            self._piece(ARC, end, centre, turns, context)
        elif self._beside is not None:
            self._compensate_arc(self._beside, end, centre, turns, (context, self.line))
        else:
            self._arc_row((ARC, *end, context, self.line), *centre, turns)
        self.state.at = end

    def dwell(self, seconds: float) -> None:
        """DWELL where the machine is."""
        self.end_corner()
        context = self.track.context(self.carried(seconds))
        if self._beside is not None:
            self._emit(self._beside.pause((context, self.line, None)))
        else:
            self._row((DWELL, *self.state.at, context, self.line))
