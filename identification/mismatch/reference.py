"""How well a flexible reference predicts, on held-out data, the innovations of an explanation.

No list of possible physics is complete. The reference names no effect: it has classes of influences on a loop (by
past OP, by size, level, direction and switching, by past PV, by sensor or clock), each a ridge regression of the
innovations on earlier signals. Noise is not predictable on data that no weight was fitted to, so what a class
predicts there is physics that the explanation does not include.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from identification.estimation.model import Fitted
from identification.estimation.noise import lag_means, whitened
from identification.estimation.prediction_error import sensitivities
from identification.estimation.problem import Problem
from identification.record import Floats
from identification.simulation.lag import lagged
from identification.simulation.open_loop import simulate, through_valve
from identification.simulation.parameters import Slot
from identification.simulation.vessel import plain_vessel

SETTLES = 0.1  # Share of the record that a time constant may take if the loop is to be seen to settle

BOXES = 32  # Past stretches of OP that may act, each with a weight of its own
REACH = 8.0  # Their reach into the past, in time constants plus dead times: a recycle of seven is within it
MOST_REACH = 0.2  # The same at most, in the recording
LEAST_BOX = 3  # Fewest samples of such a stretch [samples]
FOLDS = 5  # Parts of a record, each predicted from the others
CALM = 0.05
"""Precision of the ridge's prior of a periodic waveform over that of a sample, per sample: .015 and .05 do
alike."""
FAST = 0.3  # Time constants over which a move still acts
OF_RECORD = 0.05  # Largest reach of the loop's history, over the recording: what lasts longer is a drift
HARMONICS = 16
"""Harmonics of a periodic waveform: a switched load leaves innovations at the switching and none between;
with three a periodic pump gained 4 nat in the median of 21, with sixteen 41, and nothing else did."""
CLOCK_CYCLES = 3  # Cycles of a periodic waveform that a record must contain
WIDEST = 5.0  # Standard deviations to which a move predicted by the model is clipped: one move is no law
PRIORS = (0.003, 0.3)
"""Precisions of the ridge's prior over that of a sample, of which the better counts [per sample]. Source: of
.003 to 3 unnamed physics that rings is found by the first, all else by the second (proofs/concealed)."""
MEMORIES = (3.0, 10.0, 30.0, 100.0)  # How far back the loop's history reaches [time constants]
LEVELS = (0.2, 0.4, 0.6, 0.8)  # Quantiles of possible switching levels
BANDS = (0.03, 0.15, 0.4)  # Hysteresis of a possible switch [of the range]
FINER = 8
"""Lines of a periodic load's spectrum for one of the record's: the last harmonic has to keep step over it."""


@dataclass(frozen=True, slots=True)
class Prediction:
    """The class with the best prediction, and its gain [nat]."""

    influence: str = ""
    gain: float = 0.0


def response(x: Floats, c: Floats, dt_s: float) -> Floats:
    """Response of PV to a load at the inlet, shape (n,), of unit gain with a model's lag and dead time."""
    unit = c.copy()
    unit[[Slot.K, Slot.BIAS, Slot.START]] = 1.0, 0.0, 0.0
    return plain_vessel(x - x[0], np.zeros(x.size), unit, dt_s, 0.0)


class LoopSignals:
    """Signals of the influence classes, for a model of constants c, shape (SIZE,): flow `through` the valve [% OP],
    the same and earlier PV [% PV] about their means, shape (n,) each, and the time constant [s].

    Errors of an experiment are simulation errors and are correlated in time, so recorded PV predicts them for
    any cause. In an experiment PV is therefore the simulated one.
    """

    def __init__(self, p: Problem, c: Floats) -> None:
        self.through, self.dt_s = through_valve(p.inputs, c), p.inputs.dt_s
        pv = simulate(p.inputs, c) if p.by_simulation else np.concatenate((p.y[:1], p.y[:-1]))
        self.flow, self.pv = self.through - self.through.mean(), pv - pv.mean()
        self.lag_s = min(max(float(c[Slot.T]), self.dt_s), SETTLES * pv.size * self.dt_s)
        self.c, self.lagging = c, c.copy()
        self.lagging[Slot.T] = self.lag_s

    def response(self, x: Floats) -> Floats:
        """The response of PV to a load, shape (n,), with the time constant limited by the record."""
        return response(x, self.lagging, self.dt_s)

    def ahead(self, x: Floats) -> Floats:
        """A signal, shape (n,), less its own lag."""
        return x - lagged(x, FAST * self.lag_s, self.dt_s)


