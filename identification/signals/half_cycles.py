"""Cycles half by half: signs of a cycle whose halves differ in length and size, as slips of a stem do.

A line of the spectrum and a returning autocorrelation ask for one period. Where every half is as long as friction
lets it, power still gathers about the mean period, all the time and not in one event, and the halves still alternate.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.fft import ifft, next_fast_len

from identification.limits import SIGNALS
from identification.record import Floats
from identification.signals.correlation import rhythm
from identification.signals.spectrum import Spectrum, band_signal


def half_cycles(x: Floats, dt_s: float) -> Floats:
    """Lengths [s], shape (h,), of the half-cycles of a signal without drift, shape (n,), at interval dt_s [s]; those
    at the ends left out."""
    beyond = SIGNALS.turn * math.sqrt(float(x @ x) / max(x.size, 1))
    side = np.where(x > beyond, 1, np.where(x < -beyond, -1, 0))
    outside = np.flatnonzero(side)
    return np.diff(outside[np.flatnonzero(np.diff(side[outside])) + 1]) * dt_s


def levelled_correlation(x: Floats, dt_s: float, period_s: float) -> float:
    """How well a band's signal comes back after a period once no half-cycle is larger than the usual one [-].

    The lesser of the autocorrelation's first peak and 1.5 times the trough before it. One step of the load, through
    the band a few large swings, hides a cycle of many halves from the plain autocorrelation; not from this one.
    """
    usual = float(np.median(np.abs(x)))
    if usual <= 0.0:
        return 0.0
    found = rhythm(np.clip(x, -SIGNALS.level * usual, SIGNALS.level * usual), dt_s, period_s)
    return min(found.first, 1.5 * found.trough)


def _usual_power(s: Spectrum, low: float, high: float) -> float:
    """Median over time of the power per line of a band, in lines low to high."""
    first = min(max(math.ceil(low), 1), s.lines.size - 2)
    last = max(min(int(high), s.lines.size - 2), first)
    part = s.lines[first : last + 1]
    size = next_fast_len(max(2 * part.size, 64))
    z = ifft(part, size) * size
    return float(np.median(z.real**2 + z.imag**2)) / part.size


def usual_prominence(s: Spectrum, line: float) -> float:
    """Power about a frequency over the geometric mean of the power on both sides, each its median over time [-].

    As the prominence of spectrum.bands, whose mean over time one event can fill: a step in the surroundings, a burst
    at the peak. For Gaussian noise median and mean have one ratio in every band, so both agree.
    """
    near = _usual_power(s, line / SIGNALS.peak_band, line * SIGNALS.peak_band)
    low = _usual_power(s, line / SIGNALS.side_far, line / SIGNALS.own_band)
    high = _usual_power(s, line * SIGNALS.own_band, min(line * SIGNALS.side_far, s.lines.size - 2))
    return near / max(math.sqrt(low * high), 1e-12 * near + 1e-300)


def size_kurtosis(s: Spectrum, line: float) -> float:
    """Kurtosis of the band about a frequency [-]: 1.5 where every cycle is as large as the other.

    Noise through a resonance is Gaussian, its envelope Rayleigh's, and has 3 (Rice 1945); a load from a machine, a
    limit cycle, a loop between OP's limits keep their size.
    """
    x, _ = band_signal(s, line, SIGNALS.own_band)
    power = float(x @ x) / x.size
    return float(np.mean(x**4)) / power**2 if power > 0.0 else 3.0


@dataclass(frozen=True, slots=True)
class Shape:
    """What the wide band about a period looks like.

    kurtosis : fourth moment over the squared second [-]: Gaussian noise 3 however coloured, a triangle 1.8, a sine
    1.5, a square 1, for a cycle swings between limits and noise does not; spread : standard deviation of the
    logarithm of the half-cycles' lengths [-]; share : of the record's variance [-].
    """

    kurtosis: float
    spread: float
    share: float


def shape(s: Spectrum, line: float) -> Shape:
    """Shape of the signal about a frequency, wide enough for halves that differ and for edges."""
    x, dt_s = band_signal(s, line, SIGNALS.shape_below, SIGNALS.shape_above)
    power = float(x @ x) / x.size
    if power <= 0.0:
        return Shape(3.0, 0.0, 0.0)
    halves = half_cycles(x, dt_s)
    spread = float(np.log(halves).std()) if halves.size > 2 else math.inf
    return Shape(float(np.mean(x**4)) / power**2, spread, power / s.variance)
