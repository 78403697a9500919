"""Cycles that may be aliased by the sampling, and their figures and pictures."""

from __future__ import annotations

import numpy as np
import pytest

from analyzer.loop.decisions import MissingData
from analyzer.night import chunk
from analyzer.night.nights import Night
from analyzer.store import rows
from proofs.plant import CONFIG, START_S, series, spec


def night_row(ti_s: float) -> dict[str, object]:
    """A loop with a sine of 100 s, logged every 10 s, whose controller has this integral time."""
    stamp = START_S + 10.0 * np.arange(2160)
    swing = np.sin(2 * np.pi * stamp / 100.0) + 0.05 * np.random.default_rng(1).normal(size=stamp.size)
    trend = {"L.SP": np.full(stamp.size, 50.0), "L.PV": 50.0 + swing, "L.OP": 50.0 - swing}
    trends = {tag: series(stamp, x) for tag, x in trend.items()}
    night = Night("2026-03-02", START_S, START_S + 86400.0)
    kept = chunk.Rows()
    chunk._loop_row(spec(kp=1.0, ti=ti_s), trends, night, CONFIG, True, kept)
    (found,) = kept.nights
    return rows.night_row(found)


@pytest.mark.parametrize(("ti_s", "has_figures"), [(1.0, True), (60.0, True)])
def test_a_stated_integral_time_alone_removes_no_figures(ti_s: float, has_figures: bool) -> None:
    """A stated Ti alone decides nothing: with 1 s, which OP does not follow, a cycle keeps its figures and its
    picture.
    """
    row = night_row(ti_s)
    figures = ("period_s", "oscillating_pct", "close_first_s", "close_last_s", "turns")
    assert [row[name] is not None for name in figures] == [has_figures] * len(figures)
    assert (row["lack"] == MissingData.FASTER) is not has_figures
