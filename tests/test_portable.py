"""What differs between systems, simulated on Linux: encodings of consoles and files, ends of lines."""

from __future__ import annotations

import ast
import io
import sys
from pathlib import Path

import pytest

from chipload import cli

SOURCE = Path(__file__).parents[1] / "src" / "chipload"
#: calls that open a text file, and modes that write
OPENS, WRITES = {"open", "read_text", "write_text", "fdopen"}, ("w", "a", "x")
#: scripts of the simulated LinuxCNC, which is Linux alone
LINUX = SOURCE / "examples" / "tube" / "linuxcnc"


@pytest.mark.parametrize("encoding", ["cp1252", "cp437"])
def test_a_console_of_one_country_prints_names_of_another(encoding, tmp_path, monkeypatch):
    program = tmp_path / "部品-\u03bc.ngc"
    program.write_text("G21 G90 G17\nG0 X0 Y0 Z5\nG0 X10\nM30\n", encoding="ascii", newline="\n")
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding=encoding) for _ in range(2))
    monkeypatch.setattr(sys, "stdout", out)
    monkeypatch.setattr(sys, "stderr", err)
    monkeypatch.setattr(sys, "argv", ["chipload", "check", str(program)])
    with pytest.raises(SystemExit) as end:
        cli.main()
    out.flush()
    err.flush()
    text = (out.buffer.getvalue() + err.buffer.getvalue()).decode(encoding)
    assert end.value.code == 0, text
    assert "\\u90e8\\u54c1-" in text


def text_calls(source: str) -> list[tuple[str, int, bool, bool]]:
    """Name, line, whether the encoding is stated, and whether the ends of lines are or need not be, of each call."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Call):
            continue
        name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        if name not in OPENS or ast.unparse(node.func).startswith("os."):
            continue
        texts = [a.value for a in node.args if isinstance(a, ast.Constant) and isinstance(a.value, str)]
        texts += [k.value.value for k in node.keywords if k.arg == "mode" and isinstance(k.value, ast.Constant)]
        named = {k.arg for k in node.keywords}
        mode = next((t for t in texts if set(t) <= set("rwaxbt+")), "w" if name == "write_text" else "")
        is_file = name != "open" or isinstance(node.func, ast.Name) or bool(mode) or "encoding" in named
        if is_file and "b" not in mode:
            encoded = "encoding" in named or any(t in {"utf-8", "utf-8-sig", "ascii", "latin-1"} for t in texts)
            found.append((name, node.lineno, encoded, "newline" in named or not mode.startswith(WRITES)))
    return found


def test_a_text_file_states_its_encoding_and_its_ends_of_lines():
    """Without them Windows reads and writes cp1252 with CRLF: another result from the same input."""
    bad = [
        f"{path.relative_to(SOURCE)}:{line} {name}"
        for path in sorted(SOURCE.rglob("*.py"))
        if LINUX not in path.parents
        if any(f"{call}(" in (text := path.read_text(encoding="utf-8")) for call in OPENS)
        for name, line, encoded, ended in text_calls(text)
        if not (encoded and ended)
    ]
    assert not bad


@pytest.mark.parametrize(
    ("source", "fine"),
    [
        ("path.write_text('a')", False),
        ("path.write_text('a', encoding='utf-8')", False),
        ("path.write_text('a', 'utf-8', newline='')", True),
        ("open(path, 'w', encoding='utf-8')", False),
        ("path.read_text()", False),
        ("path.read_text('utf-8')", True),
        ("path.open('rb')", True),
        ("self.dialog.open()", True),
        ("os.fdopen(number, mode='wb')", True),
    ],
)
def test_a_call_without_them_is_found(source, fine):
    assert all(encoded and ended for _, _, encoded, ended in text_calls(source)) == fine