def on_above(x: Floats, at: float, band: float) -> Floats:
    """1 where x, shape (n,), was last above `at` + half a band, 0 where it was last below `at` - half a band."""
    states = np.where(x > at + band / 2.0, 1.0, np.where(x < at - band / 2.0, 0.0, np.nan))
    states[0] = float(x[0] > at)
    last = np.maximum.accumulate(np.where(np.isnan(states), 0, np.arange(x.size)))
    return states[last]  # type: ignore[no-any-return]


def by_level(o: LoopSignals) -> list[Floats]:
    """Gain and load that depend on PV's level, and loads switched by PV."""
    out = [o.response(o.flow * o.pv), o.response(o.flow * o.pv**2), o.pv**2, o.pv**3]
    edges, span = np.quantile(o.pv, LEVELS[:3]), float(np.ptp(o.pv))
    return out + [o.response(on_above(o.pv, at, band * span)) for at in edges for band in BANDS[:2]]


def by_switch(o: LoopSignals) -> list[Floats]:
    """Load and gain of another flow regime, which ends at another level than it begins."""
    span = float(np.subtract(*np.quantile(o.flow, (0.99, 0.01))))
    out = []
    for at in np.quantile(o.flow, LEVELS):
        for band in BANDS:
            on = on_above(o.flow, at, band * span)
            out += [o.response(on), o.response(on * (o.flow - at))]
    return out


def by_history(o: LoopSignals) -> list[Floats]:
    """Load and gain that depend on past PV and on past travel of the valve."""
    travel = np.abs(np.diff(o.flow, prepend=o.flow[0]))
    longest_s = OF_RECORD * o.flow.size * o.dt_s
    out = []
    shortest_s, *others_s = (m * o.lag_s for m in MEMORIES)
    for memory_s in (shortest_s, *(m for m in others_s if m <= longest_s)):
        been, gone = (lagged(x - x.mean(), memory_s, o.dt_s) for x in (o.pv, travel))
        out += [o.response(x) for x in (been, gone, o.flow * been, o.flow * gone)]
    return out


def by_direction(o: LoopSignals) -> list[Floats]:
    """Gain, load and reading that depend on the direction and the speed of flow and of PV."""
    flow, pv = o.ahead(o.flow), o.ahead(o.pv)
    direction, rise = (np.tanh(3.0 * x / (float(np.std(x)) + 1e-9)) for x in (flow, pv))
    loads = [o.response(x) for x in (direction, direction * o.flow, rise, rise * o.flow)]
    return [*loads, np.abs(flow), np.abs(pv), pv * o.pv, rise, np.abs(pv) * o.pv]


def by_sensor(p: Problem, fit: Fitted) -> list[Floats]:
    """For the innovations directly: whether PV is constant, and its predicted move by size and direction."""
    one, two = (np.concatenate((np.full(k, p.y[0]), p.y[:-k])) for k in (1, 2))
    move = _bounded(p.y - fit.e - one)
    is_constant = (one == two).astype(float)
    return [is_constant, move * is_constant, move * np.abs(move), np.maximum(move, 0.0), np.abs(move)]


def past_moves(o: LoopSignals) -> list[Floats]:
    """Means of OP behind the valve over past stretches, each shape (n,)."""
    n, dt_s = o.flow.size, o.dt_s
    length_s = min(REACH * float(o.c[Slot.T] + o.c[Slot.L]), MOST_REACH * n * dt_s)
    width = max(round(length_s / BOXES / dt_s), LEAST_BOX)
    total = np.concatenate(([0.0], np.cumsum(o.flow)))
    at = [np.maximum(np.arange(n) - i * width, 0) for i in range(BOXES + 1)]
    return [(total[at[i]] - total[at[i + 1]]) / width for i in range(BOXES)]


def bent_moves(o: LoopSignals) -> list[Floats]:
    """Responses to OP's fast part by size, to its square and to its cube, each shape (n,)."""
    moves = []
    for share in (0.1, 0.5):
        fast = o.through - lagged(o.through, max(share * float(o.c[Slot.T]), o.dt_s), o.dt_s)
        moves += [fast * np.abs(fast), np.abs(fast)]
    return [response(x, o.c, o.dt_s) for x in (*moves, o.flow**2, o.flow**3)]


INFLUENCES: Mapping[str, Callable[[LoopSignals], list[Floats]]] = {
    "past": past_moves,
    "size": bent_moves,
    "level": by_level,
    "switch": by_switch,
    "history": by_history,
    "direction": by_direction,
}
"""The classes of influences on PV, each with its signals, shape (n,) each."""


def influence_signals(p: Problem, fit: Fitted) -> Iterator[tuple[str, list[Floats]]]:
    """All classes with their whitened signals, shape (n,) each."""
    o = LoopSignals(p, fit.model.c)
    for name, signals_of in INFLUENCES.items():
        yield name, [whitened(x, fit.ar, p.edges) for x in signals_of(o)]
    if not p.by_simulation:
        yield "sensor", by_sensor(p, fit)


