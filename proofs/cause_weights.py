"""What the signs of a cause weigh: python -m proofs.cause_weights [FOLDER ...] [--jobs 2]

Simulated loops whose cause is known and that oscillate are measured as a night does, and a multinomial logit is
fitted to them by ridge regression, each sign pointing the way that physics gives it. Fitted on are loops of
proofs/untidy (seeds 21 to 32, and 51 and 52 with up to 900 cycles), loads that swing worn valves (seed 41), plants
of proofs/coupled (seeds 500 to 513; a follower has a load), and the folders given, as ../shared/wild has them. Others
are kept apart and only asked: untidy loops of seeds 5, 6 and 7, worn valves of seed 42, coupled plants 520 to 533.
Writes analyzer/loop/cause_weights.json and proofs/cause_weights.md.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing import Pool
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

from analyzer import api
from analyzer.config import Config
from analyzer.loop.cause_weights import FILE, NAMES, measures, parted
from analyzer.loop.decisions import CAUSES
from analyzer.loop.fitness import unfit_for_cause
from analyzer.loop.measure import measure
from analyzer.loop.oscillation import counting, detect
from analyzer.loop.quality import Prepared, prepare
from analyzer.loops.tags import controller
from identification.errors import TriageError
from identification.models import Pid
from identification.record import Floats
from proofs.common import command, command_line, publish, table
from proofs.coupled.draw import draw as draw_plant
from proofs.explained import shows as shows_truth
from proofs.plant_wide import recorded as recorded_loop
from proofs.untidy.draw import CYCLES, draw
from proofs.untidy_loops import NAMED, clear, recorded, shows

WEIGHTS = Path(api.__file__).parent / "loop" / FILE
LONG = (150.0, 900.0)
KNOTS = (0.33, 0.67)
"""Quantiles of each measure at which its line breaks."""
RIDGE = 10.0
"""Penalty on squared weights of measures in units of their deviation [nat]; of 2 to 20 the loops kept apart are told
alike."""
WAYS = {
    "evidence": "+-0",
    "evidence_per_cycle": "+-0",
    "agreeing": "+-0",
    "steadiness": "+00",
    "jump": "+-0",
    "size": "+-0",
    "line_linear": "0-+",
    "line_valve": "-0+",
    "amplification": "0+-",
    "loop_gain": "0+0",
    "dead_time_share": "0+0",
    "consistency": "00-",
    "harmonic": "0-0",
    "kurtosis": "0f-",
    "rhythm": "-f+",
    "saturated": "0+-",
    "wave_left": "-0+",
}
"""Whether a measure speaks for (+) or against (-) valve, tuning and load, says nothing of it (0), or may do both (f).

