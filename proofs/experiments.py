"""What `explain` names in open-loop experiments: plants of known physics, with a scripted OP, under known loads.

python -m proofs.experiments [--plants 20] [--seed 1] [--out proofs/experiments.md]

Each plant is integrated by Euler's method with twenty steps a sample, without code of identification. OP is a
staircase, a random binary signal, random levels, or one step. White noise acts at the sensor. A first-order load
moves PV by .15 to .9 %, with a time constant of a tenth to three times that of the process. The saved constants are
tested on a second recording of the plant, with other OP moves and another load.
"""

from __future__ import annotations

import pathlib
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from identification.mismatch.answer import Answer, answer
from identification.mismatch.diagnosis import explain
from identification.mismatch.explanation import Explanation
from identification.mismatch.model_file import carried, to_data
from identification.mismatch.proof import misfit
from identification.mismatch.recording import Recording
from identification.record import Floats
from proofs.common import parser_of

N, PARTS, DT = 1500, 20, 1.0
"""Samples of a recording, Euler steps in one sample, and sample interval [s]."""
Physics = Callable[[Floats, np.random.Generator, "Plant"], Floats]


@dataclass(frozen=True, slots=True)
class Plant:
    """Constants of a plant: gain [% PV / % OP], time constant and dead time [s], and one constant of its kind."""

    gain: float
    lag_s: float
    dead_s: float
    own: float


def euler(op: Floats, plant: Plant, speed: Callable[[float, float], float]) -> Floats:
    """PV after a dead time, shape (n,) [% PV]. The state changes at speed(level, OP) and starts at rest at 50 %
    OP."""
    late = round(plant.dead_s / DT * PARTS)
    driven = np.concatenate((np.full(late, op[0]), np.repeat(op, PARTS)))[: op.size * PARTS]
    x, out = 50.0, np.empty(op.size)
    for k in range(op.size):
        out[k] = x
        for u in driven[k * PARTS : (k + 1) * PARTS]:
            x += DT / PARTS * speed(x, float(u))
    return out


def plain(op: Floats, _: np.random.Generator, p: Plant) -> Floats:
    """The baseline process."""
    return euler(op, p, lambda x, u: (50.0 + p.gain * (u - 50.0) - x) / p.lag_s)


def second_lag(op: Floats, rng: np.random.Generator, p: Plant) -> Floats:
    """A second lag of .4 to .8 of the first, in series."""
    fine, lag = np.repeat(plain(op, rng, p), PARTS), p.lag_s * p.own
    x, out = 50.0, np.empty(op.size)
    for k in range(op.size):
        out[k] = x
        for v in fine[k * PARTS : (k + 1) * PARTS]:
            x += DT / PARTS * (v - x) / lag
    return out


def slow_mode(op: Floats, rng: np.random.Generator, p: Plant) -> Floats:
    """A vessel wall: .15 to .3 of each response has a time constant eight times as long."""
    slow = Plant(p.gain, 8.0 * p.lag_s, p.dead_s, 0.0)
    share = 0.375 * p.own
    return (1.0 - share) * plain(op, rng, p) + share * plain(op, rng, slow)


def curve(op: Floats, rng: np.random.Generator, p: Plant) -> Floats:
    """A valve characteristic: the gain at least doubles over the strokes used."""
    bent = 50.0 + 25.0 * (np.exp(p.own * (op - 50.0) / 12.0) - 1.0) / p.own * 0.5
    return plain(bent, rng, p)


def supply(op: Floats, rng: np.random.Generator, p: Plant) -> Floats:
    """A heat exchanger whose hot side cools by a third or more and recovers: gain and bias follow it."""
    at = np.linspace(0.0, 2.0 * np.pi, op.size)
    hot = 1.0 - 0.5 * p.own * (1.0 - np.cos(at)) / 2.0
    late = round(p.dead_s / DT)
    moved = np.concatenate((np.full(late, op[0]), op))[: op.size]
    x, out = 50.0, np.empty(op.size)
    for k in range(op.size):
        out[k] = x
        x += DT / p.lag_s * ((50.0 + p.gain * (moved[k] - 50.0)) * hot[k] - x)
    return out


