"""Task of a worker: a few loops over some nights, each assessed separately, with the results written as pieces.

An error of one loop is a result of that loop.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pyarrow as pa

from analyzer.belief.nights import Held
from analyzer.columns import HOURS, NIGHTS, SETTINGS
from analyzer.config import Config
from analyzer.history.plant_clock import stamp
from analyzer.history.series import Series
from analyzer.lanes.figures import standing
from analyzer.locations import each, enable_retries
from analyzer.loop.advice.advise import (
    Advice,
    advise,
    advise_beyond_faults,
    on_recorded,
    with_controller_note,
)
from analyzer.loop.assess import Assessment, assess
from analyzer.loop.conclusion import FailedLoop, concluded
from analyzer.loop.decisions import (
    Cell,
    Finding,
    LacksError,
    MissingData,
    Requirement,
    RequirementKind,
    Status,
)
from analyzer.loop.experiments.finding import by_experiment, with_experiment
from analyzer.loop.experiments.found import experiment_results
from analyzer.loop.oscillation.detection import counting
from analyzer.loop.oscillation.field_indices import field_indices
from analyzer.loop.page_trends import half_cycle_data, thinned
from analyzer.loop.record.judged_stretch import Earlier, controller_of, earlier_settings
from analyzer.loop.record.quality import Prepared, prepare
from analyzer.loop.record.sample_clock import interval
from analyzer.loop.witness import witness
from analyzer.loops.changes import TuningChange, in_force, settings_from
from analyzer.loops.spec import LoopSpec, controller_columns
from analyzer.night.nights import Night, Plant, cut
from analyzer.pages import compared as settings_pages
from analyzer.plantwide.oscillation_lines import oscillation_table
from analyzer.plantwide.structure import Moves, moves_of, moves_table
from analyzer.store.rows import hour_rows, piece_row
from analyzer.store.store import Store
from analyzer.store.table import naming, rows_table, write_table
from analyzer.words import units as words
from identification.errors import NotAssessedError, TriageError
from identification.models import Pid
from reports.page_file import dumps
from tuning.recommend import WITHOUT_SETTINGS


@dataclass(frozen=True, slots=True)
class Task:
    """A chunk of a plant's loops over some nights, small enough to send to a worker; `key` names its pieces, `alone`
    marks the second try of a single loop, and `held` are settings that earlier nights recommended for its loops."""

    plant: Plant
    nights: tuple[Night, ...]
    store: Store
    key: str
    alone: bool = False
    held: Mapping[str, Held] = field(default_factory=dict)

    @property
    def specs(self) -> tuple[LoopSpec, ...]:
        """Its loops."""
        return self.plant.specs

    def part(self, specs: tuple[LoopSpec, ...], name: object, alone: bool = False) -> Task:
        """A task of some of its loops, with its own name for the pieces."""
        return replace(self, plant=replace(self.plant, specs=specs), key=f"{self.key}-{name}", alone=alone)


@dataclass(frozen=True, slots=True)
class Done:
    """A worker's report on its chunk: the key of its pieces, their loops, and problems in their samples."""

    key: str
    loops: int
    met: Counter[str] = field(default_factory=Counter)


def assess_loop(
    spec: LoopSpec,
    prepared: Prepared,
    config: Config,
    advising: bool = True,
    earlier: Sequence[Earlier] = (),
    held: Held | None = None,
) -> tuple[Assessment, Advice]:
    """Assess one loop, and advise on it if wanted, with settings before its last change and earlier recommendations.

    The advice is for the controller completed by what the record shows, or for recorded settings if none are stated.
    """
    stated = controller_of(spec, prepared)
    found = with_controller_note(assess(prepared, stated, config, spec.type, earlier), spec, stated, prepared)
    if not advising:
        return found, Advice(WITHOUT_SETTINGS.get(found.verdict.cause))  # settings are only for the next day
    pair = None
    if held is not None and held[0] == (spec.kp, spec.ti):
        kp, ti = held[1]
        pair = controller_of(replace(spec, kp=kp, ti=ti), prepared)
    advice = advise(found, spec, found.shown or stated, prepared.scale.span, config, pair, prepared.record)
    if stated is None:
        advice = on_recorded(advice, found, spec, prepared.scale.span)
    return found, advice if stated is None else advise_beyond_faults(
        found, advice, prepared, spec, stated, config
    )


