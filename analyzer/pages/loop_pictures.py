"""Pictures of a loop: trends, PV over OP, autocorrelation of the error, and half-cycles of a faulty valve."""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np

from analyzer.pages.reading import Thinned
from analyzer.pages.words import PLAIN, PvScale, Row, duration, pv_scale_of, texts
from identification.signals.correlation import lag_sums
from reports.pages import Band, Floats, Line, Mark, Panels, Plot, Sparkline, Text, Trend

SPARK_BUCKETS = 100
"""Buckets of a sparkline: a pixel and a fifth each."""
CAPTION = (
    "Minimum and maximum of each interval of {step}. Zoom: drag, or the mouse wheel with Ctrl. "
    "Move: drag with Shift, or the arrow keys. Two fingers zoom and move. All: double click."
)
LEAST_PCT = 2.0
"""Minimum height of an axis [% of span]; ours: a smaller one would show noise like an oscillation."""
SEGMENTS = 4
"""Parts over which the spectrum is averaged."""
LEAST_SAMPLES = 64
"""Minimum buckets for autocorrelation and spectrum."""
LEAST_BUCKETS = 2.5
"""Minimum buckets per period in a decimated trend [-]; below 2 it is aliased (Nyquist)."""
SHOWN_PERIODS = 8.0
"""Length of the autocorrelation shown [periods]."""
STEM_AT_REST = "OP moves, the stem does not"
Course = tuple[Floats, Floats, slice]
"""A line's horizontal and vertical values, shape (n,) each, and the part of it in which the stem is at rest."""


def close_span(row: Row, thin: Thinned) -> tuple[float, float] | None:
    """First and last time [s] of the ten periods shown initially; None if the night has none."""
    first, last = row.get("close_first_s"), row.get("close_last_s")
    if first is None or last is None or thin.between(first, last).time_s.size < 3:
        return None
    return first, last


def trend_block(
    name: str,
    title: str,
    thin: Thinned,
    marks: Sequence[Mark] = (),
    scale: PvScale = PLAIN,
    opening: tuple[float, float] | None = None,
) -> Trend:
    """SP, PV over OP on linked axes, in the loop's own unit, initially on a span of time if given."""
    bands = []
    for s in ("pv", "sp", "op"):
        low, high = (thin.extremes[f"{s}_{end}"] for end in ("min", "max"))
        own = (low, high) if s == "op" else (scale.of(low), scale.of(high))
        bands.append(Band(s.upper(), s, int(s == "op"), *own))
    step = (thin.time_s[-1] - thin.time_s[0]) / max(thin.time_s.size - 1, 1)
    panels = (f"SP, PV [{scale.label}]", "OP [%]")
    caption, least = CAPTION.format(step=f"{step:.3g} s"), (LEAST_PCT * scale.span / 100.0, LEAST_PCT)
    shaded = thin.spans(thin.manual | thin.frozen)
    if shaded:
        causes = [
            text for text, mask in (("in manual", thin.manual), ("PV constant", thin.frozen)) if mask.any()
        ]
        caption = f"Shaded: {' or '.join(causes)}. {caption}"
    signals, seen = tuple(bands), tuple(marks)
    return Trend(name, title, thin.time_s, thin.gap, signals, panels, seen, caption, shaded, opening, least)


def sparkline(thin: Thinned, span: tuple[float, float] | None = None) -> Sparkline:
    """The PV as a cell's picture, over a span of time if given; gaps are closed."""
    first, last = span or (float("-inf"), float("inf"))
    known = thin.between(first, last).coarser(SPARK_BUCKETS)
    shown = ~known.gap
    return Sparkline(known.extremes["pv_min"][shown], known.extremes["pv_max"][shown])


def _least_ends(middle: float, scale: PvScale) -> tuple[float, float]:
    """Ends that an axis of PV around a value includes."""
    half = 0.5 * LEAST_PCT * scale.span / 100.0
    return middle - half, middle + half


def pv_over_op(thin: Thinned, row: Row) -> Plot:
    """PV over OP, for the ten periods if the night has them."""
    scale, close = pv_scale_of(row), close_span(row, thin)
    part = thin.between(*close) if close else thin
    usable = ~(part.gap | part.frozen)
    pv, op = scale.of(part.middle("pv")[usable]), part.middle("op")[usable]
    line = Line("PV over OP", op, pv, joined=close is not None)
    caption = (
        "A cloud along a line: an ideal valve. An ellipse or a parallelogram: lag, backlash or stick-slip."
    )
    title = "PV over OP, " + ("the last ten periods" if close else "the last night")
    reach = _least_ends(float(np.median(pv)) if pv.size else 0.0, scale)
    return Plot("pv-op", title, "OP [%]", f"PV [{scale.label}]", (line,), (), caption, reach=reach)


def rhythm_plots(thin: Thinned, period_s: float | None) -> tuple[Plot | Text, ...]:
    """Autocorrelation and spectrum of the error, or a sentence on why the trend cannot show them."""
    usable = ~(thin.gap | thin.frozen)
    if thin.time_s.size < LEAST_SAMPLES or int(usable.sum()) < LEAST_SAMPLES:
        return (Text(("Too few samples for autocorrelation and spectrum.",), "note"),)
    step = float(np.median(np.diff(thin.time_s)))
    if period_s is not None and period_s < LEAST_BUCKETS * step:
        text = f"The stored trend, a bucket each {step:.0f} s, cannot show a period of {duration(period_s)}."
        return (Text((text,), "note"),)
    # linear where nothing is known
    grid = np.arange(thin.time_s[0], thin.time_s[-1] + 0.5 * step, step)
    error = np.interp(grid, thin.time_s[usable], (thin.middle("sp") - thin.middle("pv"))[usable])
    error -= error.mean()
    return _correlation(error, step, period_s), _spectrum_plot(error, step, period_s)


