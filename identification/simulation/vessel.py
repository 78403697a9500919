"""From flow to PV: transport, vessel, further modes and transmitter, exact for held inputs."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from identification.record import Floats
from identification.simulation.lag import held, stepped, unit_lag
from identification.simulation.parameters import Slot

T, L, K, BIAS, START = (int(s) for s in (Slot.T, Slot.L, Slot.K, Slot.BIAS, Slot.START))
T2, T3, SHARE, MODE_T, ASYM = (int(s) for s in (Slot.T2, Slot.T3, Slot.SHARE, Slot.MODE_T, Slot.ASYMMETRY))
SLOPE, ROOT, CAP = (int(s) for s in (Slot.SLOPE, Slot.ROOT, Slot.CAP))
LEAK, PIPE, GAIN_SLOPE, SPEED = (int(s) for s in (Slot.LEAK, Slot.PIPE, Slot.GAIN_SLOPE, Slot.SPEED))
UPPER_CAP, PASSED, BEGUN = (int(s) for s in (Slot.UPPER_CAP, Slot.PASSED, Slot.BEGUN))
Memory = tuple[float, float, float, float]
"""State of a vessel: level, second mode, second and third lag."""
SHORT = 0.03
"""Step, relative to an outflow's time constant, below which the exponential is a series: the next term is 5e-16."""
C1, C2, C3, C4, C5, C6 = ((-1.0) ** k / math.factorial(k + 1) for k in range(1, 7))
"""Coefficients of (1 - exp(-z)) / z."""
WEIR = 25.0
"""Outflow over the cap per % of level, relative to the vessel's own; ours: stiff compared with every vessel."""


@njit(cache=True, error_model="numpy")
def transported(flow: Floats, delay_s: float, pipe: float, middle: float, dt_s: float) -> Floats:
    """Mean outflow of the pipe during each sample, shape (n,), where the flow determines the transport speed.

    delay_s [s] at flow `middle`; pipe : relative change of speed per relative change of flow.
    """
    n = flow.size
    passed = np.zeros(n + 1)
    moved = np.zeros(n + 1)
    for k in range(n):
        speed = max(1.0 + pipe * (flow[k] / middle - 1.0), 0.1)
        passed[k + 1] = passed[k] + dt_s * speed
        moved[k + 1] = moved[k] + dt_s * speed * flow[k]
    out = np.empty(n)
    at, before = 0, -delay_s * flow[0]
    for k in range(n):
        mark = passed[k + 1] - delay_s
        if mark <= 0.0:
            total = mark * flow[0]
        else:
            while passed[at + 1] < mark:
                at += 1
            total = moved[at] + (mark - passed[at]) * flow[at]
        out[k] = (total - before) / (passed[k + 1] - passed[k])
        before = total
    return out


class Outflow(NamedTuple):
    """Dependence of a vessel's outflow and time constant on its level and on the direction of motion.

    slope : curvature of the outflow [per % PV]; leak : outflow per level of a linear vessel [-]; root : nonzero where
    the outflow depends on the square root of the level; head : level deviation at which such a vessel would be empty,
    sign reversed [% PV]; cap : level above which it overflows [% PV]; gain_slope [per % PV], speed : gain that
    depends on the level, and its power in the time constant; up, down : rate of a rising and of a falling level [-].
    """

    slope: float
    leak: float
    root: float
    head: float
    cap: float
    gain_slope: float
    speed: float
    up: float
    down: float


@njit(cache=True, error_model="numpy")
def outflow_of(c: Floats, head: float) -> Outflow:
    """The outflow for the given constants."""
    slope, gain_slope, pace = c[SLOPE] / 50.0, c[GAIN_SLOPE] / 50.0, math.exp(0.5 * c[ASYM])
    return Outflow(slope, c[LEAK], c[ROOT], head, c[CAP], gain_slope, c[SPEED], pace, 1.0 / pace)


