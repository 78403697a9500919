"""Spectra of a loop's error: one Fourier transform, from which bands, peaks and the shape of cycles are computed.

A single line requires a constant period. If friction varies the half-cycles of a cycle, power is still concentrated
near the mean period, at all times and not in one event, and the halves differ in length and size.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import ifft, irfft, next_fast_len, rfft

from identification.record import Floats, Mask

PEAK_BAND = 1.2  # Factor about a frequency within which a peak's power is read
SIDE_FAR = 4.0  # Factor about a frequency up to which its surroundings are read
WIDE_BAND = 2.5
"""Factor about a frequency within which correlations are taken: it keeps drift and sensor noise out and
leaves flat noise without a peak at its own centre."""
OWN_BAND = 1.6
"""Factor about a frequency within which a cycle's size is read, and beyond which its surroundings begin."""
SHAPE_BELOW = 4.0
"""Factor under a frequency from which on a cycle's shape is read: halves of twice their length keep their
fundamental."""
SHAPE_ABOVE = 8.0  # Factor over a frequency up to which a cycle's shape is read: a square keeps its edges
TURN = 0.6
"""A half-cycle ends where the signal is beyond this share of its rms on the other side: faster changes are
noise."""

Complex = NDArray[np.complex128]

PER_OCTAVE = 6
"""Candidate centre frequencies per octave."""


@dataclass(frozen=True, slots=True)
class Spectrum:
    """One-sided transform of a signal after removal of its straight line.

    lines : complex, shape (m,); n, dt_s : samples and interval [s]; variance : of the signal.
    """

    lines: Complex
    n: int
    dt_s: float
    variance: float

    @property
    def duration_s(self) -> float:
        """Length [s]; line k is the frequency k / duration_s."""
        return self.n * self.dt_s


def without_line(x: Floats) -> Floats:
    """The signal less its least-squares straight line, shape (n,)."""
    n = x.size
    t = np.arange(-0.5 * (n - 1), 0.5 * n)
    slope = 12.0 * float(t @ x) / max(n * (n * n - 1.0), 1.0)
    t *= -slope
    t += x
    t -= x.mean()
    return t


def spectrum(x: Floats, dt_s: float) -> Spectrum:
    """Transform of the whole signal: cutting or padding would change its share with the sampling."""
    flat = without_line(x)
    return Spectrum(rfft(flat), x.size, dt_s, float(flat @ flat) / x.size)


def tapered_power(s: Spectrum) -> Floats:
    """Power of the Hann-tapered signal at each line, shape (m,), from the untapered lines."""
    x = s.lines
    h = 0.5 * x
    h[1:-1] -= 0.25 * (x[:-2] + x[2:])
    h[0], h[-1] = 0.0, 0.0
    return h.real**2 + h.imag**2


@dataclass(frozen=True, slots=True)
class Bands:
    """Mean power about trial frequencies and the value expected from their surroundings.

    line : trial frequencies in lines, shape (b,); power, prominence : shape (b,).
    """

    line: Floats
    power: Floats
    prominence: Floats


def _mean(total: Floats, first: Floats, last: Floats, top: int) -> Floats:
    a = np.clip(np.round(first), 1, top).astype(np.int64)
    b = np.maximum(np.clip(np.round(last), 1, top).astype(np.int64), a)
    return (total[b + 1] - total[a]) / (b - a + 1)


def _about(power: Floats, line: Floats) -> tuple[Floats, Floats]:
    """Mean power about frequencies [lines], and the geometric mean of that on both sides, shape (b,) each."""
    total, top = np.concatenate(([0.0], np.cumsum(power))), power.size - 2
    near = _mean(total, line / PEAK_BAND, line * PEAK_BAND, top)
    low = _mean(total, line / SIDE_FAR, line / OWN_BAND, top)
    high = _mean(total, line * OWN_BAND, np.minimum(line * SIDE_FAR, top), top)
    return near, np.sqrt(low * high)


def bands(power: Floats, fewest_lines: float) -> Bands:
    """Power about trial frequencies over the geometric mean of the power on both sides.

    A power law has prominence 1 everywhere; the knee of a double lag reaches 2.8.
    """
    highest = (power.size - 2) / PEAK_BAND
    count = max(int(math.log2(max(highest / fewest_lines, 1.0)) * PER_OCTAVE), 0) + 1
    line = fewest_lines * 2.0 ** (np.arange(count) / PER_OCTAVE)
    line = line[line * PEAK_BAND <= power.size - 2]
    near, sides = _about(power, line)
    floor = 1e-12 * max(float(power.max(initial=0.0)), 1e-300)
    return Bands(line, near, near / np.maximum(sides, floor))


def peak_prominence(power: Floats, line: float) -> float:
    """Power about one frequency over the geometric mean of the power on both sides of it."""
    near, sides = _about(power, np.array([line]))
    return float(near[0] / max(sides[0], 1e-12 * float(power.max()) + 1e-300))


def _usual_power(s: Spectrum, low: float, high: float) -> float:
    """Median over time of the power per line of a band from line low to high."""
    first = min(max(math.ceil(low), 1), s.lines.size - 2)
    last = max(min(int(high), s.lines.size - 2), first)
    part = s.lines[first : last + 1]
    size = next_fast_len(max(2 * part.size, 64))
    z = ifft(part, size) * size
    return float(np.median(z.real**2 + z.imag**2)) / part.size


