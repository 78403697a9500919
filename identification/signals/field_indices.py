"""Published indices for sticking valves, oscillation and sluggish control, with their published limits.

Each is a pure function of trends on one clock, and abstains (None) where its own conditions are not met. Trends have
shape (n,), OP in % of OP span and PV in % of span; `period` is that of the cycle [samples].
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.special import chdtri

from identification.record import Floats
from identification.signals.spectrum import band_signal, spectrum

Values = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Published:
    """Published limits of an index: positive if all values are above `above`, negative if all are at most `below`,
    otherwise undecided; without `below`, negative if not positive."""

    above: Values
    below: Values = ()


PUBLISHED: Mapping[str, Published] = {
    "horch": Published((2 / 3, 1 / 3), (1 / 3, 0.072)),
    "he": Published((0.6,), (0.4,)),
    "yamashita": Published((0.25, 0.25)),
    "kano": Published((0.25,)),
    "choudhury": Published((0.001, 0.01)),
    "hagglund": Published((10.0,)),
    "idle": Published((0.25,), (0.0,)),
}
"""Limits by index, as published: Horch for phases of 60 and 30 degrees from an even correlation; Yamashita's 1/4 is
the value for two unrelated signals; Choudhury, Shah, Thornhill, Shook 2006. Kano and Hägglund 1999 give only the ends
of the scale: those of `kano` and `idle` are ours."""
HALVES, HALF_SAMPLES, CYCLES = 6, 5, 3.0
"""Least half-cycles of a curve fit, samples of the shortest one, and cycles for all other indices; ours."""
THIRD = 0.4307
"""Number of standard deviations that contain a third of a Gaussian: steps up, none and down are equally frequent."""
STILL, MOVED = 0.25, 0.1
"""A trend is constant where its step is below this share of its mean step over a cycle, and moves where it covers
this share of its range; Kano leaves both to the user."""
SEGMENT, DATA, FEWEST, LOUD = 64, 4096, 16, 10.0
"""Samples of a segment of the bicoherence and of its data (Choudhury, Shah, Thornhill 2004); ours: fewest segments,
and the power over the median above which a segment is left out, because one step makes all pairs coherent."""
CONFIDENCE, TAPERED = 0.05, 2.2
"""Probability that Gaussian noise passes the test of the bicoherence, and number of its line pairs that count as one:
under the Hann taper the six neighbours of a pair correlate by (2/3)^2 with it, and squares add up."""
ROUNDING = 1e-9
"""Share of the largest power below which lines contain only rounding."""
DISTURBED_PCT, SUPERVISED = 1.0, 50.0
"""Amplitude of the oscillation above which a half-cycle is a load disturbance [% of span], and integral times over
which they are counted (Hägglund 1995)."""
IDLE_STEP, IDLE_STEPS, AFTER_MOVE = 0.1, 10, 10
"""Step size in standard deviations of all above which its sign counts, required steps of both signals, and excluded
steps after a set point move; ours. A load has moved PV where the error exceeds its deviation."""


def concluded(name: str, values: Sequence[float] | None) -> bool | None:
    """Result of an index by its published limits: None where it abstains or is undecided."""
    if values is None or not all(map(math.isfinite, values)):
        return None
    lines = PUBLISHED[name]
    if all(v > limit for v, limit in zip(values, lines.above, strict=False)):
        return True
    return None if lines.below and any(v > b for v, b in zip(values, lines.below, strict=False)) else False


def _centred(x: Floats, period: float) -> Floats | None:
    """A trend less its mean over the cycle about each sample, half a cycle cut at both ends; None if too few cycles
    remain or nothing moves."""
    width = max(round(period), 1)
    if x.size < (CYCLES + 1.0) * width:
        return None
    total = np.cumsum(np.concatenate(([0.0], x)))
    mean = (total[width:] - total[:-width]) / width
    first = width // 2
    out = x[first : first + mean.size] - mean
    return out if float(np.ptp(out)) > 1e-9 * max(float(np.abs(x).max()), 1.0) else None


def cross_correlation(op: Floats, pv: Floats, period: float) -> Values | None:
    """Oddness of the cross-correlation of OP and PV: by the lags of the zero crossings on either side of lag
    0, and by heights.

    Both are 0 for an even one (PV opposed to OP: a load, or tight tuning) and 1 for an odd one (a quarter of a cycle
    apart: a sticking valve), in loops whose process is no integrator (Horch 1999, Control Engineering Practice 7).
    """
    u, y = _centred(op, period), _centred(pv, period)
    if u is None or y is None:
        return None
    most = math.ceil(period)
    size = next_fast_len(u.size + most + 1, real=True)
    both = irfft(np.conj(rfft(u, size)) * rfft(y, size), size)
    r = np.concatenate((both[-most:], both[: most + 1]))
    crossing = np.flatnonzero(np.signbit(r[1:]) != np.signbit(r[:-1]))
    at = crossing + r[crossing] / (r[crossing] - r[crossing + 1]) - most
    if not ((at <= 0.0).any() and (at > 0.0).any()):
        return None
    left, right = -float(at[at <= 0.0][-1]), float(at[at > 0.0][0])
    now = abs(float(r[most]))
    best = float(np.abs(r[most - int(left) : most + int(right) + 1]).max())
    return abs(left - right) / (left + right), (best - now) / (best + now)


def _half_misfits(y: Floats, t: Floats, length: float) -> tuple[float, float]:
    """Mean square residual of a half sine, and of the best triangle, for a half-cycle of a length, at times t from
    its start, shape (n,)."""
    power, sine = float(y @ y), np.sin(np.pi * t / length)
    rest = length - t
    rising = np.cumsum(y * t)[:-1], np.cumsum(t * t)[:-1]
    falling = (np.cumsum((y * rest)[::-1])[::-1][1:], np.cumsum((rest * rest)[::-1])[::-1][1:])
    peak = 0.5 * (t[1:] + t[:-1])
    fitted = (rising[0] / peak + falling[0] / (length - peak)) ** 2
    triangle = float((fitted / (rising[1] / peak**2 + falling[1] / (length - peak) ** 2)).max())
    residual_power = power - float(sine @ y) ** 2 / float(sine @ sine), power - triangle
    return max(residual_power[0], 0.0) / y.size, max(residual_power[1], 0.0) / y.size


def curve_fit(x: Floats, period: float) -> Values | None:
    """Misfit of a sine over that of sine and triangle together, half-cycle by half-cycle: 0 for a sine, 1 for a
    triangle.

    A sticking valve makes triangles after an integration: in OP, or in PV if the process is an integrator (He, Wang,
    Pottmann, Qin 2007, Industrial & Engineering Chemistry Research 46).
    """
    y = _centred(x, period)
    if y is None:
        return None
    before = np.flatnonzero(np.signbit(y[1:]) != np.signbit(y[:-1]))
    at = before + y[before] / (y[before] - y[before + 1])
    halves = [
        (y[a:b], np.arange(a, b) - start, end - start)
        for a, b, start, end in zip(before[:-1] + 1, before[1:] + 1, at[:-1], at[1:], strict=True)
    ]
    usual = [h for h in halves if h[0].size >= HALF_SAMPLES and 0.5 <= 2.0 * h[2] / period <= 1.5]
    if len(usual) < HALVES:
        return None
    sine, triangle = np.sum([_half_misfits(*h) for h in usual], axis=0).tolist()
    return (sine / (sine + triangle),) if sine + triangle > 0.0 else None


def _step_signs(x: Floats) -> np.ndarray | None:
    """Each step of a trend as -1, 0 or 1; None for a constant."""
    step = np.diff(x)
    spread = float(step.std())
    if not spread > 1e-12 * max(float(np.abs(x).max()), 1.0):
        return None
    z = (step - step.mean()) / spread
    return (z > THIRD).astype(np.int8) - (z < -THIRD)


def qualitative_shape(op: Floats, pv: Floats, period: float) -> Values | None:
    """Shares of the moving time in which OP moves while flow is constant, and of those after which flow moves in the
    same direction, as in a slip; 1/4 and less for unrelated signals.

    PV is a flow that rises with OP, sampled some ten times a cycle (Yamashita 2006, Control Engineering Practice 14:
    rho 1 and rho 3).
    """
    u, y = _step_signs(op), _step_signs(pv)
    if u is None or y is None or op.size < CYCLES * period:
        return None
    moving = (u != 0) | (y != 0)
    u, y = u[moving], y[moving]
    ends = np.flatnonzero((np.diff(u) != 0) | (np.diff(y) != 0)) + 1
    first = np.concatenate(([0], ends))
    length = np.diff(np.concatenate((first, [u.size])))
    u, y = u[first], y[first]
    stuck = (y == 0) & (u != 0)
    slips = np.zeros_like(stuck)
    slips[:-1] = stuck[:-1] & (y[1:] == u[:-1]) & (u[1:] != -u[:-1])
    return float(length[stuck].sum() / length.sum()), float(length[slips].sum() / length.sum())


def standing_share(op: Floats, pv: Floats, period: float) -> Values | None:
    """Share of the time in which flow is constant while OP moves; near 1 for a valve that sticks most of the time.

    PV is a flow (Kano, Maruta, Kugemoto, Shimizu 2004, DYCOPS: method A).
    """
    if op.size < CYCLES * period:
        return None
    width = max(round(period), 2)
    whole = op.size // width * width
    spans = [float(np.median(np.ptp(x[:whole].reshape(-1, width), axis=1))) for x in (op, pv)]
    if not min(spans) > 0.0:
        return None
    still = np.abs(np.diff(pv)) < STILL * 2.0 * spans[1] / period
    edges = np.flatnonzero(np.diff(np.concatenate(([0], still.astype(np.int8), [0]))))
    stuck = sum(
        last - first
        for first, last in zip(edges[::2], edges[1::2], strict=True)
        if np.ptp(op[first : last + 1]) >= MOVED * spans[0]
        and np.ptp(pv[first : last + 1]) <= MOVED * spans[1]
    )
    return (float(stuck) / still.size,)


def _bicoherence(x: Floats) -> tuple[Floats, int] | None:
    """Squared bicoherence of a signal at pairs of frequencies, shape (p,), and the number of its segments."""
    frames = np.lib.stride_tricks.sliding_window_view(x[-DATA:], SEGMENT)[:: SEGMENT // 2]
    frames = frames - frames.mean(axis=1, keepdims=True)
    size = np.mean(frames**2, axis=1)
    frames = frames[size <= LOUD * np.median(size)]
    if len(frames) < FEWEST:
        return None
    lines = rfft(frames * np.hanning(SEGMENT), axis=1)
    i, j = (k + 1 for k in np.tril_indices(SEGMENT // 2 - 1))
    inside = i + j <= SEGMENT // 2
    i, j = i[inside], j[inside]
    pair, third = lines[:, i] * lines[:, j], lines[:, i + j]
    power = np.mean(np.abs(pair) ** 2, axis=0) * np.mean(np.abs(third) ** 2, axis=0)
    floor = ROUNDING * float(power.max())
    if not floor > 0.0:
        return None
    return np.abs(np.mean(pair * np.conj(third), axis=0)) ** 2 / (power + floor), len(frames)


def nonlinearity(error: Floats) -> Values | None:
    """Indices of non-Gaussianity and nonlinearity of an error: both about 0 or less for a linear loop.

    The mean of its squared bicoherence less the limit for Gaussian noise, and its maximum less the mean plus twice
    the deviation (Choudhury, Shah, Thornhill 2004, Automatica 40). A segment should contain several cycles; a signal
    symmetric about its mean, such as a triangle or a square wave, has no bicoherence.
    """
    found = _bicoherence(error) if error.size >= SEGMENT else None
    if found is None:
        return None
    b, segments = found
    free = 2.0 * b.size / TAPERED
    critical = float(chdtri(free, CONFIDENCE)) / (free * segments)
    return float(b.mean()) - critical, float(b.max() - b.mean() - 2.0 * b.std())


def apparent_stiction(op: Floats, pv: Floats, period: float) -> float | None:
    """Chord along OP, through the centre, of the ellipse of OP and PV in the band of the cycle [% of OP span].

    The ellipse is that of the moments, exact for sines (Choudhury, Shah, Thornhill, Shook 2006, Control Engineering
    Practice 14). It includes the effects of loop, dead time and lag: a valve of width d before a process that only
    follows it gives 4/pi of d if OP moves far beyond d.
    """
    if op.size < CYCLES * period or not min(float(np.ptp(op)), float(np.ptp(pv))) > 0.0:
        return None
    x, y = (band_signal(spectrum(s, 1.0), s.size / period)[0] for s in (op, pv))
    across, along = float(y @ y), float(x @ x)
    if not (across > 0.0 and along > 0.0):
        return None
    aside = max(along - float(x @ y) ** 2 / across, 0.0) / x.size
    return 2.0 * math.sqrt(2.0 * aside)


def load_disturbances(error: Floats, dt_s: float, ti_s: float) -> Values | None:
    """Largest number, within fifty integral times, of half-cycles of an error [% of span] whose absolute integral
    exceeds that of an oscillation of 1 % at the period of the integral time; over ten: the loop oscillates.

    Older ones fade (Hägglund 1995, Control Engineering Practice 3). None without an integral time, with too few
    samples in one, or in a record shorter than the time of supervision.
    """
    if not (math.isfinite(ti_s) and 4.0 * dt_s <= ti_s) or error.size * dt_s < SUPERVISED * ti_s:
        return None
    first = np.flatnonzero(np.diff(np.signbit(error), prepend=not np.signbit(error[0])))
    large = np.add.reduceat(np.abs(error), first) * dt_s > 2.0 * DISTURBED_PCT * ti_s / (2.0 * math.pi)
    ends = np.concatenate((first[1:], [error.size]))[large]
    count, most, before = 0.0, 0.0, 0
    for end in ends.tolist():
        count = count * math.exp((before - end) * dt_s / (SUPERVISED * ti_s)) + 1.0
        most, before = max(most, count), end
    return (most,)


def idle_index(op: Floats, pv: Floats, sp: Floats, gain_sign: float) -> Values | None:
    """Time in which OP and PV move in the same direction less that of opposite directions, over both, while a load
    has moved PV: near 1 for sluggish control, about 0 or less otherwise.

    Sampled a few times in the loop's own time; steps soon after a set point move are left out; gain_sign, the sign
    of the process gain (Hägglund 1999, Control Engineering Practice 7).
    """
    u, y, off = np.diff(op), np.diff(pv), 0.5 * np.abs(sp[1:] - pv[1:] + sp[:-1] - pv[:-1])
    moved = np.convolve(np.abs(np.diff(sp)) > 1e-9, np.ones(2 * AFTER_MOVE + 1))[
        AFTER_MOVE : AFTER_MOVE + u.size
    ]
    both = (np.abs(u) > IDLE_STEP * u.std()) & (np.abs(y) > IDLE_STEP * y.std())
    both &= (off > float((sp - pv).std())) & (moved < 0.5)
    if both.sum() < IDLE_STEPS:
        return None
    return (float(np.sign(u[both] * y[both] * gain_sign).mean()),)
