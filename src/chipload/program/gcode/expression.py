"""Values in RS-274 text: numbers, parameters, expressions in brackets, functions.

Notation: ``text`` is a block without spaces and comments in lower case, ``at`` the place where reading begins. Binary
operators bind in five steps, each from the left: ``**``; ``* / MOD``; ``+ -``; ``EQ NE GT GE LT LE``; ``AND OR XOR``.
Angles are in degrees, as in the text.

Reference: LinuxCNC 2.9, "G-code overview", parameters and expressions.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable

from chipload.errors import InputError
from chipload.program.gcode.parameters import Parameters

#: deepest nesting of brackets, functions and parameters of parameters
DEEPEST = 60
#: largest magnitude of any value
LARGEST = 1e15
#: two values that differ by less are equal for EQ and NE
EQUAL = 1e-4

_NUMBER = re.compile(r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)")
_NAME = re.compile(r"<([^<>]*)>")
_OPERATOR = re.compile(r"\*\*|\*|/|mod|\+|-|eq|ne|gt|ge|lt|le|and|or|xor")
_FUNCTION = re.compile(r"(abs|acos|asin|atan|cos|exists|exp|fix|fup|ln|round|sin|sqrt|tan)\[")
_STEP = {"**": 5, "*": 4, "/": 4, "mod": 4, "+": 3, "-": 3, "and": 1, "or": 1, "xor": 1}
_STEP.update(dict.fromkeys(("eq", "ne", "gt", "ge", "lt", "le"), 2))


def integer_of(value: float, what: str) -> int:
    """A value that has to be whole, within 0.0001."""
    if not math.isfinite(value):
        raise InputError(f"{what}: must be a whole number, it is {value:g}")
    whole = round(value)
    if abs(value - whole) > 1e-4:
        raise InputError(f"{what} {value:g}: must be a whole number")
    return whole


def read_value(text: str, at: int, parameters: Parameters, depth: int = 0) -> tuple[float, int]:
    """The value that begins at ``at``, and where it ends.

    >>> read_value("[1+2*3**2]y1", 0, Parameters())
    (19.0, 10)
    """
    if depth > DEEPEST:
        raise InputError(f"nested deeper than {DEEPEST}: write it in several blocks")
    first = text[at : at + 1]
    if first == "[":
        return _bracket(text, at + 1, parameters, depth + 1)
    if first == "#":
        return _parameter(text, at + 1, parameters, depth + 1)
    if first == "-":
        value, at = read_value(text, at + 1, parameters, depth + 1)
        return -value, at
    if first == "+":
        return read_value(text, at + 1, parameters, depth + 1)
    number = _NUMBER.match(text, at)
    if number is not None:
        end = number.end()
        if text[end : end + 1] == ".":
            raise InputError(f"number {text[at : end + 1]}...: has two decimal points")
        return _require_finite(float(number[0])), end
    function = _FUNCTION.match(text, at)
    if function is not None:
        return _function(function[1], text, function.end(), parameters, depth + 1)
    if not first:
        raise InputError("the block ends where a value is expected: complete it")
    raise InputError(f"{text[at : at + 12]!r}: a number, #, [ or a function is expected here")


def _require_finite(value: float) -> float:
    if not abs(value) <= LARGEST:
        raise InputError(f"value {value:g}: must be within {LARGEST:g}")
    return value


def read_parameter_key(text: str, at: int, parameters: Parameters, depth: int = 0) -> tuple[int | str, int]:
    """Number or name of the parameter whose ``#`` stands before ``at``, and where it ends."""
    name = _NAME.match(text, at)
    if name is not None:
        if not name[1]:
            raise InputError("#<>: a name is missing")
        return name[1], name.end()
    if text[at : at + 1] == "<":
        raise InputError("#<: the name is not closed by >")
    value, at = read_value(text, at, parameters, depth)
    return integer_of(value, "parameter number"), at


def _parameter(text: str, at: int, parameters: Parameters, depth: int) -> tuple[float, int]:
    key, at = read_parameter_key(text, at, parameters, depth)
    return parameters.read(key), at