What fits a faulty valve speaks for it, and against a tuning, whose swing is a sine that no play explains, but not
against a load, whose wave may be any; a peak left in the load, and harmonics of the cycle that the faulty valve does
not explain, for a load; amplification, a loop gain, a period of few dead times and limits at both ends for tuning; a
kept size and rhythm for a load and, of the size, against noise through a resonance. Without these ways the fit learns
how the simulated plants were drawn, whose loads are squares in loops of little gain and whose valves seldom make
squares: it tells more of the loops kept apart, and calls sticking valves of real flows loads.
"""
BOUNDS = {"+": (0.0, None), "-": (None, 0.0), "0": (0.0, 0.0), "f": (None, None)}
PER_SEED = 300


@dataclass(frozen=True, slots=True)
class NightDecision:
    """One oscillating loop: its true cause, whether it is clear, its measures of shape (len(NAMES),)."""

    cause: str
    clear: bool
    found: Floats


def told(prepared: Prepared, stated: Pid | None, kind: str, cause: str, plain: bool) -> NightDecision | None:
    """One loop measured; None where it does not count as oscillating or cannot be measured."""
    config = Config()
    found = detect(prepared.record, config.oscillation)
    first = counting(found)
    if first is None or unfit_for_cause(prepared, first, config) is not None:
        return None
    try:
        m = measure(prepared.record, first, stated, config.cause, found.spectrum, kind)
    except TriageError:
        return None
    return NightDecision(NAMED.get(cause, cause), plain, measures(m, first))


def untidy(task: tuple[int, tuple[float, float], bool]) -> list[NightDecision]:
    """An untidy loop that shows its cause."""
    seed, lengths, worn = task
    drawn = draw(seed, "load" if worn else None, lengths, worn)
    if drawn.truth["cause"] == "healthy" or not shows(drawn):
        return []
    found = told(*recorded(drawn, Config()), drawn.kind, drawn.truth["cause"], clear(drawn))
    return [] if found is None else [found]


def coupled(seed: int) -> list[NightDecision]:
    """The loops of a coupled plant that a fault of their own or a neighbour swings."""
    out = []
    drawn = draw_plant(seed, 30, hours=8)
    for x in drawn.loops:
        truth = drawn.truth[x.name]
        cause = "load" if truth["role"] == "follower" else NAMED.get(truth["cause"], truth["cause"])
        if cause not in CAUSES:
            continue
        spec, series = recorded_loop(x)
        try:
            prepared = prepare(spec, series, Config().quality)
        except TriageError:
            continue
        found = told(prepared, controller(spec, 100.0), x.kind, cause, True)
        out += [] if found is None else [found]
    return out


def kept(task: tuple[Path, str]) -> list[NightDecision]:
    """A loop of a folder that shows its cause."""
    folder, name = task
    truth = json.loads((folder / "truth.json").read_text())[name]
    if truth["cause"] == "healthy" or not shows_truth(truth):
        return []
    loop = api.read(folder / f"{name}.parquet", loops=folder / "loops.csv").loop(name)
    stated = controller(loop.spec, loop.prepared.scale.span)
    found = told(loop.prepared, stated, loop.spec.type, truth["cause"], True)
    return [] if found is None else [found]


def _seeds(*seeds: int) -> list[int]:
    return [100_000 * s + k for s in seeds for k in range(PER_SEED)]


def design(found: Floats, knots: Sequence[Floats]) -> Floats:
    """Parts of measures of shape (n, measures), shape (n, pieces)."""
    return np.concatenate([parted(found[:, k], knots[k]) for k in range(len(NAMES))], axis=1)


def fitted(x: Floats, y: np.ndarray, ways: Sequence[str]) -> tuple[Floats, Floats]:
    """Ridge regression of a multinomial logit: weights of shape (pieces, 3) in units of x, base of shape (3,).

    x of shape (n, pieces); y, numbers of the causes, shape (n,); ways of each piece, as in WAYS.
    """
    middle, spread = x.mean(axis=0), np.maximum(x.std(axis=0), 1e-9)
    z, hot = (x - middle) / spread, np.eye(3)[y]

    def loss(flat: Floats) -> tuple[float, Floats]:
        w, b = flat[:-3].reshape(-1, 3), flat[-3:]
        score = z @ w + b
        top = score.max(axis=1, keepdims=True)
        log_sum = top[:, 0] + np.log(np.exp(score - top).sum(axis=1))
        over = np.exp(score - log_sum[:, None]) - hot
        value = float((log_sum - (score * hot).sum(axis=1)).sum() + 0.5 * RIDGE * (w**2).sum())
        return value, np.concatenate(((z.T @ over + RIDGE * w).ravel(), over.sum(axis=0)))

    start = np.zeros(3 * (x.shape[1] + 1))
    bounds = [BOUNDS[c] for way in ways for c in way] + 3 * [(None, None)]
    best = minimize(loss, start, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": 5000})
    w = best.x[:-3].reshape(-1, 3) / spread[:, None]
    base = best.x[-3:] - middle @ w
    return w, base - base.mean()


def written(loops: Sequence[NightDecision]) -> None:
    """Fit the weights and write them."""
    found = np.array([t.found for t in loops])
    y = np.array([[str(c) for c in CAUSES].index(t.cause) for t in loops])
    knots = [np.unique(np.round(np.quantile(column, KNOTS), 3)) for column in found.T]
    x = design(found, knots)
    w, base = fitted(
        x, y, [WAYS[n] for n, own in zip(NAMES, knots, strict=True) for _ in range(1 + own.size)]
    )
    middle = x.mean(axis=0)
    at, table = 0, {}
    for name, own in zip(NAMES, knots, strict=True):
        part, usual = w[at : at + 1 + own.size], middle[at : at + 1 + own.size]
        at += 1 + own.size
        table[name] = {"knots": own.tolist(), "usual": np.round(usual @ part, 4).tolist()}
        table[name] |= {str(c): np.round(part[:, k], 4).tolist() for k, c in enumerate(CAUSES)}
    kept_base = {str(c): round(float(base[k]), 4) for k, c in enumerate(CAUSES)}
    counts = {str(c): int((y == k).sum()) for k, c in enumerate(CAUSES)}
    WEIGHTS.write_text(
        json.dumps({"fitted_on": counts, "base": kept_base, "measures": table}, indent=1) + "\n"
    )


def line(name: str, loops: Sequence[NightDecision], chances: object) -> list[object]:
    """How the loops of a set are told by probability alone, as a row of the table."""
    plain = [t for t in loops if t.clear]
    pairs = [(t.cause, max((p := chances(t.found)), key=p.get), max(p.values())) for t in plain]  # type: ignore[operator]
    cells: list[object] = [name, len(plain), f"{np.mean([a == b for a, b, _ in pairs]):.2f}"]
    for low, high in ((0.0, 0.6), (0.6, 0.8), (0.8, 1.01)):
        inside = [a == b for a, b, p in pairs if low <= p < high]
        cells.append(f"{sum(inside)} of {len(inside)}")
    blamed = sum(a != "valve" and b == "valve" for a, b, _ in pairs)
    cells.append(f"{blamed} of {sum(a != 'valve' for a, _, _ in pairs)}")
    return cells


def main() -> None:
    """Draw, measure, fit and write."""
    options = command_line(__doc__, folders="*", jobs=2)
    with Pool(options.jobs) as pool:

        def drawn(
            seeds: list[int], lengths: tuple[float, float] = CYCLES, worn: bool = False
        ) -> list[NightDecision]:
            tasks = [(s, lengths, worn) for s in seeds]
            return [t for part in pool.imap(untidy, tasks, chunksize=5) for t in part]

        def plants(first: int, last: int) -> list[NightDecision]:
            return [t for part in pool.imap(coupled, range(first, last + 1)) for t in part]

        fit = drawn(_seeds(*range(21, 33))) + drawn(_seeds(51, 52), LONG)
        fit += drawn(_seeds(41)[:120], worn=True) + plants(500, 513)
        for folder in options.folders:
            names = sorted(json.loads((folder / "truth.json").read_text()))
            fit += [t for part in pool.imap(kept, [(folder, n) for n in names]) for t in part]
        apart = {
            "untidy, seeds 5, 6, 7": drawn([100_000 * s + k for s in (5, 6, 7) for k in range(200)]),
            "loads on worn valves, seed 42": drawn(_seeds(42)[:120], worn=True),
            "coupled plants 520 to 533": plants(520, 533),
        }
    written(fit)
    from analyzer.loop.cause_weights import chances

    heads = (
        "loops kept apart | clear | likeliest is right | right below .6 | .6 to .8 | above .8 "
        "| valve likeliest of other causes"
    )
    text = table(heads, (line(name, loops, chances) for name, loops in apart.items()))
    shown = command(__file__, *(f"../shared/wild/{f.name}" for f in options.folders))
    publish(__file__, "What the signs of a cause weigh", shown, f"Fitted on {len(fit)} loops.", text)


if __name__ == "__main__":
    main()
