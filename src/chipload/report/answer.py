"""The critical limit of a result in one line: its value as a bar, its margin, its line and its place."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape

from chipload.number_text import percent_text
from chipload.result import LimitCheck, Result, Verdict

#: class of a bar by the state of its limit
BARS = {Verdict.HOLDS: "ok", Verdict.UNPROVEN: "may", Verdict.EXCEEDS: "no"}
#: a bar ends at most at so many times the limit
LONGEST = 3.0

#: style of :func:`answer_html`, for report and page; --ink and --track are theirs
STYLE = """.answer { display: flex; flex-wrap: wrap; gap: 2px 14px; align-items: center; color: var(--ink); }
.answer .value { font-weight: 650; }
.limit-bar { position: relative; display: inline-block; flex: 0 1 220px; min-width: 90px; height: 12px;
  background: var(--track, #dfe4ea); border-radius: 3px; -webkit-print-color-adjust: exact; print-color-adjust: exact; }
.limit-bar b, .limit-bar i, .limit-bar u { position: absolute; top: 0; bottom: 0; display: block; left: 0; }
.limit-bar u { top: -3px; bottom: -3px; width: 0; border-left: 2.5px solid var(--ink); margin-left: -2px; }
.limit-bar.ok b { background: #3f936f; } .limit-bar.ok i { background: #a3d0bb; }
.limit-bar.no b { background: #b3261e; } .limit-bar.no i { background: #e3a8a3; }
.limit-bar.may b { background: #d19a1f; } .limit-bar.may i { background: #ecd39a; }
"""


@dataclass(frozen=True)
class BarShares:
    """A limit as a bar: the shares of its length at which the worst value, the value at the confidence of the limit and
    the limit stand.
    """

    value: float
    at_confidence: float
    limit: float


def bar_shares(check: LimitCheck) -> BarShares | None:
    """Return the shares of a bar that is filled the more the less margin there is; None: the check has no margin.

    >>> bar_shares(LimitCheck("force_n", 500.0, 400.0, Verdict.HOLDS, resolution_error=0.0))
    BarShares(value=0.8, at_confidence=0.8, limit=1.0)
    >>> bar_shares(LimitCheck("force_n", 400.0, 500.0, Verdict.EXCEEDS))
    BarShares(value=1.0, at_confidence=1.0, limit=0.8)
    """
    if check.margin is None or check.worst is None:
        return None
    least = check.column.least
    worst = check.worst if least else abs(check.worst)
    level_value = check.budget.value(worst, least=least) if check.by_confidence and check.budget is not None else worst
    share, level = (
        (min(check.limit / x if x > 0.0 else LONGEST, LONGEST) if least else min(x / check.limit, LONGEST))
        for x in (worst, level_value)
    )
    end = max(share, level, 1.0)
    return BarShares(share / end, level / end, 1.0 / end)


def bar_html(check: LimitCheck) -> str:
    """The bar of a limit as HTML; empty: it has no margin."""
    shares = bar_shares(check)
    if shares is None:
        return ""
    more = max(shares.at_confidence - shares.value, 0.0)
    label = f"{percent_text(shares.at_confidence / shares.limit)} of the limit is used"
    return (
        f'<span class="limit-bar {BARS[check.state]}" role="img" aria-label="{escape(label)}" title="{escape(label)}">'
        f'<b style="width:{100.0 * shares.value:.1f}%"></b>'
        f'<i style="left:{100.0 * shares.value:.1f}%;width:{100.0 * more:.1f}%"></i>'
        f'<u style="left:{100.0 * shares.limit:.1f}%"></u></span>'
    )


def answer_html(check: LimitCheck | None, row: int | None = None, program: str = "") -> str:
    """The critical limit as HTML in the words of the message: value, bar, margin, line and place; empty: there is none.

    ``row``: of the history to which a click on the place leads; None: it leads nowhere. ``program``: of several, the
    one that the limit is of.
    """
    if check is None:
        return ""
    within = check.state is Verdict.EXCEEDS or (check.margin or 0.0) >= 0.0
    margin = f"<span>{escape(check.margin_text)}</span>" if within else ""
    go = f' data-row="{row}" class="cl-go" title="go there" tabindex="0" role="button"' if row is not None else ""
    where = f"<span{go}>{escape(check.where)}</span>" if check.where else ""
    of = f"{program}: " if program else ""
    value = f'<span class="value">{escape(of + check.value_text)}</span>'
    return f'<div class="answer">{value}{bar_html(check)}{margin}{where}</div>'


def critical_html(result: Result) -> str:
    """The critical limit of a result as HTML, see :func:`answer_html`."""
    return answer_html(result.critical, program=result.critical_program)
