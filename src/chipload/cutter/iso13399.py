"""Reading of ISO 13399 tool data from exchange files of ISO 10303-21 (`.p21`): the properties that a cutter needs.

The reader takes values that carry their symbol, ``NUMERICAL_VALUE('DC', ...)``, as tool makers write them. It leaves
out values that only the code of a dictionary identifies. Lengths are in mm unless the unit of the value is inch.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from chipload.errors import InputError
from chipload.files import read_regular

#: symbol -> key of the ``[[cutter]]``; of several symbols the first one that the file states counts
SYMBOLS = {
    "DC": "diameter_mm", "RE": "corner_radius_mm", "LCF": "flute_length_mm", "APMX": "flute_length_mm",
    "DMM": "shank_diameter_mm", "DCONMS": "shank_diameter_mm", "FHA": "helix_deg", "ZEFF": "flutes", "NOF": "flutes",
    "RMPX": "ramp_angle_deg", "RPMX": "max_rpm", "TP": "thread_pitch_mm",
}  # fmt: skip
_LARGEST_FILE = 20_000_000
_VALUE = re.compile(
    r"NUMERICAL_VALUE\s*\(\s*'([A-Z0-9_]{1,20})'\s*,([^,()]*),([^,()]*),\s*([-+0-9.eE]+)\s*\)", re.IGNORECASE
)
_NAMED = re.compile(r"STRING_VALUE\s*\(\s*'([A-Z0-9_]{1,20})'\s*,\s*(?:\$\s*,\s*)?'([^']*)'\s*\)", re.IGNORECASE)


def read_iso13399(path: str | Path) -> dict[str, Any]:
    """Read a file as keys of a job's ``[[cutter]]``; values that it does not state are left out.

    Raises
    ------
    InputError
        The file cannot be read, is not an exchange file, has no diameter, or states a property with two values.
    """
    path = Path(path)
    label = f"cutter.file {path}"
    text = read_regular(path, label, _LARGEST_FILE, "not tool data").decode("utf-8", "replace")
    if not text.lstrip().startswith("ISO-10303-21"):
        raise InputError(f"{label}: not an exchange file: must begin with ISO-10303-21")
    units = dict(
        re.findall(r"#(\d+)\s*=\s*(?:\(|)?\s*(?:UNIT|[A-Z_]*UNIT[A-Z_]*)\s*\(([^;]*)\)\s*;", text, re.IGNORECASE)
    )
    found: dict[str, float] = {}
    for symbol, _, unit, number in _VALUE.findall(text):
        symbol = symbol.upper()
        if symbol not in SYMBOLS:
            continue
        try:
            value = float(number)
        except ValueError:
            raise InputError(f"{label}: {symbol} = {number[:40]!r}: must be a number") from None
        named = units.get(unit.strip().lstrip("#"), unit).upper()
        if "INCH" in named and SYMBOLS[symbol].endswith("_mm"):
            value *= 25.4
        if found.setdefault(symbol, value) != value:
            raise InputError(
                f"{label}: {symbol} is {found[symbol]:g} and {value:g}: must be one value: one tool a file"
            )
    if "DC" not in found:
        raise InputError(f"{label}: states no DC, the cutting diameter, by its symbol")
    out: dict[str, Any] = {}
    for symbol, key in SYMBOLS.items():
        if symbol in found:
            out.setdefault(key, int(found[symbol]) if key == "flutes" else found[symbol])
    names = {symbol.upper(): value for symbol, value in _NAMED.findall(text)}
    grade = names.get("BMC", "").lower()
    if grade in ("carbide", "hss"):
        out |= {"modulus_gpa": 580.0 if grade == "carbide" else 210.0, "tool_material": grade}
    return out