@dataclass(slots=True)
class Rows:
    """What is stored of the loops of one night: findings, compared settings, moves of the signals, assessments, and
    decimated trends, also of loops that could not be assessed."""

    nights: list[Finding] = field(default_factory=list)
    compared: list[dict[str, Any]] = field(default_factory=list)
    moves: list[Moves] = field(default_factory=list)
    found: list[Assessment] = field(default_factory=list)
    trends: list[tuple[str, Mapping[str, np.ndarray]]] = field(default_factory=list)


def _loop_row(
    stated: LoopSpec,
    series: dict[str, Series],
    night: Night,
    config: Config,
    advising: bool,
    rows: Rows,
    changes: Sequence[TuningChange] = (),
    held: Held | None = None,
) -> None:
    """Add the row of one loop and night, in any case, and its assessment if there is one."""
    spec = in_force(stated, changes, night.at_end_s)
    part = {tag: cut(s, night) for tag, s in series.items()}
    known: dict[str, Cell] = {
        "good_h": _good_h(part.get(spec.pv or "")),
        "timezone": night.zone,
        "settings_from": settings_from(stated, changes, night.at_end_s, night.zone),
    }
    prepared = None
    try:
        prepared = prepare(spec, part, config.quality)
        earlier, present = earlier_settings(stated, changes, prepared), controller_of(spec, prepared)
        known["controller"] = _controller_terms(spec, prepared)
        known |= _of_trends(prepared) | standing(prepared, present, spec.type, config)
        taught = experiment_results(spec, part, prepared, config, closed=False)
        try:
            found, advice = assess_loop(spec, prepared, config, advising, earlier, held)
        except LacksError as error:
            if taught is None or taught.model is None:
                raise
            rows.nights.append(by_experiment(taught, spec, night.name, error.needs, present, known))
            rows.trends.append((spec.loop, thinned(prepared.record)))
            return
        known |= _typed_in(earlier, spec, found, night.zone)
        known["turns"] = half_cycle_data(prepared, found) if advising else None
        known |= _signs_kept(prepared, found, found.settings or present, spec.type, config)
        finding = concluded(found, advice, spec, night.name, config.advice, **known)
        if taught is not None:
            finding = with_experiment(finding, taught, spec, present)
        drawn = _settings_row(spec, night.name, advice)
    except Exception as error:  # an error of one loop is that loop's result and never ends the night
        rows.nights.append(_lost(error, config).of(spec, night.name, **known))
        if prepared is not None:
            rows.trends.append((spec.loop, thinned(prepared.record)))
        return
    rows.nights.append(finding)
    rows.trends.append((spec.loop, found.trend))
    rows.compared += drawn
    rows.moves += filter(None, [moves_of(prepared.record)])
    rows.found.append(found)


def _controller_terms(spec: LoopSpec, prepared: Prepared) -> str | None:
    """Columns of loops.csv that state the law in addition to kp and ti, and the factor of a gain schedule that is in
    force in most of the record (JSON); None if there are none."""
    share = prepared.gain_share
    terms = controller_columns(spec) | ({} if share == 1.0 else {"gain_share": share})
    return json.dumps(terms, separators=(",", ":")) if terms else None


def _of_trends(prepared: Prepared) -> dict[str, Cell]:
    """Columns of a row about its trends in general."""
    low, span = prepared.scale.low, prepared.scale.span
    travel_of = "OP" if prepared.record.position is None else "stem"
    straight_pct = 100.0 * prepared.compressed_share
    return {"pv_lo": low, "pv_hi": low + span, "travel_of": travel_of, "straight_pct": straight_pct}


def _signs_kept(
    prepared: Prepared, found: Assessment, controller: Pid | None, kind: str, config: Config
) -> dict[str, Cell]:
    """Evidence of the night about the valve, and the published indices."""
    cycles = found.oscillations
    return {
        "witness": witness(found.verdict, counting(cycles) is not None, prepared, config),
        "field_indices": field_indices(prepared, cycles, controller, kind, config),
    }


def _typed_in(earlier: Sequence[Earlier], spec: LoopSpec, found: Assessment, zone: str) -> dict[str, Cell]:
    """Settings last entered within the night, in words, and the time from which the verdict applies to them; empty if
    there were none."""
    if not earlier:
        return {}
    last = earlier[-1]
    text = words.settings_changed(last.spec, spec, stamp(last.until_s, zone).split()[-1])
    since_s = None if found.outdated else last.until_s
    return {"settings_changed": text, "settings_changed_s": last.until_s, "judged_since_s": since_s}


