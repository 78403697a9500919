"""Which causes remain identifiable after sampling, quantisation and compression: python -m proofs.recorded [--records
8]

Four loops with known causes are simulated at 1 s by the sample mill's physics and then recorded. They are thinned to
fewer samples per cycle, rounded to a grid, or archived by a swinging door and read by linear interpolation. Grid and
deviation are relative to the amplitude of the cycle. Writes recorded.md here and docs/figures/recorded.png.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from analyzer.loop.assess import assess
from analyzer.loop.decisions import Cause, counts
from analyzer.loop.oscillation.detection import detect
from analyzer.loop.record.quality import prepare
from identification.errors import NotAssessedError
from proofs.common import command, command_line, publish, table
from proofs.plant import CONFIG, START_S, Sketch, Trends, prepared, series, simulate, spec
from proofs.untidy.recorder import swinging_door

FIGURE = Path(__file__).resolve().parents[1] / "docs" / "figures" / "recorded.png"
HOURS = 6.0
SKETCHES = {
    "play": Sketch("valve", (60.0, 1800.0, 9.0), 0.9, 40.0, backlash=2.5),
    "stick-slip": Sketch("valve", (1.5, 40.0, 8.0), 0.8, 40.0, stickband=3.0, slip_jump=1.5),
    "tuning": Sketch("tuning", (1.5, 120.0, 20.0), 4.6, 60.0, noise=0.03, load_std=0.6, load_s=300.0),
    "load": Sketch("load", (1.4, 90.0, 10.0), 0.8, 120.0, load_std=0.3, sine=3.0, sine_s=300.0),
}
SAMPLES = (60.0, 30.0, 20.0, 15.0, 10.0, 8.0, 6.0, 5.0, 4.0, 3.0)
"""Samples per cycle."""
GRIDS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.4, 0.8)
"""Step of the grid of PV and OP, relative to their amplitudes."""
DOORS = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4)
"""Deviation of the swinging door, relative to the amplitudes."""
LONGEST_S = 600
"""Longest straight line that the historian draws [s]."""
NAMES = ("valve", "tuning", "load")
COLOURS = dict(zip(SKETCHES, ("#b3342d", "#d98a2b", "#6a9a3b", "#1f6f9f"), strict=True))
WAYS = {"samples per cycle": SAMPLES, "grid over amplitude": GRIDS, "deviation over amplitude": DOORS}


@dataclass(frozen=True)
class Cell:
    """One loop, recorded in one way."""

    name: str
    way: str
    much: float


@dataclass(frozen=True)
class Answer:
    """Of one record: whether it was assessed, whether an oscillation was found, the cause, the estimated width over
    the true one."""

    assessed: bool
    found: bool
    cause: str
    width: float | None


@cache
def drawn(name: str, seed: int) -> tuple[Trends, float]:
    """Trends at 1 s and the measured period of their cycle [s]."""
    trends = simulate(SKETCHES[name], HOURS, seed)
    found = detect(prepared(trends).record, CONFIG.oscillation).first
    return trends, found.period_s if found is not None else 300.0


def recorded(cell: Cell, seed: int) -> tuple[np.ndarray, list[np.ndarray]]:
    """Stamps [s] and SP, PV, OP as a historian keeps them."""
    trends, period = drawn(cell.name, seed)
    step = max(round(period / cell.much), 1) if cell.way == "samples per cycle" else 1
    samples = [x[::step] for x in (trends.sp, trends.pv, trends.op)]
    sizes = [0.0, *(float(np.std(x)) * np.sqrt(2) for x in samples[1:])]
    if cell.way == "grid over amplitude":
        steps = [cell.much * s for s in sizes]
        samples = [x if q == 0 else np.round(x / q) * q for x, q in zip(samples, steps, strict=True)]
    if cell.way == "deviation over amplitude":
        doors = [cell.much * s for s in sizes]
        samples = [
            x if d == 0 else swinging_door(x, d, LONGEST_S) for x, d in zip(samples, doors, strict=True)
        ]
    return START_S + step * np.arange(samples[0].size, dtype=float), samples


def answered(job: tuple[Cell, int]) -> Answer:
    """The answer of the night for one record."""
    cell, seed = job
    stamp, samples = recorded(cell, seed)
    found = {f"L.{role}": series(stamp, x) for role, x in zip(("SP", "PV", "OP"), samples, strict=True)}
    sketch = SKETCHES[cell.name]
    try:
        a = assess(prepare(spec("L"), found, CONFIG.quality), sketch.controller, CONFIG)
    except NotAssessedError:
        return Answer(False, False, "", None)
    first = a.oscillations.first
    if a.needs is not None:
        return Answer(False, False, "", None)
    oscillates = first is not None and counts(first.oscillating_pct)
    width = None
    if a.verdict.cause is Cause.VALVE and a.verdict.measured is not None:
        m = a.verdict.measured
        best = m.stick_slip if m.stick_slip is not None and a.verdict.fault == "stiction" else m.backlash
        width = float(best.valve.stickband) / (sketch.backlash or sketch.stickband)
    return Answer(True, oscillates, str(a.verdict.cause), width)


def line(cell: Cell, answers: Sequence[Answer]) -> list[str]:
    """A row of the table."""
    n = len(answers)
    right = sum(a.cause == SKETCHES[cell.name].cause for a in answers)
    named = sum(a.cause in NAMES for a in answers)
    widths = [a.width for a in answers if a.width is not None]
    shares = (sum(a.found for a in answers), right, named - right, n - sum(a.assessed for a in answers))
    width = f"{float(np.median(widths)):.2f}" if widths and SKETCHES[cell.name].cause == "valve" else ""
    return [cell.name, f"{cell.much:g}", *(f"{100 * s / n:.0f}" for s in shares), width]


def draw(results: dict[Cell, list[Answer]]) -> None:
    """Right and wrong causes against the way of recording."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 3.6), layout="constrained")
    FigureCanvasAgg(figure)
    for ax, (way, levels) in zip(figure.subplots(1, 3, sharey=True), WAYS.items(), strict=True):
        for name, sketch in SKETCHES.items():
            mine = [results[Cell(name, way, much)] for much in levels]
            right = [100 * np.mean([a.cause == sketch.cause for a in found]) for found in mine]
            wrong = [
                100 * np.mean([a.cause in NAMES and a.cause != sketch.cause for a in found]) for found in mine
            ]
            ax.plot(levels, right, "o-", color=COLOURS[name], label=name, markersize=3)
            ax.plot(levels, wrong, "x:", color=COLOURS[name], markersize=4)
        ax.set(xscale="log", xlabel=way, ylim=(-4, 104))
        ax.set_xticks(levels[::2], [f"{x:g}" for x in levels[::2]])
        ax.minorticks_off()
        ax.grid(color="#dddddd", linewidth=0.6)
    figure.axes[0].set_ylabel("right cause % (dots), wrong cause % (crosses)")
    figure.axes[0].legend(fontsize=8, frameon=False)
    figure.savefig(FIGURE, dpi=110, metadata={"Software": None})


