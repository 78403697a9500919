"""How small and how short an oscillation can be to be found and explained: python -m proofs.sensitivity [--records
24]

Two loops are simulated: a level loop with backlash in its valve, and a pressure loop with an external periodic load.
The noise is from an eighth of the amplitude to three times it, and the record has few to many periods. Writes
sensitivity.md here and docs/figures/sensitivity.png.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from analyzer.loop.assess import assess
from analyzer.loop.decisions import counts
from analyzer.loop.oscillation.detection import detect
from identification.errors import NotAssessedError
from proofs.common import command, command_line, publish, table
from proofs.plant import CONFIG, Sketch, Trends, prepared, simulate

FIGURE = Path(__file__).resolve().parents[1] / "docs" / "figures" / "sensitivity.png"
TANK = Sketch("valve", (60.0, 1800.0, 9.0), 0.9, 40.0, backlash=2.5)
PASSED_ON = "play, noise passed on to OP"
SKETCHES = {
    PASSED_ON: TANK,
    "play, noise on PV alone": TANK,
    "sinusoidal load": Sketch("load", (1.4, 90.0, 10.0), 0.8, 120.0, load_std=0.3, sine=3.0, sine_s=300.0),
}
RATIOS = (0.3, 0.5, 0.6, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 8.0)
"""Amplitude of the cycle over the standard deviation of the noise on PV, white at 1 s.

The amplitude is that without noise. Noise that the controller passes on at every scan moves the stem through the
backlash (dither). Noise on the recorded PV alone, as with a filtering controller, does not change the cycle.
"""
PERIODS = (2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 12.0, 20.0, 40.0, 80.0)
"""Periods in the record."""
AT_PERIODS, AT_RATIO = 30.0, 3.0
"""Periods of the records with varying noise; amplitude over noise of the records with varying length."""
COLOURS = dict(zip(SKETCHES, ("#b3342d", "#d98a2b", "#1f6f9f"), strict=True))


@dataclass(frozen=True)
class Cell:
    """One kind of loop at one noise and one length."""

    name: str
    ratio: float
    periods: float


@dataclass(frozen=True)
class Share:
    """Shares of the records of one cell [%]: oscillation found, right cause named, a wrong one named."""

    cell: Cell
    found: float
    right: float
    wrong: float


@cache
def clean(name: str) -> tuple[float, float]:
    """Period [s] and amplitude [%] of a loop's cycle without noise."""
    first = detect(
        prepared(simulate(replace(SKETCHES[name], noise=0.0), 6.0)).record, CONFIG.oscillation
    ).first
    if first is None:
        raise ValueError(f"{name} does not cycle")
    return first.period_s, first.amplitude_pct


def made(cell: Cell, seed: int) -> Trends:
    """The end of a longer record, so that the cycle is developed and has a random phase."""
    period, amplitude = clean(cell.name)
    n = int(cell.periods * period)
    rng = np.random.default_rng([seed, 1])
    noise, passed_on = amplitude / cell.ratio, cell.name == PASSED_ON
    sketch = replace(SKETCHES[cell.name], noise=noise if passed_on else 0.0)
    whole = simulate(sketch, (n + rng.uniform(6, 7) * period) / 3600, seed)
    sp, pv, op, stem = (getattr(whole, x)[-n:] for x in ("sp", "pv", "op", "stem"))
    return Trends(sp, pv if passed_on else pv + noise * rng.standard_normal(n), op, stem)


def judged(case: tuple[Cell, int]) -> tuple[bool, str]:
    """Whether the loop counts as oscillating, and the cause named."""
    cell, seed = case
    try:
        found = assess(prepared(made(cell, seed)), SKETCHES[cell.name].controller, CONFIG)
    except NotAssessedError:
        return False, "undecided"
    first = found.oscillations.first
    return first is not None and counts(first.oscillating_pct), found.verdict.cause


