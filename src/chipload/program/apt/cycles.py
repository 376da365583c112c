"""CYCLE records: the motions of holes in CL data.

Notation: a hole is at a point of the surface, its depth d [mm] counted from there against the tool's axis; rapto c and
rtrcto h [mm] are counted from there along it. A step is ``(kind, height, value)``: RAPID or LINE to a height above the
surface (a depth is negative), DWELL of a time [s], SPIN to the sense of the spindle, 1 as it was or -1 reversed.

CYCLE/kind,word,number,... with FEDTO or DEPTH d (the sign does not count), RAPTO or CLEAR c, RTRCTO or RETURN h (AUTO
or none: h = c), a feed MMPM, MMPR, IPM, IPR, PERMIN or PERREV, DWELL in seconds, pecks STEP or INCR, or 1STPECK and
then SUBPECK; or CYCLE/kind,d[,INCR,step],unit,feed,c,... with the feed before or behind its unit. Each GOTO until
CYCLE/OFF is a hole. The tool rises to h if it is lower, moves over the hole, goes in as told and ends at h. A peck of
DEEP leaves the hole up to c and comes back to ``RETURN_MM`` above where it was; one of BRKCHP goes up by ``RETURN_MM``.
Where RAPTO comes with CLEAR, it leads from CLEAR on towards the hole.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from chipload.program.apt.records import AptRecord, number
from chipload.program.apt.track import MINUTE, TURN
from chipload.program.program import DWELL, LINE, RAPID
from chipload.units import MM_PER

SPIN = -1
#: pecks of one hole
MOST_PECKS = 10_000
#: a peck returns to this height above the bottom drilled so far [mm]
RETURN_MM = 0.254

#: cycles that cut straight to the depth, and whether they come out at the feed
PLAIN = {
    **dict.fromkeys(("DRILL", "FACE", "CSINK", "CBORE", "CDRILL"), False),
    **dict.fromkeys(("REAM", "BORE", "TAP"), True),
}
PECKS = ("DEEP", "DEEP2", "DEEPHL", "BRKCHP")
_LENGTHS = {
    "FEDTO": "depth",
    "DEPTH": "depth",
    "RAPTO": "rapto",
    "CLEAR": "clear",
    "RTRCTO": "rtrcto",
    "RETURN": "rtrcto",
    "STEP": "step",
    "INCR": "step",
    "1STPECK": "first",
    "SUBPECK": "step",
}
#: what a feed counts and mm in its unit of length, None: that of the text
FEEDS = {
    "MMPM": (MINUTE, 1.0),
    "MMPR": (TURN, 1.0),
    "IPM": (MINUTE, MM_PER["inch"]),
    "IPR": (TURN, MM_PER["inch"]),
    "PERMIN": (MINUTE, None),
    "PERREV": (TURN, None),
}


@dataclass(frozen=True)
class Cycle:
    """One hole's motions: lengths [mm], ``feed`` a number and what it counts, None: that of FEDRAT; ``dwell`` [s]."""

    kind: str
    depth: float
    rapto: float
    rtrcto: float
    feed: tuple[float, str] | None = None
    dwell: float = 0.0
    first: float = 0.0
    step: float = 0.0

    def steps(self) -> Iterator[tuple[int, float, float]]:
        """From above the hole to ``rtrcto``."""
        yield RAPID, self.rapto, 0.0
        if self.kind in PECKS:
            yield from self._pecks()
        else:
            yield LINE, -self.depth, 0.0
        if self.dwell > 0.0:
            yield DWELL, -self.depth, self.dwell
        if self.kind == "TAP":
            yield SPIN, -self.depth, -1.0
        if PLAIN.get(self.kind, False):
            yield LINE, self.rapto, 0.0
        if self.kind == "TAP":
            yield SPIN, self.rapto, 1.0
        yield RAPID, self.rtrcto, 0.0

    def _pecks(self) -> Iterator[tuple[int, float, float]]:
        done = self.first
        while done < self.depth - 1e-9:
            yield LINE, -done, 0.0
            if self.kind != "BRKCHP":
                yield RAPID, self.rapto, 0.0
            yield RAPID, min(RETURN_MM - done, self.rapto), 0.0
            done += self.step
        yield LINE, -self.depth, 0.0


