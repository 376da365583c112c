"""Description of a machine by an MTConnect agent, and samples of its spindle.

An agent answers ``/probe`` with the description of the device (MTConnectDevices) and ``/sample`` with measured values
(MTConnectStreams); either may also be a file. From a description this module reads the limits of the linear axes, the
limits of the spindle's speed and the greatest path feed; from samples the speed, current, power and torque of the
spindle, and the path feed. Values have the units of the standard (ANSI/MTC1.4,
Part 2: millimetre, revolution/minute, ampere, watt, newton metre, millimetre/second).

A description does not state the acceleration of axes, the mounting of rotary axes or the dialect of the controller. The
machine's file holds such keys as comments, and it is refused until they are filled in.
"""

from __future__ import annotations

import http.client
import math
import time
import urllib.error
import urllib.request
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from xml.etree import ElementTree

from chipload.errors import Finding, InputError
from chipload.files import read_regular
from chipload.machine.spindle_samples import Sample, log_text

Element = ElementTree.Element

#: largest document [bytes], and longest wait for an agent's answer [s]
MOST_BYTES, WAIT_S = 1 << 26, 20.0
#: greatest number of samples in an answer, and of answers that are requested
COUNT, ANSWERS = 10_000, 1_000
#: types of samples -> column of the log and the factor to its unit
TYPES = {
    "RotaryVelocity": ("speed_rpm", 1.0),
    "SpindleSpeed": ("speed_rpm", 1.0),
    "Amperage": ("current_a", 1.0),
    "AmperageAC": ("current_a", 1.0),
    "AmperageDC": ("current_a", 1.0),
    "Wattage": ("power_w", 1.0),
    "Torque": ("torque_nm", 1.0),
    "PathFeedrate": ("feed_mm_min", 60.0),
}
#: types of events of the path -> column of the log; an event without a value: no line
EVENTS = {"Line": "line", "LineNumber": "line", "PathFeedrateOverride": "override_percent"}
#: subtypes of events that are used
USED = (None, "ABSOLUTE", "PROGRAMMED")
#: the columns in their order
COLUMNS = ("speed_rpm", "current_a", "power_w", "torque_nm", "feed_mm_min", "line", "override_percent")
#: subtypes of values that are commanded, not measured
WANTED = ("COMMANDED", "PROGRAMMED", "OVERRIDE", "TARGET", "JOG", "RAPID")
#: components that may be the spindle
TURNING = ("Rotary", "Spindle")


@dataclass(frozen=True)
class Described:
    """Description of a device.

    Parameters
    ----------
    name : of the device
    travel : least and greatest position [mm] of each linear axis by its letter; None: not stated
    speed : least and greatest speed of the spindle [rpm]; None: not stated
    feed : greatest path feed [mm/min]; None: not stated
    rotary : names of the rotary axes other than the spindle
    """

    name: str
    travel: Mapping[str, tuple[float | None, float | None]]
    speed: tuple[float | None, float | None]
    feed: float | None
    rotary: tuple[str, ...]


