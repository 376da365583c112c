"""Chatter heard in the torque of a simulated cut: in the time domain, by angle, with teeth that lose contact."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from numba import njit

from chipload.control.chatter import ChatterAnswer, ChatterGuard, ListeningRules, WindowKind, listen
from chipload.control.chatter_stream import answers, quiet_speeds_of
from chipload.errors import InputError
from chipload.stability.margin import largest_multipliers, stability_margins
from chipload.stability.speeds import quiet_speeds
from stability.stability_oracles import HALF, KR, KT, TAU, TWO, cut_of, shapes

RATE, RADIUS, FEED, TEETH = 4000.0, 5.0, 0.05, 3
RULES = ListeningRules(RATE, 0.05, share=0.1, most=1.5)


@njit(cache=True)
def torque(steps, seconds, rpm, depth, st, ex, w, z, U, state, past, rate):
    """Torque [N m] sampled as the mean of what lies between two samples; ``state`` (2 M + 1,) and the surface that each
    tooth left by angle, ``past`` (teeth, steps), go on from call to call. The delay is that of the angle, so that it
    follows the speed.
    """
    M, teeth = len(w), len(past)
    dt = 60.0 / (rpm * teeth) / steps
    out = np.zeros(int(seconds * rate))
    time = 0.0
    total = 0.0
    count = 0
    at = 0
    i = int(state[2 * M])
    while at < len(out):
        x = (U[0] * state[:M]).sum()
        y = (U[1] * state[:M]).sum()
        ft = 0.0
        fn = 0.0
        for j in range(teeth):
            phi = ((i + 0.5) / steps + j) * 2.0 * math.pi / teeth
            if st < phi < ex:
                s = math.sin(phi)
                c = math.cos(phi)
                h = 0.05 * s + s * x + c * y - past[j, i]
                if h > 0.0:
                    ft -= depth * h * (700.0 * c + 210.0 * s)
                    fn -= depth * h * (210.0 * c - 700.0 * s)
                    total += 700.0 * depth * h * 5.0e-3
                    past[j, i] = s * x + c * y
                else:
                    past[j, i] -= 0.05 * s
        for k in range(M):
            f = (U[0, k] * ft + U[1, k] * fn) / w[k] ** 2
            wd = w[k] * math.sqrt(1 - z[k] ** 2)
            e = math.exp(-z[k] * w[k] * dt)
            c = math.cos(wd * dt)
            s = math.sin(wd * dt)
            a, v = state[k] - f, state[M + k]
            state[k] = f + e * (a * (c + z[k] * w[k] / wd * s) + v * s / wd)
            state[M + k] = e * (v * (c - z[k] * w[k] / wd * s) - a * w[k] ** 2 / wd * s)
        i = (i + 1) % steps
        count += 1
        time += dt
        if time >= (at + 1) / rate:
            out[at] = total / count
            total = 0.0
            count = 0
            at += 1
    state[2 * M] = i
    return out


class Cut:
    """A cut of half the diameter whose speed can be changed."""

    def __init__(self, depth):
        self.depth, self.steps = depth, 200
        self.w, self.z, U = shapes(TWO)
        self.U = np.ascontiguousarray(U)
        self.state, self.past = np.zeros(5), np.zeros((TEETH, self.steps))
        self.noise = np.random.default_rng(1)

    def sampled(self, seconds, rpm):
        out = torque(self.steps, seconds, rpm, self.depth, *HALF, self.w, self.z, self.U, self.state, self.past, RATE)
        return out + 0.005 * self.noise.standard_normal(len(out))


def test_the_constants_of_the_simulation_are_those_of_the_cut():
    assert (KT, KR, RADIUS, FEED) == (700.0, 210.0, 5.0, 0.05)


@pytest.mark.parametrize(
    ("rpm", "depth"), [(6000, 2.0), (7000, 2.0), (9000, 2.0), (9000, 3.0), (8000, 3.0), (6000, 5.0)]
)
def test_chatter_is_heard_where_the_map_says_that_the_cut_is_unstable(rpm, depth):
    cut = cut_of(TWO, rpm, depth, HALF)
    grows = abs(largest_multipliers(cut)[0]) > 1.0
    machine = Cut(depth)
    machine.sampled(1.0, rpm)
    windows = [listen(machine.sampled(RULES.window, rpm), rpm / 60.0, RULES) for _ in range(4)]
    assert {x.kind for x in windows} == {WindowKind.CHATTER if grows else WindowKind.QUIET}
    if grows:
        # torque moves with the chatter at its own frequency, beside those of the teeth that it is mixed with
        expected = stability_margins(cut).frequency[0]
        tooth = TEETH * rpm / 60.0
        off = [abs((x.hertz - expected + 0.5 * tooth) % tooth - 0.5 * tooth) for x in windows]
        mirrored = [abs((x.hertz + expected + 0.5 * tooth) % tooth - 0.5 * tooth) for x in windows]
        assert np.minimum(off, mirrored).max() < 30.0
    else:
        assert max(x.level for x in windows) < 0.02


def test_the_guard_finds_a_quiet_speed_and_the_chatter_ends():
    depth, rpm = 3.0, 9000.0
    speeds = np.linspace(5000.0, 15000.0, 101) * TAU / 60.0
    windows = [(w.low / TAU, w.high / TAU) for w in quiet_speeds([cut_of(TWO, rpm, depth, HALF)], speeds, 1.3).windows]
    guard, machine, told = ChatterGuard(RULES, rpm / 60.0, windows), Cut(depth), []
    for _ in range(14):
        speed = guard.override * rpm / 60.0
        told.append(guard.answer(machine.sampled(RULES.window, 60.0 * speed), speed))
    kinds = [x.kind for x in told]
    assert kinds.count(ChatterAnswer.SPEED) == 1
    k = kinds.index(ChatterAnswer.SPEED)
    assert 1 <= k <= 6
    assert ChatterAnswer.STOP not in kinds
    assert all(x.window.kind is WindowKind.QUIET for x in told[k + 4 :])
    new = guard.override * rpm
    assert any(60.0 * a < new < 60.0 * b for a, b in windows)
    assert stability_margins(cut_of(TWO, new, depth, HALF)).margin[0] > 1.2


def test_without_a_quiet_speed_in_reach_it_stops():
    rpm, machine = 9000.0, Cut(3.0)
    guard, answer = ChatterGuard(RULES, rpm / 60.0, [(400.0, 500.0)]), None
    for _ in range(10):
        answer = guard.answer(machine.sampled(RULES.window, rpm), rpm / 60.0)
        if answer.kind is ChatterAnswer.STOP:
            break
    assert answer is not None
    assert (answer.kind, guard.override) == (ChatterAnswer.STOP, 0.0)
    assert "no quiet speed within the override" in answer.text


def test_a_speed_that_moves_is_not_judged_and_too_slow_a_one_neither():
    y = np.sin(np.arange(1000) * 1.7)
    assert listen(y, np.linspace(100.0, 110.0, 1000), RULES).kind is WindowKind.UNSTEADY
    assert listen(y, 10.0, RULES).kind is WindowKind.UNSTEADY
    assert listen(y, 100.0, RULES).kind is WindowKind.CHATTER


def test_a_stream_is_answered_with_commands_of_halcmd(tmp_path):
    path = tmp_path / "summary.json"
    window = {"low_rpm": 10500.0, "high_rpm": 12500.0, "margin": 2.0}
    told = {"operations": [{"stability": {"windows": [window], "speed_rpm": 9000.0}}]}
    path.write_text(json.dumps(told))
    speed, windows = quiet_speeds_of(path)
    assert (speed, windows) == (150.0, ((175.0, 12500.0 / 60.0),))
    signal = Cut(3.0).sampled(4.0, 9000.0)
    lines = ["overrun", *(f"{k} {x:.6f} 150.0" for k, x in enumerate(signal))]
    found = [text for _, text in answers(lines, RULES, speed, windows, halui=True)]
    assert found[:4] == [
        "setp halui.spindle.0.override.scale 0.001", "setp halui.spindle.0.override.direct-value 1",
        "setp halui.spindle.0.override.counts 1000", "setp halui.spindle.0.override.count-enable 1",
    ]  # fmt: skip
    # 10 % inside of the window: 10700 rpm; the input still turns at 9000 rpm, where it stays: a stop
    assert found[4:] == ["setp halui.spindle.0.override.counts 1188", "setp halui.program.pause 1"]
    said = [text for _, text in answers(lines, RULES, speed, windows)]
    assert said[0].startswith("chatter at ")
    assert said[0].endswith(": 10700 rpm")


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: ListeningRules(0.0, 1.0), r"chatter\.rate_hz = 0"),
        (lambda: ListeningRules(1000.0, 0.0), r"chatter\.floor = 0: must be above 0: measure the signal in air"),
        (lambda: ListeningRules(100.0, 1.0), r"chatter\.window_s = 0\.25: must hold 64 samples"),
        (lambda: ChatterGuard(RULES, 0.0, []), "programmed speed of 0"),
        (lambda: listen(np.zeros(3), 100.0, RULES), "need 1000 finite ones"),
    ],
)
def test_what_cannot_be_heard_is_refused(make, text):
    with pytest.raises(InputError, match=text):
        make()


def test_a_summary_without_windows_is_refused(tmp_path):
    path = tmp_path / "summary.json"
    path.write_text('{"operations": [{"kind": "simulate"}]}')
    with pytest.raises(InputError, match=r"summary\.json: has no stability\.windows: simulate the program"):
        quiet_speeds_of(path)
