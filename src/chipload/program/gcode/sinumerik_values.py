"""Values of a Sinumerik: R parameters, names, fields of names, functions, DIV and MOD, and texts that stand for others.

Notation: R5 is stored as #5, a name as #<_name>, an element of a field as the name ``_field[2]``. In the text of a
value DIV and MOD are written :data:`DIV` and :data:`MOD`, as a value ends before a blank.

Reference: Siemens, SINUMERIK 840D sl Programming Manual Job Planning, "User variables", "Arithmetic functions".
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from chipload.errors import InputError
from chipload.program.gcode.dialect import NotReadError
from chipload.program.gcode.expression import integer_of, read_value
from chipload.program.gcode.sinumerik_words import FUNCTIONS

if TYPE_CHECKING:
    from chipload.program.gcode.controller import Controller

DIV, MOD = "\\", "%"
#: elements of one field
MOST_ELEMENTS = 10_000
_R = re.compile(r"R([0-9]+)(?![0-9A-Z_])")
_NAMED = re.compile(r"[A-Z_$][A-Z0-9_$]*")
_ELEMENT = re.compile(r"([A-Z_$][A-Z0-9_$]*)\[([^\[\]]*)\]")
_CALL = re.compile(r"(?<![A-Z0-9_$])(TRUNC|ROUND|POT|ATAN2|MINVAL|MAXVAL|BOUND)\(")
_BLANKS = re.compile(r"([A-Z_$][A-Z0-9_$]+|[0-9.)\]])[ \t]*([-+*/])[ \t]+(?=[A-Z0-9_$.(])")
_WHOLE = re.compile(r"[ \t]+(DIV|MOD)[ \t]+")
_SIDE = r"((?:[0-9.]+|#[0-9]+|\([^()]*\)))"
_DIVIDED = re.compile(rf"{_SIDE}{re.escape(DIV)}{_SIDE}")
#: DEF names
_DEFINED = re.compile(r"\s*([A-Z_][A-Z0-9_]*)\s*(?:\[([0-9]+)(?:\s*,\s*[0-9]+)*\])?\s*(?:=\s*(.*))?\Z", re.DOTALL)
_FUNCTIONS: Mapping[str, tuple[int, Callable[..., float]]] = {
    "TRUNC": (1, lambda x: float(math.trunc(x))),
    "ROUND": (1, lambda x: math.copysign(math.floor(abs(x) + 0.5), x)),
    "POT": (1, lambda x: x * x),
    "ATAN2": (2, lambda y, x: math.degrees(math.atan2(y, x))),
    "MINVAL": (2, min),
    "MAXVAL": (2, max),
    "BOUND": (3, lambda low, high, x: min(max(x, low), high)),
}
_CONSTANTS = {"TRUE": "1", "FALSE": "0"}


def without_blanks(body: str) -> str:
    r"""A block whose values have no blanks around their operators.

    >>> without_blanks("R1 = R2 + 5 X=DEPTH - 1 R3=7 DIV 2"), without_blanks("G1 X5 Y -3")
    ('R1 = R2+5 X=DEPTH-1 R3=7\\2', 'G1 X5 Y -3')
    """
    if "=" not in body and "(" not in body:
        return body
    body = _WHOLE.sub(lambda hit: DIV if hit[1] == "DIV" else MOD, body)
    return _BLANKS.sub(r"\1\2", body)


def value_of(text: str, c: Controller) -> float:
    """Value of an expression with R parameters, names and ( ).

    Raises
    ------
    NotReadError
        Nothing gives a name of it a value.
    InputError
        It is no expression.
    """
    plain = _with_functions(_with_elements(_R.sub(r"#\1", "".join(text.split())), c), c)
    while (found := _DIVIDED.search(plain)) is not None:
        below = value_of(found[2], c)
        if below == 0.0:
            raise InputError(f"{text!r}: divides by zero")
        plain = plain[: found.start()] + _number(math.trunc(value_of(found[1], c) / below)) + plain[found.end() :]
    if _NAMED.sub("", plain) != plain:
        for name in _NAMED.findall(plain):
            if name in FUNCTIONS:
                continue
            if name in _CONSTANTS:
                plain = re.sub(rf"(?<![A-Z0-9_]){name}(?![A-Z0-9_])", _CONSTANTS[name], plain)
                continue
            if f"_{name.lower()}" not in c.parameters.shared:
                raise NotReadError(f"{name}: its value is not known")
            plain = re.sub(rf"(?<![A-Z0-9_]){re.escape(name)}(?![A-Z0-9_])", f"#<_{name.lower()}>", plain)
    plain = plain.replace("(", "[").replace(")", "]").replace(MOD, "mod").lower()
    value, end = read_value(f"[{plain}]", 0, c.parameters)
    if end != len(plain) + 2:
        raise InputError(f"{text!r}: cannot be read as a value")
    return value


def element(name: str, index: str, c: Controller) -> int | str:
    """Key of an element of a field, or of R[ ]."""
    places = [integer_of(value_of(x, c), f"{name}[ ]") for x in index.split(",")]
    if name == "R" and len(places) == 1:
        return places[0]
    key = f"_{name.lower()}[{','.join(map(str, places))}]"
    if key not in c.parameters.shared and not any(x.startswith(f"_{name.lower()}[") for x in c.parameters.shared):
        raise NotReadError(f"{name}[{index}]: is no field that DEF has made")
    return key


def define(names: str, c: Controller) -> None:
    """DEF REAL, INT and BOOL: names and fields with their values, 0 without one."""
    for part in _parts(names):
        found = _DEFINED.match(part)
        if found is None:
            c.once("nc-ignored", f"DEF: {part.strip()[:40]}: is not read")
        elif found[2] is None:
            c.parameters.assign(f"_{found[1].lower()}", value_of(found[3], c) if found[3] else 0.0)
        else:
            count, listed = int(found[2]), (found[3] or "").strip().removeprefix("SET").strip().strip("()")
            if count > MOST_ELEMENTS or "," in part[: part.index("]")]:
                raise NotReadError(f"DEF {found[1]}[{found[2]}]: a field has one index and at most {MOST_ELEMENTS}")
            values = [value_of(x, c) for x in listed.split(",") if x.strip()]
            for k in range(count):
                c.parameters.assign(f"_{found[1].lower()}[{k}]", values[k] if k < len(values) else 0.0)


def _parts(text: str) -> list[str]:
    """Parts of a list that commas outside of brackets separate."""
    out, depth = [""], 0
    for character in text:
        depth += {"(": 1, "[": 1, ")": -1, "]": -1}.get(character, 0)
        if character == "," and depth == 0:
            out.append("")
        else:
            out[-1] += character
    return [part for part in out if part.strip()]


def _number(value: float) -> str:
    """A number as a value of the text holds it."""
    return f"({value:.15f})"


def _with_elements(plain: str, c: Controller) -> str:
    while (found := _ELEMENT.search(plain)) is not None:
        key = element(found[1], found[2], c)
        plain = plain[: found.start()] + _number(c.parameters.read(key)) + plain[found.end() :]
    return plain


def _with_functions(plain: str, c: Controller) -> str:
    """Values in place of the functions that RS-274 does not have."""
    while (found := _CALL.search(plain)) is not None:
        depth, end = 1, found.end()
        while end < len(plain) and depth > 0:
            depth += {"(": 1, ")": -1}.get(plain[end], 0)
            end += 1
        count, f = _FUNCTIONS[found[1]]
        operands = [value_of(x, c) for x in _parts(plain[found.end() : end - 1])]
        if len(operands) != count:
            raise InputError(f"{found[1]}: has {count} arguments, not {len(operands)}")
        plain = plain[: found.start()] + _number(f(*operands)) + plain[end:]
    return plain
