"""Damaged conversational programs: findings or one line of refusal, and an end."""

import random

from chipload.errors import InputError
from chipload.program.heidenhain import reader
from chipload.program.heidenhain.reader import read_heidenhain

TEXT = """BEGIN PGM T MM
TOOL DEF 5 L+30 R+2
TOOL CALL 5 Z S3000
CYCL DEF 7.0 DATUM SHIFT
CYCL DEF 7.1 X+4
Q1 = 3 * ( 2 + SQRT 16 )
L X+10 Y+0 Z+25 R0 FMAX M3
CYCL DEF 1.0 PECKING
CYCL DEF 1.1 DIST25.000
CYCL DEF 1.2 DEPTH-7
CYCL DEF 1.3 PLNGNG3.0
CYCL DEF 1.5 F240
L FMAX M99
LBL 1
L IX+Q1 F100
CC X+0 Y+0
C DR+
CALL LBL 1 REP 2/2
FN12: IF +Q1 LT +3 GOTO LBL 1
CP IPA+360 IZ-6 DR+
END PGM T MM
"""


def test_damage(monkeypatch):
    monkeypatch.setattr(reader, "MOST_BLOCKS", 20_000)
    rng = random.Random(1)
    refusals = []
    for _ in range(1500):
        lines = TEXT.splitlines()
        for _ in range(rng.randint(1, 3)):
            k = rng.randrange(len(lines))
            kind = rng.randrange(4)
            if kind == 0 and lines[k]:
                at = rng.randrange(len(lines[k]))
                lines[k] = lines[k][:at] + chr(rng.randrange(1, 255)) + lines[k][at + 1 :]
            elif kind == 1:
                lines[k] = lines[k][: rng.randrange(len(lines[k]) + 1)]
            elif kind == 2:
                lines.insert(k, lines[rng.randrange(len(lines))])
            else:
                lines[k] += rng.choice(["9" * 30, " X+1e999", " Q99999", "\\0", " REP 999999999"])
        try:
            commands, findings = read_heidenhain("\n".join(lines))
            assert len(commands) < 1_000_000
            assert len(findings) <= reader.KEPT
        except InputError as err:
            refusals.append(str(err))
    assert 300 < len(refusals) < 1500
    assert all(len(text.splitlines()) == 1 for text in refusals)
