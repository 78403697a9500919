"""Waves compared: put on one clock, which of two is later, and whose past foresees the others."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.fft import fft, ifft, next_fast_len

from analyzer.limits import WAVES
from analyzer.plantwide.wave import Wave
from identification.record import Floats
from identification.signals.cross_spectrum import Delay, band, granger_f, lag, tapered

FINE = 8
"""Samples of the envelope for each line."""
Span = tuple[float, float]
"""Start [s since 1970-01-01 UTC] and duration [s]."""


def on_one_clock(waves: Sequence[Wave]) -> list[Wave]:
    """The waves that can be compared, all over the span that most of them have."""
    if not waves:
        return []
    counted = Counter((w.start_s, w.duration_s) for w in waves)
    span = max(counted, key=lambda span: (counted[span], span[1]))
    moved = (_on_span(w, span) for w in waves)
    return [w for w in moved if w is not None]


def _on_span(wave: Wave, span: Span) -> Wave | None:
    """The wave with the lines that it has over another span; None where its record covers too little of that."""
    start, length = span
    if abs(wave.start_s - start) + abs(wave.duration_s - length) <= WAVES.same * wave.period_s:
        return wave
    begin, end = max(start, wave.start_s), min(start + length, wave.start_s + wave.duration_s)
    if end - begin < WAVES.covered * length:
        return None
    count = wave.lines.size
    size = next_fast_len(FINE * count)
    padded = np.zeros(size, dtype=np.complex128)
    padded[:count] = wave.lines
    envelope = ifft(padded) * size  # of the lines from wave.first on
    fresh = next_fast_len(max(math.ceil(FINE * count * length / wave.duration_s), 16))
    t = start + np.arange(fresh) * (length / fresh)
    at = (t - wave.start_s) / wave.duration_s * size
    inside = (at >= 0) & (at <= size - 1)
    real = np.interp(at, np.arange(size), envelope.real)
    imag = np.interp(at, np.arange(size), envelope.imag)
    z = np.where(inside, real + 1j * imag, 0.0)
    low = math.ceil(wave.first * length / wave.duration_s)
    turns = wave.first * (t - wave.start_s) / wave.duration_s - low * (t - start) / length
    lines = fft(z * np.exp(2j * np.pi * turns)) / fresh
    most = max(math.floor((wave.first + count) * length / wave.duration_s) - low, 1)
    return replace(wave, start_s=start, duration_s=length, first=low, lines=lines[:most].astype(np.complex64))


class Lags:
    """How much later each of some loops is than each other one; a pair is compared once."""

    def __init__(self, waves: Mapping[str, Wave]) -> None:
        self.waves = waves
        self._known: dict[tuple[str, str], Delay] = {}

    def between(self, one: str, other: str) -> Delay:
        """How much later the second loop's wave is than the first one's."""
        pair = one, other
        if pair not in self._known:
            self._known[pair] = _lag(self.waves[one], self.waves[other])
        return self._known[pair]


def _lag(one: Wave, other: Wave) -> Delay:
    low, high, _ = band(one.line)
    low = max(low, one.first + 1, other.first + 1)
    high = min(high, one.first + one.lines.size - 1, other.first + other.lines.size - 1)
    if high - low < 4:
        return Delay(0.0, math.inf, 0.0)
    x, y = (tapered(w.lines[low - w.first - 1 : high - w.first + 1]) for w in (one, other))
    return lag(x, y, one.duration_s, max(WAVES.lag_periods * one.period_s, WAVES.lag_least_s))


def _foreseeing(waves: Sequence[Wave]) -> tuple[list[int], Floats]:
    """Which of some waves have trends whose steps lie on each other, and Granger's F of each on each, shape (k, k);
    none where fewer than two have, or over too few steps."""
    step = max((w.step_s for w in waves if w.trend.size), default=0.0)
    found: list[tuple[int, int, Floats]] = []
    for i, w in enumerate(waves):
        few = round(step / w.step_s) if w.trend.size else 0
        if few < 1 or abs(few * w.step_s / step - 1.0) > 1e-6:
            continue
        skip = -w.trend_first % few
        count = (w.trend.size - skip) // few
        means = w.trend[skip : skip + count * few].reshape(count, few).mean(axis=1)
        found.append((i, (w.trend_first + skip) // few, means))
    begin = max((first for _, first, _ in found), default=0)
    end = min((first + x.size for _, first, x in found), default=0)
    if len(found) < 2 or end - begin < WAVES.least_steps:
        return [], np.zeros((0, 0))
    trends = np.array([x[begin - first : end - first] for _, first, x in found], float)
    return [i for i, *_ in found], granger_f(trends, WAVES.foreseen)


def foresees(waves: Sequence[Wave]) -> Floats:
    """Mean over the others of how much better each foresees them than they foresee it (-1 to 1), by Granger's F."""
    out = np.zeros(len(waves))
    known, f = _foreseeing(waves)
    if not known:
        return out
    clear = np.maximum(f, f.T) >= WAVES.least_f
    ratio = np.log(np.maximum(f, 0.1) / np.maximum(f.T, 0.1)) / math.log(WAVES.plain_ratio)
    out[known] = np.where(clear, np.clip(ratio, -1.0, 1.0), 0.0).sum(axis=1) / (len(known) - 1)
    return out


def foresight(one: Wave, others: Sequence[Wave]) -> float:
    """F with which one wave's past foresees others, in the median; 0 where theirs foresees it as well or better."""
    known, f = _foreseeing([one, *others])
    if known[:1] != [0]:
        return 0.0
    forth, back = float(np.median(f[0, 1:])), float(np.median(f[1:, 0]))
    return forth if forth > back else 0.0
