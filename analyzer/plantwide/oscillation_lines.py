"""Data of a loop for the plant-wide pass: the spectral lines of its error near each possible common period, and the
conversion of many loops to one clock."""

from __future__ import annotations

import math
import os
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, BinaryIO

import numpy as np
import pyarrow as pa
from scipy.fft import fft, ifft, irfft, next_fast_len

from analyzer.config import PlantLimits
from analyzer.loop.oscillation.detection import Oscillations, peaks
from identification.record import Floats
from identification.signals.spectrum import Complex, Spectrum, locked_harmonic, peak_prominence

MOST_OSCILLATIONS = 8
"""Periods of a loop that are compared with those of others, at most: more were never shared."""

REACH = 1.35
"""Factor to either side of a period's frequency up to which lines are kept, for neighbours whose period
differs."""
STEPS = 12  # Steps of a period that a trend keeps at least
TREND_STEPS = 2400  # Steps of a trend at most: a hundred periods show which loop predicts which
APART = 1.2  # Ratio from which two peaks of one loop are two oscillations
ENVELOPE = 0.5
"""An oscillation is present if its envelope exceeds this share of its 90 % quantile: as an oscillation's
is."""
SAME = 0.02  # Difference of two spans that counts as zero [periods]
COVERED = 0.8  # Share of the common span that a record has to cover for a comparison

FINE = 8
"""Samples of the envelope for each line."""
EXTRA_LINES = 6
"""Additional lines on either side."""
HARMONICS = (2, 3)
"""Harmonics that are used; ours: higher ones are below the noise."""


@dataclass(frozen=True, slots=True)
class OscillationLines:
    """Spectral lines of a loop's error near one period.

    loop; period_s [s]; harmonic, 1 for a period of the loop's own, m for the m-th harmonic of one; own, whether the
    loop alone shows the oscillation; start_s, duration_s of the record [s], line k being the frequency k /
    duration_s; first, the number of the first stored line; prominence of the peak [-]; share of the error's power
    above slow drift in the band [-]; nonlinearity, size of the phase-locked harmonics over the fundamental [-];
    lines, complex, shape (m,), scaled so that a sine of amplitude a [% of span] has a line of size a; trend, the
    error in steps of step_s [s] at the record's end, shape (t,), its first step the number trend_first since 1970.
    """

    loop: str
    period_s: float
    harmonic: int
    own: bool
    start_s: float
    duration_s: float
    first: int
    prominence: float
    share: float
    nonlinearity: float
    lines: Complex = field(repr=False)
    step_s: float = 1.0
    trend_first: int = 0
    trend: Floats = field(default_factory=lambda: np.zeros(0), repr=False)

    @property
    def line(self) -> float:
        """The period's frequency in lines: number of periods in the record."""
        return self.duration_s / self.period_s

    @property
    def amplitude_pct(self) -> float:
        """Half of peak to peak over the whole record [% of span]."""
        low, high = round(self.line / 1.2) - self.first, round(self.line * 1.2) - self.first
        return float(np.sqrt(np.sum(np.abs(self.lines[max(low, 0) : high + 1]) ** 2)))

    @property
    def oscillating_pct(self) -> float:
        """Share of the time with the oscillation [%]."""
        size = next_fast_len(max(4 * self.lines.size, 16))
        power = (np.abs(ifft(self.lines, size)) * size) ** 2
        width = max(round(2 * size / self.line), 1)
        padded = np.pad(power, width, mode="reflect")
        level = np.sqrt(np.convolve(padded, np.ones(width) / width, mode="same"))[width:-width]
        top = float(np.quantile(level, 0.9))
        on = level >= ENVELOPE * top if top > 0 and math.isfinite(top) else np.zeros(1)
        return 100.0 * float(np.mean(on))


def _centred(s: Spectrum, line: float) -> float:
    """Period [s] at the centre of the power about a frequency [lines]."""
    at = np.arange(math.floor(line / APART), min(math.ceil(line * APART), s.lines.size - 1) + 1)
    power = np.abs(s.lines[at]) ** 2
    return s.duration_s / float(power @ at / power.sum())