def document(source: str, path: str = "", query: str = "") -> Element:
    """The XML of a file, or of an agent's answer.

    Parameters
    ----------
    source : a file, or the address of an agent, as ``http://127.0.0.1:5000``
    path, query : request to the agent, such as ``probe``

    Raises
    ------
    InputError
        The document cannot be read or is not XML of MTConnect, or the agent reports an error.
    """
    if source.startswith(("http://", "https://")):
        address = f"{source.rstrip('/')}/{path}{query}"
        try:
            with urllib.request.urlopen(address, timeout=WAIT_S) as answer:
                data = _read_within(answer, time.monotonic() + WAIT_S)
        except (OSError, ValueError, urllib.error.URLError, http.client.HTTPException) as err:
            raise InputError(f"MTConnect {address}: no answer: {err}: start the agent or give a file") from None
        if len(data) > MOST_BYTES:
            raise InputError(f"MTConnect {address}: more than {MOST_BYTES} bytes: ask for fewer samples")
        label = f"MTConnect {address}"
    else:
        label = f"MTConnect {source}"
        data = read_regular(Path(source), label, MOST_BYTES, "cut it into parts")
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise InputError(f"{label}: a DOCTYPE or ENTITY declaration, which MTConnect does not use: take it out")
    try:
        root = ElementTree.fromstring(data)
    except ElementTree.ParseError as err:
        raise InputError(f"{label}: not XML: {err}") from None
    if _kind(root) == "MTConnectError":
        reported = "; ".join((e.text or "").strip() for e in root.iter() if _kind(e) == "Error")
        raise InputError(f"{label}: the agent reports: {reported or 'an error'}")
    if not _kind(root).startswith("MTConnect"):
        raise InputError(f"{label}: the document is a {_kind(root)}: MTConnectDevices or MTConnectStreams is read")
    return root


def _read_within(answer: http.client.HTTPResponse, until: float) -> bytes:
    """Return the body of an answer, at most one byte over :data:`MOST_BYTES`.

    Raises
    ------
    TimeoutError
        It is not complete at the time ``until`` of the monotonic clock, however often a byte comes.
    """
    parts, size = [], 0
    while size <= MOST_BYTES:
        # one call of the system at a time: a full read would wait for each byte as long as for the first
        part = answer.read1(min(1 << 16, MOST_BYTES + 1 - size))
        if not part:
            break
        parts.append(part)
        size += len(part)
        if time.monotonic() > until:
            raise TimeoutError(f"the answer is not complete after {WAIT_S:g} s")
    return b"".join(parts)


def describe_device(root: Element, name: str | None = None) -> Described:
    """The device of a description.

    Parameters
    ----------
    root : of MTConnectDevices
    name : of the device; None: the only one

    Raises
    ------
    InputError
        There is no such device, or there are several and ``name`` is None.
    """
    devices = [e for e in root.iter() if _kind(e) == "Device"]
    if not devices:
        raise InputError("MTConnect: the document describes no device: give the answer to /probe")
    names = [d.get("name") or d.get("uuid") or "device" for d in devices]
    if name is None and len(devices) > 1:
        raise InputError(f"MTConnect: {len(devices)} devices: state --device, one of {', '.join(names)}")
    if name is not None and name not in names:
        raise InputError(f"MTConnect: no device {name}: there are {', '.join(names)}")
    device = devices[0 if name is None else names.index(name)]
    travel: dict[str, tuple[float | None, float | None]] = {}
    speed: tuple[float | None, float | None] = (None, None)
    rotary = []
    for part in device.iter():
        own = part.get("name") or ""
        letter = (part.get("nativeName") or own)[:1].upper()
        if _kind(part) == "Linear" and letter in "XYZ" and letter and letter not in travel:
            travel[letter] = _limits(part, ("POSITION",))
        elif _kind(part) in TURNING:
            turns = any(
                i.get("type") in ("ROTARY_VELOCITY", "SPINDLE_SPEED") for i in _own(part) if _kind(i) == "DataItem"
            )
            if turns and speed == (None, None):
                speed = _limits(part, ("ROTARY_VELOCITY", "SPINDLE_SPEED"))
            elif not turns:
                rotary.append(own)
    feeds = [f for p in device.iter() if _kind(p) == "Path" if (f := _limits(p, ("PATH_FEEDRATE",))[1]) is not None]
    return Described(names[devices.index(device)], travel, speed, 60.0 * max(feeds) if feeds else None, tuple(rotary))


