"""The parser of CL data, which returns records.

Notation: WORD/arg,arg,... is a record, a word with arguments. At a ``$`` it goes on on the next line; what follows that
and what follows ``$$`` is a comment. Blanks around words and numbers do not count, nor do small letters; the text of
PARTNO, PPRINT and INSERT is kept as it stands. ``$$->`` begins a comment that a CAM system writes for its
postprocessors.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass

from chipload.errors import InputError

#: longest text [characters]
LONGEST_TEXT = 500_000_000
#: longest record [characters], the lines that it goes on over together
LONGEST_RECORD = 10_000
#: greatest number in a record
LARGEST_NUMBER = 1e9
#: words whose argument is a text
TEXT_WORDS = ("PARTNO", "PPRINT", "INSERT", "TPRINT", "REMARK", "LETTER", "OPFEATSTART", "OPFEATEND")
#: word of a comment that carries data of a CAM system, which may go on on the next line as records do
NOTE = "$$->"

_TEXT = re.compile(rf"\s*({'|'.join(TEXT_WORDS)})(?:\s*/|\s+|$)(.*)", re.IGNORECASE)
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[EeDd][+-]?[0-9]{1,4})?")
_SHOWN = 80


@dataclass(frozen=True)
class AptRecord:
    """One record: ``word`` in capitals, ``args`` in capitals without blanks (or the one text), ``line`` from 1."""

    word: str
    args: tuple[str, ...]
    line: int

    def __str__(self) -> str:
        text = self.word + ("/" + ",".join(self.args) if self.args else "")
        return text if len(text) <= _SHOWN else text[: _SHOWN - 3] + "..."

    def error(self, what: str) -> InputError:
        """Error about this record, for the caller to raise."""
        return InputError(f"line {self.line}: {self}: {what}")

    def number(self, k: int) -> float:
        """Argument ``k`` as a number."""
        if k >= len(self.args):
            raise self.error(f"must have at least {k + 1} numbers")
        value = number(self.args[k])
        if value is None:
            raise self.error(f"{self.args[k][:_SHOWN]!r} must be a number of at most {LARGEST_NUMBER:g}")
        return value

    def numbers(self, *counts: int) -> tuple[float, ...]:
        """All arguments as numbers, their number one of ``counts`` (empty: any number)."""
        if counts and len(self.args) not in counts:
            raise self.error(f"has {len(self.args)} numbers: must have {' or '.join(map(str, counts))}")
        return tuple(self.number(k) for k in range(len(self.args)))


def number(text: str) -> float | None:
    """A number of CL data, None where the text is none or out of bounds.

    >>> number("-12."), number(".5D-3"), number("1E400"), number("CLW")
    (-12.0, 0.0005, None, None)
    """
    if len(text) > _SHOWN or _NUMBER.fullmatch(text) is None:
        return None
    value = float(text.upper().replace("D", "E"))
    return value if math.isfinite(value) and abs(value) <= LARGEST_NUMBER else None


def records(text: str) -> Iterator[AptRecord]:
    r"""The records of a text, in order.

    Raises
    ------
    InputError
        The text or a record is too long.

    >>> [str(one) for one in records("GOTO / 1., 2., $\n 3. $$ top\nPARTNO a, b\n$$ nothing\nrapid")]
    ['GOTO/1.,2.,3.', 'PARTNO/a, b', 'RAPID']
    """
    if len(text) > LONGEST_TEXT:
        raise InputError(f"CL data of {len(text)} characters: must be at most {LONGEST_TEXT}: split it")
    begun, first, noted = "", 0, False
    for line, whole in enumerate(text.splitlines(), start=1):
        if noted or (not begun and whole.lstrip().startswith(NOTE)):
            if not noted:
                yield AptRecord(NOTE, (whole.strip()[len(NOTE) :].strip(),), line)
            noted = whole.rstrip().endswith("$")
            continue
        as_text = None if begun else _TEXT.fullmatch(whole)
        if as_text is not None:
            yield AptRecord(as_text[1].upper(), (as_text[2].strip(),), line)
            continue
        statement, comment, _ = whole.partition("$$")
        statement, more, _ = statement.partition("$")
        first = first or line
        begun += statement
        if len(begun) > LONGEST_RECORD:
            raise InputError(f"line {first}: a record of more than {LONGEST_RECORD} characters: must be shorter")
        if more or (begun.strip() and comment and not statement.strip()):
            continue
        record = _record(begun, first)
        begun, first = "", 0
        if record is not None:
            yield record
    record = _record(begun, first)
    if record is not None:
        yield record


def _record(text: str, line: int) -> AptRecord | None:
    word, slash, rest = text.upper().partition("/")
    word = "".join(word.split())
    if not word and not slash:
        return None
    args = [" ".join(arg.split()) for arg in rest.split(",")]
    while args and not args[-1]:
        args.pop()
    return AptRecord(word, tuple(args), line)
