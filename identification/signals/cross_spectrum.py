"""Coherence and lag of two signals near one frequency.

Spectral lines are compared in sections of the band in which the phase is nearly constant, so that a delay or a slow
phase drift does not reduce the coherence, and after a Hann taper, which limits the leakage of a steady oscillation.
Granger's test checks whether the past of one signal improves the prediction of the other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.fft import ifft, next_fast_len
from scipy.special import betainccinv

from identification.record import Floats
from identification.signals.setpoint_response import SIDE_LINES
from identification.signals.spectrum import Complex

SHARED_BAND = 0.08  # Half width of the band in which two loops are compared, as a share of the frequency
PIECE = 0.03
"""Width of the pieces of that band within which the phase may be taken as constant, as a share of the
frequency: the delay from loop to loop turns it over the whole band."""
PIECE_LINES = 8  # The same at least [lines]
UNEVEN = 1.4
"""Pieces that count as one, because those with more power count more: mean square over squared mean of the
products."""

HANN_WIDTH = 1.8
"""Lines that a Hann taper combines: neighbours correlate by 2/3, next ones by 1/6, and squares add up."""
DRIFT_BLOCKS = 64
"""Parts of a record whose phases are compared to find a drift."""
DRIFTS = np.arange(-60, 61) / 20.0
"""Candidate drifts [turns over the record]."""
TURNS = np.exp(2j * np.pi * DRIFTS[:, None] * ((np.arange(DRIFT_BLOCKS) + 0.5) / DRIFT_BLOCKS))
"""Factors that compensate each block's phase for each drift, shape (drifts, blocks)."""
Whole = NDArray[np.int64]


def tapered(lines: Complex) -> Complex:
    """Lines of the Hann-tapered signal from those of the signal, shape (m - 2,): those with two neighbours."""
    return lines[1:-1] - 0.5 * (lines[:-2] + lines[2:])


def band(line: float) -> tuple[int, int, int]:
    """First line, line after the last and width of the sections [lines] of the band about a frequency [lines]."""
    half = max(SHARED_BAND * line, SIDE_LINES)
    width = max(PIECE_LINES, round(PIECE * line))
    return max(round(line - half), 1), round(line + half) + 1, width