def two_tanks(op: Floats, _: np.random.Generator, p: Plant) -> Floats:
    """Two vessels with outlet holes, one above the other; half of the upper overflow goes to the lower vessel."""
    full, h1, h2 = 62.0 + 10.0 * p.own, 50.0, 50.0
    k, out = np.sqrt(50.0) / p.lag_s, np.empty(op.size)
    for i, u in enumerate(op):
        out[i] = h2
        for _ in range(PARTS):
            inflow, down = k * np.sqrt(50.0) * (1.0 + 2.0 * (u - 50.0) / 50.0), k * np.sqrt(max(h1, 0.0))
            h1 += DT / PARTS * (inflow - down)
            spilt = max(h1 - full, 0.0)
            h1 -= spilt
            h2 += DT / PARTS * (down - k * np.sqrt(max(h2, 0.0))) + 0.5 * spilt
    return out


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of plant: its physics, the right names, and whether a single step shows its effect."""

    physics: Physics
    names: tuple[str, ...]
    by_a_step: bool = False


KINDS = {
    "plain": Kind(plain, ("none",), True),
    "second lag": Kind(second_lag, ("second-lag", "sensor-lag"), True),
    "slow mode": Kind(slow_mode, ("slow-mode",), True),
    "bent valve": Kind(curve, ("valve-characteristic", "nonlinear-gain")),
    "wandering supply": Kind(supply, ("supply-variation", "gain-drift")),
    "two vessels": Kind(two_tanks, ("overflow", "sqrt-outflow", "second-lag")),
}


def moves(rng: np.random.Generator, one_step: bool, lag_s: float) -> Floats:
    """OP of a script, shape (N,) [% OP]."""
    if one_step:
        return np.where(np.arange(N) < N // 8, 50.0, 50.0 + rng.choice([-10.0, 10.0]))
    hold = max(int(lag_s * rng.uniform(1.0, 4.0)), 5)
    parts = N // hold + 1
    kind = rng.integers(3)
    if kind == 0:
        levels = 50.0 + 12.0 * rng.uniform(-1.0, 1.0, parts)
    elif kind == 1:
        levels = 50.0 + 8.0 * rng.choice([-1.0, 1.0], parts)
    else:
        levels = 50.0 + 12.0 * (2.0 * np.abs((np.arange(parts) + 3) % 12 / 6.0 - 1.0) - 1.0)
    levels[0] = 50.0
    return np.repeat(levels, hold)[:N]


def load(rng: np.random.Generator, lag_s: float) -> Floats:
    """Sensor noise and a first-order load, shape (N,) [% PV]."""
    pole = np.exp(-DT / (lag_s * np.exp(rng.uniform(np.log(0.1), np.log(3.0)))))
    size = np.exp(rng.uniform(np.log(0.15), np.log(0.9)))
    e = rng.standard_normal(N) * size * np.sqrt(1.0 - pole**2)
    x, out = 0.0, np.empty(N)
    for k in range(N):
        x = pole * x + e[k]
        out[k] = x
    return out + 0.1 * rng.standard_normal(N)


def drawn(kind: str, seed: int) -> tuple[Recording, Recording]:
    """One plant of a kind: the recording to explain, and a later one."""
    rng = np.random.default_rng([seed, list(KINDS).index(kind)])
    lag_s = float(np.exp(rng.uniform(np.log(10.0), np.log(30.0))))
    plant = Plant(rng.uniform(0.8, 2.0), lag_s, rng.uniform(0.1, 0.5) * lag_s, rng.uniform(0.4, 0.8))
    one_step = KINDS[kind].by_a_step and rng.random() < 0.3
    out = []
    for single in (one_step, False):
        op = moves(rng, single, lag_s)
        pv = np.round(KINDS[kind].physics(op, rng, plant) + load(rng, lag_s), 2)
        out.append(Recording(None, pv, op, np.ones(N, bool), DT, DT * np.arange(N)))
    return out[0], out[1]


def carried_misfit(found: Explanation, later: Recording) -> tuple[float, float]:
    """Misfit [% PV] of the baseline and of the better model on the later recording."""
    fits = (found.plain, found.best)
    data = [to_data("X", found.p.inputs, f.model.c, (), 0.0, {}) for f in fits]
    sizes = [misfit(later.pv, carried(d, later.op, later.pv, later.dt_s)).rmse for d in data]
    return sizes[0], sizes[1]


def answered(kind: str, seed: int) -> tuple[Answer, tuple[float, float]]:
    """The answer for one plant, and the misfits of its models on the later recording."""
    s, later = drawn(kind, seed)
    found = explain(s)
    return answer(found, s), carried_misfit(found, later)


def line(kind: str, seeds: Sequence[int]) -> str:
    """One kind as a row of the table."""
    with np.errstate(all="ignore"):
        answers = [answered(kind, seed) for seed in seeds]
    first = Counter(found_answer.verdict for found_answer, _ in answers)
    right = sum(found_answer.verdict in KINDS[kind].names for found_answer, _ in answers)
    within = sum(
        any(e.name in KINDS[kind].names for e in found_answer.effects) for found_answer, _ in answers
    )
    before, after = np.median([sizes for _, sizes in answers], axis=0)
    worse = sum(y > 1.1 * x for _, (x, y) in answers)
    names = ", ".join(f"{name} {count}" for name, count in first.most_common())
    count = len(answers)
    return f"| {kind} | {right} of {count} | {within} | {before:.2f} → {after:.2f} | {worse} | {names} |"


def table(plants: int, seed: int) -> str:
    """The proof as Markdown."""
    seeds = range(1000 * seed, 1000 * seed + plants)
    head = (
        "| plant | right word | right name among the effects | later misfit, plain → better [% PV, median] "
        "| worse there by a tenth | words |\n| --- | --- | --- | --- | --- | --- |"
    )
    return "\n".join([head, *(line(kind, seeds) for kind in KINDS)])


def main() -> None:
    parser = parser_of(__doc__, plants=20, seed=1)
    parser.add_argument("--out", type=pathlib.Path)
    a = parser.parse_args()
    text = (
        "# Experiments in open loop\n\n"
        f"`python -m proofs.experiments --plants {a.plants} --seed {a.seed}`\n\n"
        f"{table(a.plants, a.seed)}\n"
    )
    if a.out is not None:
        a.out.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
