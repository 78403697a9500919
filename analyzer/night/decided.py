"""The decision of a night on one loop: its row of `triage rank`, from a store or computed exactly as in a run.

`tune` and `explain` begin with it, so that all commands give the same answer.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from analyzer.columns import BELIEVED, LISTED, RANKING, Row, names
from analyzer.loop.assess import Assessment
from analyzer.loop.oscillation.detection import detect
from analyzer.loop.record.quality import prepare
from analyzer.loops.spec import LoopSpec
from analyzer.night.chunk import Task, assessed
from analyzer.night.finish import finish_night
from analyzer.night.nights import Night, Plant
from analyzer.plantwide.groups import groups_of
from analyzer.plantwide.oscillation_lines import OscillationLines, error_lines_of
from analyzer.plantwide.structure import Moves, links_of, moves_of
from analyzer.store.store import Store
from identification.errors import InputError, NotAssessedError

OF_ORDER = (
    *("lack", "night", "lanes", "expected_period_s", "expected_pv_amplitude_pct"),
    *("field_indices", "harris_index"),
)
"""Columns for an order and for the published indices, besides those of a list."""
COLUMNS = tuple(dict.fromkeys((*names((*RANKING, *LISTED, *BELIEVED)), *OF_ORDER)))
TIES = ("master", "ratio_of", "split_of", "override_with")
"""Columns of loops.csv that link a loop to another one."""
MOST_NEIGHBOURS = 60
"""Largest number of loops of a plant for which common oscillations are searched: takes some seconds."""


@dataclass(frozen=True, slots=True)
class Decided:
    """The row of a loop in a night, and its assessment if the row was recomputed and the loop could be assessed."""

    row: Row
    found: Assessment | None = None


def decided(plant: Plant, night: Night, loop: str, store: Store | None = None) -> Decided:
    """The decision of a night on a loop.

    store, one with the night: its row, which includes all nights there; None: the row of a store with this night
    only. Raises InputError where the store has no such night, or the night no such loop.
    """
    if store is not None:
        return Decided(_stored(store, night.name, loop))
    specs = _related(plant, night, loop)
    with TemporaryDirectory() as folder:
        made = Store(Path(folder) / "store")
        task = Task(replace(plant, specs=specs, notes=()), (night,), made, "alone")
        rows = assessed(task)[night.name]
        finish_night(made, night.name, [spec.loop for spec in specs], plant.config, [task.key])
        found = next((a for a in rows.found if a.loop == loop), None)
        return Decided(_stored(made, night.name, loop), found)


def _stored(store: Store, night: str, loop: str) -> Row:
    known = store.nights()
    if night not in known:
        expected = f"one of {', '.join(known[-3:]) or 'no nights'}"
        raise InputError(
            f"{store.path}: holds no night {night}", expected, "run that night, or leave out --store"
        )
    rows = store.rows("nights", night, COLUMNS, [loop])
    if not rows:
        seen = f"{store.path}, night {night}: no loop {loop}"
        raise InputError(seen, "a loop of that night", "run it with this loop")
    return rows[0]


def _related(plant: Plant, night: Night, loop: str) -> tuple[LoopSpec, ...]:
    """The loop and all loops whose night may change its row: those with a common oscillation or a link, by loops.csv
    or by the trends; in a large plant by loops.csv alone."""
    ties = [(spec.loop, other) for spec in plant.specs for other in _stated(spec)]
    if len(plant.specs) <= MOST_NEIGHBOURS:
        ties += _seen(plant, night)
    found, before = {loop}, 0
    while len(found) > before:
        before = len(found)
        found |= {x for pair in ties if found & set(pair) for x in pair}
    return tuple(spec for spec in plant.specs if spec.loop in found)


def _stated(spec: LoopSpec) -> Iterable[str]:
    return filter(None, (getattr(spec, column) for column in TIES))


def _seen(plant: Plant, night: Night) -> Sequence[tuple[str, str]]:
    """Pairs of loops with a common oscillation, or in which one's output moves the other's set point."""
    series = plant.trends(list(dict.fromkeys(tag for spec in plant.specs for tag in spec.tags)), night)
    lines: list[OscillationLines] = []
    moves: list[Moves] = []
    config = plant.config
    for spec in plant.specs:
        with suppress(NotAssessedError):
            record = prepare(spec, {t: series[t] for t in spec.tags}, config.quality).record
            end_s = record.start_s + record.duration_s
            lines += error_lines_of(spec.loop, detect(record, config.oscillation), end_s, config.plant)
            moves += filter(None, [moves_of(record)])
    shared = [
        (group.loops[0], other) for group in groups_of(lines, config.plant) for other in group.loops[1:]
    ]
    return [*shared, *((loop, link.loop) for loop, link in links_of(moves, config.plant).items())]
