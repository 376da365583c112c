"""What a draft asks its user: the guesses that change a result most, at most five, in the order of their effect.

A guess about the text moves the whole path; one about stock, tools or machine decides what is cut and where anything
collides; teeth and lengths of tools change loads by a part. Guesses that no question names are usual values, which the
job marks.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from chipload.jobs.drafts.draft import Draft, DraftTable, Entry, toml

#: most questions before a first verdict
MOST = 5
#: keys of ``[program]`` that change the whole path, and the effect of another answer
PROGRAM = {
    "unit": "the other unit makes the part 25.4 times smaller or greater",
    "control": "another control reads the program in another way",
    "dialect": "another language reads the program in another way",
    "compensation": "wear alone leaves the path as it stands; the radius moves it by the cutter's radius",
    "work_offsets": "nothing says how the parts lie beside one another: all are simulated in the place of the first",
    "tools_unit": "the other unit changes diameters and lengths by 25.4",
    "feed_mm_min": "times and loads of the cuts before the first F",
    "speed_rpm": "times the teeth's feed and the loads",
}
#: tables that are one question: what it asks, and the effect of another answer
TABLES = {
    "stock": ("which block is it cut from", "where material is: rapids through it, depths and loads"),
    "machine": ("which machine runs it", "travel, speeds, torque and power; --on names it"),
    "material": ("which material is it", "forces differ by a factor of up to 5"),
    "limits": ("which limits hold", "what is compared"),
    "wall": ("is the wall the right one", "shape and stock"),
    "workpiece": ("how stiff is the workpiece", "its deflection"),
    "part": ("is the part read right", "what is finished"),
    "impeller": ("how many blades are there", "the width between them, and which cutters fit"),
    "catalogue": ("which cutters are there", "which one is chosen, and what it reaches"),
}
#: keys of a cutter that decide what it removes
SHAPE = ("diameter_mm", "corner_radius_mm", "body_mm", "taper_deg")


@dataclass(frozen=True)
class Question:
    """A question of a draft.

    Parameters
    ----------
    text : what is asked, what was guessed, and the effect of another answer
    keys : number of the table in the draft and key of each guess that an answer states
    """

    text: str
    keys: tuple[tuple[int, str], ...]


def questions(tables: Sequence[DraftTable]) -> tuple[str, ...]:
    """The questions of a draft as texts, the one with the greatest effect first.

    >>> from chipload.jobs.drafts.draft import DraftTable, Entry
    >>> unit = Entry("unit", "inch", "the program states none", guess=True)
    >>> questions([DraftTable("program", (unit,))])
    ('program.unit = "inch": the program states none? the other unit makes the part 25.4 times smaller or greater',)
    """
    return tuple(question.text for question in questions_with_keys(tables))


def questions_with_keys(tables: Sequence[DraftTable]) -> tuple[Question, ...]:
    """The questions of a draft with the keys that their answers state, the one with the greatest effect first.

    >>> from chipload.jobs.drafts.draft import DraftTable, Entry
    >>> unit = Entry("unit", "inch", "the program states none", guess=True)
    >>> questions_with_keys([DraftTable("program", (Entry("file", "a.nc"), unit))])[0].keys
    ((0, 'unit'),)
    """
    guessed = {t.name: t for t in tables if t.guesses and not t.repeated}
    cutters = [t for t in tables if t.name == "cutter" and t.guesses]
    program = {e.key: e for e in guessed["program"].guesses} if "program" in guessed else {}

    def keys_of(asked: Sequence[DraftTable], only: Sequence[str] = ()) -> tuple[tuple[int, str], ...]:
        own = [(number, t) for number, t in enumerate(tables) if any(t is one for one in asked)]
        return tuple((number, e.key) for number, t in own for e in t.guesses if not only or e.key in only)

    def table_question(name: str) -> Question:
        return Question(_table(guessed[name], *TABLES[name]), keys_of([guessed[name]]))

    out = [
        Question(_one("program", program[key], effect), keys_of([guessed["program"]], (key,)))
        for key, effect in PROGRAM.items()
        if key in program
    ][:4]
    sizes = [t for t in cutters if any(e.key in SHAPE for e in t.guesses)]
    asked = [table_question(name) for name in ("part", "wall", "stock") if name in guessed]
    turned = [t for t in tables if t.name == "setup" and t.guesses]
    if turned:
        text = _table(turned[0], "how does the part lie in its later setups", "what they cut of it")
        asked.append(Question(text, keys_of(turned)))
    if sizes:
        asked.append(Question(_sizes(sizes), keys_of(sizes)))
    asked += [table_question(name) for name in ("machine", "material", "workpiece") if name in guessed]
    rest = [t for t in cutters if t not in sizes]
    if rest:
        asked.append(Question(_tools(rest), keys_of(rest)))
    asked += [table_question("limits")] if "limits" in guessed else []
    return tuple((*out, *asked)[:MOST])


def questions_of(drafts: Iterable[Draft]) -> tuple[str, ...]:
    """The questions of drafts whose jobs follow one another: a table that several have is asked once."""
    out: dict[tuple[str, object], DraftTable] = {}
    for draft in drafts:
        count = Counter[str]()
        for table in draft.tables:
            number = next((e.value for e in table.entries if e.key == "number"), -count[table.name])
            count[table.name] += 1
            out.setdefault((table.name, number), table)
    return questions(tuple(out.values()))


def _one(table: str, entry: Entry, effect: str) -> str:
    value = "" if entry.value is None else f" = {toml(entry.value)}"
    return f"{table}.{entry.key}{value}: {entry.note}? {effect}"


def _table(table: DraftTable, question: str, effect: str) -> str:
    shown = ", ".join(f"{e.key} = {toml(e.value)}" for e in table.guesses[:2])
    return f"[{table.name}]: {question}? {shown}: {table.guesses[0].note}; {effect}"


def _sizes(tables: Sequence[DraftTable]) -> str:
    shown = ", ".join(f"T{_number(t)} {_shape(t)}" for t in tables[:6])
    more = f" and {len(tables) - 6} more" if len(tables) > 6 else ""
    return f"[[cutter]]: which tools are {shown}{more}? no file states their size; --tools names a table or a library"


def _tools(tables: Sequence[DraftTable]) -> str:
    keys = list(dict.fromkeys(e.key for t in tables for e in t.guesses))
    names = ", ".join(f"T{_number(t)}" for t in tables[:8])
    more = f" and {len(tables) - 8} more" if len(tables) > 8 else ""
    return f"[[cutter]]: {', '.join(keys)} of {names}{more}? usual values; --tools names a library that states them"


def _number(table: DraftTable) -> int:
    return next(int(e.value) for e in table.entries if e.key == "number")


def _shape(table: DraftTable) -> str:
    stated = {e.key: e.value for e in table.entries if e.value is not None}
    size = stated.get("diameter_mm")
    name = str(stated.get("name", "end mill"))[:24]
    return f"({name}, {size:g} mm)" if isinstance(size, (int, float)) else f"({name})"
