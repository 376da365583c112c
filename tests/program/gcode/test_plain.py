"""Plain blocks read fast are what the long way makes of them."""

import random

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.program.gcode import flow
from chipload.program.gcode.reader import read_gcode

LETTERS = "XYZABC"


def _text(source):
    lines = ["G20" if source.random() < 0.3 else "G21", "F100"]
    for _ in range(60):
        kind = source.random()
        axes = "".join(f" {x}{source.uniform(-9, 9):.{source.randrange(4)}f}" for x in LETTERS if source.random() < 0.4)
        if kind < 0.5:
            lines.append(source.choice(["", "G0", "G1", "G01 ", "N12 G1", "g1"]) + axes)
        elif kind < 0.65:
            r = source.uniform(1, 9)
            lines.append(
                f"G{source.choice([2, 3])} I{r:.3f} J{source.uniform(-3, 3):.2f}" + source.choice(["", " Z1", " A5"])
            )
        elif kind < 0.8:
            lines.append(f"G1{axes} F{source.choice([0, 5, 50.5])}")
        else:
            lines.append(
                source.choice(
                    [
                        "G17",
                        "G18",
                        "G90",
                        "G91",
                        "G93",
                        "G94",
                        "F30",
                        "G20",
                        "G21",
                        "",
                        "(note)",
                        "S5 M3",
                        "G80",
                        "G81 X1 Z-9 R9",
                        "G90.1",
                        "G91.1",
                        "T1 M6",
                        "G55",
                        "G7",
                        "G8",
                        "G1 X1 F7",
                    ]
                )
            )
    return "\n".join(lines) + "\nM2\n"


def _read(text):
    try:
        return read_gcode(text), ""
    except InputError as error:
        return None, str(error)


@pytest.mark.parametrize("seed", range(60))
def test_fast_as_the_long_way(seed, monkeypatch):
    source = random.Random(seed)
    text = _text(source)
    # cut where it would be refused, so that most of it is read
    for _ in range(60):
        got, refused = _read(text)
        if got is not None:
            break
        lines = text.split("\n")
        del lines[int(refused.split("line ")[1].split(":")[0]) - 1]
        text = "\n".join(lines)
    fast, slow = [], []
    for out, way in ((fast, flow.run_plain), (slow, lambda c, motion, lines, line: (line, 0))):
        monkeypatch.setattr(flow, "run_plain", way)
        out.extend(_read(text))
    assert fast[1] == slow[1]
    (one, noted), (two, said) = fast[0], slow[0]
    assert noted == said
    assert len(one) > 10
    for name in ("motion", "position", "plane", "centre", "turns", "feed", "spindle", "tool", "frame", "line"):
        assert np.array_equal(getattr(one, name), getattr(two, name)), name
