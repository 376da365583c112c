"""Words of a conversational block, and how a line becomes a block.

Notation: a value is a number or a parameter, Q5, QL5 or QR5, with a sign; I before an axis: from where it stands.
"""

from __future__ import annotations

import re

from chipload.errors import InputError

VALUE = r"Q[LR]?\d+|\d+\.?\d*|\.\d+"
#: axis words; radius, pole and turn of an arc; polar coordinates
AXIS = re.compile(rf"(I?)([XYZABC])\s*([-+]?)\s*({VALUE})")
FEED = re.compile(rf"\bF\s*(MAX|AUTO|\+?\s*(?:{VALUE}))")
#: feed for each turn of the spindle
TURN_FEED = re.compile(rf"\bFU\s*({VALUE})")
M_CODE = re.compile(r"\bM\s*(\d+)\b")
#: unit of F: for each turn (M136), for each minute (M137)
FEED_UNIT = re.compile(r"\bM\s*(136|137)\b")
#: feed of plunges in percent of F (M103 F); without a number they have F
PLUNGING = re.compile(rf"\bM\s*103\b(?:\s*F\s*({VALUE}))?")
SIDE = re.compile(r"\bR([LR0])(?![\d.A-Z])")
TURN = re.compile(r"\bDR([-+])")
RADIUS = re.compile(rf"\bR(?!0(?![\d.]))\s*([-+]?)\s*({VALUE})")
POLAR = re.compile(rf"\b(I?)P([RA])\s*([-+]?)\s*({VALUE})")
#: retraction along the tool by M140
RETRACT = re.compile(rf"\bM\s*140\s*MB\s*(MAX|{VALUE})")
#: M functions with words of their own that set no motion: look-ahead, filter, handwheel, rotary axes
SETTINGS = re.compile(
    rf"\bM\s*(?:120\s*LA\s*(?:{VALUE})|124\s*T\s*(?:{VALUE})|118(?:\s*[XYZABC]\s*[-+]?(?:{VALUE}))+|138(?:\s+[ABC]\b)+)"
)
LABEL = re.compile(r'LBL\s*(\d+|"[^"]*")$')
Q_VALUE = re.compile(r"(Q[LR]?)\s*(\d+)\s*=\s*(F?MAX|F?AUTO|[-+]?\s*(?:Q[LR]?\s*\d+|\d+\.?\d*|\.\d+))")


def feed_unit(scale: float) -> float:
    """Unit of F [mm/min] in a text whose unit of length is ``scale`` [mm]: a tenth of an inch in one of inches.

    >>> feed_unit(1.0), round(feed_unit(25.4), 9)
    (1.0, 2.54)
    """
    return scale if scale == 1.0 else 0.1 * scale


def bare(raw: str) -> str:
    """A block without number, comment and needless blanks, in capitals.

    >>> bare("12 L  X+1 Y-Q2 fmax ; to the start"), bare("7 * - Pocket 1")
    ('L X+1 Y-Q2 FMAX', '* - POCKET 1')
    """
    # ~ says that the block goes on in the next line, where Q parameters stand by themselves
    text = raw.split(";", 1)[0].replace("~", " ").upper()
    return re.sub(r"^\d+ ?(?=[A-Z*]|$)", "", re.sub(r"\s+", " ", text).strip())


def blocks_of(text: str) -> list[str]:
    r"""The blocks of a text by line; a block that ~ continues takes the lines that follow.

    >>> blocks_of("1 CYCL DEF 200 ~\nQ200=2 ;clearance ~\nQ201=-9\nL X+1")
    ['CYCL DEF 200 Q200=2 Q201=-9', '', '', 'L X+1']
    """
    out: list[str] = []
    head, goes_on = 0, False
    for k, raw in enumerate(text.splitlines()):
        block = bare(raw)
        if goes_on:
            out[head] = f"{out[head]} {block}".strip()
            out.append("")
        else:
            head = k
            out.append(block)
        goes_on = raw.rstrip().endswith("~")
    return out


def number(text: str) -> float:
    """The value of a number.

    Raises
    ------
    InputError
        It is none.
    """
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{text!r}: must be a number") from None


def rest_of(text: str, *patterns: re.Pattern[str]) -> str:
    """What no pattern reads."""
    for pattern in patterns:
        text = pattern.sub(" ", text)
    return text.strip()
