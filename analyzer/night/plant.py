"""An export with its loops, settings and nights as one object, for notebooks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from identification.models import Pid
from identification.record import LoopRecord

if TYPE_CHECKING:
    from analyzer.config import Config
    from analyzer.history.export import Export
    from analyzer.loop.judged_stretch import Earlier
    from analyzer.loop.quality import Prepared
    from analyzer.loops.changes import TuningChange
    from analyzer.loops.spec import LoopSpec
    from analyzer.night.nights import Night

Paths = str | Path | Sequence[str | Path]


@dataclass(frozen=True)
class PlantLoop:
    """One loop over one night, or over all of an export.

    spec : its row of loops.csv with the settings in force; prepared : its trends on one clock, with masks and notes;
    plant : the export that it is of; night : None where it is the whole export.
    """

    spec: LoopSpec
    prepared: Prepared
    plant: Plant
    night: Night | None = None

    @property
    def record(self) -> LoopRecord:
        """SP, PV and OP on one clock [% of span], shape (n,) each."""
        return self.prepared.record

    @property
    def controller(self) -> Pid | None:
        """The stated settings in percent and seconds; None where loops.csv does not state them."""
        from analyzer.loop.judged_stretch import controller_of

        return controller_of(self.spec, self.prepared)

    @property
    def earlier(self) -> tuple[Earlier, ...]:
        """Settings that were in force in the record before its last ones, oldest first."""
        from analyzer.loop.judged_stretch import earlier_settings
        from analyzer.loops.spec import spec_of

        stated = spec_of(self.plant.specs, self.spec.loop)
        return earlier_settings(stated, self.plant.changes, self.prepared)


@dataclass(frozen=True)
class Plant:
    """An export, its loops and the changes of their settings, as `read` returns it."""

    export: Export
    specs: tuple[LoopSpec, ...]
    changes: tuple[TuningChange, ...]
    notes: tuple[str, ...]
    config: Config

    @property
    def loops(self) -> tuple[str, ...]:
        """Names of the loops."""
        return tuple(spec.loop for spec in self.specs)

    @cached_property
    def spans(self) -> Mapping[str, Night]:
        """Nights by name, oldest first."""
        from analyzer.night import nights

        return {n.name: n for n in nights.nights_of(self.export, list(self.specs), self.config.nights)}

    @property
    def nights(self) -> tuple[str, ...]:
        """Names of the nights, oldest first."""
        return tuple(self.spans)

    def loop(self, name: str, night: str | None = None) -> PlantLoop:
        """One loop, over one night or over all that the export holds.

        Raises
        ------
        InputError
            There is no such loop or night, or the loop has no PV.
        NotAssessedError
            Its trends hold too little to be put on a clock.
        """
        from analyzer.loop.quality import prepare
        from analyzer.loops.changes import in_force
        from analyzer.loops.spec import spec_of
        from analyzer.night.nights import cut
        from identification.errors import InputError

        spec = spec_of(self.specs, name)
        if night is not None and night not in self.spans:
            raise InputError(f"night {night}", f"one of {', '.join(self.nights[-3:])}", "see Plant.nights")
        span = None if night is None else self.spans[night]
        spec = in_force(spec, self.changes, self.export.span()[1] if span is None else span.last_s)
        whole = self.export.read(spec.tags)
        series = whole if span is None else {tag: cut(x, span) for tag, x in whole.items()}
        return PlantLoop(spec, prepare(spec, series, self.config.quality), self, span)


def read(
    export: Paths,
    loops: str | Path | None = None,
    changes: str | Path | None = None,
    config: Config | None = None,
    **reading: Any,
) -> Plant:
    """Open an export.

    Parameters
    ----------
    export : path or sequence of paths
        CSV or Parquet, wide or long, or folders of them.
    loops, changes : path or None
        loops.csv and changes.csv; without loops.csv loops are found by their tags' endings.
    config : Config or None
        Thresholds; the defaults where None.
    **reading
        How to read text: timezone, delimiter, decimal, encoding, day_first, date_format, time_column,
        quality_column, good_quality.

    Raises
    ------
    InputError
        The export or a table cannot be used; the text says what was seen, what was expected and what to do.
    """
    from analyzer.config import Config as Defaults
    from analyzer.loops.changes import read_changes
    from analyzer.night.asked import opened

    paths = [export] if isinstance(export, str | Path) else list(export)
    source, specs, notes = opened([Path(p) for p in paths], None if loops is None else Path(loops), **reading)
    dated = () if changes is None else read_changes(Path(changes))
    return Plant(source, specs, dated, notes, config or Defaults())
