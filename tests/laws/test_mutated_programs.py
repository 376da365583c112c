"""Mutated programs: bytes flipped, lines cut and moved, numbers made huge. A refusal or Commands, nothing else."""

import random

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.program.gcode.reader import read_gcode
from chipload.program.gcode.tools import read_tool_table

TABLE = "T1 P1 D2 Z3\nT2 P2 D4 Z5 X1\nT3 P3 D0.5 Q2\n"
SEEDS = {
    "mill": "G21 G90 G17 F200\nT1 M6 G43\nS1000 M3\nG0 X1 Y2 Z5\nG1 Z-1\nX10 F300\nG2 X12 Y4 I2\n"
    "G3 X10 Y6 R2 Z-2\nG0 Z5\n",
    "cycles": "G98 G0 Z5\nF100\nG81 X1 Y1 Z-3 R1\nX2\nG83 X3 Z-4 R1 Q.5 L2\nG91 X1 L3\nG90 G80\n"
    "S9 M3\nG84 X1 Y1 Z-1 R1\n",
    "flow": "o<a> sub\n#1=[#1-1]\no1 if [#1 gt 0]\no<a> call [#1]\no1 else\nG0 X[#1+SIN[30]]\no1 endif\n"
    "o<a> endsub [#1]\n"
    "o<a> call [5]\n#<n>=0\no2 while [#<n> lt 4]\n#<n>=[#<n>+1]\nG1 Y#<n> F50\no2 endwhile\no3 repeat [3]\nG91 G0 X1\n"
    "o3 endrepeat\nG90\n",
    "offsets": "G10 L2 P1 X5 R30\nG10 L20 P2 Z1\nG55 G0 X1\nG52 X3\nG92 Y1\nG92.2\nG92.3\nG28 Z5\nG53 G0 Z0\nT2 M6\n"
    "G10 L10 P2 Z5\nG43 H2\nG43.1 X1\nG49\n(debug, #5420 #5221)\n",
    "comp": "F100\nT3 M6\nG0 X0 Y0\nG41.1 D1\nG1 X5\nY5\nG2 X7 Y7 I2\nG1 X10\nG4 P1\nX10 Y0\nG40\nG0 X0\n",
    "spline": "F100\nG0 X0 Y0\nG5 X10 Y0 I0 J3 P0 Q-3\nG5.1 X20 Y0 I5 J5\nG5.2 P1 L3 X21 Y1\nX22 Y2 P2\n"
    "X23 Y0 P1\nG5.3\nG0 X0\n",
    "modes": "G93 G1 X1 F2\nY1 A9 F3\nG94\nG20 F10\nG1 X1\nG95 S100 M3 F.1\nG1 Y1\nG96 D500 S90\nG97 S8\nM70\nG91\n"
    "M72\n@5 ^30\n"
    "G7\nG8\nG64 P.1\nG61\n",
}
HUGE = ["1e9", "99999999999999", "-" + "9" * 40, "." + "0" * 60 + "1", "0", "-0", "[1/3]", "[2**9999]", "#5421", "#1"]


def mutated(text, source):
    lines = text.split("\n")
    for _ in range(source.choice([1, 1, 1, 2, 3, 6])):
        k = source.randrange(len(lines))
        kind = source.randrange(7)
        if kind == 0 and lines[k]:
            at = source.randrange(len(lines[k]))
            lines[k] = (
                lines[k][:at]
                + chr(source.choice([source.randrange(32, 127), source.randrange(0, 300)]))
                + lines[k][at + 1 :]
            )
        elif kind == 1 and lines[k]:
            lines[k] = lines[k][: source.randrange(len(lines[k]))]
        elif kind == 2:
            lines[k] = ""
        elif kind == 3:
            lines[k], lines[0] = lines[0], lines[k]
        elif kind == 4:
            lines.insert(k, source.choice(lines))
        elif kind == 5 and any(c.isdigit() for c in lines[k]):
            places = [p for p, c in enumerate(lines[k]) if c.isdigit()]
            at = source.choice(places)
            lines[k] = lines[k][:at] + source.choice(HUGE) + lines[k][at + 1 :]
        elif kind == 6 and lines[k]:
            at = source.randrange(len(lines[k]))
            lines[k] = lines[k][:at] + source.choice("GMXYZOFSTNIJKPQRL#[]<>()%/=@^$;-. \t\n") + lines[k][at:]
    return "\n".join(lines)


@pytest.mark.parametrize("dialect", ["linuxcnc", "fanuc", "sinumerik"])
@pytest.mark.parametrize("name", SEEDS)
def test_a_mutated_program_is_read_or_refused(name, dialect):
    source = random.Random(f"{name} {dialect}")
    tools, _ = read_tool_table(TABLE)
    text = SEEDS[name] + "M2\n"
    read, refused = 0, []
    for _ in range(300 if dialect == "linuxcnc" else 100):
        trial = mutated(text, source)
        try:
            commands, findings = read_gcode(trial, name="m", tools=tools, dialect=dialect, most_blocks=2000)
        except InputError as error:
            refused.append(str(error))
            continue
        read += 1
        assert np.isfinite(commands.machine()).all()
        assert all(finding.text for finding in findings)
    assert all(text.startswith("m: line ") for text in refused)
    assert read > 0 or dialect != "linuxcnc"


@pytest.mark.parametrize("name", SEEDS)
def test_the_programs_themselves_are_read(name):
    commands, _ = read_gcode(SEEDS[name] + "M2\n", tools=read_tool_table(TABLE)[0])
    assert len(commands) > 3
