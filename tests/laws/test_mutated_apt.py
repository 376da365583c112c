"""A damaged text is refused or read with findings; nothing else is raised, and no Program is out of bounds."""

from __future__ import annotations

import numpy as np

from chipload.errors import InputError
from chipload.program.apt.reader import read_apt
from program.apt.cl_points import read_cl_points

SEED = """$$-> MFGNO / X
PARTNO/ A
UNITS/MM
PPRINT/ one
CUTTER/10.,1.,4.,1.,0,0,50.
LOAD/TOOL,3
COOLNT/FLOOD
SPINDL/3500,RPM,CLW
TRNTYP/WORLD,0,0,0
CSYS/0,-1.,0,3.,1.,0,0,4.,0,0,1.,5.
RAPID/
GOTO/44.,32.5,25.
FEDRAT/889.,MMPM
GOTO/44.,32.5,0
CUTCOM/LEFT
CIRCLE/44.,42.5,0,0,0,1.
GOTO/54.,42.5,0
MULTAX/ON
GOTO/54.,42.5,10.,0.6,0,0.8
CIRCLE/54.,47.5,10.,0,0,1.
GOTO/54.,52.5,10.,0,0.6,0.8
GODLTA/1.,2.,3.
DELAY/2.
MULTAX/OFF
TRNTYP/LOCAL
CYCLE/DEEP2,FEDTO,9.,1STPECK,5.,SUBPECK,2.,MMPM,382.,RAPTO,3.,RTRCTO,25.
GOTO/44., $
32.5,0
CYCLE/ DRILL,G98,12.3,PECKING,5.0,2.0,MMPM,187.,3.0,46.9 46.9 DWELL,0.0
GOTO/74.,17.5,0
CYCLE/TAP,DEPTH,5,CLEAR,2,MMPR,1.5
GOTO/74.,17.5,0
CYCLE/OFF
TLAXIS/0,-1,0
ROTABL/90,AAXIS,TABLE,CCLW
GOTO/1,2,3
FINI
"""
NUMBERS = ("1E9", "-1E9", "1e400", "nan", "inf", "0", "-1", "1e-300", "9" * 500, "", "$", "1/0", "AUTO", "0x10")


def mutated(rng, text):
    """One damage: bytes, lines cut, doubled or moved, a number changed."""
    kind = rng.integers(5)
    if kind == 0:
        data = bytearray(text.encode())
        for k in rng.integers(len(data), size=rng.integers(1, 6)):
            data[k] = rng.integers(256)
        return bytes(data).decode("utf-8", "replace")
    lines = text.splitlines()
    k = int(rng.integers(len(lines)))
    if kind == 1:
        del lines[k : k + int(rng.integers(1, 6))]
    elif kind == 2:
        lines.insert(int(rng.integers(len(lines))), lines[k])
    elif kind == 3:
        lines[k] = lines[k][: rng.integers(len(lines[k]) + 1)]
    else:
        head, slash, rest = lines[k].partition("/")
        args = rest.split(",")
        args[rng.integers(len(args))] = str(rng.choice(NUMBERS))
        lines[k] = head + slash + ",".join(args)
    return "\n".join(lines) + "\n"


def outcome(read, text, **options):
    """The Program, or the message of the refusal; any other error ends the test."""
    try:
        return read(text, **options)[0]
    except InputError as err:
        return str(err)


def test_the_seed_itself_is_read():
    program, findings = read_apt(SEED)
    assert len(program) > 35
    assert {f.code for f in findings} == {"apt-comment", "apt-unused", "apt-cutcom", "apt-coordinates"}


def test_damaged_texts():
    rng = np.random.default_rng(7)
    read = refused = 0
    for _ in range(1500):
        text = SEED
        for _ in range(rng.integers(1, 4)):
            text = mutated(rng, text)
        found = outcome(read_apt, text)
        if isinstance(found, str):
            assert 0 < len(found) < 500
            refused += 1
        else:
            assert np.isfinite(found.p_work).all()
            assert len(found) < 200_000
            read += 1
    assert read > 300
    assert refused > 300


def test_damaged_tables():
    rng = np.random.default_rng(8)
    seed = "\n".join(" ".join(f"{x:.4f}" for x in row) for row in rng.normal(size=(20, 6)))
    refused = 0
    for _ in range(300):
        found = outcome(read_cl_points, mutated(rng, seed), feed=1.0, spindle=0.0, tool=1)
        if isinstance(found, str):
            assert 0 < len(found) < 500
            refused += 1
    assert 50 < refused < 300