def machine_text(found: Described) -> str:
    """The machine's file (TOML); a value that is not known is a comment to be filled in."""

    def line(key: str, value: float | None, what: str = "") -> str:
        return f"{key} = {value!r}" if value is not None else f"# {key} =        # not stated by the agent{what}"

    quoted = found.name.replace("\\", " ").replace('"', "'")
    lines = [
        f"# {' '.join(quoted.split())}, as its MTConnect agent describes it. Fill in what is a comment: a machine's",
        "# limits are never guessed. Travel is that of the cutter's tip in the work frame: move it by the work offset.",
        f'name = "{" ".join(quoted.split())}"',
        "# dialect =        # linuxcnc, fanuc, sinumerik or heidenhain",
        "decimals = 3",
        "# rapid_mm_min =        # not stated by an agent",
        line("feed_max_mm_min", found.feed),
        "# corner_tolerance_mm =        # of the controller's path mode",
    ]
    if found.rotary:
        lines.append(
            f"# axes that turn, without their mounting: {', '.join(' '.join(n.split()) for n in found.rotary)}"
        )
    for letter in "XYZ":
        low, high = found.travel.get(letter, (None, None))
        lines += [
            "", f"[axis.{letter.lower()}]", line("min_mm", low), line("max_mm", high),
            "# acceleration_mm_s2 =        # not stated by an agent",
        ]  # fmt: skip
    lines += [
        "", "[spindle]", line("min_rpm", found.speed[0]), line("max_rpm", found.speed[1]),
        "# power_w =        # from the data sheet", "# torque_nm =        # likewise",
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def samples(source: str, device: str | None = None, component: str | None = None) -> tuple[str, list[Finding]]:
    """The log of a spindle (CSV), as :func:`chipload.control.logs.read_log` reads it.

    Parameters
    ----------
    source : a file with streams, or the address of an agent, whose whole buffer is read
    device : its name; None: the only one
    component : name or id of the spindle's component; None: the only one that states a speed

    Raises
    ------
    InputError
        There is no spindle speed, neither current nor power, or more than one spindle and ``component`` is None.

    Notes
    -----
    A row is written where the current (or the power) is reported; the other columns have their last value. Rows with
    a column that is not yet known or is unavailable are omitted, with a finding ``mtconnect-unavailable``.
    """
    found = list(_events(source, device, component))
    if not found:
        raise InputError(f"MTConnect {source}: no sample of a spindle: its speed and its current or power are needed")
    known = {column for _, _, column, value in found if value is not None}
    load = next((c for c in ("current_a", "power_w") if c in known), None)
    if load is None or "speed_rpm" not in known:
        missing = "speed (RotaryVelocity)" if load is not None else "current (Amperage) or power (Wattage)"
        raise InputError(f"MTConnect {source}: no sample of the spindle's {missing}: add it to the agent's device file")
    log, omitted = log_text(found, COLUMNS, f"MTConnect {source}")
    text = f"{omitted} samples are left out: a column is not yet known or unavailable, or time does not rise"
    return log, [Finding("mtconnect-unavailable", 0, text)] if omitted else []


def _events(source: str, device: str | None, component: str | None) -> Iterator[Sample]:
    """Time [s], sequence, column and value of each sample of the spindle and of the path."""
    spindles: set[str] = set()
    first = True
    for root in _answers(source):
        found = list(events_of(root, source, device, component, spindles))
        if first and any(column == "line" for _, _, column, _ in found):
            # before its first event no line runs
            yield min(at for at, *_ in found), -1, "line", 0.0
            first = False
        yield from found


def events_of(
    root: Element, source: str, device: str | None, component: str | None, spindles: set[str]
) -> Iterator[Sample]:
    """Time [s], sequence, column and value of each sample of the spindle and of the path in a document.

    Parameters
    ----------
    source, device, component : as :func:`samples`
    spindles : names of those that were found, which grows
    """
    for stream in (e for e in root.iter() if _kind(e) == "DeviceStream"):
        if device is not None and stream.get("name") != device:
            continue
        for part in (e for e in stream if _kind(e) == "ComponentStream"):
            names = {part.get("name"), part.get("componentId"), part.get("component")} - {None}
            items = [i for group in part if _kind(group) == "Samples" for i in group if _kind(i) in TYPES]
            items = [i for i in items if i.get("subType") not in WANTED]
            turning = part.get("component") in TURNING
            if turning and component is not None and component not in names:
                continue
            if turning and any(TYPES[_kind(i)][0] == "speed_rpm" for i in items):
                spindles.add(str(part.get("name") or part.get("componentId")))
                if component is None and len(spindles) > 1:
                    names_of = ", ".join(sorted(spindles))
                    raise InputError(f"MTConnect {source}: spindles {names_of}: state --component, one of them")
            for item in items:
                column, factor = TYPES[_kind(item)]
                if turning or part.get("component") == "Path":
                    yield _time(item, source), _whole(item, "sequence"), column, _value(item, factor)
            for item in (i for group in part if _kind(group) == "Events" for i in group if _kind(i) in EVENTS):
                column, value = EVENTS[_kind(item)], _value(item, 1.0)
                if item.get("subType") in USED and (column == "line" or value is not None):
                    yield _time(item, source), _whole(item, "sequence"), column, value or 0.0


def _answers(source: str) -> Iterator[Element]:
    """Documents with streams: the file, or all of an agent's buffer, answer by answer."""
    root = document(source, "sample", f"?count={COUNT}")
    for _ in range(ANSWERS):
        yield root
        header = next((e for e in root if _kind(e) == "Header"), None)
        following, last = (_whole(header, k) if header is not None else 0 for k in ("nextSequence", "lastSequence"))
        if not source.startswith("http") or following > last:
            return
        root = document(source, "sample", f"?from={following}&count={COUNT}")


def header_of(root: Element) -> tuple[int, int]:
    """Return the instance of the agent of a document with streams, and the number of its next sample."""
    header = next((e for e in root if _kind(e) == "Header"), None)
    if header is None:
        raise InputError("MTConnect: the answer has no Header: not a document with streams")
    return _whole(header, "instanceId"), _whole(header, "nextSequence")


def _whole(element: Element, key: str) -> int:
    """Return a whole number of an attribute, 0 where it is missing.

    Raises
    ------
    InputError
        It is another text, or has more than 18 digits.
    """
    text = element.get(key, "0")
    if not (text.isascii() and text.isdigit() and len(text) <= 18):
        raise InputError(f"MTConnect: {_kind(element)} {key} = {text[:40]!r}: must be a whole number from 0")
    return int(text)


def _time(item: Element, source: str) -> float:
    text = item.get("timestamp", "")
    try:
        return datetime.fromisoformat(text).timestamp()
    except (ValueError, OverflowError, OSError):
        raise InputError(f"MTConnect {source}: timestamp {text[:60]!r}: must be a date and time of ISO 8601") from None


def _value(item: Element, factor: float) -> float | None:
    """The value of an element times ``factor``; None: unavailable."""
    try:
        value = factor * float((item.text or "").strip())
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _kind(element: Element) -> str:
    """The name of an element without its namespace."""
    return element.tag.rsplit("}", 1)[-1]


def _own(part: Element) -> Iterator[Element]:
    """Elements of a component, without those of the components inside it."""
    waiting = [child for child in reversed(part) if _kind(child) != "Components"]
    while waiting:
        element = waiting.pop()
        yield element
        waiting += [child for child in reversed(element) if _kind(child) != "Components"]


def _limits(part: Element, types: tuple[str, ...]) -> tuple[float | None, float | None]:
    """Least and greatest value of the types of data that a component states, as constraint or specification."""
    low: float | None = None
    high: float | None = None
    for item in _own(part):
        if _kind(item) not in ("DataItem", "Specification") or item.get("type") not in types:
            continue
        for bound in item.iter():
            if _kind(bound) in ("Minimum", "Maximum"):
                value = _value(bound, 1.0)
                low = value if _kind(bound) == "Minimum" and low is None else low
                high = value if _kind(bound) == "Maximum" and high is None else high
    return low, high
