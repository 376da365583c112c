"""The order in which blocks are carried out: O-words, subroutines, files that are called, and the end.

Notation: ``line`` counts from 0 in its source. A call keeps where it came from. Blocks are counted, with those of calls
and loops, so that every text ends.

Reference: LinuxCNC 2.9, "O Codes".
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from chipload.errors import InputError
from chipload.files import decode_text, is_file, read_regular
from chipload.program.gcode.dialect import Dialect, NotReadError
from chipload.program.gcode.expression import integer_of, read_value
from chipload.program.gcode.interpreter import BlockInterpreter
from chipload.program.gcode.macros import block_number, call_macro
from chipload.program.gcode.modal import COVET, has_axes
from chipload.program.gcode.parameters import LOCAL
from chipload.program.gcode.plain import run_plain
from chipload.program.gcode.sinumerik_calls import call_program
from chipload.program.gcode.source import KEYWORDS, OWord, Source, read_source
from chipload.program.gcode.track import BoundError
from chipload.program.gcode.unreached import note_unreached
from chipload.program.gcode.words import Block, MacroCall, bare

#: calls within calls
DEEPEST_CALL = 10
#: largest file that is called [bytes]
LARGEST_FILE = 50_000_000
#: files that a text may call
MOST_FILES = 1000
#: repeats of a loop or a call that are taken at all
MOST_REPEATS = 1_000_000_000


@dataclass
class _Call:
    source: Source
    back: int
    label: str
    loops: dict[int, int]
    local: bool
    left: int
    first: int
    macro: bool = False


class Flow:
    """Runs a text on an interpreter.

    Parameters
    ----------
    source : the main text
    folder : the one folder that called files may lie in; None: no files
    most_blocks : blocks that may be carried out
    progress : called with the part of the main text that is done
    lenient : a block that cannot be read is a finding; else it refuses the text
    """

    def __init__(
        self,
        interpreter: BlockInterpreter,
        source: Source,
        dialect: Dialect,
        folder: Path | None,
        most_blocks: int,
        progress: Callable[[float, str], None],
        lenient: bool = False,
    ):
        self.i = interpreter
        self.c = interpreter.c
        self.main = source
        self.source = source
        self.dialect = dialect
        self.folder = folder
        self.most_blocks = most_blocks
        self.progress = progress
        self.lenient = lenient
        self.blocks = 0
        self.line = 0
        self._calls: list[_Call] = []
        self._loops: dict[int, int] = {}
        self._files: dict[str, Source | None] = {}
        self._opened = False
        #: whether each line of the main text has been carried out
        self._reached = bytearray(len(source.lines))

    def run(self) -> None:
        """Carry out blocks until the program ends."""
        try:
            self.line = self.dialect.begins_at(self.main.lines)
            self._opened = self._percent()
            report = 0
            while self._step_or_finding():
                if self.blocks - report >= 4096 or self.blocks < report:
                    report = self.blocks
                    self.c.track.spill()
                    self.progress(min(1.0, self.line / max(1, len(self.main.lines))), "reading")
            if self.lenient:
                note_unreached(self.c, self.main.lines, self._reached, self.line if self.source is self.main else None)
        except InputError as error:
            raise InputError(f"{self.source.name}: line {self.line + 1}: {error}") from None

    def _step_or_finding(self) -> bool:
        """Carry out the next blocks; where ``lenient``, a block that cannot be read is a finding and left out."""
        if not self.lenient:
            return self._step()
        used_up = self.line >= len(self.source.lines)
        try:
            return self._step()
        except BoundError:
            raise
        except InputError as error:
            self.c.leave_out("nc-not-read", f"{error}: the block is left out")
            self.c.placed = set()
            self.line += 1
            return not used_up and self.line <= len(self.source.lines)

    def _reach(self, begin: int, end: int) -> None:
        """Note that lines of the main text are carried out."""
        if self.source is self.main:
            self._reached[begin:end] = b"\1" * (end - begin)

    def _percent(self) -> bool:
        for line in range(self.line, len(self.main.lines)):
            text = self.main.lines[line].strip()
            if text:
                if text == "%":
                    self.line = line + 1
                    return True
                return False
        return False

    def _step(self) -> bool:
        """Carry out the next blocks; whether there are more."""
        lines = self.source.lines
        if self.line >= len(lines):
            return self._end()
        if self.dialect.plain:
            begin = self.line
            self.line, done = run_plain(self.c, self.i.motion, lines, begin)
            self.blocks += done
            self._reach(begin, self.line)
            if self.line >= len(lines):
                return self._end()
        self.blocks += 1
        if self.blocks > self.most_blocks:
            raise BoundError(f"more than {self.most_blocks} blocks: a loop does not end, or most_blocks must be raised")
        raw = lines[self.line]
        self.c.line = self.line + 1
        self._reach(self.line, self.line + 1)
        word = self.source.words.get(self.line)
        if word is not None:
            self._check_length(raw)
            for text in bare(raw)[1]:
                self.i.comment(text)
            return self._o_word(word)
        stripped = raw.strip()
        if not stripped:
            self.line += 1
            return True
        if stripped == "%":
            if not self._opened:
                self._lone_percent()
            self.i.finish()
            return False
        self._check_length(raw)
        return self._line(raw)

    def _line(self, raw: str) -> bool:
        """Carry out the blocks of a line; whether there are more."""
        source, line = self.source, self.line
        *first, last = self.dialect.blocks_of(raw, self.c)
        for block in first:
            if not self._block(block):
                return False
            if self.source is not source or self.line != line + 1:
                self.c.leave_out("nc-end-of-block", f"{last.strip()[:60]!r}: stands behind a jump or a call: left out")
                return True
            self.line = line
        return self._block(last)

    def _lone_percent(self) -> None:
        """A % that ends a text without one at its beginning.

        LinuxCNC 2.9 carries out all motions before it and stops with an error; what stands behind it is lost.
        """
        message = "%: ends a text that begins with %, and this one does not"
        text_follows = any(text.strip() for text in self.source.lines[self.line + 1 :])
        remedy = "remove it" if text_follows else "write M2 in its place"
        if self.dialect.strict:
            raise InputError(f"{message}: {remedy}")
        if text_follows:
            self.c.refused("nc-percent", f"{message}: the lines after it are left out: {remedy}")
        else:
            self.c.findings.add(
                "nc-percent", self.c.line, f"{message}: the motions end here, the spindle goes on: {remedy}"
            )

    def _check_length(self, raw: str) -> None:
        longest = self.c.control.text.longest_line
        if longest and len(raw.rstrip("\r")) > longest:
            message = f"{len(raw)} characters: a line has at most {longest}"
            if self.dialect.strict:
                raise InputError(message)
            self.c.leave_out("nc-long-line", message)

    def _block(self, raw: str) -> bool:
        if self.dialect.jump(self, raw):
            return True
        try:
            block = self.dialect.read(raw, self.c)
            if block is None:
                self.line += 1
                return True
            for key, value in block.sets:
                self.c.parameters.assign(key, value)
            ends = self.i.execute(block)
            for more in block.after:
                self.i.execute(more)
        except NotReadError as error:
            if self.dialect.strict:
                raise
            self.c.leave_out("nc-not-read", f"{error}: the block is left out")
            self.line += 1
            return True
        self.line += 1
        if ends:
            return False
        if block.macro is not None and block.macro.modal:
            self.c.modal_macro = block.macro, self.c.level
        elif block.macro is not None:
            self._macro(block.macro)
        elif self.c.modal_macro is not None and self.c.modal_macro[1] == self.c.level and self._moves_axis(block):
            self._macro(self.c.modal_macro[0])
        elif self.c.modal_program is not None and self.c.modal_program[3] == self.c.level and self._moves_axis(block):
            self._program(*self.c.modal_program[:3])
        elif block.block_call:
            self._call_block(block.block_call)
        elif block.program_call is not None:
            self._program(*block.program_call, block.arguments)
        elif 98 in block.m:
            self._call_number(block.words)
        elif 99 in block.m:
            return self._return_number(block.returns_to)
        return True

    def _macro(self, call: MacroCall) -> None:
        try:
            call_macro(self, call)
        except NotReadError as error:
            self.c.leave_out("nc-not-read", f"{error}: the block is left out")

    def _program(self, name: str, times: int, arguments: list[float | None]) -> None:
        try:
            call_program(self, name, times, arguments)
        except NotReadError as error:
            if self.dialect.strict:
                raise
            self.c.leave_out("nc-call", f"{error}: the call is left out")

    def _moves_axis(self, block: Block) -> bool:
        """Whether a block moves an axis, so that a modal macro is called behind it."""
        return has_axes(block) and not self.c.left_out and COVET.isdisjoint(block.g)

    def _end(self) -> bool:
        """The lines are used up."""
        self.line = len(self.source.lines) - 1
        if self._calls:
            message = f"the text ends within o{self._calls[-1].label}: endsub or M99 is missing"
            if not self.lenient:
                raise InputError(message)
            self.c.leave_out("nc-no-end", message)
            self.i.finish()
            return False
        if self.dialect.strict:
            raise InputError("the text ends without M2, M30 or %: write M2 as its last block")
        self.c.leave_out("nc-no-end", "the text ends without M2 or M30: it may be truncated")
        self.i.finish()
        return False

    # -- values ----------------------------------------------------------------------------------------------------

    def _bracket(self, text: str, word: OWord) -> tuple[float, str]:
        if not text.startswith("["):
            raise InputError(f"o{word.label} {word.keyword}: [ is missing after it")
        value, end = read_value(text, 0, self.c.parameters)
        return value, text[end:]

    def _condition(self, word: OWord) -> float:
        value, rest = self._bracket(word.rest, word)
        if rest:
            raise InputError(f"{rest[:12]!r}: nothing may follow an O-word but a comment")
        return value

    def _ignore_word(self, word: OWord) -> None:
        if word.rest:
            raise InputError(f"{word.rest[:12]!r}: nothing may follow an O-word but a comment")

    # -- O-words ---------------------------------------------------------------------------------------------------

    def _o_word(self, word: OWord | str) -> bool:
        if isinstance(word, str):
            raise InputError(word)
        if word.keyword == "dynamic":
            word = self._calculated_word(word)
        source, line, key = self.source, self.line, word.key
        match word.keyword:
            case "":
                self.line += 1
            case "sub":
                end = source.after(line, key, ("endsub",))
                for other in range(line + 1, end):
                    if other in source.words and source.keyword(other) == "sub":
                        raise InputError(f"o{word.label} sub: another sub begins on line {other + 1} before its endsub")
                self.line = end + 1
            case "call":
                self._call(word)
            case "return" | "endsub":
                self._return(word)
            case "if":
                self._choose(word, line)
            case "else" | "elseif":
                source.before(line, key, ("if",))
                self.line = source.after(line, key, ("endif",)) + 1
            case "endif":
                source.before(line, key, ("if",))
                self._ignore_word(word)
                self.line += 1
            case "do":
                self._ignore_word(word)
                self.line += 1
            case "while":
                self._while(word)
            case "endwhile":
                self.line = source.before(line, key, ("while",))
            case "repeat":
                self._repeat(word)
            case "endrepeat":
                head = source.before(line, key, ("repeat",))
                if head not in self._loops:
                    raise InputError(f"o{word.label} endrepeat: repeat on line {head + 1} was not carried out")
                self._loops[head] -= 1
                self.line = head + 1 if self._loops[head] > 0 else line + 1
            case _:
                self._leave_loop(word)
        return True

    def _calculated_word(self, word: OWord) -> OWord:
        value, at = read_value(word.rest, 0, self.c.parameters)
        label = str(integer_of(value, "O"))
        for keyword in KEYWORDS:
            if word.rest.startswith(keyword, at):
                if keyword != "call":
                    raise InputError(f"o[...] {keyword}: a calculated label goes with call only")
                return OWord(label, keyword, word.rest[at + len(keyword) :].replace("(", ""), (word.key[0], label))
        raise InputError(f"o{label}: no keyword of an O-word follows the label")

    def _choose(self, word: OWord, line: int) -> None:
        holds = self._condition(word) != 0.0
        while not holds:
            line = self.source.after(line, word.key, ("elseif", "else", "endif"))
            other = self.source.words[line]
            assert isinstance(other, OWord)
            if other.keyword != "elseif":
                break
            self.line = line
            holds = self._condition(other) != 0.0
        self.line = line + 1

    def _is_tail(self, line: int, key: tuple[str, str]) -> int:
        """Line of the ``do`` that a ``while`` closes, -1 where it opens a loop."""
        try:
            other = self.source.before(line, key, ("do", "while", "endwhile"))
        except InputError:
            return -1
        return other if self.source.keyword(other) == "do" else -1

    def _while(self, word: OWord) -> None:
        line = self.line
        head = self._is_tail(line, word.key)
        if head >= 0:
            self.line = head + 1 if self._condition(word) != 0.0 else line + 1
        elif self._condition(word) != 0.0:
            self.line += 1
        else:
            self.line = self.source.after(line, word.key, ("endwhile",)) + 1

    def _repeat(self, word: OWord) -> None:
        count = self._condition(word)
        if count > MOST_REPEATS:
            raise InputError(f"repeat [{count:g}]: must be at most {MOST_REPEATS}")
        if round(count) <= 0:
            self.line = self.source.after(self.line, word.key, ("endrepeat",)) + 1
            return
        self._loops[self.line] = round(count)
        self.line += 1

    def _leave_loop(self, word: OWord) -> None:
        """``break`` and ``continue``."""
        self._ignore_word(word)
        source, line, key = self.source, self.line, word.key
        head = source.before(line, key, ("while", "do", "repeat"))
        if source.keyword(head) == "repeat":
            raise InputError(f"o{word.label} {word.keyword}: belongs to while and do; line {head + 1} is a repeat")
        opens = source.keyword(head) == "do" or self._is_tail(head, key) < 0
        if not opens:
            raise InputError(f"o{word.label} {word.keyword}: while or do is missing before it")
        tail = source.after(line, key, ("while",) if source.keyword(head) == "do" else ("endwhile",))
        if word.keyword == "break":
            self.line = tail + 1
        else:
            self.line = tail if source.keyword(head) == "do" else head

    # -- calls -----------------------------------------------------------------------------------------------------

    def _find(self, label: str) -> tuple[Source, int]:
        for source in (self.source, self.main):
            if label in source.subs:
                return source, source.subs[label]
        source_or_none = self._file(label)
        if source_or_none is not None and label in source_or_none.subs:
            return source_or_none, source_or_none.subs[label]
        where = "this text" if self.folder is None else f"this text and {label}.ngc beside it"
        raise InputError(f"o{label} call: there is no o{label} sub in {where}")

    def _file(self, label: str) -> Source | None:
        return self.subprogram_source(label, (".ngc",))

    def subprogram_source(self, label: str, endings: tuple[str, ...]) -> Source | None:
        """The file of a subprogram beside the text; None: there is none."""
        if self.folder is None or not label.replace("_", "").replace("-", "").isalnum():
            return None
        if label not in self._files:
            if len(self._files) >= MOST_FILES:
                raise BoundError(f"more than {MOST_FILES} files are called")
            root = self.folder.resolve()
            paths = [(root / f"{name}{ending}").resolve() for ending in endings for name in (label, label.lower())]
            path = next((p for p in paths if p.parent == root and is_file(p)), paths[0])
            found = path.parent == root and is_file(path)
            data = read_regular(path, path.name, LARGEST_FILE) if found else b""
            text = decode_text(data).replace("\r\n", "\n")
            self._files[label] = read_source(text, path.name) if found else None
        return self._files[label]

    def _enter(self, source: Source, line: int, label: str, local: bool, times: int) -> None:
        if len(self._calls) >= DEEPEST_CALL:
            raise InputError(f"o{label}: calls are nested deeper than {DEEPEST_CALL}")
        self._calls.append(_Call(self.source, self.line, label, self._loops, local, times, line + 1))
        self._loops = {}
        self.c.level += 1
        self.source, self.line = source, line + 1

    def statement(self, raw: str) -> None:
        """Carry out a statement that stands within another (THEN)."""
        block = self.dialect.read(raw, self.c)
        if block is not None:
            for key, value in block.sets:
                self.c.parameters.assign(key, value)
            self.i.execute(block)

    def again(self, line: int) -> None:
        """Carry out a block of this text once more, from another place; blocks are counted."""
        self.blocks += 1
        if self.blocks > self.most_blocks:
            raise BoundError(f"more than {self.most_blocks} blocks: a loop does not end, or most_blocks must be raised")
        self.c.line = line + 1
        block = self.dialect.read(self.source.lines[line], self.c)
        if block is not None:
            for key, value in block.sets:
                self.c.parameters.assign(key, value)
            for some in (block, *block.after):
                self.i.execute(some)

    def enter_program(self, source: Source, line: int, name: str, times: int) -> None:
        """Begin a subprogram behind a line of a text."""
        self._enter(source, line, name, False, times)

    def enter_macro(self, line: int, label: str, times: int) -> None:
        """Begin a subroutine of the main text with parameters of its own (G65)."""
        self._enter(self.main, line, label, False, times)
        self._calls[-1].macro = True
        self.c.parameters.enter([])

    def _call(self, word: OWord) -> None:
        arguments: list[float] = []
        rest = word.rest
        while rest:
            if not rest.startswith("["):
                raise InputError(f"{rest[:12]!r}: arguments of a call must be in [ ]")
            value, rest = self._bracket(rest, word)
            arguments.append(value)
        if len(arguments) > LOCAL:
            raise InputError(f"o{word.label} call: {len(arguments)} arguments: at most {LOCAL}")
        source, line = self._find(word.label)
        self.line += 1
        try:
            self._enter(source, line, word.label, True, 1)
        except InputError:
            self.line -= 1
            raise
        self.c.parameters.enter(arguments)

    def _return(self, word: OWord) -> None:
        if not self._calls or not self._calls[-1].local:
            raise InputError(f"o{word.label} {word.keyword}: no subroutine was called")
        value = (self._condition(word), 1.0) if word.rest else (0.0, 0.0)
        self.c.parameters.leave()
        self.c.returned = value
        self._leave()

    def _leave(self) -> None:
        call = self._calls.pop()
        level = self.c.level
        self.c.level -= 1
        self.source, self.line, self._loops = call.source, call.back, call.loops
        self.i.left(level)

    def _call_number(self, words: dict[str, float]) -> None:
        """M98: a subroutine that begins with its O number and ends with M99."""
        self.line -= 1
        label, times = self.dialect.call(words, self.c)
        place = self.source.numbers.get(label)
        source = self.source
        if place is None and label in self.main.numbers:
            place, source = self.main.numbers[label], self.main
        if place is None:
            message = f"M98 P{label}: there is no block O{label} in this text"
            if self.dialect.strict:
                raise InputError(message)
            self.c.leave_out("nc-call", f"{message}: the call is left out")
            self.line += 1
            return
        self.line += 1
        if times > 0:
            self._enter(source, place, label, False, times)

    def _call_block(self, words: dict[str, float]) -> None:
        """M97 of a Haas: a subroutine that begins with its N number and ends with M99."""
        number, times = integer_of(words.get("p", -1.0), "P"), integer_of(words.get("l", 1.0), "L")
        place = block_number(self.source, self.line, number)
        if times > 0:
            self._enter(self.source, place - 1, f"N{number}", False, min(times, MOST_REPEATS))

    def _return_number(self, number: int | None = None) -> bool:
        """M99; with P it goes on at the block N of that number in the text that called."""
        if not self._calls and number is not None and block_number(self.source, self.line, number) >= self.line:
            self.line = block_number(self.source, self.line, number)
            return True
        if not self._calls:
            self.c.note("nc-endless", "M99 in the main program starts it again without end: it is read once")
            self.i.finish()
            return False
        call = self._calls[-1]
        if call.local:
            raise InputError("M99: ends a subroutine that M98 calls; this one ends with endsub")
        call.left -= 1
        if call.left > 0:
            self.line = call.first
            self._loops = {}
        else:
            if call.macro:
                self.c.parameters.leave()
            self._leave()
            if number is not None:
                self.line = block_number(self.source, self.line, number)
        return True
