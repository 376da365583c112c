"""Macro calls: words of G65 are arguments, G66 calls after each motion, M98 by its packed number.

Oracle: the argument tables of Fanuc B-63684EN and of the Haas manual, paths by hand.
"""

import pytest

from control_texts import ends, read

MACRO = "M30\nO64\nG0 X[#{number}]\nM99\n"
#: variable of each argument
TABLE = dict(
    zip(
        "ABCDEFHIJKMQRSTUVWXYZ",
        (1, 2, 3, 7, 8, 9, 11, 4, 5, 6, 13, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26),
        strict=True,
    )
)


@pytest.mark.parametrize("letter", TABLE)
def test_each_argument(letter):
    commands, findings = read(f"G65 P64 {letter}3.\n{MACRO.format(number=TABLE[letter])}", "haas")
    assert (ends(commands)[-1, 0], findings) == (3.0, [])


def test_m_s_t_and_f_of_a_call_are_not_carried_out():
    commands, findings = read("G65 P64 M30. S200. T7. F5.\nG0 Y9.\nM30\nO64\nG0 X#13\nM99\n")
    assert findings == []
    assert ends(commands)[-2:].tolist() == [[30, 0, 10], [30, 9, 10]]
    assert (commands.tool[-1], commands.spindle[-1]) == (1, pytest.approx(104.719755))


@pytest.mark.parametrize(
    ("words", "number", "value"),
    [
        ("I1. J2. K3. I4. J5. K6.", 7, 4.0),
        ("I1. J2. K3. I4. J5. K6.", 9, 6.0),
        ("I1. I2. I3.", 10, 3.0),
        ("A1. I2. D5.", 7, 5.0),
        ("I1. I2. D5.", 7, 5.0),
        ("D5. I1. I2.", 7, 2.0),
        ("Z2500", 26, 2.5),
        ("F2500", 9, 2500.0),
    ],
)
def test_repeated_and_mixed_arguments(words, number, value):
    """Of two words for one variable the later one counts; a number without a point counts as its word does."""
    commands, _ = read(f"G65 P64 {words}\n{MACRO.format(number=number)}")
    assert ends(commands)[-1, 0] == pytest.approx(value)


def test_a_thread_mill_by_a_macro():
    """M30. is the diameter of the thread: to the wall at 15, a full turn, back, and the program goes on."""
    macro = "O64\nG0 Z#26\nG1 X[#13/2] F#9\nG3 I-[#13/2]\nG1 X0.\nM99\n"
    commands, findings = read(f"G65 P64 M30. S3.5 Z-10. F200.\nG0 Z5.\nX100.\nM30\n{macro}")
    assert findings == []
    assert ends(commands)[-1].tolist() == [100, 0, 5]
    assert ends(commands)[:, 0].max() == 100


def test_a_modal_macro_is_called_after_each_motion():
    macro = "M30\nO66\nG0 Z#18\nG1 Z#26 F#9\nG0 Z#18\nM99\n"
    commands, findings = read(f"G66 P66 Z-5. R2. F100.\nX10.\nM8\nX20.\nG67\nX30.\n{macro}")
    assert findings == []
    path = [
        [10, 0, 10],
        [10, 0, 2],
        [10, 0, -5],
        [10, 0, 2],
        [20, 0, 2],
        [20, 0, 2],
        [20, 0, -5],
        [20, 0, 2],
        [30, 0, 2],
    ]
    assert ends(commands)[1:].tolist() == path


def test_packed_calls_of_a_fanuc_and_plain_ones_of_a_haas():
    """P68003: O8003 six times (guide to the 30i, p. 86); a Haas calls O68003."""
    body = "M98 P68003\nM30\nO8003\nG91 G0 X1.\nG90\nM99\nO68003\nG0 X50.\nM99\n"
    assert ends(read(body)[0])[-1, 0] == 6.0
    assert ends(read(body, "haas")[0])[-1, 0] == 50.0