@njit(cache=True, error_model="numpy")
def outflow(x: float, o: Outflow) -> tuple[float, float]:
    """Outflow at level x [% PV] and its derivative, for the linear, the square-root and the curved vessel."""
    if o.root != 0.0:
        root = math.sqrt(max(1.0 + x / o.head, 1e-3))
        return 2.0 * o.head * (root - 1.0), 1.0 / root
    if o.slope != 0.0:
        inside = max(1.0 + o.slope * x, 0.05)
        return math.log(inside) / o.slope, 1.0 / inside
    return o.leak * x, o.leak


@njit(cache=True, error_model="numpy")
def scheduled(x: float, slope: float) -> float:
    """Relative gain at level x [% PV]; `slope` is its change [per % PV]."""
    return max(1.0 + slope * x, 0.05)


@njit(cache=True, error_model="numpy")
def share_filled(rise: float, time: float) -> float:
    """Rise of a level divided by its net feed after some time [time constants], for an outflow with that derivative
    (exponential step)."""
    z = rise * time
    if z < SHORT:  # to sixteen digits, without the slow exponential
        return time * (1.0 + z * (C1 + z * (C2 + z * (C3 + z * (C4 + z * (C5 + z * C6))))))
    return (1.0 - math.exp(-z)) / rise


@njit(cache=True, error_model="numpy")
def filled(x: float, feed: float, time: float, o: Outflow) -> float:
    """Level after some time [time constants] of constant feed (exact for a linear vessel)."""
    out, rise = outflow(x, o)
    over = max(x - o.cap, 0.0)
    if over > 0.0:
        rise += WEIR
    net = feed - out - WEIR * over
    if o.gain_slope != 0.0 and o.speed != 0.0:
        time /= scheduled(x, o.gain_slope) ** o.speed
    return x + net * share_filled(rise, time * (o.up if net > 0.0 else o.down))


@njit(cache=True, error_model="numpy")
def shares_filled(o: Outflow, times: tuple[float, float]) -> Floats:
    """The same for a linear outflow, shape (2, 2, 2): part of a sample, rising or falling, below or above a cap."""
    out = np.zeros((2, 2, 2))
    for half in range(2):
        for falling in range(2):
            for over in range(2):
                if times[half] > 0.0:
                    pace = o.down if falling else o.up
                    out[half, falling, over] = share_filled(o.leak + over * WEIR, times[half] * pace)
    return out


@njit(cache=True, error_model="numpy")
def risen(x: float, feed: float, o: Outflow, rises: Floats, half: int) -> float:
    """Result of `filled` for a linear outflow, from its shares (`shares_filled`)."""
    net, over = feed - o.leak * x, 0
    if x > o.cap:
        net, over = net - WEIR * (x - o.cap), 1
    return x + net * rises[half, 0 if net > 0.0 else 1, over]


@njit(cache=True, error_model="numpy")
def kept(c: Floats, parts: tuple[float, float]) -> tuple[Floats, Floats]:
    """held() of second and third lag and second mode, by part of a sample, shape (2, 3) each."""
    remaining, mean = np.empty((2, 3)), np.empty((2, 3))
    for half in range(2):
        for i, lag_s in enumerate((c[T2], c[T3], c[MODE_T])):
            remaining[half, i], mean[half, i] = held(lag_s, parts[half])
    return remaining, mean


@njit(cache=True, error_model="numpy")
def poured(
    level: float, feed: float, remaining: float, mean: float, cap: tuple[float, float], held_over: float
) -> tuple[float, float]:
    """Level of the vessel before the last one after a time of constant feed, and its mean outflow meanwhile.

    All in % PV of feed at rest. remaining, mean : of `held`; cap : level above which it overflows, and the share [-]
    of the overflow that enters the next vessel; held_over : its time constant divided by that time [-].
    """
    after = feed + (level - feed) * remaining
    out = feed + (level - feed) * mean
    if after > cap[0]:
        return cap[0], min(out, cap[0]) + cap[1] * (after - cap[0]) * held_over
    return after, out


@njit(cache=True, error_model="numpy")
def parted(c: Floats, dt_s: float) -> tuple[int, tuple[float, float]]:
    """The dead time's whole samples, and the two parts of a sample split by its fraction [s]."""
    if c[PIPE] != 0.0:
        return 0, (0.0, dt_s)
    delay = int(c[L] / dt_s)
    part = c[L] - delay * dt_s
    return delay, (part, dt_s - part)


