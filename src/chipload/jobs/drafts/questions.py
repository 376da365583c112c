"""What a draft asks its user: the guesses that change a result most, at most five, in the order of their effect.

A guess about the text moves the whole path; one about stock, tools or machine decides what is cut and where anything
collides; teeth and lengths of tools change loads by a part. Guesses that no question names are usual values, which the
job marks.
"""

from __future__ import annotations

from collections.abc import Sequence

from chipload.jobs.drafts.draft import DraftTable, Entry, toml

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
}
#: keys of a cutter that decide what it removes
SHAPE = ("diameter_mm", "corner_radius_mm", "body_mm", "taper_deg")


def questions(tables: Sequence[DraftTable]) -> tuple[str, ...]:
    """The questions of a draft, the one with the greatest effect first.

    >>> from chipload.jobs.drafts.draft import DraftTable, Entry
    >>> unit = Entry("unit", "inch", "the program states none", guess=True)
    >>> questions([DraftTable("program", (unit,))])
    ('program.unit = "inch": the program states none? the other unit makes the part 25.4 times smaller or greater',)
    """
    guessed = {t.name: t for t in tables if t.guesses and not t.repeated}
    cutters = [t for t in tables if t.name == "cutter" and t.guesses]
    program = {e.key: e for e in guessed["program"].guesses} if "program" in guessed else {}
    out = [_one("program", program[key], effect) for key, effect in PROGRAM.items() if key in program][:4]
    sizes = [t for t in cutters if any(e.key in SHAPE for e in t.guesses)]
    asked = [_table(guessed[name], *TABLES[name]) for name in ("part", "wall", "stock") if name in guessed]
    turned = [t for t in tables if t.name == "setup" and t.guesses]
    if turned:
        asked.append(_table(turned[0], "how does the part lie in its later setups", "what they cut of it"))
    if sizes:
        asked.append(_sizes(sizes))
    asked += [_table(guessed[n], *TABLES[n]) for n in ("machine", "material", "workpiece") if n in guessed]
    rest = [t for t in cutters if t not in sizes]
    if rest:
        asked.append(_tools(rest))
    asked += [_table(guessed["limits"], *TABLES["limits"])] if "limits" in guessed else []
    return tuple((*out, *asked)[:MOST])


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
