"""Waves of records that do not cover one span of time, put on one clock."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.fft import fft, ifft, next_fast_len

from analyzer.plantwide.wave import Wave

SAME = 0.02
"""Difference of spans [periods] that is none; ours."""
FINE = 8
"""Samples of the envelope for each line."""
COVERED = 0.8
"""Share of the common span that a record has to cover to be compared at all; ours."""
Span = tuple[float, float]
"""Start [s since 1970-01-01 UTC] and duration [s]."""


def common_span(waves: Sequence[Wave]) -> Span:
    """The span that most waves have."""
    counted = Counter((w.start_s, w.duration_s) for w in waves)
    return max(counted, key=lambda span: (counted[span], span[1]))


def is_same(wave: Wave, span: Span) -> bool:
    """Whether a wave's lines are those of a span as they are."""
    drift = abs(wave.start_s - span[0]) + abs(wave.duration_s - span[1])
    return drift <= SAME * wave.period_s


def on_span(wave: Wave, span: Span) -> Wave | None:
    """The wave with the lines that it has over another span; None where its record covers too little of that."""
    if is_same(wave, span):
        return wave
    start, length = span
    begin, end = max(start, wave.start_s), min(start + length, wave.start_s + wave.duration_s)
    if end - begin < COVERED * length:
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


def on_one_clock(waves: Sequence[Wave]) -> list[Wave]:
    """The waves that can be compared, all over the span that most of them have; see on_span."""
    if not waves:
        return []
    span = common_span(waves)
    moved = (on_span(w, span) for w in waves)
    return [w for w in moved if w is not None]
