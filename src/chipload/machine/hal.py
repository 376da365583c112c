"""The text of a LinuxCNC configuration: sections and keys of the `.ini`, values that its HAL commands give to pins."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

from chipload.errors import Finding, InputError
from chipload.files import read_regular

#: largest file that is read [bytes]
MOST_BYTES = 1 << 20


@dataclass(frozen=True)
class Ini:
    """Values by section and key, in the order of the file; a key may occur more than once."""

    label: str
    folder: Path
    sections: dict[str, dict[str, list[str]]]

    def value(self, section: str, key: str) -> str | None:
        """The first value of a key; None: the key is missing or empty."""
        values = self.sections.get(section, {}).get(key)
        return values[0] if values and values[0] else None

    def values(self, section: str, key: str) -> list[str]:
        """All values of a key."""
        return self.sections.get(section, {}).get(key, [])


def read_sections(path: str | Path) -> tuple[Ini, list[Finding]]:
    """The sections of an `.ini` file; a trailing backslash joins lines, # and ; begin a comment line.

    Raises
    ------
    InputError
        The file cannot be read, is larger than ``MOST_BYTES`` or holds no section.
    """
    label = f"machine {path}"
    text = _text(label, Path(path))
    sections: dict[str, dict[str, list[str]]] = {}
    findings = []
    current: dict[str, list[str]] | None = None
    for number, line in enumerate(re.sub(r"\\\r?\n", " ", text).splitlines(), 1):
        line = line.strip()
        if line.startswith("#INCLUDE"):
            findings.append(Finding("ini-include", number, f"{line[8:].strip()} is not read"))
        elif line.startswith("[") and "]" in line:
            current = sections.setdefault(line[1 : line.index("]")].strip().upper(), {})
        elif line and line[0] not in "#;" and "=" in line and current is not None:
            key, value = line.split("=", 1)
            current.setdefault(key.strip().upper(), []).append(value.strip())
    if not sections:
        raise InputError(f"{label}: no [section]: must be a configuration of LinuxCNC")
    return Ini(label, Path(path).parent, sections), findings


def hal_pins(ini: Ini, findings: list[Finding]) -> dict[str, float]:
    """Numbers that the HAL commands of a configuration assign to pins, by ``setp`` or by ``sets`` on a signal.

    Files of `HALFILE` and `POSTGUI_HALFILE` are read if they are `.hal` files in the folder of the `.ini`. Each other
    file adds a finding to ``findings``.
    """
    commands = list(ini.values("HAL", "HALCMD"))
    for name in [*ini.values("HAL", "HALFILE"), *ini.values("HAL", "POSTGUI_HALFILE")]:
        path = ini.folder / name
        if re.fullmatch(r"[\w.\-]+\.hal", name) and path.is_file() and not path.is_symlink():
            commands += _text(f"machine {path}", path).splitlines()
        else:
            findings.append(Finding("ini-hal", 0, f"{name} is not read: only .hal files beside the .ini are"))
    pins: dict[str, float] = {}
    signals: dict[str, float] = {}
    nets: dict[str, str] = {}
    for command in commands:
        words = [word for word in command.split("#")[0].replace("=>", " ").replace("<=", " ").split() if word != "="]
        if words[:1] == ["setp"] and len(words) == 3:
            _store(pins, words[1], words[2])
        elif words[:1] == ["sets"] and len(words) == 3:
            _store(signals, words[1], words[2])
        elif words[:1] == ["net"] and len(words) > 2:
            nets |= dict.fromkeys(words[2:], words[1])
    return {**pins, **{pin: signals[signal] for pin, signal in nets.items() if signal in signals}}


def _store(values: dict[str, float], key: str, text: str) -> None:
    """Store a number under a key; a bit is 0 or 1; any other text is ignored."""
    try:
        value = {"true": 1.0, "false": 0.0}.get(text.lower())
        value = float(text) if value is None else value
    except ValueError:
        return
    if math.isfinite(value):
        values[key] = value


def _text(label: str, path: Path) -> str:
    return read_regular(path, label, MOST_BYTES, "must be a text of a configuration").decode("utf-8", "replace")