def read_cycle(record: AptRecord, mm: float) -> tuple[Cycle, tuple[str, ...]] | None:
    """The cycle that a record defines and the words of it that are not read; None: the cycle is not known.

    Parameters
    ----------
    mm : in one unit of the text

    Raises
    ------
    InputError
        A number is missing or out of range, a word appears twice.
    """
    words = [word for arg in record.args for word in arg.split(" ") if word]
    kind = words[0] if words else ""
    if kind not in PLAIN and kind not in PECKS:
        return None
    if words[1:2] in (["G98"], ["G99"]):
        return _in_places(record, words, mm), ()
    if len(words) > 1 and number(words[1]) is not None:
        words = _name_words(words)
    values: dict[str, float] = {}
    unread: list[str] = []
    feed: tuple[float, str] | None = None
    k = 1
    while k < len(words):
        word = words[k]
        if word in ("RTRCTO", "RETURN") and words[k + 1 : k + 2] == ["AUTO"]:
            k += 2
            continue
        value = number(words[k + 1]) if k + 1 < len(words) else None
        if word not in FEEDS and word != "DWELL" and word not in _LENGTHS:
            unread.append(word if value is None else f"{word},{words[k + 1]}")
            k += 1 if value is None else 2
            continue
        if value is None:
            raise record.error(f"{word} must be followed by a number")
        if word in FEEDS:
            feed = _feed(word, value, mm)
        elif word == "DWELL":
            values["dwell"] = value
        elif _LENGTHS[word] not in values:
            values[_LENGTHS[word]] = value * mm
        else:
            raise record.error(f"{word} is stated twice: take one out")
        k += 2
    if kind not in PECKS and {"first", "step"} & values.keys():
        unread.append("pecks")
        values.pop("first", None)
        values.pop("step", None)
    clear = values.pop("clear", None)
    if clear is not None:
        values["rapto"] = clear - abs(values["rapto"]) if "rapto" in values else clear
        values.setdefault("rtrcto", clear)
    return _check_cycle(record, kind, values, feed), tuple(unread)


def _name_words(words: list[str]) -> list[str]:
    """kind,d[,INCR,step],unit,feed,c,... with the words that name its numbers; a feed may stand before its unit.

    >>> _name_words(["DEEP", "20", "INCR", "5", "MMPM", "100", "2", "RAPTO", "1"])
    ['DEEP', 'DEPTH', '20', 'INCR', '5', 'MMPM', '100', 'CLEAR', '2', 'RAPTO', '1']
    """
    out, k, clear = [words[0], "DEPTH", words[1]], 2, False
    while k < len(words):
        more = words[k + 1 : k + 2]
        if number(words[k]) is None:
            pair = bool(more) and number(more[0]) is not None
            out += words[k : k + 2] if pair else words[k : k + 1]
            k += 2 if pair else 1
        elif more and more[0] in FEEDS:
            out += [more[0], words[k]]
            k += 2
        else:
            out += ["SHIFT" if clear else "CLEAR", words[k]]
            clear, k = True, k + 1
    return out


def _in_places(record: AptRecord, words: list[str], mm: float) -> Cycle:
    """kind,G98,depth,PECKING,first,step,unit,feed,rapto,rtrcto,...,DWELL,time as one CAM system writes it."""
    numbers = [number(word) for word in words]
    layout = [word if value is None else "#" for word, value in zip(words, numbers, strict=True)]
    begins = ["#", "PECKING", "#", "#"]
    known = layout[2:6] == begins and len(words) > 9 and words[6] in FEEDS and layout[7:10] == ["#", "#", "#"]
    if not known or layout[10:] not in ([], ["#"], ["DWELL", "#"], ["#", "DWELL", "#"]):
        raise record.error("must read kind,G98,depth,PECKING,first,step,unit,feed,rapto,rtrcto")
    v = [value if value is not None else 0.0 for value in numbers]
    values = {"depth": v[2] * mm, "first": v[4] * mm, "step": v[5] * mm, "rapto": v[8] * mm}
    if words[1] == "G98":
        values["rtrcto"] = v[9] * mm
    if "DWELL" in words:
        values["dwell"] = v[-1]
    kind = "DEEP" if words[0] == "DRILL" else words[0]
    return _check_cycle(record, kind, values, _feed(words[6], v[7], mm))


def _feed(word: str, value: float, mm: float) -> tuple[float, str]:
    counts, scale = FEEDS[word]
    return value * (mm if scale is None else scale), counts


def _check_cycle(record: AptRecord, kind: str, values: dict[str, float], feed: tuple[float, str] | None) -> Cycle:
    if "depth" not in values or "rapto" not in values:
        raise record.error("must state the depth, by FEDTO or DEPTH, and the start, by RAPTO or CLEAR")
    values["depth"] = abs(values["depth"])
    values.setdefault("rtrcto", values["rapto"])
    values["rtrcto"] = max(values["rtrcto"], values["rapto"])
    if values["rapto"] < -values["depth"]:
        raise record.error("RAPTO is below the bottom: must be above it")
    if values.get("dwell", 0.0) < 0.0 or (feed is not None and feed[0] <= 0.0):
        raise record.error("DWELL must be at least 0, a feed above 0")
    if kind in PECKS:
        values.setdefault("first", values.get("step", 0.0))
        values.setdefault("step", values["first"])
        if min(values["first"], values["step"]) <= 0.0:
            raise record.error("pecks must be above 0: give STEP, or 1STPECK and SUBPECK")
        if values["depth"] / min(values["first"], values["step"]) > MOST_PECKS:
            raise record.error(f"makes more than {MOST_PECKS} pecks: make them larger")
    elif "first" in values or "step" in values:
        raise record.error(f"{kind} has no pecks: must be {' or '.join(PECKS)}")
    return Cycle(kind, feed=feed, **values)
