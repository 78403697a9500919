"""Forecasts of new settings compared with their effect on the true plant, on the recorded day and on another one:
python -m benchmarks.world.promises --seed 1"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from analyzer.config import Config
from analyzer.history.export import open_export
from analyzer.loop.advice.advise import withheld
from analyzer.loop.advice.tune import tune
from analyzer.loop.assess import assess
from analyzer.loop.decisions import Action
from analyzer.loop.record.judged_stretch import controller_of
from analyzer.loop.record.quality import prepare
from benchmarks.world.__main__ import export, night_rows, spec_of
from benchmarks.world.draw import Drawn, drawn, run
from benchmarks.world.recorder import Recording, recorded
from benchmarks.world.settings import outcome
from benchmarks.world.simulate import Controller
from identification.models import Estimate
from proofs.common import command_line, table

FIGURES = ("average_absolute_error", "stem_travel")


@dataclass(frozen=True)
class Promise:
    """Forecast changes of error and stem travel, and the true ones, on the recorded day and on the next one [-]."""

    forecast: tuple[Estimate, Estimate]
    came: tuple[tuple[float, float], tuple[float, float]]

    def held(self, day: int, k: int) -> bool:
        """Whether the 90 % interval contains a figure's change on a day."""
        return self.forecast[k].low <= self.came[day][k] <= self.forecast[k].high


def forecast_of(d: Drawn, record: Recording, row: dict[str, Any]) -> tuple[Estimate, Estimate] | None:
    """Forecast of a night's new settings, as `triage tune` computes it; None without a forecast."""
    spec, config = spec_of(d), Config()
    with tempfile.TemporaryDirectory() as folder:
        one = prepare(
            spec, open_export(export(Path(folder), {d.name: record})).read(spec.tags), config.quality
        )
    present = controller_of(spec, one)
    assert present is not None
    found = assess(one, present, config)
    new = controller_of(replace(spec, kp=row["kp_new"], ti=row["ti_new"]), one)
    kept = withheld(found, spec, present, one.scale.span, config)
    forecast = tune(found, present, config, kept, one, spec.type, (Action.RETUNE, new)).forecast
    return None if forecast is None else (forecast.change[FIGURES[0]], forecast.change[FIGURES[1]])


def changes(d: Drawn, new: Controller, day: int) -> tuple[float, float]:
    """Changes of the average absolute error and the stem travel on a day of the true plant [-]."""
    error, travel, _, _ = outcome(d, new, day)
    return error - 1.0, travel - 1.0


def promises(kind: str, seeds: list[int], each: int, way: str, jobs: int) -> list[Promise]:
    """The forecasts for all loops of a kind that get new settings."""
    found = []
    for seed in seeds:
        loops = drawn(seed, each, (kind,))
        records = {d.name: recorded(run(d), way, d.seed) for d in loops}
        rows = night_rows(loops, records, jobs)
        for d in loops:
            row = rows[d.name]
            if row["kp_new"] is None:
                continue
            forecast = forecast_of(d, records[d.name], row)
            if forecast is None:
                print(f"{seed} {d.name}: no forecast", file=sys.stderr)
                continue
            new = replace(d.controller, kp=row["kp_new"], ti_s=row["ti_new"])
            one = Promise(forecast, (changes(d, new, 0), changes(d, new, 1)))
            found.append(one)
            e, t = forecast
            print(
                f"{seed} {d.name} error {e.low:+.2f} {e.value:+.2f} {e.high:+.2f} came {one.came[0][0]:+.2f} "
                f"{one.came[1][0]:+.2f} travel {t.low:+.2f} {t.value:+.2f} {t.high:+.2f} came "
                f"{one.came[0][1]:+.2f} {one.came[1][1]:+.2f}",
                file=sys.stderr,
            )
    return found


def line(kind: str, found: list[Promise]) -> tuple[object, ...]:
    """A row of the table."""
    n = len(found)
    cells: list[object] = [kind, n]
    for k in (0, 1):
        pairs = [(p.forecast[k].value, p.came[0][k]) for p in found]
        cells += [f"{100 * np.median([x[i] for x in pairs]):+.0f}" if n else "" for i in (0, 1)]
        cells += [sum(p.held(day, k) for p in found) for day in (0, 1)]
    cells.append(sum(p.forecast[0].high < 0.0 < max(p.came[0][0], p.came[1][0]) for p in found))
    return tuple(cells)


def main() -> None:
    """Draw, record, assess, forecast, set the new settings, compare."""
    kinds = ["backlash", "stiction", "tight", "sluggish"]
    options = command_line(__doc__, seed=[1], each=8, way="plain", jobs=2, kinds=kinds)
    rows = [
        line(k, promises(k, options.seed, options.each, options.way, options.jobs)) for k in options.kinds
    ]
    heads = (
        "kind|settings|error forecast, median %|came|within 90 %|next day|travel forecast, median %|came|within "
        "90 %|next day|fall forecast, rise came"
    )
    print(table(heads, rows, True))


if __name__ == "__main__":
    main()
