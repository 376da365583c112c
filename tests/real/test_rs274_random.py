"""Random programs of motions, cycles, offsets and modes: LinuxCNC's interpreter and ours make the same of them."""

import random

import pytest

from canonical import Refused, compare_commands, parse_canonical, run_canonical
from chipload.errors import InputError
from chipload.program.gcode.reader import read_gcode
from chipload.program.gcode.tools import read_tool_table
from rs274 import MISSING, rs274_installed

TABLE = "T1 P1 D0.2 Z3\nT2 P2 D0.4 Z5 X1\nT3 P3 D0.1 Z1 Y2\n"
SAID = "(debug,#5420 #5421 #5422 #5423 #5220 #5221 #5222 #5230 #5211 #5212 #5210 #5161 #5183)"
MODES = [
    "G17",
    "G18",
    "G19",
    "G20",
    "G21",
    "G90",
    "G91",
    "G90.1",
    "G91.1",
    "G98",
    "G99",
    "G54",
    "G55",
    "G59",
    "G59.3",
    "G92.1",
    "G92.2",
    "G92.3",
    "G43 H1",
    "G43 H2",
    "G49",
    "G43.2 H3",
    "S100 M3",
    "M4 S50",
    "M5",
    "G93",
    "G94 F100",
    "G95 F.2 S100",
    "F50",
    "G28.1",
    "G30.1",
    "G61",
    "G64 P.1",
    "G80",
    "M70",
    "M72",
    "G7",
    "G8",
    "T2",
    "G0",
    "#1=2 #2=[#1*2]",
    "G0 X#1 Y[#2-#1/3]",
]


class Maker:
    def __init__(self, seed):
        self.r = random.Random(seed)

    def number(self, low=-9.0, high=9.0):
        return f"{self.r.uniform(low, high):.{self.r.randrange(4)}f}"

    def axes(self):
        letters = self.r.sample("XYZ", self.r.randint(1, 3)) + (["A"] if self.r.random() < 0.1 else [])
        return "".join(f" {x}{self.number()}" for x in letters)

    def motion(self):
        return self.r.choice(
            [
                lambda: self.r.choice(["G0", "G1", ""]) + self.axes(),
                lambda: f"G1{self.axes()} F{self.number(1, 500)}",
                lambda: f"G{self.r.choice([2, 3])}{self.axes()} R{self.number(-20, 20)}",
                lambda: f"G{self.r.choice([2, 3])} {self.r.choice('IJK')}{self.number()} P{self.r.randint(1, 3)}",
                lambda: f"G{self.r.choice([28, 30])}{self.axes()}",
                lambda: f"G53 G0{self.axes()}",
                lambda: f"@{self.number(1)} ^{self.number(0, 360)}",
                lambda: f"G5 X{self.number()} Y{self.number()} I1 J2 P1 Q-2",
            ]
        )()

    def mode(self):
        return self.r.choice(
            [
                lambda: self.r.choice(MODES),
                lambda: self.r.choice(MODES),
                lambda: f"G10 L{self.r.choice([2, 20])} P{self.r.randint(0, 9)}{self.axes()}",
                lambda: f"G10 L2 P{self.r.randint(0, 3)} R{self.number(-90, 90)}",
                lambda: f"G10 L{self.r.choice([1, 10, 11])} P{self.r.randint(1, 3)}{self.axes()}",
                lambda: f"G{self.r.choice([92, 52])}{self.axes()}",
                lambda: f"G43.1{self.axes()}",
                lambda: f"G4 P{self.number(0, 3)}",
                lambda: SAID,
            ]
        )()

    def cycle(self):
        bottom = self.r.uniform(-9, 3)
        r = bottom + self.r.uniform(-0.5, 6.0)
        code = self.r.choice([73, 81, 82, 83, 84, 85, 86, 87, 89])
        block = f"G{code} X{self.number()} Y{self.number()} Z{bottom:.2f} R{r:.2f}"
        block += {73: " Q1.3", 83: " Q0.7", 82: " P1", 86: " P0", 89: " P.5", 87: " I1 J2 K-1"}.get(code, "")
        after = [
            f"X{self.number()}",
            f"Y{self.number()} L2",
            f"X{self.number()} R{r + 1.0:.2f}",
            "G98",
            "G99",
            "G91",
            "G80",
            block,
        ]
        return "\n".join([block, *self.r.choices(after, k=self.r.randrange(4))])

    def program(self):
        lines = [self.r.choice(["G20", "G21"]), "F100"]
        lines += self.r.choice([[], ["T1 M6"], ["G0 X1 Y1 Z5"], ["S9 M3", "G0 Z9"]])
        for _ in range(5):
            lines.append(self.r.choice([self.motion, self.motion, self.mode, self.mode, self.cycle])())
        return "\n".join(lines) + "\nM2\n"


@pytest.mark.skipif(not rs274_installed(), reason=MISSING)
@pytest.mark.parametrize("block", range(10))
def test_the_same_motions(block):
    tools, _ = read_tool_table(TABLE, units="inch")
    compared = 0
    for seed in range(12 * block, 12 * block + 12):
        text = Maker(seed).program()
        try:
            commands, findings = read_gcode(text, tools=tools, machine_units="inch")
        except InputError as error:
            with pytest.raises(Refused):
                pytest.fail(f"we refuse it: {error}\n{text}\n{run_canonical(text, table=TABLE)}")
            continue
        motions, messages = parse_canonical(run_canonical(text, table=TABLE))
        compared += compare_commands(motions, commands)
        said = [x.text for x in findings if x.code == "nc-message"]
        wanted = [x.replace("-0.000000", "0.000000") for x in messages]
        assert list(dict.fromkeys(said)) == list(dict.fromkeys(wanted))
    assert compared > 10
