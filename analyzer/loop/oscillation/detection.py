"""Detection of oscillations: periods, amplitude, regularity, share of time, significance.

A peak of the spectrum counts if it has a sufficient share of the error, is prominent most of the time, and its
half-cycles, none larger than the usual one, recur more regularly than noise does in as many cycles: see _in_shape.
The set point's part is removed first, so set point steps and a cascade's moving set point are no oscillation of the
loop; neither is ringing that decays while the set point is constant, as after a programme's corners. A slightly less
regular cycle counts if PV shows that the valve causes it: see `assess.with_valve_oscillation`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from analyzer.config import OscillationLimits
from analyzer.loop.decisions import counts
from identification.controller.check import runs
from identification.record import Floats, LoopRecord, Mask
from identification.signals.correlation import Rhythm, levelled_correlation, rhythm
from identification.signals.setpoint_response import amplitude_at_rest, moves, without_setpoint
from identification.signals.spectrum import (
    WIDE_BAND,
    Bands,
    Spectrum,
    band_signal,
    bands,
    envelope,
    shape,
    spectrum,
    tapered_power,
    usual_prominence,
)

FAR = 3.0  # First error over the usual error after settling, from which a record begins with a transient
LONGEST_WAY = 0.5  # Largest share of a record for the transient to the set point
REPORTED = 3  # Periods reported per loop


@dataclass(frozen=True, slots=True)
class Oscillation:
    """One period of a loop.

    period_s [s]; amplitude_pct, half of peak to peak of the fundamental [% of PV span] while it oscillates;
    oscillating_pct, share of time [%]; significance [% h], amplitude times correlation summed over the hours of
    oscillation; rhythm, regularity of the autocorrelation; prominence as in OscillationLimits; cycles, number of
    periods in the record, which is the frequency in lines of the spectrum.
    """

    period_s: float
    amplitude_pct: float
    oscillating_pct: float
    significance: float
    rhythm: Rhythm
    prominence: float
    cycles: float


@dataclass(frozen=True, slots=True)
class Oscillations:
    """Oscillations of one record.

    found : the oscillations, the most significant first; active : True where the first one is on, shape (m,), at
    interval active_dt_s [s]; level : its amplitude over time [% of PV span], shape (m,); spectrum and bands of the
    error without the set point's part.
    """

    found: tuple[Oscillation, ...] = ()
    active: Mask | None = None
    level: Floats | None = None
    active_dt_s: float = 1.0
    spectrum: Spectrum | None = None
    bands: Bands | None = None

    @property
    def first(self) -> Oscillation | None:
        """The most significant oscillation, None where there is none."""
        return self.found[0] if self.found else None


def start_up_end(error: Floats) -> int:
    """Sample at which the error first reaches zero, of a record that begins far from its set point; else 0.

    A vessel that heats up, or a loop just switched on, approaches its set point; this excursion hides every cycle.
    """
    arrived = int(np.argmax(error * error[0] <= 0.0))
    if arrived == 0 or arrived > LONGEST_WAY * error.size:
        return 0
    usual = math.sqrt(float(np.mean(error[arrived:] ** 2)))
    return arrived if abs(error[0]) > FAR * usual else 0


def error_spectrum(record: LoopRecord, whole: bool = False) -> Spectrum:
    """Spectrum of the error after it has reached the set point, without the set point's part unless the `whole` error
    is required."""
    error, good = record.error, np.flatnonzero(record.at_work)
    if good.size < error.size:
        error = np.interp(np.arange(error.size), good, error[good])
    first = 0 if record.sp_estimated else start_up_end(error)
    found = spectrum(error[first:], record.dt_s)
    if whole or record.sp_estimated or float(np.ptp(record.sp[first:])) == 0.0:
        return found
    sp = spectrum(record.sp[first:], record.dt_s)
    lines = without_setpoint(found.lines, sp.lines)
    power = float(np.sum(np.abs(lines[1:]) ** 2)) * 2 / found.n**2
    return replace(found, lines=lines, variance=power)


def _in_shape(
    s: Spectrum,
    line: float,
    x: Floats,
    dt_s: float,
    seen: tuple[float, float, float],
    limits: OscillationLimits,
) -> bool:
    """Whether half-cycles that differ in length and size are still more regular than noise in the same band.

    seen : cycles, prominence, correlation. Prominence in doublings (average of its mean over time and its median)
    and correlation (average of the band's and its levelled half-cycles') are added; noise of any colour, also the
    closed loop's, reaches shape + shape_few / sqrt(cycles) in fewer than one of a thousand records. A swing between
    limits, absent in Gaussian noise of any spectrum, adds to that and suffices alone if halves differ most.
    """
    cycles, prominence, correlation = seen
    levelled = 0.5 * (correlation + levelled_correlation(x, dt_s, s.duration_s / line))
    usual = 0.5 * math.log2(prominence * max(usual_prominence(s, line), 1e-3))
    total, scatter = usual + limits.shape_trade * levelled, limits.shape_few / math.sqrt(cycles)
    few = s.duration_s / line < limits.samples * s.dt_s
    enough = total >= max(limits.shape + scatter, limits.shape_least)
    if few and levelled < limits.shape_correlation_few:
        return False
    if prominence >= limits.least * limits.prominence and enough:
        return True
    if few or cycles < limits.swing_cycles or total + 2 * limits.swing_trade < limits.swing + scatter:
        return False
    found = shape(s, line)
    total += limits.swing_trade * max(3.0 - found.kurtosis, 0.0)
    return found.spread <= limits.swing_spread and total >= max(limits.swing + scatter, limits.swing_least)


def _candidate(s: Spectrum, b: Bands, k: int, limits: OscillationLimits) -> Oscillation | None:
    """The oscillation at one trial frequency, None if the criteria do not agree."""
    line = float(b.line[k])
    expected = s.duration_s / line
    if expected < limits.samples_few * s.dt_s:
        return None
    x, dt = band_signal(s, line)
    above = float(np.sum(np.abs(s.lines[math.ceil(line / WIDE_BAND) :]) ** 2)) * 2 / s.n**2
    share = float(x @ x) / x.size / above if above > 0 else 0.0
    found = rhythm(x, dt, expected)
    cycles = s.duration_s / found.period_s
    if cycles < limits.periods or share < limits.share:
        return None
    prominence, correlation = float(b.prominence[k]), min(found.first, 1.5 * found.trough)
    if not _in_shape(s, line, x, dt, (cycles, prominence, correlation), limits):
        return None
    amplitude = math.sqrt(2 * float(x @ x) / x.size)
    return Oscillation(found.period_s, amplitude, 0, 0, found, prominence, cycles)


def peaks(b: Bands, least: float) -> list[int]:
    """Trial frequencies with the highest prominence within half an octave, the most power first."""
    p = b.prominence
    ks = [k for k in range(p.size) if p[k] >= least and p[k] >= p[max(k - 3, 0) : k + 4].max()]
    return sorted(ks, key=lambda k: -float(b.power[k] * b.line[k]))[: 2 * REPORTED]


def subthreshold_period(found: Oscillations, limits: OscillationLimits) -> float | None:
    """Period [s] of a prominent cycle with too few samples to be judged, or None."""
    s, b = found.spectrum, found.bands
    if s is None or b is None:
        return None
    few = replace(limits, samples_few=limits.samples_least)
    fast = [
        k for k in peaks(b, limits.prominence) if s.duration_s / float(b.line[k]) < limits.samples * s.dt_s
    ]
    seen = [o.period_s for k in fast if (o := _candidate(s, b, k, few)) is not None]
    return seen[0] if seen else None


def active_samples(
    level: Floats, dt_s: float, own_s: float, period_s: float, usable: Mask, limits: OscillationLimits
) -> tuple[Mask, Mask, Floats]:
    """Where a band is loud and where it may be used, shape (m,) each, and its level over two periods [% of span],
    shape (m,); from its level at interval dt_s [s] and the usable samples at interval own_s [s], shape (n,).
    """
    width = max(round(2 * period_s / dt_s), 1)
    power = np.convolve(np.pad(level**2, width, mode="reflect"), np.ones(width) / width, mode="same")
    smooth = np.sqrt(power[width:-width])
    at = np.minimum((np.arange(level.size) * dt_s / own_s).astype(np.int64), usable.size - 1)
    good = usable[at]
    top = float(np.quantile(smooth[good], 0.9)) if good.any() else math.inf
    return (smooth >= limits.envelope * top) & good, good, smooth


def _sized_by_envelope(
    s: Spectrum, o: Oscillation, usable: Mask, limits: OscillationLimits
) -> tuple[Oscillation, Mask, Floats, float]:
    """Amplitude, share of time and significance from the envelope of the band."""
    level, dt = envelope(s, o.cycles)
    active, good, smooth = active_samples(level, dt, s.dt_s, o.period_s, usable, limits)
    if not good.any():
        return o, good, smooth, dt
    amplitude = math.sqrt(float(np.mean(level[active] ** 2))) if active.any() else 0.0
    hours = active.sum() * dt / 3600.0
    sized = replace(
        o,
        amplitude_pct=amplitude,
        oscillating_pct=100.0 * float(active.sum()) / float(good.sum()),
        significance=amplitude * max(o.rhythm.first, 0.0) * hours,
    )
    return sized, active, smooth, dt


def _lasts(s: Spectrum, record: LoopRecord, o: Oscillation, limits: OscillationLimits) -> bool:
    """Whether a period is the loop's own: its amplitude exceeds the set point's in its band times the sensitivity, or
    it occurs while the set point is constant. It is the set point's if the set point moves in every second cycle of
    it. If the set point is never constant, neither is tested."""
    moving = moves(record.sp)
    if record.sp_estimated or not moving.any() or moving.mean() > limits.programme_moves:
        return True
    set_point, _ = band_signal(spectrum(record.sp[len(record) - s.n :], record.dt_s), o.cycles)
    if limits.sensitive * math.sqrt(2 * float(set_point @ set_point) / set_point.size) < o.amplitude_pct:
        return True
    amplitude, count = amplitude_at_rest(record.error, record.sp, record.usable, o.period_s / record.dt_s)
    if count >= limits.rest_stretches:
        return amplitude >= limits.rest_share * o.amplitude_pct
    begun = int(np.sum(moving[1:] & ~moving[:-1]))
    return begun * o.period_s < limits.moved_cycles * record.duration_s


def _longest_seen(record: LoopRecord) -> float:
    """Period [s] of which two fit between times at which another loop has the valve: longer ones come from the
    change-overs; inf if the loop has its own valve."""
    idle = record.mask("idle")
    if not idle.any():
        return math.inf
    return max(b - a for a, b in runs(~idle)) * record.dt_s / 2.0


def _is_harmonic_of(o: Oscillation, other: Oscillation) -> bool:
    """Whether one oscillation has a whole multiple (2 to 7) of a stronger one's frequency."""
    ratio = other.period_s / o.period_s
    whole = round(ratio)
    return 2 <= whole <= 7 and abs(ratio / whole - 1) < 0.02 and o.amplitude_pct < 0.6 * other.amplitude_pct