def _thinned_error(error: Floats, dt_s: float, start_s: float, period_s: float) -> tuple[float, int, Floats]:
    """Step [s], number of the first step and means of an error at 12 to 24 steps per period, the last ones.

    Steps are the sample interval times a power of two and begin at whole multiples of themselves, so that those of
    other loops with the same interval coincide or can be joined in pairs.
    """
    few = 2 ** max(math.floor(math.log2(max(period_s / (STEPS * dt_s), 1.0))), 0)
    first, means = in_steps(error, round(start_s / dt_s), few)
    last = means[-TREND_STEPS:]
    return few * dt_s, first + means.size - last.size, last.astype(np.float32)


def in_steps(x: Floats, first: int, few: int) -> tuple[int, Floats]:
    """Means of so many samples each, from a whole multiple of them on, and the number of the first of these steps;
    `first` is that of the first sample."""
    skip = -first % few
    count = (x.size - skip) // few
    return (first + skip) // few, x[skip : skip + count * few].reshape(count, few).mean(axis=1)


def _cut(
    s: Spectrum, power: Floats, loop: str, start_s: float, error: Floats, wanted: tuple[float, int, bool]
) -> OscillationLines | None:
    """The lines near one period of a loop's error, None if the spectrum has too few.

    power : of all lines; wanted : period [s], harmonic and whether the loop alone shows the oscillation.
    """
    period_s, harmonic, own = wanted
    line = s.duration_s / period_s
    low = max(math.floor(line / REACH) - EXTRA_LINES, 0)
    high = min(math.ceil(line * REACH) + EXTRA_LINES, s.lines.size - 1)
    if line * 1.1 > s.lines.size - 1 or high - low < 2 * EXTRA_LINES:
        return None
    near = slice(math.floor(line / APART), math.ceil(line * APART) + 1)
    above = float(power[max(math.ceil(line / (2 * APART)), 1) :].sum())
    return OscillationLines(
        loop,
        period_s,
        harmonic,
        own,
        start_s,
        s.duration_s,
        low,
        peak_prominence(power, line),
        float(power[near].sum()) / above if above > 0 else 0.0,
        math.hypot(*(locked_harmonic(s, period_s, m) for m in HARMONICS)),
        (s.lines[low : high + 1] * (2.0 / s.n)).astype(np.complex64),
        *_thinned_error(error, s.dt_s, start_s, period_s),
    )


def error_lines_of(
    loop: str, found: Oscillations, end_s: float, limits: PlantLimits
) -> tuple[OscillationLines, ...]:
    """The oscillations of a loop, the harmonics of the first, and weaker peaks of its spectrum.

    found : with spectrum and bands; end_s : end of the record [s since 1970-01-01 UTC]; the spectrum is of its last
    samples.
    """
    s, b = found.spectrum, found.bands
    if s is None or b is None:
        return ()
    wanted: list[tuple[float, int, bool]] = []
    for o in found.found:
        wanted.append((o.period_s, 1, True))
        if o is found.first:
            sizes = [(m, locked_harmonic(s, o.period_s, m)) for m in HARMONICS]
            wanted += [(o.period_s / m, m, False) for m, size in sizes if size > limits.locked_harmonic]
    for k in peaks(b, limits.weak_prominence):
        period = _centred(s, float(b.line[k]))
        if all(abs(math.log(period / p)) > math.log(APART) for p, *_ in wanted):
            wanted.append((period, 1, False))
        if len(wanted) >= MOST_OSCILLATIONS:
            break
    error, power = irfft(s.lines, s.n), s.lines.real**2 + s.lines.imag**2
    cut = (_cut(s, power, loop, end_s - s.duration_s, error, one) for one in wanted)
    return tuple(w for w in cut if w is not None)


SCALARS = [f.name for f in fields(OscillationLines) if f.name not in ("lines", "trend")]