def _settings_row(spec: LoopSpec, night: str, advice: Advice) -> list[dict[str, Any]]:
    """The page of compared settings, as a row; none if no settings were searched."""
    if advice.compared is None:
        return []
    page = settings_pages.settings_page(spec.loop, night, advice.compared, spec)
    return [{"loop": spec.loop, "night": night, "settings_page": dumps(page)}]


def _lost(error: Exception, config: Config) -> FailedLoop:
    """The result of a loop that ended with an error."""
    if isinstance(error, LacksError):
        return FailedLoop(Status.NOT_ASSESSED, error.needs)
    text = str(error) if isinstance(error, TriageError) else f"{type(error).__name__}: {error}"
    if isinstance(error, MemoryError):
        text = f"needs more memory than the {config.workers.memory_mb:.0f} MB that one loop may take"
    return FailedLoop(
        Status.NOT_ASSESSED if isinstance(error, NotAssessedError) else Status.FAILED,
        _error_requirement(text),
    )


def _error_requirement(text: str) -> Requirement:
    """The text of an error."""
    return Requirement(None, RequirementKind.AS_TOLD, (text,))


def _good_h(pv: Series | None) -> float:
    """Hours of good samples of a PV as logged [h]."""
    good = 0 if pv is None else int((~pv.bad).sum())
    return good * interval(pv.stamp_s) / 3600.0 if pv is not None and good > 1 else 0.0


def _samples_of(task: Task, spec: LoopSpec) -> dict[str, Series] | FailedLoop:
    """The loop's raw samples, or why there are none."""
    if spec.pv is None:
        wanted = spec.wanted_pv or f"{spec.loop}.PV"
        return FailedLoop(Status.NOT_ASSESSED, Requirement(MissingData.PV, RequirementKind.PV_TAG, (wanted,)))
    try:
        return task.plant.export.read(spec.tags)
    except Exception as error:  # a broken column is that loop's result
        return _lost(error, task.plant.config)


def work(task: Task, began: Callable[[int], None] = lambda at: None) -> Done:
    """Assess a chunk and write its pieces; `began` is called with the number of each started loop."""
    enable_retries(task.store.path)
    assessed(task, began)
    met = task.plant.export.met(tag for spec in task.specs for tag in spec.tags)
    return Done(task.key, len(task.specs), met)


def assessed(task: Task, began: Callable[[int], None] = lambda at: None) -> dict[str, Rows]:
    """The results of a chunk by night, with its pieces written."""
    rows, plant = {n.name: Rows() for n in task.nights}, task.plant
    for at, spec in enumerate(task.specs):
        began(at)
        series = _samples_of(task, spec)
        for night in task.nights:
            if isinstance(series, FailedLoop):
                rows[night.name].nights.append(series.of(spec, night.name, timezone=night.zone))
                continue
            advising = night is task.nights[-1]
            held = task.held.get(spec.loop)
            _loop_row(spec, series, night, plant.config, advising, rows[night.name], plant.changes, held)
    for night in task.nights:
        _write_pieces(task, night.name, rows[night.name])
    return rows


def lose(task: Task, reason: str) -> Done:
    """Write the rows of a chunk that no worker could finish."""
    lost = FailedLoop(Status.FAILED, _error_requirement(reason))
    for night in task.nights:
        loops = [lost.of(spec, night.name, timezone=night.zone) for spec in task.specs]
        _write_pieces(task, night.name, Rows(nights=loops))
    return Done(task.key, len(task.specs))


def _write_pieces(task: Task, night: str, rows: Rows) -> None:
    """Write the pieces, that of the table of nights last: it names the others, and makes the chunk complete."""
    trends = [
        pa.table({"loop": pa.array([loop] * len(trend["time_s"])).dictionary_encode(), **trend})
        for loop, trend in rows.trends
    ]
    tables = {
        "hours": rows_table([row for a in rows.found for row in hour_rows(a, night)], HOURS),
        "trends": pa.concat_tables(trends).unify_dictionaries() if trends else None,
        "waves": oscillation_table([oscillation for a in rows.found for oscillation in a.oscillation_lines]),
        "moves": moves_table(rows.moves),
        "compared": rows_table(rows.compared, SETTINGS),
        "nights": rows_table([piece_row(found) for found in rows.nights], NIGHTS),
    }
    filled = {name: table for name, table in tables.items() if table is not None and table.num_rows}
    last = naming(filled.pop("nights"), filled)
    paths = [task.store.part(night, name, task.key) for name in filled]
    each(lambda path, table: write_table(table, path), paths, filled.values())
    write_table(last, task.store.part(night, "nights", task.key))
