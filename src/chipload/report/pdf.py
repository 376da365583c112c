"""One A4 page of PDF: headings, lines of text, tables. fpdf2 draws it, in the extra ``export``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from chipload.lazy import require_extra

if TYPE_CHECKING:
    from fpdf import FPDF

#: [pt]
MARGIN = 34.0
#: greatest and least size of letters [pt], and the distance of lines in sizes
LARGEST, SMALLEST, LEADING = 9.0, 6.0, 1.28


@dataclass(frozen=True)
class SheetLine:
    """A line of text from the left margin: a heading if ``bold``; ``size`` in sizes of the page's letters."""

    text: str
    bold: bool = False
    size: float = 1.0


@dataclass(frozen=True)
class SheetTable:
    """A table: the first row is its head; ``shares`` of the page's width, one a column."""

    rows: tuple[tuple[str, ...], ...]
    shares: tuple[float, ...]


Block = SheetLine | SheetTable


def one_page(title: str, blocks: Sequence[Block]) -> bytes | None:
    """The file, in the largest letters with which everything is on one page; None: it is too much for one page.

    Letters that are not in Latin-1 become question marks.

    Raises
    ------
    InputError
        fpdf2 is not installed.
    """
    require_extra("export")
    size = LARGEST
    while size >= SMALLEST:
        page = _draw_document(title, blocks, size)
        if page.page_no() == 1:
            return bytes(page.output())
        size -= 0.5
    return None


def _draw_document(title: str, blocks: Sequence[Block], size: float) -> FPDF:
    """The document with letters of a size; it has a second page where the first is full."""
    from fpdf import FPDF
    from fpdf.fonts import FontFace

    page = FPDF(format="A4", unit="pt")
    page.set_title(_latin(title))
    page.set_margin(MARGIN)
    page.set_auto_page_break(True, MARGIN)
    page.add_page()
    for block in blocks:
        if page.page_no() > 1:
            break
        if isinstance(block, SheetLine):
            letters = size * block.size
            page.set_font("Helvetica", "B" if block.bold else "", letters)
            page.ln(0.6 * letters if block.bold else 0.0)
            page.multi_cell(0.0, LEADING * letters, _latin(block.text), align="L", new_x="LMARGIN", new_y="NEXT")
            continue
        page.set_font("Helvetica", "", size)
        with page.table(
            col_widths=block.shares,
            line_height=LEADING * size,
            text_align="LEFT",
            borders_layout="HORIZONTAL_LINES",
            headings_style=FontFace(emphasis="BOLD"),
        ) as table:
            for row in block.rows:
                table.row([_latin(cell) for cell in row])
    return page


def _latin(text: str) -> str:
    return text.encode("latin-1", "replace").decode("latin-1")