def unfollowed(p: Problem, fit: Fitted) -> Callable[[Floats], Floats]:
    """A function that removes from signals, shape (n,) or (n, m), weighted as innovations are, the part that a fit's
    own constants and its noise model can follow linearly."""
    r = p.y - simulate(p.inputs, fit.model.c)
    own = np.concatenate((sensitivities(p, fit.model, fit.ar), lag_means(r, p.edges))) * np.sqrt(p.weight)
    span = np.linalg.qr(np.nan_to_num(own).T)[0]
    return lambda x: x - span @ (span.T @ x)


def flexible_residual(p: Problem, fit: Fitted) -> Floats:
    """Residual of a fit's weighted innovations under the flexible model, shape (n,)."""
    root, rest, o = np.sqrt(p.weight), unfollowed(p, fit), LoopSignals(p, fit.model.c)
    free = past_moves(o) + bent_moves(o)
    e = rest(fit.e * root)
    more = rest((np.stack([whitened(x, fit.ar, p.edges) for x in free]) * root).T)
    q, scale = np.linalg.qr(more)
    kept = np.abs(np.diag(scale)) > 1e-8 * np.abs(np.diag(scale)).max()
    return e - q[:, kept] @ (q[:, kept].T @ e)  # type: ignore[no-any-return]


def best_prediction(p: Problem, fit: Fitted, clock: bool = True) -> Prediction:
    """The class with the best prediction of a fit's innovations on held-out data, optionally with a clock; the part
    that the fit's constants and its noise model could follow is excluded."""
    root, rest = np.sqrt(p.weight), unfollowed(p, fit)
    e = rest(fit.e * root)
    best = Prediction("clock", _gained(fit, e, _by_clock(e, root))) if clock else Prediction()
    for influence, signals in influence_signals(p, fit):
        x = rest(np.nan_to_num(np.stack(signals) * root).T)
        size = x.std(axis=0)
        kept = size > 1e-9 * size.max(initial=1e-30)
        won = max(_gained(fit, e, _by_ridge(e, x[:, kept] / size[kept], prior)) for prior in PRIORS)
        best = Prediction(influence, won) if won > best.gain else best
    return best


def _bounded(x: Floats) -> Floats:
    """A signal, shape (n,), with its largest moves clipped."""
    most = WIDEST * np.std(x)
    return np.clip(x, -most, most)


def _folds(n: int) -> Iterator[slice]:
    """The parts of a record."""
    ends = np.linspace(0, n, FOLDS + 1).astype(int)
    return (slice(a, b) for a, b in pairwise(ends))


def _by_ridge(e: Floats, x: Floats, prior: float) -> Floats:
    """Residual of e, shape (n,), in each part when the other parts train its prediction from x, shape (n, m)."""
    gram, slope, out = x.T @ x, x.T @ e, np.empty(e.size)
    ridge = prior * e.size * np.eye(x.shape[1])
    for part in _folds(e.size):
        mine = x[part]
        weights = np.linalg.solve(gram - mine.T @ mine + ridge, slope - mine.T @ e[part])
        out[part] = e[part] - mine @ weights
    return out


def _by_clock(e: Floats, root: Floats) -> Floats:
    """The same with a periodic prediction, of the period with the most power in all harmonics in the other parts."""
    n, out, each = e.size, np.empty(e.size), np.arange(1, HARMONICS + 1)
    bounded = _bounded(e)
    for part in _folds(n):
        known = np.ones(n, dtype=bool)
        known[part] = False
        power = np.abs(np.fft.rfft(bounded * known, FINER * n)) ** 2
        lines = np.arange(FINER * CLOCK_CYCLES, power.size // (each.size + 1))
        if lines.size == 0:
            return e
        highest = lines[np.argmax(power[np.outer(each, lines)].sum(axis=0))]
        angle = 2.0 * np.pi * highest / (FINER * n)
        turn = np.outer(np.arange(n) * angle, each)
        harmonics = np.concatenate((np.cos(turn), np.sin(turn)), axis=1) * root[:, None]
        gram, slope = harmonics[known].T @ harmonics[known], harmonics[known].T @ e[known]
        ridge = CALM * n * np.eye(2 * each.size)
        out[part] = e[part] - harmonics[part] @ np.linalg.solve(gram + ridge, slope)
    return out


def _gained(fit: Fitted, e: Floats, residual: Floats) -> float:
    """Gain in log likelihood [nat] from e to `left`, shape (n,) each."""
    won = 0.5 * fit.count * np.log(float(e @ e) / max(float(residual @ residual), 1e-30))
    return float(won) if np.isfinite(won) else 0.0
