"""Which comment of an NC text describes which tool.

A comment describes the tool whose number begins it (``T4 | 3/8 FLAT ENDMILL``, ``TOOL #3 - 0.25 DIA``, ``#7 D=6``),
else the tool of the change on its line, just below it, or just above it before any motion. Heidenhain's comments stand
above TOOL DEF; Sinumerik and Heidenhain also call tools by names.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from chipload.program.reconcile import StatedDiameter, unit_mm, without_offsets
from chipload.program.setup import FIRST_NAMED
from chipload.program.tool_words import Stated, describe_tool, kind_of, names_diameter

#: a comment of NC text, with one pair of brackets in it
COMMENT = re.compile(r"\(((?:[^()\n]|\([^()\n]*\))*)\)|;([^\n]*)")
#: the number of a tool at the beginning of a comment, and what follows
_NUMBERED = re.compile(
    r"^\W{0,3}(?:T(?:OOL)?\s*(?:NO\.?|NUMBER|NUM\.?)?\s*[-:#=]?\s*T?\s?(?P<tool>[0-9]{1,8})|#(?P<post>[0-9]{1,8})(?=\s+D=))"
    r"(?![0-9./\"]|\s*(?:MM|IN|INCH)\b)\s*[-:=|,]*(?P<rest>.*)$",
    re.IGNORECASE,
)
#: a comment, and the tool that is defined behind it (Heidenhain)
_TOOL_DEF = re.compile(r";([^\n]*)\n[^\n]*\bTOOL\s+(?:DEF|CALL)\s+(\d{1,8})\b", re.IGNORECASE)
#: a tool called by its name: Sinumerik, Heidenhain
_NAMED = re.compile(r'(?:\bT\d*\s*=\s*|\bTOOL\s+CALL\s+)"([^"\n]+)"', re.IGNORECASE)
#: a change of tools by number (G100 of a Brother, TOOL CALL of a Heidenhain), and a motion that is no retraction
_CHANGE = re.compile(r"(?<![A-Z_<\[#])(?:M0?6(?![0-9.])|G100(?![0-9.]))|\bTOOL\s+CALL\s+[0-9]", re.IGNORECASE)
_TOOL_WORD = re.compile(r"(?:(?<![A-Z_<\[#])T\s*|\bTOOL\s+CALL\s+)([0-9]{1,8})(?![0-9.=])", re.IGNORECASE)
_MOTION = re.compile(r"(?<![A-Z_<\[#])[XYZ]\s*[-+.0-9\[#]", re.IGNORECASE)
_RETRACTION = re.compile(r"(?<![A-Z])(?:G(?:28|30|53)(?![0-9.])|M91\b)|\b(?:SUPA|BLK\s+FORM)\b", re.IGNORECASE)
_BY_VARIABLE = re.compile(r"(?<![A-Z_<\[#])T\s*(?P<key>#(?:<[^<>\n]+>|[0-9]{1,6}))", re.IGNORECASE)
_ASSIGNMENT = re.compile(r"^\s*#(?:<[^<>\n]+>|[0-9]{1,6})\s*=")
#: a text that names a tool
_NAMES_TOOLS = re.compile(r"\bTOOL\s+(?:DEF|CALL)\b|(?<![A-Z_])T\d*\s*=", re.IGNORECASE)
#: CutViewer, Carbide Create: kind of the tool and its numbers
_CUT_VIEWER = re.compile(r"^\s*TOOL/(MILL|DRILL)\s*,([^()\n]*)$", re.IGNORECASE)
#: Mastercam's first form: the number, offsets and the diameter
_OFFSETS = re.compile(
    r"^\s*TOOL\s*-\s*([0-9]{1,8})\s+DIA\.?\s*OFF\.?\s*-\s*[0-9]+\s+LEN\.?\s*-\s*[0-9]+\s+(DIA\..*)$", re.IGNORECASE
)
#: a name or a size of the tool on a line of its own, without its number
_OWN_LINE = re.compile(
    r"^\s*(?:TOOL[\s_]*(?:NAME|DESCRIPTION|DESC|DIAMETER|DIA|RADIUS|TYPE)?|TC|WERKZEUG|OUTIL)\b\.?\s*[-:=]",
    re.IGNORECASE,
)
#: a size with which the words about a tool begin
_SIZE_FIRST = re.compile(r"\s*(?:[0-9]+/[0-9]+|[0-9]+\.?[0-9]*|\.[0-9]+)(?![0-9./])")
#: name of an operation with its number, which is no size: ``Contour Mill14``, ``Drill1``
_OPERATION = re.compile(
    r"^\s*(?:[A-Z]+[ -][A-Z -]*(?:MILL|DRILL|BORE|TAP|REAM|CHAMFER)[0-9]{1,2}|[A-Z]+[12])\s*$", re.IGNORECASE
)
#: lines of numbers alone that move, as a CAM system writes them: no comment, no tool; so many at once
_MOTIONS = re.compile(
    r"(?:^[ \t]*(?:N[0-9]{1,9}[ \t]*)?(?:G0?[0-3](?![0-9.])[ \t]*)?(?:[ABC][ \t]*[-+.0-9]+[ \t]*)*[XYZ][ \t]*[-+.0-9]+"
    r"(?:[ \t]*[XYZABCIJKF][ \t]*[-+.0-9]+)*[ \t]*\r?\n){1,500}",
    re.IGNORECASE | re.MULTILINE,
)
#: lines above a change of tools whose comments may describe the tool
ABOVE = 6


def stated_tools(text: str, mm: float) -> dict[int, Stated]:
    """What the comments and names of an NC text state about each tool.

    Parameters
    ----------
    mm : in the unit of the text
    """
    out: dict[int, Stated] = {}
    # of a long program hardly any line speaks of a tool
    text = _with_numbers(_MOTIONS.sub("X0\n", text))
    for number, words, comment in _described_tools(text):
        own = out.setdefault(number, {})
        for key, stated in _statement(words, mm, comment).items():
            own.setdefault(key, stated)
    for k, name in enumerate(dict.fromkeys(_NAMED.findall(re.sub(r";[^\n]*", "", text)))):
        own = out.setdefault(FIRST_NAMED + k, {})
        described = describe_tool(name, mm, f"the name of the tool ({name[:50]})")
        if "diameter_mm" in described and not names_diameter(name, unit=True):
            described["number_mm"] = (described.pop("diameter_mm")[0], f"the number in its name, {name[:50]}")
        for key, stated in described.items():
            own.setdefault(key, stated)
    return out


def stated_diameters(text: str, unit: str = "mm") -> dict[int, StatedDiameter]:
    r"""The diameter of each tool that a comment with its number states, the first of each tool.

    ``unit`` is that of a text that selects none.

    Read are numbers that the comment calls a diameter, and those that stand between the tool's number and its kind.

    >>> stated_diameters("(T1 D=10. CR=0. - ZMIN=-5. - flat end mill)")[1].diameter
    10.0
    >>> stated_diameters("G20\n(TOOL: T2 = 0.5 dia. ENDMILL)")[2].diameter
    12.7
    """
    out: dict[int, StatedDiameter] = {}
    mm = unit_mm(text, unit)
    for line, row in enumerate(text.split("\n"), start=1):
        for comment in _comments_of(row) if "(" in row or ";" in row else ():
            found = next(_numbered_tools(comment), None)
            if found is None or found[0] in out:
                continue
            number, words = found
            value = describe_tool(words, mm).get("diameter_mm")
            if value is not None and (names_diameter(words) or (_SIZE_FIRST.match(words) and kind_of(words))):
                where = f"the comment ({' '.join(comment.upper().split())[:60]})"
                out[number] = StatedDiameter(float(value[0]), where, line)
    return out


def _with_numbers(text: str) -> str:
    """The text with the numbers of tools that it calls by a variable that it sets once, to a whole number."""

    def number(found: re.Match[str]) -> str:
        values = re.findall(rf"{re.escape(found['key'])}\s*=\s*([^\s(;]*)", text, re.IGNORECASE)
        return f"T{values[0]}" if len(values) == 1 and values[0].isdigit() else found[0]

    return _BY_VARIABLE.sub(number, text)


def _numbered_tools(comment: str) -> Iterator[tuple[int, str]]:
    """The number of the tool that begins a comment, and the words about it."""
    if (found := _OFFSETS.match(comment)) is not None:
        yield int(found[1]), found[2]
    elif (found := _NUMBERED.match(comment)) is not None and _describes(found["rest"], sure=True):
        shorter = _NUMBERED.match(without_offsets(comment.upper()))
        yield int(found["tool"] or found["post"]), (found if shorter is None else shorter)["rest"]


def _described_tools(text: str) -> Iterator[tuple[int, str, str]]:
    """Number of a tool, words about it, and the comment that they stand in, the surest first."""
    for line in text.splitlines():
        for comment in _comments_of(line):
            for number, words in _numbered_tools(comment):
                yield number, words, comment
    for number, comment in _at_changes(text):
        yield number, comment, comment
    for hit in _TOOL_DEF.finditer(text):
        if _describes(hit[1]):
            yield int(hit[2]), hit[1], hit[1]
    yield from _only_tool(text)


def _comments_of(line: str) -> list[str]:
    return [hit[1] if hit[1] is not None else hit[2] for hit in COMMENT.finditer(line)]


def _at_changes(text: str) -> Iterator[tuple[int, str]]:
    """Tool numbers with the comments that describe the tool: on the line of its change, just above it, or below it and
    before any motion.
    """
    above: list[str] = []
    chosen = waiting = 0
    for line in text.splitlines():
        words = COMMENT.sub(" ", line)
        if found := _TOOL_WORD.search(words):
            chosen = int(found[1])
        comments = [c for c in _comments_of(line) if not _names_another(c, chosen)]
        if _CHANGE.search(words) and chosen:
            near = [c for c in (*comments, *reversed(above)) if _describes(c) and not _names_another(c, chosen)]
            for k, comment in enumerate(near):
                if k == 0 or _OWN_LINE.match(comment):
                    yield chosen, comment.strip()
            above, waiting = [], 0 if near else chosen
        elif _MOTION.search(words) and not _RETRACTION.search(words):
            above, waiting = [], 0
        else:
            below = [c for c in comments if waiting and _describes(c)]
            if below:
                yield waiting, below[0].strip()
                waiting = 0
            # lines that only set a variable do not count
            own = _comments_of(line) or ([""] if words.strip() and not _ASSIGNMENT.match(words) else [])
            above = [*above, *own][-ABOVE:]


def _only_tool(text: str) -> Iterator[tuple[int, str, str]]:
    """The comment on the tool of a text that has one tool, where one describes a tool: number 0 without a change, else
    by a line of its own that names the tool.
    """
    code = COMMENT.sub(" ", text)
    changes = _CHANGE.search(code) is not None
    numbers = {int(number) for number in _TOOL_WORD.findall(code)} - {0} if changes else {0}
    if len(numbers) != 1 or _NAMES_TOOLS.search(code):
        return
    spoken = [c for line in text.splitlines() for c in _comments_of(line)]
    comments = dict.fromkeys(c.strip() for c in spoken if _describes(c) and (_OWN_LINE.match(c) or not changes))
    if len(comments) == 1 and not any(True for c in spoken for _ in _numbered_tools(c)):
        comment = next(iter(comments))
        yield numbers.pop(), comment, comment


def _names_another(comment: str, number: int) -> bool:
    """Whether a comment is about a tool of another number."""
    found = _NUMBERED.match(comment)
    return found is not None and number > 0 and int(found["tool"] or found["post"]) != number


def _describes(comment: str, sure: bool = False) -> bool:
    """Whether a comment describes a tool: by its kind and a size, or by either where it names the tool."""
    if _CUT_VIEWER.match(comment):
        return True
    kind = kind_of(comment) is not None
    if not sure and _OPERATION.match(comment):
        return False
    if sure or _OWN_LINE.match(comment):
        return kind or names_diameter(comment)
    return kind and "diameter_mm" in describe_tool(comment, 1.0)


def _statement(comment: str, mm: float, whole: str) -> Stated:
    """What words about a tool state; ``whole`` is the comment with them."""
    where = f"the comment ({' '.join(whole.split())[:60]})"
    if (found := _CUT_VIEWER.match(comment)) is None:
        return describe_tool(comment, mm, where) | {"name": (_name(comment, whole), where)}
    try:
        numbers = [float(part) for part in found[2].split(",")]
    except ValueError:
        return {}
    if not numbers or numbers[0] <= 0.0:
        return {}
    d, second = numbers[0] * mm, numbers[1] if len(numbers) > 1 else 0.0
    kind = "DRILL" if found[1].upper() == "DRILL" else "MILL"
    out = describe_tool(kind, mm, where) | {"diameter_mm": (d, where), "name": (comment.strip(), where)}
    if kind == "DRILL" and 0.0 < second < 180.0:
        out["bottom_deg"] = (90.0 - 0.5 * second, where)
    elif kind == "MILL" and 0.0 < second * mm <= 0.5 * d:
        out["corner_radius_mm"] = (second * mm, where)
    return out


def _name(words: str, comment: str) -> str:
    """The words of a comment that name the tool, as they stand there: of parts between signs the one with its kind.

    >>> _name("D=10. CR=0. - ZMIN=-5. - FLAT END MILL", "T1 D=10. CR=0. - ZMIN=-5. - flat end mill")
    'flat end mill'
    """
    plain = re.sub(r"^(?:[-:=|,\s]|\.(?![0-9]))*", "", " ".join(words.split()))
    parts = [part.strip() for part in re.split(r"\|| - ", plain) if part.strip()]
    named = [part for part in parts if "=" not in part and kind_of(part) is not None]
    name = named[0] if len(parts) > 1 and named else plain
    at = " ".join(comment.split()).upper().find(name.upper())
    return name if at < 0 else " ".join(comment.split())[at : at + len(name)]
