"""One page of PDF with text in the built-in fonts Helvetica and Helvetica-Bold: headings, tables, lists, a banner.

Reference: Adobe, PDF Reference 1.4: file structure 3.4, text 5.2 and 5.3; widths of Helvetica from Adobe's AFM file.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

#: of A4 [pt]
WIDTH, HEIGHT, MARGIN = 595.0, 842.0, 34.0
#: greatest and least size of letters [pt], and the distance of lines in sizes
LARGEST, SMALLEST, LEADING = 9.0, 6.0, 1.28
#: widths of the letters from space to ~ in 1/1000 of the size; of others that of a digit
_WIDTHS = (
    278, 278, 355, 556, 556, 889, 667, 191, 333, 333, 389, 584, 278, 333, 278, 278, 556, 556, 556, 556, 556, 556, 556,
    556, 556, 556, 278, 278, 584, 584, 584, 556, 1015, 667, 667, 722, 722, 667, 611, 778, 722, 278, 500, 667, 556, 833,
    722, 778, 667, 778, 722, 667, 611, 722, 667, 944, 667, 667, 611, 278, 278, 278, 469, 556, 333, 556, 556, 500, 556,
    556, 278, 556, 556, 222, 222, 500, 222, 833, 556, 556, 556, 556, 333, 500, 278, 556, 500, 722, 500, 500, 500, 334,
    260, 334, 584,
)  # fmt: skip
#: bold letters are wider by this factor at most
_BOLD = 1.12


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


def text_width(text: str, size: float, bold: bool = False) -> float:
    """Width of a text [pt].

    >>> text_width("Al 7", 10.0)
    17.23
    """
    units = sum(_WIDTHS[ord(c) - 32] if 32 <= ord(c) < 127 else 556 for c in text)
    return round(units * size * (_BOLD if bold else 1.0) / 1000.0, 6)


def wrapped(text: str, width: float, size: float, bold: bool = False) -> list[str]:
    """A text in lines of a width [pt]; a word that is longer is cut.

    >>> wrapped("force on the cutter", 50.0, 10.0)
    ['force on', 'the cutter']
    """
    lines, line = list[str](), ""
    for word in text.split():
        while text_width(word, size, bold) > width and len(word) > 1:
            if line:
                lines.append(line)
                line = ""
            end = len(word)
            while end > 1 and text_width(word[:end], size, bold) > width:
                end -= 1
            lines.append(word[:end])
            word = word[end:]
        longer = f"{line} {word}" if line else word
        if line and text_width(longer, size, bold) > width:
            lines.append(line)
            line = word
        else:
            line = longer
    return [*lines, line] if line else lines or [""]


def one_page(title: str, blocks: Sequence[Block]) -> bytes | None:
    """The file, in the largest letters with which everything is on one A4 page; None: it is too much for one page.

    Letters that are not in Windows-1252 become question marks.
    """
    size = LARGEST
    while size >= SMALLEST - 1e-9:
        drawn, bottom = _drawn(blocks, size)
        if bottom >= MARGIN:
            return _file(title, drawn)
        size -= 0.25
    return None


def _drawn(blocks: Sequence[Block], size: float) -> tuple[list[bytes], float]:
    """The operators of a page, and the height of its last line [pt]."""
    out, y, whole = list[bytes](), HEIGHT - MARGIN, WIDTH - 2.0 * MARGIN
    for block in blocks:
        if isinstance(block, SheetLine):
            letters = size * block.size
            y -= 0.6 * letters if block.bold else 0.0
            for line in wrapped(block.text, whole, letters, block.bold):
                y -= LEADING * letters
                out.append(_text(line, MARGIN, y, letters, block.bold))
            continue
        total = sum(block.shares)
        wide = [whole * share / total for share in block.shares]
        for k, row in enumerate(block.rows):
            cells = [wrapped(cell, w - 4.0, size, k == 0) for cell, w in zip(row, wide, strict=True)]
            x = MARGIN
            for cell, w in zip(cells, wide, strict=True):
                out += [_text(line, x, y - (i + 1) * LEADING * size, size, k == 0) for i, line in enumerate(cell)]
                x += w
            y -= LEADING * size * max(map(len, cells)) + 1.5
            out.append(f"0.75 G 0.4 w {MARGIN:.2f} {y - 0.5:.2f} m {WIDTH - MARGIN:.2f} {y - 0.5:.2f} l S".encode())
    return out, y


def _text(text: str, x: float, y: float, size: float, bold: bool) -> bytes:
    """The operators of a line of text."""
    plain = text.encode("cp1252", "replace")
    for mark in (b"\\", b"(", b")"):
        plain = plain.replace(mark, b"\\" + mark)
    return f"BT /F{2 if bold else 1} {size:.2f} Tf {x:.2f} {y:.2f} Td (".encode() + plain + b") Tj ET"


def _file(title: str, drawn: Sequence[bytes]) -> bytes:
    """Catalog, page, fonts, contents, title and the table of their places."""
    content = b"\n".join(drawn)
    name = title.encode("cp1252", "replace").replace(b"\\", b"").replace(b"(", b"").replace(b")", b"")
    font = "<< /Type /Font /Subtype /Type1 /BaseFont /{} /Encoding /WinAnsiEncoding >>"
    objects = [
        b"<< /Type /Catalog /Pages 2 0 R >>",
        b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        f"<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {WIDTH:g} {HEIGHT:g}] /Contents 6 0 R "
        "/Resources << /Font << /F1 4 0 R /F2 5 0 R >> >> >>".encode(),
        font.format("Helvetica").encode(),
        font.format("Helvetica-Bold").encode(),
        b"<< /Length " + str(len(content)).encode() + b" >>\nstream\n" + content + b"\nendstream",
        b"<< /Title (" + name + b") /Producer (chipload) >>",
    ]
    out = bytearray(b"%PDF-1.4\n%\xe2\xe3\xcf\xd3\n")
    places = []
    for k, body in enumerate(objects, 1):
        places.append(len(out))
        out += f"{k} 0 obj\n".encode() + body + b"\nendobj\n"
    start = len(out)
    out += f"xref\n0 {len(objects) + 1}\n0000000000 65535 f \n".encode()
    out += b"".join(f"{place:010d} 00000 n \n".encode() for place in places)
    out += f"trailer\n<< /Size {len(objects) + 1} /Root 1 0 R /Info 7 0 R >>\nstartxref\n{start}\n%%EOF\n".encode()
    return bytes(out)