@cache
def chance_coherence(lines: int, width: int, chance: float) -> float:
    """Coherence that two unrelated signals exceed with a probability of `chance` [-].

    For one section it is distributed as Beta(1, d - 1), d the independent lines of the section (Carter, Knapp,
    Nuttall 1973); for a mean over sections as the beta of the same mean and a variance as many times smaller.

    lines, width : lines of the band, and of one of its sections.
    """
    free = max(width / HANN_WIDTH, 1.5)
    pieces = max(lines // width / UNEVEN, 1.0)
    spread = pieces * (free + 1) - 1
    return float(betainccinv(spread / free, spread * (1 - 1 / free), chance))


@njit(cache=True)
def _cross(mine: Complex, yours: Complex) -> tuple[float, float]:
    """Squared cross power of two sections of lines, and the product of their powers."""
    re, im, own, other = 0.0, 0.0, 0.0, 0.0
    for k in range(mine.size):
        x, y = mine[k], yours[k]
        re += x.real * y.real + x.imag * y.imag
        im += x.imag * y.real - x.real * y.imag
        own += x.real * x.real + x.imag * x.imag
        other += y.real * y.real + y.imag * y.imag
    return re * re + im * im, own * other


@njit(cache=True)
def coherences(
    flat: Complex, offset: Whole, first: Whole, count: Whole, one: int, others: Whole, span: Whole, shift: int
) -> Floats:
    """Coherence of one stretch of lines with others over a band [-].

    flat : the lines of all stretches, one after the other; offset, first, count : shape (s,), start of each stretch
    in `flat`, number of its first line, and number of lines; one : the stretch that is compared; others : shape (k,),
    those with which it is compared; span : shape (3,), first line, line after the last and width of the sections
    (`band`); shift : shift of the others in lines: shifted stretches have only the shape of their band in common.
    Returns shape (k,), 0 where a stretch does not cover the band.
    """
    out = np.zeros(others.size)
    low, high = span[0], span[1]
    pieces = max((high - low) // span[2], 1)
    if low < first[one] or high > first[one] + count[one]:
        return out
    for q in range(others.size):
        j = others[q]
        if low + shift < first[j] or high + shift > first[j] + count[j]:
            continue
        shared, whole = 0.0, 0.0
        for p in range(pieces):
            begin, end = low + (high - low) * p // pieces, low + (high - low) * (p + 1) // pieces
            mine = flat[offset[one] + begin - first[one] : offset[one] + end - first[one]]
            yours = flat[offset[j] + begin + shift - first[j] : offset[j] + end + shift - first[j]]
            cross, powers = _cross(mine, yours)
            shared += cross
            whole += powers
        if whole > 0:
            out[q] = shared / whole
    return out


def drift(x: Complex, y: Complex) -> Floats:
    """Phase drift over the record between a signal and others [turns], of either sign, at most three.

    Two signals with one source have a constant phase difference. If the sources are one Fourier line apart, the
    difference changes by one turn over the record.

    x, y : complex, shapes (m,) and (k, m), lines of the same numbers, not tapered. Returns shape (k,).
    """
    size = next_fast_len(max(4 * x.size, 4 * DRIFT_BLOCKS))
    product = ifft(x, size) * np.conj(ifft(y, size, axis=1))
    edges = np.arange(DRIFT_BLOCKS) * size // DRIFT_BLOCKS
    turned = np.add.reduceat(product, edges, axis=1) @ TURNS.T
    return np.asarray(DRIFTS[np.argmax(np.abs(turned), axis=1)])


@dataclass(frozen=True, slots=True)
class Delay:
    """Lag of a second signal: lag_s [s], its standard deviation [s], and the coherence at that lag [-]."""

    lag_s: float
    deviation_s: float
    coherence: float


def lag(x: Complex, y: Complex, duration_s: float, most_s: float) -> Delay:
    """Group delay of a second signal behind a first one, from the slope of their phase over the band.

    A steady oscillation does not determine the delay, because its phase is known only up to whole turns; changes of
    its size and phase over time do, and the deviation gives the precision (Carter 1987).

    x, y : complex, shape (m,), lines of the same numbers; duration_s : line k is the frequency k / duration_s [s];
    most_s : largest lag searched, in both directions [s].
    """
    cross = np.conj(x) * y
    power = float(np.sqrt(np.sum(np.abs(x) ** 2) * np.sum(np.abs(y) ** 2)))
    if power <= 0:
        return Delay(0.0, math.inf, 0.0)
    size = next_fast_len(max(16 * cross.size, 64))
    step = duration_s / size
    found = np.abs(ifft(cross, size)) * size / power
    reach = min(max(int(most_s / step), 1), size // 2 - 1)
    ahead = np.concatenate((found[-reach:], found[: reach + 1]))
    # a delay of y rotates the phase of conj(x) y backwards: its transform peaks where it is rotated back
    at = int(np.argmax(ahead)) - reach
    best = min(float(ahead[at + reach]) ** 2, 1.0)
    weight = np.abs(cross)
    lines = np.arange(cross.size)
    mean = float(weight @ lines / weight.sum())
    width = math.sqrt(float(weight @ (lines - mean) ** 2 / weight.sum()))
    free = float(weight.sum() ** 2 / (weight @ weight))
    slope = 2 * math.pi * max(width, 1e-9) / duration_s
    deviation = math.sqrt(max(1.0 - best, 1e-4) / (2 * max(best, 1e-9) * free)) / slope
    return Delay(at * step, deviation, best)


RIDGE = 1e-9
"""Share of a column's power that is added to it, because pasts of rounded trends are collinear."""


def granger_f(signals: Floats, lags: int, first_count: int | None = None) -> Floats:
    """F statistics for predicting every signal from the past of every other in addition to its own past.

    signals : shape (k, n), samples of one clock; lags : number of past samples used; first_count : number of first
    signals whose pairs with the later ones are computed, None for all pairs. Returns shape (k, k), F[i, j]: signal i
    predicts signal j; 0 on the diagonal, for pairs that are not computed, and everywhere if n is less than four times
    the constants of a model.
    """
    k, n = signals.shape
    rows = n - lags
    out = np.zeros((k, k))
    if rows < 4 * (2 * lags + 1):
        return out
    level = signals - signals.mean(axis=1, keepdims=True)
    own = _lagged(level[:, None], level[:, None], lags)[:, 0, 0]
    ridge = range(1, lags + 1)
    own[:, ridge, ridge] *= 1.0 + RIDGE
    own[:, ridge, ridge] += 1e-300
    first, later = (level, level) if first_count is None else (level[:first_count], level[first_count:])
    between = _lagged(first[None], later[None], lags)[0]
    one, other = np.indices(between.shape[:2]).reshape(2, -1) + np.array([[0], [first_count or 0]])
    once = one < other
    one, other, pairs = one[once], other[once], between.reshape(-1, lags + 1, lags + 1)[once]
    shared_gram, alone = pairs[:, 1:, 1:], own[:, 0, 0] - _explained(own[:, 1:, 1:], own[:, 1:, 0])
    for of, by, shared, cross in (
        (other, one, shared_gram.transpose(0, 2, 1), pairs[:, 1:, 0]),
        (one, other, shared_gram, pairs[:, 0, 1:]),
    ):
        gram = np.block([[own[of, 1:, 1:], shared], [shared.transpose(0, 2, 1), own[by, 1:, 1:]]])
        power = own[of, 0, 0]
        both = power - _explained(gram, np.concatenate((own[of, 1:, 0], cross), axis=1))
        varies = both > 1e-12 * power
        gained = np.maximum(alone[of[varies]] - both[varies], 0.0) / lags
        out[by[varies], of[varies]] = gained / (both[varies] / (rows - 2 * lags - 1))
    return out


def _lagged(x: Floats, y: Floats, lags: int) -> Floats:
    """Sums of products of signals with others about their means, each delayed by 0 to `lags` samples: the first ones
    directly, each next one by adding one sample at the start and removing one at the end.

    x, y : shapes (s, a, n) and (s, b, n). Returns shape (s, a, b, lags + 1, lags + 1).
    """
    n = x.shape[-1]
    back = [slice(lags - k, n - k) for k in range(lags + 1)]
    out = np.empty((*x.shape[:2], y.shape[1], lags + 1, lags + 1))
    turned = y.transpose(0, 2, 1)
    for k in range(lags + 1):
        out[..., 0, k] = x[..., back[0]] @ turned[:, back[k]]
        out[..., k, 0] = x[..., back[k]] @ turned[:, back[0]]
    begun, ended = y[:, None, :, lags - 1 :: -1][..., :lags], y[:, None, :, : n - lags - 1 : -1]
    for k in range(1, lags + 1):
        gone = x[..., lags - k, None, None] * begun - x[..., n - k, None, None] * ended
        out[..., k, 1:] = out[..., k - 1, :-1] + gone
    means = [np.stack([z[..., part].sum(axis=-1) for part in back], axis=-1) for z in (x, y)]
    return out - means[0][:, :, None, :, None] * means[1][:, None, :, None, :] / (n - lags)


def _explained(gram: Floats, cross: Floats) -> Floats:
    """Power explained by each of several sets of columns, by its normal equations, shape (s,)."""
    return np.asarray(np.einsum("sc,sc->s", cross, np.linalg.solve(gram, cross[..., None])[..., 0]))