def oscillation_table(oscillations: Sequence[OscillationLines]) -> pa.Table:
    """One row per oscillation."""
    columns = {name: [getattr(w, name) for w in oscillations] for name in SCALARS}
    real = [w.lines.real.astype(np.float32) for w in oscillations]
    imag = [w.lines.imag.astype(np.float32) for w in oscillations]
    trend = [w.trend.astype(np.float32) for w in oscillations]
    return pa.table({**columns, "real": real, "imag": imag, "trend": trend})


class Laid:
    """An array in a file, read when needed."""

    __slots__ = ("_at", "_file", "_kind", "size")

    def __init__(self, x: np.ndarray, file: BinaryIO) -> None:
        self._file, self._at, self._kind, self.size = file, file.seek(0, os.SEEK_END), x.dtype, x.size
        file.write(np.ascontiguousarray(x).data)

    def __getitem__(self, part: slice) -> np.ndarray:
        first, last, _ = part.indices(self.size)
        wide = self._kind.itemsize
        self._file.seek(self._at + first * wide)
        return np.frombuffer(self._file.read(max(last - first, 0) * wide), self._kind)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        return self[:] if dtype is None else self[:].astype(dtype)


def oscillations_in(tables: Iterable[pa.Table], file: BinaryIO | None = None) -> list[OscillationLines]:
    """The oscillations of some tables; with a file their lines and trends stay in it, to save memory."""
    found = []
    for table in tables:
        known = table.select(SCALARS).to_pylist()
        real, imag, trend = (table.column(name).to_numpy() for name in ("real", "imag", "trend"))
        for scalars, x, y, t in zip(known, real, imag, trend, strict=True):
            arrays: list[Any] = [x + 1j * y, t]
            laid: list[Any] = arrays if file is None else [Laid(part, file) for part in arrays]
            found.append(OscillationLines(**scalars, lines=laid[0], trend=laid[1]))
    return found


def on_one_clock(oscillations: Sequence[OscillationLines]) -> list[OscillationLines]:
    """The comparable oscillations, all over the span of most of them."""
    if not oscillations:
        return []
    counted = Counter((w.start_s, w.duration_s) for w in oscillations)
    span = max(counted, key=lambda span: (counted[span], span[1]))
    moved = (_on_span(w, span) for w in oscillations)
    return [w for w in moved if w is not None]


def _on_span(oscillation: OscillationLines, span: tuple[float, float]) -> OscillationLines | None:
    """The lines of an oscillation over another span, start and duration [s]; None if its record covers too little of
    it."""
    start, length = span
    if abs(oscillation.start_s - start) + abs(oscillation.duration_s - length) <= SAME * oscillation.period_s:
        return oscillation
    begin, end = (
        max(start, oscillation.start_s),
        min(start + length, oscillation.start_s + oscillation.duration_s),
    )
    if end - begin < COVERED * length:
        return None
    count = oscillation.lines.size
    size = next_fast_len(FINE * count)
    padded = np.zeros(size, dtype=np.complex128)
    padded[:count] = oscillation.lines
    envelope = ifft(padded) * size  # from the first line of the band on
    fresh = next_fast_len(max(math.ceil(FINE * count * length / oscillation.duration_s), 16))
    t = start + np.arange(fresh) * (length / fresh)
    at = (t - oscillation.start_s) / oscillation.duration_s * size
    inside = (at >= 0) & (at <= size - 1)
    real = np.interp(at, np.arange(size), envelope.real)
    imag = np.interp(at, np.arange(size), envelope.imag)
    z = np.where(inside, real + 1j * imag, 0.0)
    low = math.ceil(oscillation.first * length / oscillation.duration_s)
    turns = (
        oscillation.first * (t - oscillation.start_s) / oscillation.duration_s - low * (t - start) / length
    )
    lines = fft(z * np.exp(2j * np.pi * turns)) / fresh
    most = max(math.floor((oscillation.first + count) * length / oscillation.duration_s) - low, 1)
    return replace(
        oscillation, start_s=start, duration_s=length, first=low, lines=lines[:most].astype(np.complex64)
    )
