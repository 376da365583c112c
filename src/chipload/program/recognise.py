"""Which control a text is for, and in which unit: by what it says, else by evidence.

Notation: a score counts 3 for a decisive word and for a name of the control in a comment, 1 for a hint, and 2 for the
control of the machine; feeds that a control would read as thousandths of what they say count 3 against it. Two controls
whose scores differ by less than ``MARGIN`` are ambiguous. The patterns are in the profiles of the controls
(:mod:`~chipload.program.control`).
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from chipload.program.control import CONTROLS, Control, control_named
from chipload.program.reconcile import UNITS

#: a difference of scores below this is none
MARGIN = 3
DECISIVE, HINT, OF_MACHINE = 3, 1, 2
#: endings that are named after a language (RS274/NGC)
ENDINGS = {".ngc": "linuxcnc"}
#: characters of a text that are searched
SEARCHED = 200_000
#: patterns that are named in a reason
NAMED = 2
_QUOTED = re.compile(r'(^|[=\s])"([^"\n]*)"')
_COMMENT = re.compile(r"\(([^()\n]*)\)|;([^\n]*)")
_FLAGS = re.IGNORECASE | re.MULTILINE
_DISTANCE = re.compile(r"(?<![A-Z])G9[01](?![0-9.])", re.IGNORECASE)
_COORDINATE = re.compile(r"[XYZ][ \t]*[-+]?([0-9]*)\.([0-9]*)", re.IGNORECASE)
_FEED = re.compile(r"(?<![A-Z])F[ \t]*([0-9]+\.?[0-9]*|\.[0-9]+)", re.IGNORECASE)
_WHOLE_FEED = re.compile(r"(?<![A-Z])F[ \t]*[0-9]+(?![0-9.])", re.IGNORECASE)
_FEED_POINT = re.compile(r"(?<![A-Z])F[ \t]*[0-9]*\.", re.IGNORECASE)
_INCH = re.compile(r"[0-9]/[0-9]|[0-9]\"|\bIN(?:CH)?\b|\b[0-9]+-[0-9]{2}\b", re.IGNORECASE)
_MM = re.compile(r"[0-9 ]MM\b|\bM[0-9]+(?:\.[0-9])?X", re.IGNORECASE)


@dataclass(frozen=True)
class Recognition:
    """The control of a text.

    Parameters
    ----------
    control : that is read
    stated : whether somebody stated it: the job, the ending of the file, the machine
    reasons : what speaks for it
    other : the next best one where the scores are ambiguous; None: none
    """

    control: Control
    stated: bool
    reasons: tuple[str, ...] = ()
    other: Control | None = None


def scores(text: str) -> dict[str, tuple[int, tuple[str, ...]]]:
    """Score and reasons of each control.

    >>> scores("G154 P3 X1.")["haas"]
    (4, ("'G154 P'", "'X1.'"))
    """
    text = text[:SEARCHED]
    comments = " ".join(hit[1] or hit[2] or "" for hit in _COMMENT.finditer(text))
    plain = _COMMENT.sub(lambda hit: " " * len(hit[0]), text)
    out = {}
    for name in CONTROLS:
        control = control_named(name)
        family, own = control_named(control.language).evidence, control.evidence
        body = plain if control.text.o_words else text
        score, reasons = 0, []
        for pattern in own.names:
            found = re.search(rf"(?<![A-Z0-9])(?:{pattern})(?![A-Z0-9])", comments, _FLAGS)
            if found is not None:
                score += DECISIVE
                reasons.append(f"the comment {found[0]!r}")
                break
        found_words = (re.search(pattern, body, _FLAGS) for pattern in own.decisive)
        for found in found_words:
            if found is not None:
                score += DECISIVE
                reasons.append(_kind_text(found[0]))
        for pattern in dict.fromkeys((*family.hints, *own.hints)):
            found = re.search(pattern, body, _FLAGS)
            if found is not None:
                score += HINT
                reasons.append(_kind_text(found[0]))
        if control.numbers.feed_increment and _WHOLE_FEED.search(plain) and not _FEED_POINT.search(plain):
            # its feeds would be thousandths of what they say
            score -= DECISIVE
        out[name] = score, tuple(reasons)
    return out


def _kind_text(found: str) -> str:
    return repr(" ".join(found.split())[:24])


def recognise(text: str, machine: str, ending: str = "") -> Recognition:
    """The control of a text; where nothing contradicts it, that of the machine, whose name is ``machine``.

    Raises
    ------
    InputError
        There is no control of that name.
    """
    own = control_named(machine)
    found, named = scores(text), ENDINGS.get(ending)
    points = {
        name: score + OF_MACHINE * (name == machine) + DECISIVE * (name == named) for name, (score, _) in found.items()
    }
    order = sorted(points, key=lambda name: -points[name])
    best, second = order[:2]
    if points[machine] == points[best]:
        return Recognition(own, True, ("the machine",))
    other = control_named(second) if points[best] - points[second] < MARGIN else None
    return Recognition(control_named(best), False, found[best][1][:NAMED], other)


def states_unit(text: str) -> bool:
    """Whether a text states its unit.

    >>> states_unit("G21 G0 X1"), states_unit("(G21) G0 X1")
    (True, False)
    """
    return UNITS.search(_COMMENT.sub(" ", text)) is not None


def states_distance(text: str) -> bool:
    """Whether a text states absolute or incremental coordinates (G90, G91)."""
    return _DISTANCE.search(_COMMENT.sub(" ", text)) is not None


def guess_unit(text: str) -> tuple[str, str]:
    r"""The unit that a text seems to be in, and why.

    >>> guess_unit("(T1 1/2 ENDMILL)\\nG1 X1.2503 F12.")
    ('inch', "inches in comments ('1/2'), 4 decimals, feeds up to 12")
    """
    text = text[:SEARCHED]
    comments = " ".join(hit[1] or hit[2] or "" for hit in _COMMENT.finditer(text))
    # the second mark of a quoted name is not that of inches
    comments = _QUOTED.sub(r"\1\2", comments)
    plain = _COMMENT.sub(" ", text)
    inch, reasons = 0, []
    for pattern, unit, points in ((_INCH, "inches", 2), (_MM, "mm", -2)):
        found = pattern.search(comments)
        if found is not None:
            inch += points
            reasons.append(f"{unit} in comments ({found[0].strip()!r})")
    parts = _COORDINATE.findall(plain)
    if parts:
        decimals = max(len(b) for _, b in parts)
        inch += 1 if decimals >= 4 or any(a == "" for a, _ in parts) else -1
        reasons.append(f"{decimals} decimals")
    feeds = [float(x) for x in _FEED.findall(plain)]
    if feeds:
        inch += 1 if max(feeds) <= 60.0 else -1 if max(feeds) >= 100.0 else 0
        reasons.append(f"feeds up to {max(feeds):g}")
    return ("inch" if inch > 0 else "mm"), ", ".join(reasons) or "no evidence"
