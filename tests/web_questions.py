"""Ten questions that a shop asks about a result, and the clicks on the page that answer them.

``tests/web`` clicks them on a result made by hand, ``tools/pictures.py`` on an example, for docs/how-to/questions.md.
"""

from dataclasses import dataclass

from web_lists import VIEW, choose


@dataclass(frozen=True)
class ShopQuestion:
    """A question of a shop.

    Parameters
    ----------
    text : as it is asked
    clicks : steps from the first picture; ``choose`` is two clicks: the list is opened, and an option taken
    answer : selector of what shows the answer
    """

    text: str
    clicks: tuple[tuple[str, ...], ...]
    answer: str

    @property
    def count(self) -> int:
        """How many clicks that are."""
        return sum(2 if kind == "choose" else 1 for kind, *_ in self.clicks)


def tab(name: str) -> tuple[str, str]:
    """A click on a table beside the 3D view."""
    return ("click", f".cl-tabs button:has-text('{name}')")


QUESTIONS = (
    ShopQuestion("Can I run it?", (), ".cl-answer .cl-word"),
    ShopQuestion("Which line is worst, and where is that?", (("click", ".answer [data-row]"),), ".cl-now"),
    ShopQuestion("What was not checked?", (("click", ".cl-fold"),), ".cl-open .cl-lines"),
    ShopQuestion("How much margin has each limit?", (), ".cl-checks tbody tr"),
    ShopQuestion("Which tool is loaded most, and how long does it cut?", (tab("tools"),), ".cl-times"),
    ShopQuestion("Which lines load the tool most?", (tab("lines"),), ".cl-lines-box tbody tr"),
    ShopQuestion("What do the teeth cut there?", (tab("cut"),), ".cv-cut-plots svg"),
    ShopQuestion("How much faster or slower is the other one?", (("choose", "compare with"),), ".cl-compared tbody tr"),
    ShopQuestion("Where does the part bend, or miss its size?", (("choose", "surface map"),), ".cv-map-ends"),
    ShopQuestion("Which line cut this face?", (("face",),), ".cv-note:has-text('cut in step')"),
)


#: the first place in the scene, row by row from its middle, where a click meets a face that was cut, and no path
CUT_FACE = f"""() => {{ const v = {VIEW}; v.picture(); const b = v.overlay.stage.getBoundingClientRect(), n = 24;
    const order = Array.from({{ length: n * n }}, (_, k) => [k % n + 0.5, Math.floor(k / n) + 0.5]);
    order.sort((p, q) => Math.hypot(p[0] - n / 2, p[1] - n / 2) - Math.hypot(q[0] - n / 2, q[1] - n / 2));
    for (const [i, j] of order) {{
      const x = i * b.width / n, y = j * b.height / n;
      if (!v.hidden.has('path') && v.near(x, y) >= 0) continue;
      const hit = v.hit(x, y);
      if (hit && hit.object === v.stock.mesh && v.stock.cutBy(hit.faceIndex)) return [b.x + x, b.y + y]; }}
    return null; }}"""


def ask(page, question: ShopQuestion, options: dict[str, str]) -> None:
    """Do the clicks of a question and wait for its answer; ``options``: what is chosen in each list."""
    for kind, *rest in question.clicks:
        if kind == "click":
            page.locator(rest[0]).first.click()
        elif kind == "choose":
            choose(page, rest[0], options[rest[0]])
        else:
            page.mouse.click(*page.evaluate(CUT_FACE))
    page.locator(question.answer).first.wait_for(state="visible")


def take_back(page, question: ShopQuestion, options: dict[str, str]) -> None:
    """Bring the page back to its first picture."""
    for kind, *rest in question.clicks:
        if kind == "choose" and rest[0] == "compare with":
            choose(page, rest[0], options[rest[0]], chosen=False)
        elif kind == "choose":
            choose(page, rest[0], "no map")
        elif rest and rest[0] == ".cl-fold":
            page.locator(".cl-fold").click()
    page.locator(".cl-tabs button:has-text('limits')").click()
