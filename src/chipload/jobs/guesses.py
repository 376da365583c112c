"""What a result rests on where values of its job are guesses: nothing holds, and nothing exceeds, by a guess alone.

A guess is a value of a draft that its user has not confirmed, see :mod:`chipload.jobs.confirm`. A limit or a finding
rests on the guessed tables that its value depends on.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

from chipload.errors import Finding, Severity
from chipload.result import LimitCheck, Result, Track, Verdict
from chipload.result.first_lines import GUESS, HELD_BY_GUESS

#: tables that decide where material is, and how much a tooth takes
PLACE, LOAD = ("stock", "cutter", "program", "part", "fixture"), ("cutter", "material", "stock", "program", "workpiece")
#: tables that a finding depends on, by its code; of another code: all
FINDINGS = {
    "rapid-cuts": PLACE,
    "collision": PLACE,
    "nothing-cut": PLACE,
    "tool-change-in-stock": PLACE,
    "plunge": PLACE,
    "tap-pitch": ("program",),
    "thread-pitch": ("cutter", "program"),
    "tap-cutter": ("cutter", "program"),
}
#: tables that a limit depends on besides :data:`LOAD`, by its name
LIMITS = {"spindle_torque_nm": ("machine",), "spindle_power_w": ("machine",), "gouge_mm": ("part",)}
#: a rapid in material is stated in these words where it rests on a guess
RAPID = "would be a rapid through the guessed"


def with_guesses(result: Result, guesses: Sequence[str], *, plan: bool = False) -> Result:
    """Return a result with a finding for each guess of its job.

    Parameters
    ----------
    guesses : a line each, as ``cutter.0.flutes = 3: no file states them``
    plan : the job plans its program, which then rests on all of them
    """
    found = tuple(Finding(GUESS, 0, f"guess: {text}", Severity.UNPROVEN) for text in guesses)
    if guesses:
        tables = tuple(dict.fromkeys(text.partition(" ")[0].partition(".")[0].rstrip(":") for text in guesses))
        result = replace(
            result,
            tracks=tuple(_of_track(track, tables, plan) for track in result.tracks),
            findings=tuple(_of_finding(f, tables, plan) for f in result.findings),
        )
    return replace(result, findings=(*found, *result.findings))


def _of_track(track: Track, tables: Collection[str], plan: bool) -> Track:
    return replace(
        track,
        limits=tuple(_of_limit(check, tables, plan) for check in track.limits),
        findings=tuple(_of_finding(f, tables, plan) for f in track.findings),
    )


def _of_limit(check: LimitCheck, tables: Collection[str], plan: bool) -> LimitCheck:
    """A check that rests on a guess is unproven."""
    own = _guessed_tables(tables if plan else (*LOAD, *LIMITS.get(check.name, ()), "limits"), tables)
    if check.state is Verdict.UNPROVEN or not own:
        return check
    would = "it would exceed the limit with the guessed" if check.state is Verdict.EXCEEDS else HELD_BY_GUESS
    return replace(check, state=Verdict.UNPROVEN, reason=f"{would} {own}")


def _of_finding(f: Finding, tables: Collection[str], plan: bool) -> Finding:
    """A finding that exceeds by a guess is unproven."""
    every = tuple(t for t in tables if t not in ("limits", "operation"))
    own = _guessed_tables(tables if plan else FINDINGS.get(f.code, every), tables)
    if f.severity is not Severity.EXCEEDS or not own:
        return f
    text = f"{RAPID} {own}" if f.code == "rapid-cuts" else f"{f.text}, with the guessed {own}"
    return replace(f, text=text, severity=Severity.UNPROVEN)


def _guessed_tables(tables: Collection[str], guessed: Collection[str]) -> str:
    """The tables that are guessed, in words; empty: none.

    >>> _guessed_tables(("stock", "cutter", "part"), ("machine", "cutter", "stock"))
    'stock and cutter'
    """
    names = [name for name in dict.fromkeys(tables) if name in guessed]
    return " and ".join(filter(None, (", ".join(names[:-1]), *names[-1:])))
