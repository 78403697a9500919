"""Model of an experiment, and of several combined: constants with intervals, and weights."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from identification.errors import NotAssessedError
from identification.estimation.descent import NINETY
from identification.experiments.closed import closed_candidates, shown_sign
from identification.experiments.columns import Kind, trial_of
from identification.experiments.find import LEAST_PART, SAMPLES, Course, Experiment
from identification.experiments.fit import Fitted, backlash_identifiable, candidates
from identification.experiments.intervals import Averaged, averaged, estimates_of
from identification.models import Estimate, Fopdt, Integrator, Process
from identification.record import Floats, LoopRecord, Mask
from identification.signals.isolated_values import isolated_values, without_lone

BLOCKS = 1500
"""Blocks in which an experiment is fitted at first [blocks]: each of some hundred columns passes the filter
once."""
BLOCKS_A_LAG = 12.0
"""Blocks in the shortest time of a response: the sum of lags of proofs/step_tests.md moves by less than 1 %
with more."""
MOST_BLOCKS = 20000  # Largest number of blocks for a fast response [blocks]: a second of work
ANSWERS = 10.0  # Gain in log likelihood by OP from which PV responds [nat]: one in 20,000 of noise alone
MOST_GAIN = 0.7
"""Half-width of the 90 % interval of the gain's log from which no model is reported: a factor of two."""
EXPLAINED = 0.7
"""Share of PV's motion that a simulation explains of an experiment in automatic: less is made by a load that
OP answers."""
LONE = 20.0
"""Jump there and back of a single value, over the upper quartile of changes, from which it is left out: as
recorder.spike."""
LONE_SHARE = 0.5
"""The same over the range of all other values [of PV's range]: a single value that goes by less is noise that
does little."""
CONSTANT_SAMPLES = 5  # Samples of constant OP about an isolated other value that is excluded [samples]


@dataclass(frozen=True, slots=True)
class Modelled:
    """The model of one experiment.

    experiment; kind of response; estimates, by name with 90 % intervals; mean, the constants averaged over all
    candidates; nat, gain in log likelihood from OP [nat]; explained, share of PV's motion [-]; time_s, pv, simulated
    [% PV] and op [% OP] in blocks, shape (n,), from the record's start; lone_pv, lone_op, times of single values left
    out [s]; backlash_identifiable, whether the OP moves make backlash identifiable.
    """

    experiment: Experiment
    kind: Kind
    estimates: Mapping[str, Estimate]
    mean: Averaged
    nat: float
    explained: float
    time_s: Floats = field(repr=False)
    pv: Floats = field(repr=False)
    simulated: Floats = field(repr=False)
    op: Floats = field(repr=False)
    lone_pv: tuple[float, ...] = ()
    lone_op: tuple[float, ...] = ()
    backlash_identifiable: bool = False

    @property
    def process(self) -> Process:
        """The process for tuning; two lags are reduced by the half rule (Skogestad 2003, eq. 10)."""
        return process_of(self.kind, self.estimates)


def process_of(kind: Kind, e: Mapping[str, Estimate]) -> Process:
    """A process of one lag with dead time, or an integrator, from an experiment's constants."""
    dead_s = e["dead_time_s"].value
    if kind is Kind.INTEGRATOR:
        return Integrator(e["slope_pct_per_s"].value, dead_s)
    total = e["lags_s"].value
    second = min(e["second_lag_s"].value, 0.5 * total) if "second_lag_s" in e else 0.0
    late = dead_s + 0.5 * second + (e["zero_s"].value if "zero_s" in e else 0.0)
    return Fopdt(e["gain"].value, max(total - 0.5 * second, 1e-6), late)


def lone_in(record: LoopRecord) -> tuple[Mask, Mask]:
    """Isolated single values of PV, and of an OP that is otherwise constant before and after; shape (n,) each."""
    factor, count = LONE, CONSTANT_SAMPLES
    pv = isolated_values(record.pv, record.at_work, factor, LONE_SHARE)
    op = isolated_values(record.op, record.at_work, factor, LEAST_PART)
    for k in np.flatnonzero(op):
        around = np.r_[record.op[max(k - count, 0) : k], record.op[k + 1 : k + 1 + count]]
        op[k] = float(np.ptp(around)) == 0.0
    return pv, op


def modelled(record: LoopRecord, x: Experiment, neighbours: Sequence[Floats] = ()) -> Modelled:
    """The model of one experiment of a record; neighbours, OPs of others on the record's clock, shape (n,) each.

    Raises NotAssessedError where PV does not respond to OP, or the sign of the gain is uncertain.
    """
    part = record.span(x.first, x.last)
    lone_pv, lone_op = lone_in(part)
    part = replace(part, bad=part.bad | lone_pv, op=without_lone(part.op, lone_op))
    others = tuple(b[x.first : x.last] for b in neighbours if float(np.ptp(b[x.first : x.last])) > 0.0)
    found, nat = _candidates(part, x, others)
    best, mean = found[0], averaged(found, x.course.closed)
    if nat < ANSWERS or NINETY * mean.spread.log_gain > MOST_GAIN:
        raise NotAssessedError(f"PV does not respond to OP beyond its noise in the {x.course}")
    trial, start_s = best.trial, x.first * record.dt_s
    blocks = trial.op.reshape(-1, trial.factor).mean(axis=1)
    return Modelled(
        x,
        best.shape.kind,
        estimates_of(found, mean),
        mean,
        nat,
        1.0 - float(np.var((trial.pv - best.simulated)[trial.usable]) / np.var(trial.pv[trial.usable])),
        start_s + trial.time_s,
        trial.pv,
        best.simulated,
        blocks,
        tuple(start_s + record.dt_s * np.flatnonzero(lone_pv)),
        tuple(start_s + record.dt_s * np.flatnonzero(lone_op)),
        backlash_identifiable(part.op),
    )