def autocorrelation(x: Floats) -> Floats:
    """Autocorrelation of a signal without mean at lags 0 to n/2, shape (n // 2,); 1 at lag 0."""
    n = x.size
    found = lag_sums(x, n // 2)[: n // 2]
    return found / found[0] if found[0] > 0 else np.zeros(n // 2)


def _correlation(error: Floats, step: float, period_s: float | None) -> Plot:
    found = autocorrelation(error)
    most = int(SHOWN_PERIODS * period_s / step) + 1 if period_s else min(240, found.size)
    lag = np.arange(found.size, dtype=float)[:most] * (step / 60.0)
    marks = (Mark(period_s / 60.0, duration(period_s)),) if period_s else ()
    line = Line("autocorrelation", lag, found[:most])
    caption = "A sustained oscillation keeps its height from period to period; noise decays."
    return Plot("autocorrelation", "Autocorrelation of the error", "lag [min]", "–", (line,), marks, caption)


def _spectrum_plot(error: Floats, step: float, period_s: float | None) -> Plot:
    """The share of the error's power at each frequency, by Welch's periodogram (1967)."""
    from scipy.signal import welch  # its import takes longer than a page

    n = max(error.size // SEGMENTS, LEAST_SAMPLES // 2)
    frequency, power = welch(error, 1.0 / step, nperseg=min(n, error.size))
    per_hour, share = 3600.0 * frequency, 100.0 * power / max(float(power.sum()), 1e-12)
    shown = per_hour <= (6.0 * 3600.0 / period_s if period_s else per_hour[-1])
    marks = (Mark(3600.0 / period_s, duration(period_s)),) if period_s else ()
    line = Line("power", per_hour[shown], share[shown])
    caption = "Share of the error's power; a valve's cycle shows lines at odd multiples as well."
    return Plot("spectrum", "Spectrum of the error", "cycles per hour", "% of power", (line,), marks, caption)


def turn_panels(row: Row, scale: PvScale) -> Panels | None:
    """A night's half-cycles superimposed from each OP reversal, and PV over OP; None if the night has none."""
    half_cycles = json.loads(row.get("turns") or "null")
    if not half_cycles:
        return None
    delay = f", PV {half_cycles['dead_s']:.3g} s later" if half_cycles["dead_s"] > 0 else ""
    pv, minutes = f"PV [{scale.label}]", "min since OP's reversal"
    halves = [_half_cycle(h, scale, half_cycles["step_s"]) for h in half_cycles["halves"]]
    op_lines, pv_lines, plane = map(_laid_over, zip(*halves, strict=True))
    reach = _least_ends(float(np.median(plane[0].y)), scale)
    plots = (
        Plot("turns-op", "OP since its reversal", minutes, "OP [%]", op_lines, reach=(0.0, 0.0)),
        Plot("turns-pv", "PV since OP's reversal", minutes, pv, pv_lines, reach=(0.0, 0.0)),
        Plot("turns-plane", f"PV over OP{delay}", "OP [%]", pv, plane, reach=reach),
    )
    caption = texts("half_cycles").get(row["cause"], "Half-cycles, superimposed.")
    title = (
        f"The last {len(half_cycles['halves'])} half-cycles, from each OP reversal (falling ones inverted)"
    )
    return Panels("turns", title, plots, caption)


def _half_cycle(kept: Row, scale: PvScale, step_s: float) -> tuple[Course, Course, Course]:
    """OP and PV since the OP reversal, with falling halves inverted so that all coincide, and over OP the PV delayed
    by the dead time, so that a delay does not look like backlash."""
    op, pv, late = (np.array(kept[name], dtype=np.float64) for name in ("op", "pv", "late"))
    pv, late = scale.of(pv), scale.of(late)
    first, last = kept["stuck"]
    at_rest = slice(first, last + 1 if last > first else last)
    minutes = np.arange(op.size, dtype=np.float64) * (step_s / 60.0)
    sign = 1.0 if op[-1] >= op[0] else -1.0
    return (
        (minutes, sign * (op - op[0]), at_rest),
        (minutes, sign * (pv - pv[0]), at_rest),
        (op, late, at_rest),
    )


def _laid_over(paths: Sequence[Course]) -> tuple[Line, ...]:
    """Superimposed paths, with the part in which the stem is at rest drawn last."""
    stuck = [Line(STEM_AT_REST, x[part], y[part], kind="stuck") for x, y, part in paths if x[part].size > 1]
    return (*(Line("since the reversal", x, y) for x, y, _ in paths), *stuck)


def answered_moves(row: Row) -> Plot | None:
    """Superimposed responses of PV to set point moves, each from 0 to 1; None if there were none."""
    every = json.loads(row["moves"] or "[]")
    steps = [m for m in every if not m.get("ramp_s")]  # ramps are long and determine the course
    lines = [
        Line("PV", np.linspace(0.0, m["lasts_s"], len(m["course"])), np.array(m["course"]))
        for m in steps or every
    ]
    title = "PV after moves of the set point, which go from 0 to 1"
    return Plot("moves", title, "s", "share of the move", tuple(lines), reach=(0.0, 1.0)) if lines else None
