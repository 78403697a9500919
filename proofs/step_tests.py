"""Simulated step tests assessed as in a night: constants compared with the truth, intervals, and signs.

    python -m proofs.step_tests --tests 60 --seed 1

The plant is proofs/step_test_plant.py, which shares no code with the packages. Writes proofs/step_tests.md.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.special import erf

from analyzer.config import Config
from analyzer.history.series import Series
from analyzer.loop.decisions import LacksError
from analyzer.loop.experiments.found import experiment_results
from analyzer.loop.record.quality import prepare
from analyzer.loops.spec import LoopSpec
from proofs.step_test_plant import Truth, best_scatter, drawn, recorded

RESULT = Path(__file__).with_suffix(".md")
WITHIN = {"gain": 0.10, "sum of lags": 0.15, "dead time": 0.30}
"""Relative errors that count as right; for a dead time also an error of one sample."""


@dataclass(frozen=True)
class Constant:
    """One constant of one test: its name, truth, estimate with interval (None without a model), and whether it is
    right."""

    name: str
    truth: float
    value: float | None
    low: float
    high: float
    right: bool
    possible: float = np.nan
    """Probability that an unbiased normal estimate with the smallest possible scatter is right; dead times only."""

    @property
    def holds(self) -> bool:
        """Whether the interval contains the truth."""
        return self.value is not None and self.low <= self.truth <= self.high


def tested(seed: int) -> tuple[Truth, list[Constant]]:
    """The estimates of one test with their truth."""
    t = drawn(seed)
    r = recorded(t, seed)
    none = np.zeros(r.pv.size, dtype=bool)
    series = {"T.PV": Series(r.stamp_s, r.pv, none, None), "T.OP": Series(r.stamp_s, r.op, none, None)}
    spec = LoopSpec("T", pv="T.PV", op="T.OP", pv_lo=0.0, pv_hi=100.0)
    config = Config()
    try:
        found = experiment_results(spec, series, prepare(spec, series, config.quality), config)
    except LacksError:  # a test too short for a record
        found = None
    model = None if found is None else found.model
    names = {"gain": t.gain, "sum of lags": sum(t.lags_s), "dead time": t.dead_s}
    if t.kind == "integrator":
        del names["sum of lags"]
    keys = {"gain": "slope_pct_per_s" if t.kind == "integrator" else "gain", "sum of lags": "lags_s"}
    out = []
    for name, truth in names.items():
        near = max(WITHIN[name] * abs(truth), t.sample_s if name == "dead time" else 0.0)
        can = (
            float(erf(near / best_scatter(t, seed, "dead_s") / np.sqrt(2.0)))
            if name == "dead time"
            else np.nan
        )
        e = None if model is None else model.estimates.get(keys.get(name, "dead_time_s"))
        if e is None:
            out.append(Constant(name, truth, None, 0.0, 0.0, False, can))
            continue
        out.append(Constant(name, truth, e.value, e.low, e.high, abs(e.value - truth) <= near, can))
    return t, out


def table(found: list[tuple[Truth, list[Constant]]]) -> Iterator[str]:
    """The result as lines of Markdown."""
    every = [a for _, of in found for a in of]
    yield "| constant | tests | no model | right | interval contains the truth |\n|---|---|---|---|---|"
    for name, share in WITHIN.items():
        own = [a for a in every if a.name == name]
        some = [a for a in own if a.value is not None]
        right, holds = sum(a.right for a in own), sum(a.holds for a in some)
        label = f"{name} within {100 * share:.0f} %{' or a sample' if name == 'dead time' else ''}"
        lost = len(own) - len(some)
        hold = f"{holds} of {len(some)} ({100 * holds / max(len(some), 1):.0f} %)"
        yield f"| {label} | {len(own)} | {lost} | {right} ({100 * right / len(own):.0f} %) | {hold} |"
    gains = [a for a in every if a.name == "gain" and a.value is not None]
    wrong = sum((a.value or 0.0) * a.truth < 0.0 for a in gains)
    some = [a for a in every if a.value is not None]
    yield f"\nIntervals of all constants: {100 * sum(a.holds for a in some) / len(some):.0f} % contain the truth."
    yield f"Wrong signs: {wrong} of {len(gains)}."
    yield (
        "\nDead times: the bound of Cramer and Rao gives the smallest scatter that the noise of each test allows. "
        "Gain, lags, zero, backlash, offset and drift are unknown. Unbiased estimates with this scatter would be "
        "right in "
        f"{100 * possible(every):.0f} %."
    )
    yield "\n| by noise over the response | tests | gain right | lags right | dead time right | the noise allows |"
    yield "|---|---|---|---|---|---|"
    for low, high in ((0.0, 0.1), (0.1, 0.2), (0.2, 0.34)):
        part = [of for t, of in found if low <= t.noise < high]
        cells = []
        for name in WITHIN:
            own = [a for of in part for a in of if a.name == name]
            cells.append(f"{sum(a.right for a in own)} of {len(own)}")
        cells.append(f"{100.0 * possible(a for of in part for a in of):.0f} %")
        yield f"| {low:g} to {high:g} | {len(part)} | {' | '.join(cells)} |"


def possible(every: Iterable[Constant]) -> float:
    """Share of dead times for which unbiased estimates with the smallest possible scatter would be right."""
    shares = [a.possible for a in every if a.name == "dead time"]
    return float(np.mean(shares)) if shares else np.nan


def main() -> None:
    """Print the table and write it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tests", type=int, default=60)
    parser.add_argument("--seed", type=int, nargs="+", default=[1])
    args = parser.parse_args()
    found = []
    for k in (1000 * seed + i for seed in args.seed for i in range(args.tests)):
        found.append(tested(k))
        print(k, found[-1][0].kind, [(a.name, a.right, a.holds) for a in found[-1][1]], flush=True)
    seeds = " ".join(map(str, args.seed))
    head = f"# Step tests\n\n`python -m proofs.step_tests --tests {args.tests} --seed {seeds}`\n"
    about = (
        "\nThe processes are lag, two lags, integrator or inverse response. A test has one to six moves of 4 to 8 %, "
        "and noise of 1 to 33 % of the mean response. Half of the tests have a drift of up to 40 % of it. Two of "
        "five tests with four moves and more have backlash of 5 to 30 % of a step. The sample is 1 to 60 s, with at "
        "least forty samples in the sum of lags, because a record needs 200. The stamps scatter by up to 30 % of a "
        "sample.\n\n"
    )
    text = head + about + "\n".join(table(found)) + "\n"
    RESULT.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