def usual_prominence(s: Spectrum, line: float) -> float:
    """Power about a frequency over the geometric mean of the power on both sides, each its median over time [-].

    Like the prominence of `bands`, but one event cannot dominate it: a step in the surroundings, a burst at the peak.
    For Gaussian noise median and mean have the same ratio in every band, so both agree.
    """
    near = _usual_power(s, line / PEAK_BAND, line * PEAK_BAND)
    low = _usual_power(s, line / SIDE_FAR, line / OWN_BAND)
    high = _usual_power(s, line * OWN_BAND, min(line * SIDE_FAR, s.lines.size - 2))
    return near / max(math.sqrt(low * high), 1e-12 * near + 1e-300)


def band_signal(
    s: Spectrum, line: float, below: float = WIDE_BAND, above: float | None = None
) -> tuple[Floats, float]:
    """The signal in a band from a factor below a frequency to one above (the same if not given), at about 24 samples
    a period.

    Returns the band's signal and its sample interval [s].
    """
    first, last = math.ceil(line / below), min(int(line * (above or below)), s.lines.size - 1)
    m = next_fast_len(max(int(line * 24), 2 * last + 2, 16), real=True)
    cut = np.zeros(m // 2 + 1, dtype=np.complex128)
    cut[first : last + 1] = s.lines[first : last + 1]
    return irfft(cut, m) * (m / s.n), s.duration_s / m


def analytic(s: Spectrum, line: float, factor: float, size: int) -> Complex:
    """Analytic signal of the band about a frequency on `size` points over the record, shape (size,)."""
    first, last = max(math.ceil(line / factor), 1), min(int(line * factor), s.lines.size - 1)
    cut = np.zeros(size, dtype=np.complex128)
    cut[first : last + 1] = 2 * s.lines[first : last + 1]
    return np.fft.ifft(cut) * (size / s.n)


def locked_harmonic(s: Spectrum, period_s: float, order: int = 3) -> float:
    """Size of a harmonic that is phase-locked to the fundamental, relative to the fundamental.

    The mean of z3 exp(-3i phase1) over the mean of |z1|: a triangle gives 1/9, a square 1/3, a sine with noise zero,
    because its third harmonic has no fixed phase.

    s : of the signal; period_s : of the fundamental [s]; order : of the harmonic.
    """
    line = s.duration_s / period_s
    if order * line * 1.15 >= s.lines.size - 1:
        return 0.0
    size = next_fast_len(max(int(line * 4 * order), 16))
    z1, z3 = analytic(s, line, 1.3, size), analytic(s, order * line, 1.15, size)
    turned = z3 * np.exp(-1j * order * np.angle(z1))
    weight = float(np.mean(np.abs(z1)))
    return float(np.abs(np.mean(turned))) / weight if weight > 0 else 0.0


def envelope(s: Spectrum, line: float) -> tuple[Floats, float]:
    """Amplitude of the band about a frequency over time, shape (m,), and its sample interval [s]."""
    first, last = math.ceil(line / OWN_BAND), min(int(line * OWN_BAND), s.lines.size - 1)
    m = next_fast_len(max(int(line * 8), last + 2, 16))
    cut = np.zeros(m, dtype=np.complex128)
    cut[first : last + 1] = 2 * s.lines[first : last + 1]
    return np.abs(np.fft.ifft(cut)) * (m / s.n), s.duration_s / m


def half_cycles(x: Floats, dt_s: float) -> Floats:
    """Lengths [s], shape (h,), of the half-cycles of a signal without drift, shape (n,), at interval dt_s [s],
    without those at the ends."""
    beyond = TURN * math.sqrt(float(x @ x) / max(x.size, 1))
    side = np.where(x > beyond, 1, np.where(x < -beyond, -1, 0))
    outside = np.flatnonzero(side)
    return np.diff(outside[np.flatnonzero(np.diff(side[outside])) + 1]) * dt_s


def size_kurtosis(s: Spectrum, line: float, rest: Mask | None = None) -> float:
    """Kurtosis of the band about a frequency [-]: 1.5 if all cycles have the same size. rest : bool, shape (n,), the
    samples that count; None for all.

    Noise through a resonance is Gaussian with a Rayleigh envelope and has 3 (Rice 1945); a load from a machine, a
    limit cycle, or a loop between OP's limits has a constant size.
    """
    x, _ = band_signal(s, line, OWN_BAND)
    if rest is not None:
        x = x[rest[np.arange(x.size) * rest.size // x.size]]
    power = float(x @ x) / x.size
    return float(np.mean(x**4)) / power**2 if power > 0.0 else 3.0


@dataclass(frozen=True, slots=True)
class Shape:
    """Properties of the wide band about a period.

    kurtosis : fourth moment over the squared second [-]: Gaussian noise 3 in any colour, a triangle 1.8, a sine 1.5,
    a square 1, because a cycle has limits and noise has none; spread : standard deviation of the logarithm of the
    half-cycles' lengths [-]; share : of the record's variance [-].
    """

    kurtosis: float
    spread: float
    share: float


def shape(s: Spectrum, line: float) -> Shape:
    """Shape of the signal about a frequency, wide enough for unequal half-cycles and for edges."""
    x, dt_s = band_signal(s, line, SHAPE_BELOW, SHAPE_ABOVE)
    power = float(x @ x) / x.size
    if power <= 0.0:
        return Shape(3.0, 0.0, 0.0)
    halves = half_cycles(x, dt_s)
    spread = float(np.log(halves).std()) if halves.size > 2 else math.inf
    return Shape(float(np.mean(x**4)) / power**2, spread, power / s.variance)