def cells() -> list[Cell]:
    """All cells, each once."""
    by_noise = [Cell(name, ratio, AT_PERIODS) for name in SKETCHES for ratio in RATIOS]
    return by_noise + [Cell(name, AT_RATIO, periods) for name in SKETCHES for periods in PERIODS]


def shares(records: int, jobs: int) -> list[Share]:
    """Shares of every cell over `records` records."""
    cases = [(cell, seed) for cell in cells() for seed in range(records)]
    with get_context("spawn").Pool(jobs) as pool:
        results = pool.map(judged, cases, chunksize=8)
    out = []
    for k, cell in enumerate(cells()):
        mine = results[k * records : (k + 1) * records]
        truth = SKETCHES[cell.name].cause
        right = sum(cause == truth for _, cause in mine)
        wrong = sum(cause not in (truth, "none", "undecided") for _, cause in mine)
        out.append(Share(cell, *(100 * count / records for count in (sum(o for o, _ in mine), right, wrong))))
    return out


def table_of(found: Sequence[Share]) -> str:
    """A Markdown table of all cells."""
    heads = "loop | amplitude over noise | periods | oscillation found % | right cause % | wrong cause %"
    rows = (
        [s.cell.name, *(f"{x:g}" for x in (s.cell.ratio, s.cell.periods))]
        + [f"{share:.0f}" for share in (s.found, s.right, s.wrong)]
        for s in found
    )
    return table(heads, rows)


def draw(found: Sequence[Share], path: Path) -> None:
    """Two panels: against amplitude over noise, and against the number of periods."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

    half = len(SKETCHES) * len(RATIOS)
    panels = (
        (
            found[:half],
            "ratio",
            "amplitude of the cycle over standard deviation of the noise",
            RATIOS,
            AT_PERIODS,
        ),
        (found[half:], "periods", "periods in the record", PERIODS, AT_RATIO),
    )
    figure, axes = plt.subplots(1, 2, figsize=(10.5, 4.6), sharey=True, layout="constrained")
    titles = (f"{AT_PERIODS:g} periods", f"amplitude {AT_RATIO:g} times the noise")
    for ax, (rows, by, label, ticks, _), title in zip(axes, panels, titles, strict=True):
        for name, colour in COLOURS.items():
            mine = [s for s in rows if s.cell.name == name]
            x = [getattr(s.cell, by) for s in mine]
            ax.plot(x, [s.found for s in mine], "-o", color=colour, ms=4, label=f"{name}: found")
            ax.plot(
                x,
                [s.right for s in mine],
                "--s",
                color=colour,
                ms=4,
                mfc="white",
                label=f"{name}: right cause",
            )
            ax.plot(x, [s.wrong for s in mine], ":", color=colour, lw=1.2, label=f"{name}: wrong cause")
        ax.set(xscale="log", xlabel=label, ylim=(-3, 103), title=title)
        ax.xaxis.set_major_locator(FixedLocator(ticks))
        ax.xaxis.set_minor_locator(NullLocator())
        ax.xaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
        ax.tick_params(axis="x", labelsize=8)
        ax.grid(color="0.9")
        ax.spines[["top", "right"]].set_visible(False)
    axes[0].set_ylabel("records [%]")
    figure.legend(
        *axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False, fontsize=9
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=130)
    plt.close(figure)


def main() -> None:
    """Run all records, write the table and the picture."""
    options = command_line(__doc__, records=12, jobs=2)
    found = shares(options.records, options.jobs)
    shown = f"{command(__file__, records=options.records)}, drawn in docs/figures"
    about = (
        "Amplitude is that of the cycle without noise; noise is white at 1 s. Where the controller passes it on to\n"
        "OP at every scan, it moves the stem through the backlash (dither). Below an amplitude of about twice the\n"
        "noise there is then no cycle. "
        f"Records of varying noise have {AT_PERIODS:g} periods; those of varying length\n"
        f"have an amplitude {AT_RATIO:g} times the noise."
    )
    draw(found, FIGURE)
    publish(__file__, "What is found, and what is explained", shown, about, table_of(found))


if __name__ == "__main__":
    main()