def main() -> None:
    """Assess all records, write table and picture."""
    options = command_line(__doc__, records=8, jobs=2)
    cells = [Cell(name, way, much) for way, levels in WAYS.items() for name in SKETCHES for much in levels]
    jobs = [(cell, seed) for cell in cells for seed in range(options.records)]
    with get_context("spawn").Pool(options.jobs) as pool:
        answers = pool.map(answered, jobs, chunksize=4)
    results: dict[Cell, list[Answer]] = {}
    for (cell, _), found in zip(jobs, answers, strict=True):
        results.setdefault(cell, []).append(found)
    parts = [
        f"{command(__file__, records=options.records)}, drawn in docs/figures/recorded.png",
        f"Records of {HOURS:g} h. Not assessed: the night only reports what the recording lacks. Width is the "
        "estimated width of the valve's fault over the true one; the median of the records in which the valve is "
        "named.",
    ]
    for way, levels in WAYS.items():
        heads = f"loop | {way} | oscillation found % | right cause % | wrong cause % | not assessed % | width"
        mine = (Cell(name, way, much) for name in SKETCHES for much in levels)
        parts += [f"## {way.capitalize()}", table(heads, (line(cell, results[cell]) for cell in mine))]
    draw(results)
    publish(__file__, "Which causes remain identifiable in recorded data", *parts)


if __name__ == "__main__":
    main()
