"""Run mutants against tests that are collected once: a child process a mutant, with the changed function put in place.

pytest collects in this process and runs nothing here. A first child runs every test once and notes which functions of
the physics files each test calls, fixtures included, and how long it takes. A mutant is then a child process that
exchanges the code of one live function and runs the tests that call that function, quick ones first, until one fails:
nothing is imported, collected or compiled again. Compiled kernels are mutated with compilation switched off, as the
Python that they are written in. A change outside every function cannot be put in place; such mutants are given back.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import json
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import CodeType, FrameType, FunctionType, ModuleType
from typing import Any

import pytest
from _pytest.runner import runtestprotocol

#: a function of a file: the file and the first line of its code
Place = tuple[str, int]


def function_at(source: bytes, line: int) -> int | None:
    """First line of the code of the innermost function around a line; None: outside every function."""
    found: tuple[int, int] | None = None
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            first = min([node.lineno, *(d.lineno for d in node.decorator_list)])
            inside = node.body[0].lineno <= line <= (node.end_lineno or 0)
            if inside and (found is None or first > found[0]):
                found = (first, node.end_lineno or 0)
    return None if found is None else found[0]


def live_functions(module: ModuleType) -> Iterator[FunctionType]:
    """Functions and methods of a module, under their decorators."""
    seen: set[int] = set()

    def of(value: Any) -> Iterator[FunctionType]:
        if id(value) in seen:
            return
        seen.add(id(value))
        if isinstance(value, property):
            for part in (value.fget, value.fset):
                yield from of(part)
        elif isinstance(value, (staticmethod, classmethod)):
            yield from of(value.__func__)
        elif isinstance(value, functools.cached_property):
            yield from of(value.func)
        elif isinstance(value, type) and value.__module__ == module.__name__:
            for part in list(vars(value).values()):
                yield from of(part)
        elif hasattr(value, "py_func"):
            return  # compiled: its Python is not what runs
        elif hasattr(value, "__wrapped__"):
            yield from of(value.__wrapped__)
        elif isinstance(value, FunctionType) and value.__code__.co_filename == module.__file__:
            yield value

    for value in list(vars(module).values()):
        yield from of(value)


def codes(code: CodeType) -> Iterator[CodeType]:
    """A code object and all within it."""
    yield code
    for held in code.co_consts:
        if isinstance(held, CodeType):
            yield from codes(held)


def put_in_place(module: ModuleType, source: bytes, line: int) -> bool:
    """Exchange the code of the live function around a line by that of a changed source; whether there is one."""
    new = {c.co_qualname: c for c in codes(compile(source, str(module.__file__), "exec"))}
    done = False
    for function in live_functions(module):
        lines = [n for c in codes(function.__code__) for _, _, n in c.co_lines() if n is not None]
        if lines and min(lines) <= line <= max(lines) and function.__code__.co_qualname in new:
            changed = new[function.__code__.co_qualname]
            if changed.co_freevars == function.__code__.co_freevars:
                function.__code__ = changed
                done = True
    return done


class TooLong(Exception):
    """A test that takes longer than is useful here."""


def _alarm(*_: object) -> None:
    raise TooLong


class Collected:
    """A pytest plugin: the collected tests, and in place of running them ``work``.

    Parameters
    ----------
    root : of the package's source
    files : below it, whose functions are watched
    most_s : longest test that takes part [s]
    work : called with this object when all tests are collected
    """

    def __init__(self, root: Path, files: Sequence[str], most_s: float, work: Callable[[Collected], None]) -> None:
        self.names = {str(root / f): f for f in files}
        self.most_s, self.work = most_s, work
        self.items: list[pytest.Item] = []
        self.calls: dict[str, set[Place]] = {}
        self.seconds: dict[str, float] = {}
        self._noted: set[Place] = set()
        self._fixtures: dict[Any, set[Place]] = {}

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """In place of pytest's own loop."""
        self.items = list(session.items)
        self.work(self)
        return True

    @pytest.hookimpl(hookwrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any) -> Iterator[None]:
        """What a fixture calls counts for each test that uses it."""
        outer, self._noted = self._noted, set()
        yield
        self._fixtures[fixturedef] = self._fixtures.get(fixturedef, set()) | self._noted
        self._noted = outer | self._noted

    def _trace(self, frame: FrameType, event: str, _: object) -> None:
        if event == "call" and (file := self.names.get(frame.f_code.co_filename)) is not None:
            self._noted.add((file, frame.f_code.co_firstlineno))

    def map(self, kept: Path) -> None:
        """Run every test in a child and keep which functions it calls and how long it takes.

        A test that fails or takes too long is left out; one whose file is as before is not run again.
        """
        child = os.fork()
        if child == 0:
            code = 1
            try:
                _quiet()
                held = json.loads(kept.read_text()) if kept.exists() else {}
                kept.write_text(json.dumps(self._mapped(held, kept)))
                code = 0
            finally:
                os._exit(code)
        if os.waitpid(child, 0)[1]:
            raise SystemExit("the tests cannot be run")
        held = json.loads(kept.read_text())
        good = {i.nodeid: held[i.nodeid] for i in self.items if held.get(i.nodeid, {}).get("passed")}
        self.seconds = {name: value["seconds"] for name, value in good.items()}
        self.calls = {name: {(file, line) for file, line in value["calls"]} for name, value in good.items()}

    def _mapped(self, held: dict[str, Any], kept: Path) -> dict[str, Any]:
        hashes = {path: hashlib.sha256(path.read_bytes()).hexdigest() for path in {i.path for i in self.items}}
        todo = [i for i in self.items if held.get(i.nodeid, {}).get("sha256") != hashes[i.path]]
        signal.signal(signal.SIGPROF, _alarm)
        for k, item in enumerate(todo):
            after = todo[k + 1] if k + 1 < len(todo) else None
            if k % 20 == 19:
                kept.write_text(json.dumps(held))
            self._noted, start, passed = set(), time.process_time(), False
            signal.setitimer(signal.ITIMER_PROF, self.most_s)
            sys.settrace(self._trace)  # type: ignore[arg-type]
            threading.settrace(self._trace)  # type: ignore[arg-type]
            try:
                reports = runtestprotocol(item, nextitem=after, log=False)
                passed = all(r.outcome == "passed" for r in reports)
            except TooLong:
                item.session._setupstate.teardown_exact(None)
            finally:
                sys.settrace(None)
                threading.settrace(None)  # type: ignore[arg-type]
                signal.setitimer(signal.ITIMER_PROF, 0.0)
            info = getattr(item, "_fixtureinfo", None)
            for group in info.name2fixturedefs.values() if info is not None else ():
                for definition in group:
                    self._noted |= self._fixtures.get(definition, set())
            held[item.nodeid] = {
                "sha256": hashes[item.path],
                "passed": passed,
                "seconds": time.process_time() - start,
                "calls": sorted(self._noted),
            }
        return held

    def tests_of(self, place: Place, budget_s: float) -> list[pytest.Item]:
        """Tests that call a function, quick files first, as many as fit into a time together."""
        own = [i for i in self.items if place in self.calls.get(i.nodeid, ())]
        own.sort(key=lambda i: self.seconds[i.nodeid])
        chosen, total = [], 0.0
        for item in own:
            total += self.seconds[item.nodeid]
            if chosen and total > budget_s:
                break
            chosen.append(item)
        cost: dict[Path, float] = {}
        for item in chosen:
            cost[item.path] = max(cost.get(item.path, 0.0), self.seconds[item.nodeid])
        return sorted(chosen, key=lambda i: (cost[i.path], str(i.path)))

    def survives(self, module: ModuleType, source: bytes, line: int, tests: list[pytest.Item], limit_s: float) -> bool:
        """Whether every test passes with a changed source; beyond the limit one counts as failed."""
        child = os.fork()
        if child == 0:
            code = 1
            try:
                _quiet()
                signal.signal(signal.SIGPROF, signal.SIG_DFL)
                signal.setitimer(signal.ITIMER_PROF, limit_s)
                signal.alarm(int(20.0 * limit_s) + 60)
                put_in_place(module, source, line)
                for item, after in zip(tests, [*tests[1:], None][: len(tests)], strict=True):
                    if any(r.outcome == "failed" for r in runtestprotocol(item, nextitem=after, log=False)):
                        os._exit(1)
                code = 0
            except BaseException:
                os._exit(1)
            finally:
                os._exit(code)
        return os.waitpid(child, 0)[1] == 0


def _quiet() -> None:
    sink = os.open(os.devnull, os.O_WRONLY)
    os.dup2(sink, 1)
    os.dup2(sink, 2)


def collect(tests: Sequence[str], scratch: Path, plugin: Collected) -> None:
    """Collect tests and have the plugin do its work in place of running them."""
    words = ["-q", "-s", "-p", "no:cacheprovider", "-p", "no:faulthandler", "-p", "no:xdist", f"--basetemp={scratch}"]
    code = pytest.main([*words, *tests], plugins=[plugin])
    if code not in (0, 5):
        raise SystemExit(f"the tests cannot be collected: pytest ended with {code}")
