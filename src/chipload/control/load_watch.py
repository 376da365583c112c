"""Sequential tests of a running spindle against its simulated program: no cut, more load, metal in the air, wrong tool.

Notation: a block of samples has the mean signal y above the idle signal; h = (C, E) are its parts by the cutting and
the edge coefficients of the material (gain times torque, times speed for power), x the scales of both for one tool, so
that m = h x is the prediction; S the variance of y about m. Before, x is (1, 1) with the covariance of the
coefficients and of the gain; the first LEARN_BLOCKS blocks of each tool in the cut, and later those of another mix of
C and E, update it. With d the deviation of m, a test of the means a (nothing is wrong) and b (a fault) sums

    l = [(y - a)^2 - (y - b)^2] / (2 S),    c = max(0, c + min(l, t / 3)),    alarm where c >= t

a is the end of the interval of m on the side of the fault, m exp(-3 d / m) or m exp(3 d / m). Where the mean is a, or
further from b than that, E[exp(l)] <= 1, so that the mean number of blocks between two false alarms is at least exp(t)
[Lorden1971]; a greatest l only makes it longer. t follows from the false alarms that are allowed in an hour.

A cut of less than about 2 s is one block: a window that begins and ends in the air
(:mod:`chipload.control.short_cuts`). The mean load does not tell a single broken tooth: the next one takes its chip.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from chipload.control.learning import Signal, tangential_shares
from chipload.control.log_alignment import PredictedTorque
from chipload.control.sample_clock import SampleClock
from chipload.control.sequential_test import SequentialTest, WatchSettings
from chipload.control.short_cuts import short_cuts
from chipload.cutting.load_parts import with_spread
from chipload.cutting.material import Material
from chipload.errors import Finding, InputError, Severity
from chipload.number_text import number_text

Floats = NDArray[np.float64]

#: deviations between the scale of a tool and the end of its interval
INTERVAL = 3.0
#: error of the predicted torque of a block, relative, and how well a scale is known at best
MODEL_ERROR, SCALE_ERROR = 0.05, 0.03
#: blocks that tell a wrong tool, that update the scales of a tool, and of air that tell the idle signal
TOOL_BLOCKS, LEARN_BLOCKS, AIR_BLOCKS = 10, 120, 3
#: a prediction above so many deviations of the noise is one that can be tested
SEEN = 5.0
#: the same of the mean over the window of a short cut, in which how long it cuts is open by more
SEEN_SHORT = 2.5
#: metal in the air: share of the greatest prediction that is looked for
METAL = 0.2
METAL_TEXT = (
    "a cut where the program cuts air: stock that should not be there, a wrong offset or length, or a collision"
)
#: share of a short cut by which it may be shorter than calculated, for the least that it must show
LEFT = 0.6
#: idle load over the greatest cut above which the unit of the signal is asked for
MOST_IDLE = 20.0
#: samples of the window of a short cut at least
LEAST_SAMPLES = 4
#: blocks of the idle signal that count, so that it may drift
IDLE_MEMORY = 120
#: deviations of the scale of a tool that are believed: of right tools 1 of 1,000 is further away
BELIEVED = 3.29
#: feed override below which the feed counts as held
LEAST_OVERRIDE = 0.05
#: rate at which a line may run faster or slower than calculated
PACE = 0.1


@dataclass(eq=False)
class _Mean:
    """Mean and variance of values, of the last ones most where there are many; and the mean of what their own samples
    say of their variance, as few values may lie near one another by chance.
    """

    count: int = 0
    mean: float = 0.0
    variance: float = 0.0
    within: float = 0.0

    def add(self, value: float, memory: int, within: float = 0.0) -> None:
        self.count += 1
        self.within += (within - self.within) / min(self.count, memory)
        weight = 1.0 / min(self.count, memory)
        step = value - self.mean
        self.mean += weight * step
        self.variance = (1.0 - weight) * (self.variance + weight * step * step)

    @property
    def scatter(self) -> float:
        """Variance of a value: that by the usual n - 1, or by its samples if that is greater."""
        between = self.variance * self.count / max(self.count - 1, 1) if self.count <= IDLE_MEMORY else self.variance
        return max(between, self.within)


@dataclass(eq=False)
class _ToolScale:
    """What is known of the scales of a tool: x and its covariance P, and sums over its first blocks."""

    x: Floats
    covariance: Floats
    blocks: int = 0
    top: float = 0.0
    bottom: float = 0.0
    misfit: float = 0.0
    recent: _Mean = field(default_factory=_Mean)

    def interval(self, parts: Floats) -> tuple[float, float, float]:
        """Return m, and the ends of its interval."""
        mean = float(parts @ self.x)
        floor = SCALE_ERROR * mean
        ratio = INTERVAL * math.hypot(math.sqrt(float(parts @ self.covariance @ parts)), floor) / mean
        return mean, mean * math.exp(-ratio), mean * math.exp(ratio)

    def update(self, parts: Floats, y: float, variance: float) -> None:
        """Take a block in which nothing is wrong, by the update of Kalman."""
        across = self.covariance @ parts
        gain = across / (float(parts @ across) + variance)
        self.x = np.maximum(self.x + gain * (y - float(parts @ self.x)), 0.05)
        self.covariance = self.covariance - np.outer(gain, across)


@dataclass(frozen=True, eq=False)
class _MeanLoad:
    """Mean signal, its parts by the coefficients and how far they may be wrong, row, length [s] and end, variance of
    the mean by its samples, and whether it is the window of a short cut.
    """

    signal: float
    parts: Floats
    misfit: float
    row: int
    seconds: float
    time: float
    scatter: float = 0.0
    is_short: bool = False


class LoadWatch:
    """The tests of one run of a program; samples are added as they come.

    Parameters
    ----------
    predicted : torque of the program
    signal : what is measured
    material : whose spread says how far a right tool may be from the prediction
    settings : what an alarm is
    """

    def __init__(
        self, predicted: PredictedTorque, signal: Signal, material: Material, settings: WatchSettings | None = None
    ) -> None:
        self._settings = settings or WatchSettings()
        self._program = predicted
        self._start = np.concatenate([[0.0], predicted.time[:-1]])
        factor = signal.gain * signal.of_torque(predicted.speed)
        self._parts = np.column_stack([factor * predicted.cutting, factor * predicted.edge])
        self._load = self._parts.sum(axis=1)
        self._greatest = float(self._load.max())
        if self._greatest <= 0.0:
            raise InputError("the program cuts nothing: there is nothing to watch")
        self._windows = short_cuts(predicted, self._settings.block_s, self._settings.lag_s, PACE)
        self._window = -1
        self._before = tangential_shares(with_spread(material)) + signal.gain_error**2
        self._tests = {name: SequentialTest(self._settings.threshold) for name in ("none", "more", "metal")}
        self._idle: dict[int, _Mean] = {}
        self._tools: dict[int, _ToolScale] = {}
        # row, line, and since when [s], time of the program in it, time of the last sample
        self._row, self._line, self._since, self._done, self._last = 0, -1, 0.0, 0.0, 0.0
        # time, value, place, override
        self._block: list[tuple[float, float, float, float]] = []
        self._blocks, self._told = 0, {"none": 0, "more": 0, "metal": 0}
        # blocks with which the line began, and that of the last line in which the tool was seen to cut
        self._line_since, self._cut_in = 0, -1
        self._begin: float | None = None
        self.seconds = self.cut_seconds = self.judged_seconds = 0.0
        self.finished = self._is_last = False
        # samples, those in a line that is not of the program, and the longest time between two
        self._samples = self._outside = 0
        self._apart = _Mean()
        #: of the samples
        self.clock = SampleClock()
        self._is_lost = False

    @property
    def why_not_judged(self) -> str:
        """What a stream lacks of which nothing could be judged."""
        if self._samples == 0:
            return "no sample was read"
        if self._outside > 0.9 * self._samples:
            share = number_text(100.0 * self._outside / self._samples, 3)
            return f"{share} % of the samples are of a line that the program does not have: state the job that runs"
        step = self.clock.first_jump[0] if 2 * self.clock.jumps > self._samples else self._apart.mean
        if 2.0 * step > self._settings.block_s:
            apart, most = number_text(step, 3), number_text(0.5 * self._settings.block_s)
            return f"samples are {apart} s apart, at most {most} s is needed: log faster, or check the unit of the time"
        known = [idle.mean for idle in self._idle.values() if idle.count >= AIR_BLOCKS]
        if not known:
            least = number_text(AIR_BLOCKS * self._settings.block_s)
            return f"the idle load is not known: {least} s of air at the speed of the cut are needed before it"
        if max(known) > MOST_IDLE * self._greatest:
            ratio = number_text(max(known) / self._greatest, 2)
            return f"the idle load is {ratio} times the greatest cut that is predicted: check the unit of the signal"
        return "no cut is well above the noise of the idle spindle, or each is too near to others"

    def add(self, time: float, value: float, line: int, override: float = 1.0) -> list[Finding]:
        """Take a sample and return the alarms that it raises.

        Parameters
        ----------
        time : [s]; a sample of before is left out, and a clock that jumps is that of :attr:`clock`
        value : of the signal
        line : of the program that runs
        override : of the feed
        """
        self._samples += 1
        jumps, before = self.clock.jumps, self.clock.now
        if not self.clock.take(time):
            return []
        time, is_first = self.clock.now, self._begin is None
        self._begin = time if self._begin is None else self._begin
        # where it is in its line is not known after a jump
        self._is_lost |= self.clock.jumps > jumps
        if not is_first:
            self._apart.add(time - before, self._samples)
        place = self._place(time, line, override)
        self._outside += self._row < 0
        out: list[Finding] = []
        window = self._windows.at(place)
        if self._block and (
            window != self._window or (window < 0 and time - self._block[0][0] >= self._settings.block_s)
        ):
            out = self._judge()
        self._window = window
        self._block.append((time, value, place, override))
        return out

    def end(self) -> list[Finding]:
        """Return the alarms of the last samples."""
        if self._window >= 0 and self._block:
            whole = min(float(self._windows.end[self._window]), float(self._program.time[-1]))
            if self._block[-1][2] < whole - self._settings.lag_s:
                # part of a short cut tells nothing
                return []
        return self._judge() if len(self._block) > 1 else []

    def _place(self, time: float, line: int, override: float) -> float:
        """Return the time of the program at a sample; -1: its line is not of the program."""
        if line != self._line:
            # the last line is left
            self.finished |= self._row >= 0 and self._is_last
            rows = np.flatnonzero(self._program.line == line)
            if not len(rows):
                self._line, self._since = line, time
                self._row = -1
                return -1.0
            # a line that runs again, as in a subprogram: its next run
            later = rows[rows >= max(self._row, 0)]
            self._row = int(later[0] if len(later) else rows[0])
            self._line, self._since, self._line_since = line, time, self._blocks
            self._done, self._last, self._is_lost = 0.0, time, False
        if self._row < 0 or self._is_lost:
            return -1.0
        self._done += max(time - self._last, 0.0) * override
        self._last = time
        place = float(self._start[self._row]) + self._done
        # the last row of this run of the line
        other = np.flatnonzero(self._program.line[self._row :] != line)
        last = self._row + int(other[0]) - 1 if len(other) else len(self._start) - 1
        self._is_last = last == len(self._start) - 1
        self.finished |= self._is_last and place >= float(self._program.time[-1])
        return min(place, float(self._program.time[last]))

    def _judge(self) -> list[Finding]:
        """Test the block that is complete."""
        if self._window >= 0:
            return self._judge_window()
        times, values, places, overrides = (np.array(x) for x in zip(*self._block, strict=True))
        self._block = []
        self._blocks += 1
        seconds = min(self._settings.block_s, float(times[-1] - times[0]) * len(times) / max(len(times) - 1, 1))
        self.seconds += seconds
        if len(times) < 2 or (places < 0.0).any() or (overrides < LEAST_OVERRIDE).any():
            return []
        rows = np.minimum(np.searchsorted(self._program.time, places), len(self._load) - 1)
        # the chip follows the feed, the edge force does not
        parts = self._parts[rows].mean(axis=0) * np.array([overrides.mean(), 1.0])
        lag = self._settings.lag_s + PACE * float(times[-1] - self._since if times[-1] > self._since else 0.0)
        first = int(np.searchsorted(self._program.time, places[0] - lag))
        last = int(np.searchsorted(self._program.time, places[-1] + lag)) + 1
        near = self._load[first:last]
        near = near if len(near) else self._load[-1:]
        # beyond the end of its line a sample is not: the line tells where it is
        misfit = float(near.max() - near.min()) * min(lag / self._settings.block_s, 1.0)
        row = int(rows[len(rows) // 2])
        return self._test_block(_MeanLoad(float(values.mean()), parts, misfit, row, seconds, float(times[-1]),
                                       float(values.var(ddof=1)) / len(values)))  # fmt: skip

    def _judge_window(self) -> list[Finding]:
        """Test the window of a short cut that is complete."""
        times, values, places, overrides = (np.array(x) for x in zip(*self._block, strict=True))
        self._block, k, known = [], self._window, self._windows
        self._blocks += 1
        if len(times) < LEAST_SAMPLES:
            return []
        steps = np.diff(times, append=2.0 * times[-1] - times[-2])
        seconds = float(steps.sum())
        self.seconds += seconds
        length = float(known.end[k] - known.begin[k])
        late = places[0] > max(known.cut[k], known.begin[k] + steps.max()) or steps.max() > self._settings.block_s
        if late or (overrides < LEAST_OVERRIDE).any() or seconds * overrides.mean() > 2.0 * length:
            return []
        rows = np.minimum(np.searchsorted(self._program.time, places), len(self._load) - 1)
        share = steps / seconds
        parts = np.array([share @ (self._parts[rows, 0] * overrides), share @ self._parts[rows, 1]])
        # how long it cuts, and where it is at a border in a cut
        late_s = float(known.late[k] + steps.max())
        peak = int(np.argmax(self._load[rows]))
        borders = math.sqrt(2.0) if known.divided[k] else 1.0
        misfit = 0.5 * float(self._load[rows[peak]]) * min(borders * late_s / seconds, 1.0)
        at = int(rows[peak])
        block = _MeanLoad(float(share @ values), parts, misfit, at, seconds, float(times[-1]), is_short=True)
        return self._test_block(block)

    def _test_block(self, block: _MeanLoad) -> list[Finding]:
        """Return the alarms of a block by its mean signal and prediction."""
        row, parts, misfit = block.row, block.parts, block.misfit
        idle = self._idle.setdefault(round(float(self._program.speed[row])), _Mean())
        is_air = not parts.any()
        self.cut_seconds += 0.0 if is_air else block.seconds
        self._cut_in = -1 if is_air else self._cut_in
        if idle.count < AIR_BLOCKS:
            if is_air and misfit == 0.0:
                idle.add(block.signal, IDLE_MEMORY, block.scatter)
            return []
        y = block.signal - idle.mean
        noise = idle.scatter * (1.0 + 1.0 / idle.count)
        if is_air:
            return self._in_air(block, y, noise, idle) if misfit == 0.0 else []
        number = int(self._program.tool[row])
        tool = self._tools.setdefault(number, _ToolScale(np.ones(2), self._before))
        mean = float(parts @ tool.x)
        misfit *= max(mean / float(parts.sum()), 1.0)
        if mean < (SEEN_SHORT if block.is_short else SEEN) * math.sqrt(noise + misfit**2):
            return []
        self.judged_seconds += block.seconds
        return self._in_cut(tool, y, noise, misfit, block)

    def _in_air(self, block: _MeanLoad, y: float, noise: float, idle: _Mean) -> list[Finding]:
        fault = METAL * self._greatest
        variance = noise + (0.01 * self._greatest) ** 2
        if self._tests["metal"].add((y * y - (y - fault) ** 2) / (2.0 * variance), self._blocks):
            return self._alarm("metal", block, METAL_TEXT)
        # a cut in the air is no idle load
        if y * y < BELIEVED**2 * variance:
            idle.add(block.signal, IDLE_MEMORY, block.scatter)
        return []

    def _in_cut(self, tool: _ToolScale, y: float, noise: float, misfit: float, block: _MeanLoad) -> list[Finding]:
        out: list[Finding] = []
        row, parts, length = block.row, block.parts, max(block.seconds / self._settings.block_s, 1.0)
        number, none, more = int(self._program.tool[row]), self._tests["none"], self._tests["more"]
        mean, low, high = tool.interval(parts)
        variance = noise + (MODEL_ERROR * mean) ** 2 + misfit**2
        least, scatter = low, variance
        if block.is_short and 2.0 * block.misfit < LEFT * float(parts.sum()):
            # the cut lasts as long as it must at least, in place of a deviation
            least, scatter = low * (1.0 - 2.0 * block.misfit / float(parts.sum())), variance - misfit**2
        if none.add(((y - least) ** 2 - y * y) / (2.0 * scatter), self._blocks, length):
            out += self._alarm("none", block, self._missing(number))
        worn, before = max(self._settings.wear * mean, 1.1 * high), tool.recent.mean
        if more.add(((y - high) ** 2 - (y - worn) ** 2) / (2.0 * variance), self._blocks, length):
            rises = before > 1.0 + (self._settings.wear - 1.0) / 3.0
            cause = "it grew: the edge is worn" if rises else "at once: more stock, a harder place, or a chipped edge"
            share = number_text(100.0 * (y / mean - 1.0), 2)
            out += self._alarm("more", block, f"tool {number} takes {share} % more than it did, or than is "
                               f"predicted; {cause}")  # fmt: skip
        if none.sum > 0.0 or out:
            # what cuts nothing tells nothing of the tool
            return out
        # the first block of a line holds the end of the one before
        self._cut_in = self._line_since if self._blocks > self._line_since + 1 else self._cut_in
        if tool.blocks < LEARN_BLOCKS:
            tool.top, tool.bottom = tool.top + y, tool.bottom + float(parts.sum())
            tool.misfit += block.misfit if block.is_short else 0.0
            if tool.blocks + 1 == TOOL_BLOCKS:
                out += self._right_tool(tool, number, block)
        if more.sum == 0.0 or y < worn:
            tool.recent.add(y / mean, 2 * TOOL_BLOCKS)
        if more.sum == 0.0 and (tool.blocks < LEARN_BLOCKS or (high / mean) > math.exp(2.0 * INTERVAL * SCALE_ERROR)):
            tool.update(parts, y, variance)
        tool.blocks += 1
        return out

    def _right_tool(self, tool: _ToolScale, number: int, block: _MeanLoad) -> list[Finding]:
        """Return an alarm where no right tool takes what the first blocks of this one did."""
        scale = tool.top / tool.bottom
        share = block.parts / block.parts.sum()
        known = math.hypot(math.sqrt(float(share @ self._before @ share)), MODEL_ERROR, tool.misfit / tool.bottom)
        # as wide as a normal and a lognormal spread of the coefficients
        low, high = min(1.0 - BELIEVED * known, math.exp(-BELIEVED * known)), math.exp(BELIEVED * known)
        if low <= scale <= high:
            return []
        text = (
            f"tool {number} takes {number_text(scale, 2)} times what is predicted, {number_text(max(low, 0.0), 2)} to "
            f"{number_text(high, 2)} times is believed: a wrong tool or material, or the efficiency"
        )
        text += "" if 0.2 < scale < 5.0 else ", or the unit of the signal"
        line = int(self._program.line[block.row])
        return [Finding("watch-tool", line, f"{self._at(block.time)}: {text}", Severity.UNPROVEN)]

    def _missing(self, number: int) -> str:
        if self._cut_in == self._line_since:
            return f"tool {number} stopped to cut in the cut: it is broken, or out of its holder"
        return f"tool {number} cuts air where the program cuts material: missing stock, or it broke before"

    def _at(self, time: float) -> str:
        """The time since the first sample."""
        return f"{number_text(time - (self._begin or 0.0))} s"

    def _alarm(self, name: str, block: _MeanLoad, text: str) -> list[Finding]:
        """Return the alarm of a test, once a line."""
        line = int(self._program.line[block.row])
        if self._told[name] == line:
            return []
        self._told[name] = line
        code = {"none": "watch-air", "more": "watch-more", "metal": "watch-metal"}[name]
        return [Finding(code, line, f"{self._at(block.time)}: {text}", Severity.UNPROVEN)]