def _bracket(text: str, at: int, parameters: Parameters, depth: int) -> tuple[float, int]:
    """Value of an expression whose [ stands before ``at``."""
    values: list[float] = []
    pending: list[str] = []
    while True:
        value, at = read_value(text, at, parameters, depth)
        values.append(value)
        if text[at : at + 1] == "]":
            step, operator, end = 0, "", at + 1
        else:
            found = _OPERATOR.match(text, at)
            if found is None:
                if at >= len(text):
                    raise InputError("an expression is not closed by ]")
                raise InputError(f"{text[at : at + 12]!r}: an operator or ] is expected here")
            operator, end = found[0], found.end()
            step = _STEP[operator]
        while pending and _STEP[pending[-1]] >= step:
            right = values.pop()
            values.append(_require_finite(_apply(pending.pop(), values.pop(), right)))
        if not operator:
            return values[0], end
        pending.append(operator)
        at = end


def _apply(operator: str, a: float, b: float) -> float:
    if operator == "**":
        if a < 0.0 and b != int(b):
            raise InputError(f"{a:g} ** {b:g}: a negative number takes integer powers only")
        if a == 0.0 and b < 0.0:
            raise InputError(f"0 ** {b:g}: has no value")
        try:
            return float(a**b)
        except OverflowError:
            raise InputError(f"{a:g} ** {b:g}: is beyond {LARGEST:g}") from None
    if operator in ("/", "mod") and b == 0.0:
        raise InputError(f"{a:g} {operator} 0: divides by zero")
    return _BINARY[operator](a, b)


def _modulo(a: float, b: float) -> float:
    rest = math.fmod(a, b)
    return rest + abs(b) if rest < 0.0 else rest


_BINARY: dict[str, Callable[[float, float], float]] = {
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "mod": _modulo,
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "eq": lambda a, b: float(abs(a - b) < EQUAL),
    "ne": lambda a, b: float(abs(a - b) >= EQUAL),
    "gt": lambda a, b: float(a > b),
    "ge": lambda a, b: float(a >= b),
    "lt": lambda a, b: float(a < b),
    "le": lambda a, b: float(a <= b),
    "and": lambda a, b: float(a != 0.0 and b != 0.0),
    "or": lambda a, b: float(a != 0.0 or b != 0.0),
    "xor": lambda a, b: float((a != 0.0) != (b != 0.0)),
}


def _round_half_up(x: float) -> float:
    return math.copysign(math.floor(abs(x) + 0.5), x) if abs(x) < 2.0**52 else x


def _within_one(name: str, f: Callable[[float], float]) -> Callable[[float], float]:
    def call(x: float) -> float:
        if not -1.0 <= x <= 1.0:
            raise InputError(f"{name}[{x:g}]: the argument must be from -1 to 1")
        return math.degrees(f(x))

    return call


def _positive(name: str, f: Callable[[float], float], least: str) -> Callable[[float], float]:
    def call(x: float) -> float:
        if x < 0.0 or (x == 0.0 and least == "above 0"):
            raise InputError(f"{name}[{x:g}]: the argument must be {least}")
        return f(x)

    return call


def _exp(x: float) -> float:
    try:
        return math.exp(x)
    except OverflowError:
        raise InputError(f"EXP[{x:g}]: is beyond {LARGEST:g}") from None


_UNARY: dict[str, Callable[[float], float]] = {
    "abs": abs,
    "acos": _within_one("ACOS", math.acos),
    "asin": _within_one("ASIN", math.asin),
    "cos": lambda x: math.cos(math.radians(x)),
    "exp": _exp,
    "fix": lambda x: float(math.floor(x)),
    "fup": lambda x: float(math.ceil(x)),
    "ln": _positive("LN", math.log, "above 0"),
    "round": _round_half_up,
    "sin": lambda x: math.sin(math.radians(x)),
    "sqrt": _positive("SQRT", math.sqrt, "0 or more"),
    "tan": lambda x: math.tan(math.radians(x)),
}


def _function(name: str, text: str, at: int, parameters: Parameters, depth: int) -> tuple[float, int]:
    """Value of a function whose [ stands before ``at``."""
    if name == "exists":
        if text[at : at + 1] != "#":
            raise InputError("EXISTS[...]: a parameter #<name> is expected in it")
        key, at = read_parameter_key(text, at + 1, parameters, depth)
        if text[at : at + 1] != "]":
            raise InputError("EXISTS[...]: is not closed by ] after the parameter")
        return float(parameters.exists(key)), at + 1
    x, at = _bracket(text, at, parameters, depth)
    if name != "atan":
        return _require_finite(_UNARY[name](x)), at
    if text[at : at + 2] != "/[":
        raise InputError("ATAN[y]: /[x] is missing after it")
    y, at = _bracket(text, at + 2, parameters, depth)
    return math.degrees(math.atan2(x, y)), at