# A sample has two parts, before and after the dead time's fraction; values equal in both are computed once,
# into locals: the compiler cannot exclude that the loop writes to c.
@njit(cache=True, error_model="numpy")
def vessel_span(
    span: tuple[int, int], m: Memory, drive: tuple[Floats, Floats, Floats], c: Floats, dt_s: float, base: float,
    head: float, out: Floats,
) -> Memory:  # fmt: skip
    """Write PV's deviation [% PV] over samples span[0] (included) to span[1] (excluded) to `out`, shape (n,).

    m : the vessel's memory before the span; the memory after it is returned. drive : flow during each sample, load at
    the inlet [% OP] and relative gain, shape (n,) each, known up to the end of the span; base : the flow that counts
    as zero; head : level deviation at which a square-root vessel would be empty, sign reversed.
    """
    flow, act, gain = drive
    x, mode, z2, z3 = m
    delay, parts = parted(c, dt_s)
    linear = c[SLOPE] == 0.0 and c[ROOT] == 0.0 and c[GAIN_SLOPE] == 0.0
    times, o = (parts[0] / c[T], parts[1] / c[T]), outflow_of(c, head)
    rises = shares_filled(o, times)
    remaining, mean = kept(c, parts)
    k_gain, bias, share, second, third = c[K], c[BIAS], c[SHARE], c[T2] > 0.0, c[T3] > 0.0
    upper = (c[UPPER_CAP], c[PASSED])
    pours = math.isfinite(upper[0])
    for k in range(*span):
        out[k] = (1.0 - share) * x + share * mode
        factor, added = gain[k], k_gain * act[k]
        for half in range(2):
            if parts[half] <= 0.0:
                continue
            feed = factor * (k_gain * (flow[max(k - delay - 1 + half, 0)] - base) + bias)
            if o.gain_slope != 0.0:
                feed *= scheduled(x, o.gain_slope)
            feed += added
            if second and pours:
                z2, feed = poured(z2, feed, remaining[half, 0], mean[half, 0], upper, c[T2] / parts[half])
            elif second:
                z2, feed = feed + (z2 - feed) * remaining[half, 0], feed + (z2 - feed) * mean[half, 0]
            if third:
                z3, feed = feed + (z3 - feed) * remaining[half, 1], feed + (z3 - feed) * mean[half, 1]
            x = risen(x, feed, o, rises, half) if linear else filled(x, feed, times[half], o)
            if share != 0.0:
                mode += (feed - mode) * (1.0 - remaining[half, 2])
    return x, mode, z2, z3


@njit(cache=True, error_model="numpy")
def at_start(first: float, c: Floats, base: float) -> Memory:
    """The vessel's memory before the first sample: at the first flow [% OP], except for states with another start."""
    feed = c[K] * (first - base) + c[BIAS]
    return c[START], c[START], min(feed + c[BEGUN], c[UPPER_CAP]), feed


@njit(cache=True, error_model="numpy")
def vessel(
    flow: Floats, act: Floats, gain: Floats, c: Floats, dt_s: float, base: float, head: float
) -> Floats:
    """PV's deviation [% PV], shape (n,), of a vessel with any of the catalogue's physics; see vessel_span."""
    out = np.empty(flow.size)
    m = at_start(flow[0], c, base)
    vessel_span((0, flow.size), m, (flow, act, gain), c, dt_s, base, head, out)
    return out


@njit(cache=True, error_model="numpy")
def plain_vessel(flow: Floats, act: Floats, c: Floats, dt_s: float, base: float) -> Floats:
    """The same, shape (n,), where only K, T, L, bias and start are set: exact and several times faster."""
    n, lag = flow.size, unit_lag(c[T], c[L], dt_s)
    gain, bias = c[K], c[BIAS]
    out = np.empty(n)
    x = c[START]
    for k in range(n):
        out[k] = x
        later, late = flow[max(k - lag.delay - 1, 0)] - base, flow[max(k - lag.delay, 0)] - base
        x = stepped(x, lag, gain * (late + act[k]) + bias, gain * (later + act[k]) + bias)
    return out
