"""Lists, keys and view of the page, used as a person does who looks whether it worked, on however busy a computer."""

import contextlib
import re
import time
from pathlib import Path

#: checks accessibility in a browser; there after `npm install` in viewer/, not part of the package
AXE = Path(__file__).parents[1] / "viewer" / "node_modules" / "axe-core" / "axe.min.js"
#: the 3D view
VIEW = "chiploadViewer.of(document.querySelector('.cl-stage').id)"
#: seconds of the machine in a second of a slow play: the longest wait of a test does not come to the end
SLOW = 0.1
#: seconds that one look takes, and after which a choice that did not arrive is an error
LOOK, PATIENCE = 3.0, 90.0


def choose(page, name: str, option: str, chosen: bool = True) -> None:
    """Choose an option of the list ``name``, or with ``chosen=False`` take it back, and close the list.

    ``option`` is its name, which values in brackets may follow.

    A choice counts once the list shows it, which it does when the server has answered. A list that closed before,
    because its options were renewed or a click came while it moved, is opened again.
    """
    field = page.get_by_role("combobox", name=name)
    words = re.escape(option).replace("/", "\\/")
    listed = page.get_by_role("option", name=re.compile(rf"^{words}( \(|, |$)"))
    state, missed = str(chosen).lower(), ""
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until:
        try:
            if field.get_attribute("aria-expanded", timeout=1000 * LOOK) != "true":
                field.click(timeout=1000 * LOOK)
            listed.wait_for(timeout=1000 * LOOK)
            if listed.get_attribute("aria-selected", timeout=1000 * LOOK) == state:
                page.keyboard.press("Escape")
                listed.wait_for(state="hidden", timeout=1000 * LOOK)
                return
            listed.click(timeout=1000 * LOOK)
            _answered(page, listed, field, state)
        except Exception as err:  # what is not there within a look is looked for again
            missed = str(err)
            # a list that says it is open and shows nothing, clicked while the page was busy, is closed by a click
            with contextlib.suppress(Exception):
                if field.get_attribute("aria-expanded", timeout=1000 * LOOK) == "true" and not listed.is_visible():
                    field.click(timeout=1000 * LOOK)
    raise AssertionError(f"{name}: {option} is not {'chosen' if chosen else 'left'}: {missed}")


def serious_problems(page) -> list[tuple[str, list[str]]]:
    """Rules of accessibility that a page breaks seriously, with the elements; empty also where axe-core is missing."""
    if not AXE.exists():
        return []
    if not page.evaluate("'axe' in window"):
        page.evaluate(AXE.read_text())
    found = page.evaluate("axe.run(document, {resultTypes: ['violations']}).then(r => r.violations)")
    return [(v["id"], [n["html"][:200] for n in v["nodes"]]) for v in found if v["impact"] in ("serious", "critical")]


def settle(page, row: int) -> None:
    """Wait until the 3D view, as drawn, and the panels stand at a row."""
    page.wait_for_function(
        f"r => {VIEW}.row == r && !{VIEW}.dirty && document.querySelector('.cl-where').textContent"
        ".includes(`step ${r + 1} of`)",
        arg=row,
    )


def drawn(page) -> None:
    """Wait until the 3D view shows what it was told."""
    page.wait_for_function(f"!{VIEW}.dirty")


def play_slowly(page) -> None:
    """Play by the key, then slowly, until some steps went by in the view and in the panels."""
    page.keyboard.press("Space")
    page.wait_for_function(f"{VIEW}.playing")
    page.evaluate(f"{VIEW}.play({SLOW})")
    first = page.evaluate(f"{VIEW}.row")
    page.wait_for_function(f"r => {VIEW}.row > r + 3", arg=first)
    page.wait_for_function(
        "r => Number(document.querySelector('.cl-where').textContent.match(/step (\\d+)/)[1]) - 1 > r", arg=first
    )


def stop(page) -> int:
    """Stop by the key; the row at which view and panels stand then."""
    page.keyboard.press("Space")
    page.wait_for_function(f"!{VIEW}.playing")
    # the page answers by the row at which the view stopped; until then it stands between two places of the path
    page.wait_for_function(f"Number.isInteger({VIEW}.place)")
    row = int(page.evaluate(f"{VIEW}.row"))
    settle(page, row)
    return row


def click_until(page, x: float, y: float, holds: str) -> None:
    """Click a plot at a place, again every few seconds, until a function of JavaScript holds: a click that comes
    before the plot saw the pointer picks nothing.
    """
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until:
        page.mouse.move(x - 3, y)
        page.mouse.move(x, y)
        with contextlib.suppress(Exception):
            page.wait_for_selector(".hoverlayer .hovertext", state="attached", timeout=1000 * LOOK)
        page.mouse.click(x, y)
        with contextlib.suppress(Exception):
            page.wait_for_function(holds, timeout=1000 * LOOK)
            return
    raise AssertionError(f"a click at {x:.0f}, {y:.0f}: {holds} does not hold")


def press_until(page, key: str, holds: str, arg: object) -> None:
    """Press a key, again every few seconds, until a function of JavaScript holds for ``arg``: a key that comes while
    the page turns to another track goes to the old one.
    """
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until:
        page.keyboard.press(key)
        try:
            page.wait_for_function(holds, arg=arg, timeout=1000 * LOOK)
        except Exception:
            continue
        return
    raise AssertionError(f"{key}: {holds} does not hold for {arg}")


def _answered(page, listed, field, state: str) -> None:
    """Wait for the answer to a click on an option: it has the state, or the list has closed."""
    until = time.monotonic() + LOOK
    while time.monotonic() < until and field.get_attribute("aria-expanded") == "true":
        if listed.get_attribute("aria-selected", timeout=1000 * LOOK) == state:
            return
        page.wait_for_timeout(50)