def _candidates(part: LoopRecord, x: Experiment, others: tuple[Floats, ...]) -> tuple[list[Fitted], float]:
    """Candidates, best first, and OP's gain [nat]; with finer blocks if the response is too fast for the first."""
    factor = max(len(part) // BLOCKS, 1)
    for _ in range(2):
        found, nat = _in_blocks(part, x, factor, others)
        if not found:
            raise NotAssessedError(f"no process explains PV in the {x.course}")
        fast_s = sum(found[0].lags_s) + found[0].dead_s
        fine = max(int(fast_s / BLOCKS_A_LAG / part.dt_s), 1)
        if fine >= factor:
            break
        factor = max(fine, len(part) // MOST_BLOCKS, 1)
    return found, nat


def _in_blocks(
    part: LoopRecord, x: Experiment, factor: int, others: tuple[Floats, ...]
) -> tuple[list[Fitted], float]:
    trial = trial_of(part, factor, others)
    if int(trial.usable.sum()) < SAMPLES:
        need = f"needs {SAMPLES} good samples, has {int(trial.usable.sum())}"
        raise NotAssessedError(f"{need} in the {x.course}")
    if x.course.closed:
        found = closed_candidates(trial, shown_sign(trial), x.course is Course.WARM_UP)
        residual = math.inf if not found else float(np.var(found[0].trial.pv - found[0].simulated))
        good = residual < (1.0 - EXPLAINED) * float(np.var(trial.pv))
        return found, ANSWERS if good else 0.0
    found, still = candidates(trial)
    return found, found[0].score - still.score


@dataclass(frozen=True, slots=True)
class Pooled:
    """Several experiments combined: kind and estimates, the weight of each [-], and those with the same kind."""

    kind: Kind
    estimates: Mapping[str, Estimate]
    weights: tuple[float, ...]
    used: tuple[Modelled, ...]

    @property
    def process(self) -> Process:
        """The process for tuning."""
        return process_of(self.kind, self.estimates)


def pooled(found: Sequence[Modelled]) -> Pooled:
    """One model of several experiments, weighted by their precision and the variance between them (DerSimonian, Laird
    1986). found : at least one; experiments of another family or sign than the most certain one are left out."""
    surest = min(found, key=lambda m: m.mean.spread.log_gain)
    ramp = surest.kind is Kind.INTEGRATOR
    used = [m for m in found if (m.kind is Kind.INTEGRATOR) == ramp and m.mean.gain * surest.mean.gain > 0.0]
    if len(used) == 1:
        return Pooled(surest.kind, surest.estimates, (1.0,), (surest,))
    out = dict(surest.estimates)
    sign = math.copysign(1.0, surest.mean.gain)
    names = ("slope_pct_per_s",) if ramp else ("gain", "lags_s")
    gain = [(math.log(abs(m.mean.gain)), m.mean.spread.log_gain) for m in used]
    mean, deviation, weights = weighted_mean(gain)
    out[names[0]] = _around_log(out[names[0]], sign, mean, deviation)
    if not ramp:
        mean, deviation, _ = weighted_mean([(math.log(m.mean.lags_s), m.mean.spread.log_lags) for m in used])
        out["lags_s"] = _around_log(out["lags_s"], 1.0, mean, deviation)
    mean, deviation, _ = weighted_mean([(m.mean.dead.value, max(m.mean.spread.dead_s, 1e-9)) for m in used])
    late = NINETY * deviation
    out["dead_time_s"] = Estimate(mean, max(mean - late, 0.0), mean + late, "s")
    return Pooled(surest.kind, out, tuple(weights.tolist()), tuple(used))


def _around_log(old: Estimate, sign: float, mean: float, deviation: float) -> Estimate:
    low, high = (sign * math.exp(mean + side * NINETY * deviation) for side in (-1.0, 1.0))
    return Estimate(sign * math.exp(mean), min(low, high), max(low, high), old.unit)


def weighted_mean(found: Sequence[tuple[float, float]]) -> tuple[float, float, Floats]:
    """Weighted mean of numbers with their deviations, its deviation, and the weights, shape (m,), which sum to 1."""
    value, wide = (np.array(x) for x in zip(*found, strict=True))
    inverse = wide**-2.0
    mean = float(inverse @ value / inverse.sum())
    excess = float(inverse @ (value - mean) ** 2) - (value.size - 1)
    between = max(excess / (inverse.sum() - (inverse**2).sum() / inverse.sum()), 0.0)
    weight = 1.0 / (wide**2 + between)
    return (
        float(weight @ value / weight.sum()),
        float(weight.sum() ** -0.5),
        np.asarray(weight / weight.sum()),
    )
