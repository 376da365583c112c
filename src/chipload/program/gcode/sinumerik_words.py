"""Words of a Sinumerik by what they do to the path: nothing, or something that is not read.

Reference: Siemens, SINUMERIK 840D sl Programming Manual Fundamentals, and Job Planning.
"""

from __future__ import annotations

import re

from chipload.program.compensation import ContourFeed

FUNCTIONS = ("SIN", "COS", "TAN", "ASIN", "ACOS", "SQRT", "ABS", "EXP", "LN")
#: words of the program's coordinates that are read
PLACED = ("TRANS", "ATRANS", "ROT", "AROT")
#: coordinates along the tool's axis begin with these; TOROTOF ends them
ALONG_TOOL = frozenset({x + axis for x in ("TOFRAME", "TOROT") for axis in ("", "X", "Y", "Z")})
END_ALONG_TOOL = "TOROTOF"
FRAMES = ALONG_TOOL | frozenset(
    """
    AMIRROR AROT AROTS ASCALE ATRANS CROT CTRANS MIRROR ROT ROTS SCALE TOROTOF TRANS
    """.split()  # noqa: SIM905
)
JUMPS = frozenset(
    """
    CALL CASE DEF DEFINE ELSE ENDFOR ENDIF ENDLOOP ENDWHILE EXTCALL FOR GOTO GOTOB GOTOC GOTOF GOTOS IF LOOP
    PCALL REPEAT REPEATB UNTIL WHILE
    """.split()  # noqa: SIM905
)
CURVES = frozenset(
    """
    ASPLINE BSPLINE CSPLINE INVCCW INVCW OMA POLY TCARR TRAANG TRACYL TRANSMIT
    """.split()  # noqa: SIM905
)
IDLE = frozenset(
    """
    ACC ADIS ADISPOS ATOL BRISK BRISKA CDOF CDOF2 CDON COARSEA COMPCAD COMPCURV COMPOF COMPON COMPSURF
    CTOL CUT2D CUT2DF CUT3DC CUT3DF CUT3DFF CYCLE832 DIAM90 DIAMOF DISPLOF DRIVE DYNFINISH DYNNORM DYNPOS DYNPREC
    DYNROUGH DYNSEMIFIN EXTERN FA FENDNORM FFWOF FFWON FIFOCTRL FINEA FLIN FNORM GFRAME0
    GROUP_ADDEND GROUP_BEGIN GROUP_END JERKLIM LIMS NORM ORIAXES ORIEULER ORIMACHAX ORIMKS ORIRESET ORIRPY
    ORIRPY2 ORISOF ORISON ORIVECT ORIWKS OTOL PROC RTLIOF RTLION SAVE SBLOF SBLON SD SETAL SETMS SOFT SOFTA SPATH
    STARTFIFO STOPFIFO STOPRE TOWSTD UPATH UPL VELOLIM WALIMOF WALIMON WORKPIECE WRTPR
    """.split()  # noqa: SIM905
)
#: addresses whose effect is not read, and what is done instead
_ALLOWANCE = "an allowance on the contour is left out"
_TOOL, _TOUCH = "an offset of the tool is left out", "a probe signal may end the motion earlier"
_LEFT_OUT = "the motion of its block is left out"
UNREAD = {
    "DISC": "the corner stays sharp",
    **dict.fromkeys(("PO", "POS", "POSA", "POSP"), _LEFT_OUT),
    **dict.fromkeys(("TOFF", "TOFFL", "TOFFR"), _TOOL),
    **dict.fromkeys(("MEAS", "MEAW", "MEASA", "MEAWA"), _TOUCH),
    "OFFN": _ALLOWANCE,
    "FB": "the feed of the block is that before it",
    "FL": "the limit of an axis's feed is left out",
}
#: roundings and chamfers: of the next corner, and of all (RNDM)
CORNERS = ("RND", "RNDM", "CHF", "CHR")
#: feeds of them: of the next corner, and of all; 0: the feed of what follows
CORNER_FEEDS = ("FRC", "FRCM")
#: what the feed of a compensated arc is of
CONTOUR_FEEDS = {"CFTCP": ContourFeed.NONE, "CFC": ContourFeed.ALL, "CFIN": ContourFeed.CONCAVE}
#: an axis of the machine with a number, such as Z1=50
_AXIS = re.compile(r"[XYZABCUVWQ][0-9]{1,2}")
_FRAME, _TOOL_DATA = re.compile(r"\$(?:P|AC|AA)_\w*(?:FRAME|UIFR)"), re.compile(r"\$TC_DP")
_OVERRIDES = ("OVR", "OVRRAP")


def unread(name: str, text: str) -> str:
    """What is left out of an assignment, empty where its effect is no concern of the path.

    >>> unread("DISC", "5"), unread("OVR", "100"), unread("Z1", "0")
    ('DISC=5: is not read: the corner stays sharp', '', 'Z1=0: is not read: the motion of its block is left out')
    """
    if name in UNREAD or _AXIS.fullmatch(name):
        return f"{name}={text[:40]}: is not read: {UNREAD.get(name, _LEFT_OUT)}"
    if _FRAME.match(name):
        return f"{name}: coordinates that the program writes are left out: state them in program.work_offsets"
    if _TOOL_DATA.match(name):
        return f"{name}: tool data that the program writes are left out"
    if name in _OVERRIDES and text.strip() != "100":
        return f"{name}={text[:40]}: an override by the program is left out: feeds and speeds are those of F and S"
    return ""


def leaves_out(name: str) -> bool:
    """Whether the motion of a block with such an assignment is left out."""
    return UNREAD.get(name) == _LEFT_OUT or _AXIS.fullmatch(name) is not None
