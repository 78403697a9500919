"""What a night decided of one loop: its row as `triage rank` has it, from a store, or made just as a run makes it.

`tune` and `explain` begin with it, so that every command has one answer.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from analyzer.columns import BELIEVED, LISTED, RANKING, Row, names
from analyzer.loop.assess import Assessment
from analyzer.loop.oscillation import detect
from analyzer.loop.quality import prepare
from analyzer.loops.spec import LoopSpec
from analyzer.night.chunk import Task, assessed
from analyzer.night.finish import finish_night
from analyzer.night.nights import Night, Plant
from analyzer.plantwide.groups import groups_of
from analyzer.plantwide.structure import Moves, links_of, moves_of
from analyzer.plantwide.wave import Wave, waves_of
from analyzer.store.store import Store
from identification.errors import InputError, NotAssessedError

OF_ORDER = (
    *("lack", "night", "lanes", "expected_period_s", "expected_pv_amplitude_pct"),
    *("field_indices", "harris_index"),
)
"""What an order, and the indices of the literature, rest on beside the columns of a list."""
COLUMNS = tuple(dict.fromkeys((*names((*RANKING, *LISTED, *BELIEVED)), *OF_ORDER)))
TIES = ("master", "ratio_of", "split_of", "override_with")
"""Columns of loops.csv that tie a loop to another one."""
MOST_BESIDE = 60
"""Loops of a plant up to which it is looked which of them move together: some seconds."""


@dataclass(frozen=True, slots=True)
class Decided:
    """The row of a loop in a night, and its assessment where the row was made anew and the loop could be assessed."""

    row: Row
    found: Assessment | None = None


def decided(plant: Plant, night: Night, loop: str, store: Store | None = None) -> Decided:
    """What a night decided of a loop.

    store, one that holds the night: its row, which rests on all nights there; None: the row of a store that holds
    this night alone. Raises InputError where the store has no such night, or the night no such loop.
    """
    if store is not None:
        return Decided(_stored(store, night.name, loop))
    specs = _related(plant, night, loop)
    with TemporaryDirectory() as folder:
        made = Store(Path(folder) / "store")
        task = Task(replace(plant, specs=specs, notes=()), (night,), made, "alone")
        kept = assessed(task)[night.name]
        finish_night(made, night.name, [spec.loop for spec in specs], plant.config, [task.key])
        found = next((a for a in kept.found if a.loop == loop), None)
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
    """The loop and all whose night may change its row: those that share an oscillation with it, or hang on it, by
    loops.csv or by the trends; by loops.csv alone in a plant of many loops."""
    ties = [(spec.loop, other) for spec in plant.specs for other in _stated(spec)]
    if len(plant.specs) <= MOST_BESIDE:
        ties += _seen(plant, night)
    found, before = {loop}, 0
    while len(found) > before:
        before = len(found)
        found |= {x for pair in ties if found & set(pair) for x in pair}
    return tuple(spec for spec in plant.specs if spec.loop in found)


def _stated(spec: LoopSpec) -> Iterable[str]:
    return filter(None, (getattr(spec, column) for column in TIES))


def _seen(plant: Plant, night: Night) -> Sequence[tuple[str, str]]:
    """Pairs of loops that share an oscillation, or of which one's output moves the other's set point."""
    series = plant.trends(list(dict.fromkeys(tag for spec in plant.specs for tag in spec.tags)), night)
    waves: list[Wave] = []
    moves: list[Moves] = []
    config = plant.config
    for spec in plant.specs:
        with suppress(NotAssessedError):
            record = prepare(spec, {t: series[t] for t in spec.tags}, config.quality).record
            end_s = record.start_s + record.duration_s
            waves += waves_of(spec.loop, detect(record, config.oscillation), end_s, config.plant)
            moves += filter(None, [moves_of(record)])
    shared = [
        (group.loops[0], other) for group in groups_of(waves, config.plant) for other in group.loops[1:]
    ]
    return [*shared, *((loop, link.loop) for loop, link in links_of(moves, config.plant).items())]