def counting(found: Oscillations) -> Oscillation | None:
    """The first oscillation if its share of time is large enough for the loop to count as oscillating, else None."""
    first = found.first
    return first if first is not None and counts(first.oscillating_pct) else None


def detect(record: LoopRecord, limits: OscillationLimits, whole: bool = False) -> Oscillations:
    """The oscillations of a loop; none for noise, drift, ramps, steps and constants. In the `whole` error the ringing
    after set point moves counts too."""
    s = error_spectrum(record, whole)
    resolution = float(np.max(np.abs(record.error))) * 1e-9
    if s.n < 16 or s.variance <= resolution**2:
        return Oscillations(spectrum=s)
    b = bands(tapered_power(s), limits.periods)
    usable = record.at_work[len(record) - s.n :]
    oscillations: list[Oscillation] = []
    longest = _longest_seen(record)
    for k in peaks(b, limits.shape_prominence):
        o = _candidate(s, b, k, limits)
        if o is None or any(abs(math.log(o.period_s / p.period_s)) < math.log(1.3) for p in oscillations):
            continue
        if o.period_s <= longest and not any(_is_harmonic_of(o, p) for p in oscillations):
            oscillations.append(o)
    each = (_sized_by_envelope(s, o, usable, limits) for o in oscillations[:REPORTED])
    lasting = (r for r in each if whole or _lasts(s, record, r[0], limits))
    sized = sorted(lasting, key=lambda r: -r[0].significance)
    if not sized:
        return Oscillations(spectrum=s, bands=b)
    first = sized[0]
    return Oscillations(tuple(r[0] for r in sized), first[1], first[2], first[3], s, b)
