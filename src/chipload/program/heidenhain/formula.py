"""Q parameters and formulas of conversational programs.

Notation: Qn, QLn (of one program) and QRn (kept) are numbers; what the controller would put into one (SYSREAD, a probe)
is not known and never guessed, nor is what is calculated from it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping

from chipload.errors import InputError

#: numbers of Q parameters; QL0 is kept as number 10000, QR0 as 20000
LAST_Q = 2000
FIRST = {"Q": 0, "QL": 10_000, "QR": 20_000}
#: nesting of a formula, and its largest result
DEPTH, LARGEST = 40, 1e15
_Q = re.compile(r"(Q[LR]?)\s*(\d+)")
_TOKEN = re.compile(r"\s*(?:(\d+\.?\d*|\.\d+)|(Q[LR]?)\s*(\d+)|([A-Z]+)|([-+*/^()]))")


class NotKnownError(InputError):
    """A value that only the controller, or the operator, knows: the block that needs it is left out."""


def q_number(letters: str, digits: str) -> int:
    """The number under which a parameter is kept.

    >>> q_number("Q", "5"), q_number("QL", "5")
    (5, 10005)
    """
    if len(digits) > 9 or int(digits) >= LAST_Q:
        raise InputError(f"{letters}{digits[:12]}: must be from {letters}0 to {letters}{LAST_Q - 1}")
    return FIRST[letters] + int(digits)


def q_name(number: int) -> str:
    """The name of a parameter.

    >>> q_name(10005)
    'QL5'
    """
    letters = max(FIRST, key=lambda x: (FIRST[x] <= number, FIRST[x]))
    return f"{letters}{number - FIRST[letters]}"


def _sign(x: float) -> float:
    return math.copysign(1.0, x) if x else 0.0


#: functions of a formula; angles are in degrees
FUNCTIONS: Mapping[str, Callable[[float], float]] = {
    "SIN": lambda x: math.sin(math.radians(x)),
    "COS": lambda x: math.cos(math.radians(x)),
    "TAN": lambda x: math.tan(math.radians(x)),
    "ASIN": lambda x: math.degrees(math.asin(x)),
    "ACOS": lambda x: math.degrees(math.acos(x)),
    "ATAN": lambda x: math.degrees(math.atan(x)),
    "SQRT": math.sqrt,
    "SQ": lambda x: x * x,
    "LN": math.log,
    "LOG": math.log10,
    "EXP": math.exp,
    "NEG": lambda x: -x,
    "INT": lambda x: float(math.trunc(x)),
    "ABS": abs,
    "FRAC": lambda x: x - math.trunc(x),
    "SGN": _sign,
}


class QParameters:
    """Q parameters by number; ``given`` are those that are known before the program runs, SYSREAD included."""

    def __init__(self, given: Mapping[int, float]) -> None:
        self.given = dict(given)
        #: parameters that were calculated from one that is not known, and that one
        self.roots: dict[int, int] = {}
        self.values: dict[int, float | None] = dict(given)

    def read(self, number: int) -> float:
        """The value of Q ``number``."""
        if number not in self.values:
            raise InputError(f"{q_name(number)} is read before it is set: set it")
        value = self.values[number]
        if value is None:
            number = self.roots.get(number, number)
            raise NotKnownError(
                f"{q_name(number)} comes from the controller and is not known here: state it in program.parameters"
            )
        return value

    def set(self, number: int, value: float | None) -> None:
        """Put a value into Q ``number``; None: from the controller, unless it was given."""
        self.roots.pop(number, None)
        self.values[number] = self.given.get(number) if value is None else value

    def assign(self, number: int, *formulas: str, by: Callable[..., float] = lambda x: x) -> None:
        """Put the value of formulas into Q ``number``; one that is not known makes it unknown too."""
        try:
            self.set(number, by(*(self.formula(text) for text in formulas)))
        except NotKnownError:
            unknown = [q_number(*found) for text in formulas for found in _Q.findall(text)]
            root = next(k for k in unknown if self.values.get(k, 0.0) is None)
            self.set(number, None)
            self.roots[number] = self.roots.get(root, root)

    def formula(self, text: str) -> float:
        """The value of a formula.

        >>> q = QParameters({4: 10.0})
        >>> q.formula("( Q4 - 2.5 ) / 2.5"), q.formula("-Q4 + 3 * 2 ^ 2"), q.formula("INT -3.7")
        (3.0, 2.0, -3.0)
        """
        tokens, at = [], 0
        body = text.rstrip()
        while at < len(body):
            found = _TOKEN.match(body, at)
            if found is None:
                raise InputError(f"formula {body.strip()!r}: cannot be read at {body[at:].strip()[:12]!r}")
            tokens.append(found)
            at = found.end()
        reader = _Formula(tokens, self)
        value = reader.sum(0)
        if reader.at < len(tokens):
            raise InputError(f"formula {body.strip()!r}: cannot be read at {tokens[reader.at][0].strip()!r}")
        return value


class _Formula:
    """Recursive descent: sums of products of powers of signed values."""

    def __init__(self, tokens: list[re.Match[str]], parameters: QParameters) -> None:
        self.tokens, self.parameters, self.at = tokens, parameters, 0

    def _next(self, signs: str) -> str | None:
        if self.at < len(self.tokens):
            sign = self.tokens[self.at][5]
            if sign is not None and sign in signs:
                self.at += 1
                return sign
        return None

    def sum(self, depth: int) -> float:
        if depth > DEPTH:
            raise InputError(f"formula: nested more than {DEPTH} deep")
        value = self._product(depth)
        while (sign := self._next("+-")) is not None:
            other = self._product(depth)
            value = value + other if sign == "+" else value - other
        return _require_bounded(value)

    def _product(self, depth: int) -> float:
        value = self._power(depth)
        while (sign := self._next("*/")) is not None:
            other = self._power(depth)
            if sign == "/" and other == 0.0:
                raise InputError("formula: division by 0")
            value = _require_bounded(value * other if sign == "*" else value / other)
        return value

    def _power(self, depth: int) -> float:
        value = self._value(depth)
        if self._next("^") is not None:
            exponent = self._power(depth + 1)
            try:
                raised = value**exponent
            except (OverflowError, ZeroDivisionError):
                raise InputError(f"formula: {value:g} ^ {exponent:g} has no value") from None
            if isinstance(raised, complex):
                raise InputError(f"formula: {value:g} ^ {exponent:g} has no value")
            return _require_bounded(raised)
        return value

    def _value(self, depth: int) -> float:
        if depth > DEPTH:
            raise InputError(f"formula: nested more than {DEPTH} deep")
        if (sign := self._next("+-")) is not None:
            value = self._value(depth + 1)
            return -value if sign == "-" else value
        if self._next("(") is not None:
            value = self.sum(depth + 1)
            if self._next(")") is None:
                raise InputError("formula: a bracket is not closed")
            return value
        if self.at >= len(self.tokens):
            raise InputError("formula: a value is missing at its end")
        token = self.tokens[self.at]
        self.at += 1
        if token[1] is not None:
            return _require_bounded(float(token[1]))
        if token[2] is not None:
            return self.parameters.read(q_number(token[2], token[3]))
        if token[4] == "PI":
            return math.pi
        if token[4] in FUNCTIONS:
            argument = self._value(depth + 1)
            try:
                return _require_bounded(FUNCTIONS[token[4]](argument))
            except (ValueError, OverflowError):
                raise InputError(f"formula: {token[4]} {argument:g} has no value") from None
        raise InputError(f"formula: {token[0].strip()!r} stands where a value must be")


def _require_bounded(value: float) -> float:
    if not abs(value) <= LARGEST:
        raise InputError(f"formula: {value:g}: must be at most {LARGEST:g}")
    return value
