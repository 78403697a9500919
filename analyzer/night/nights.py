"""A plant: an export with its loops, cut into nights, each a span of time that is assessed as one."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from analyzer.config import Config, NightLimits
from analyzer.history.export import Export
from analyzer.history.plant_clock import DAY_S, UTC_NAME, date_of, midnights
from analyzer.history.series import Series, stamp_text
from analyzer.loop.record.judged_stretch import Earlier, controller_of, earlier_settings
from analyzer.loop.record.quality import Prepared, prepare
from analyzer.loops.changes import TuningChange, in_force
from analyzer.loops.spec import LoopSpec, spec_of
from analyzer.night.request import ALWAYS, Span
from identification.errors import InputError
from identification.models import Pid
from identification.record import LoopRecord


@dataclass(frozen=True, slots=True)
class Night:
    """A span of time that is assessed as one: its name (the plant's date of its middle), its ends [s], the plant's
    time zone."""

    name: str
    first_s: float
    last_s: float
    zone: str = UTC_NAME

    @property
    def at_end_s(self) -> float:
        """The last moment that belongs to it [s]: a time at its end belongs to the next one."""
        return math.nextafter(self.last_s, -math.inf)


def _name(first_s: float, last_s: float, zone: str) -> str:
    """The plant's date of a span's middle."""
    return date_of((first_s + last_s) / 2, zone)


def _daily(first_s: float, last_s: float, limits: NightLimits, zone: str) -> list[Night]:
    """Cut a span of time at the plant's midnights; a short first or last piece is joined to its neighbour. Raises
    InputError if there would be more than one run may have."""
    if last_s - first_s > limits.most * DAY_S:
        days, ends = (last_s - first_s) / DAY_S, f"{stamp_text(first_s)} to {stamp_text(last_s)} UTC"
        remedy = "state the part that is meant with --since and --until"
        raise InputError(
            f"the export spans {days:.0f} days, {ends}", f"at most {limits.most} nights in one run", remedy
        )
    least_s = 3600.0 * limits.least_piece_h
    inner = [c for c in midnights(first_s, last_s, zone) if min(c - first_s, last_s - c) >= least_s]
    return [Night(_name(a, b, zone), a, b, zone) for a, b in pairwise([first_s, *inner, last_s + 1.0])]


def in_nights(spans: Sequence[Span], limits: NightLimits, zone: str = UTC_NAME) -> list[Night]:
    """The nights of an export from the spans of its loops [s].

    If the median loop has more than whole_h (36 h), the export is cut into days; otherwise each loop is assessed
    whole, in one night, named by the date of the middle of the loop that ends last, so that recordings of different
    days can be ranked together.
    """
    lengths = sorted(last - first for first, last in spans)
    first, last = min(s[0] for s in spans), max(s[1] for s in spans)
    if lengths[len(lengths) // 2] > limits.whole_h * 3600.0:
        return _daily(first, last, limits, zone)
    latest = max(spans, key=lambda s: s[1])
    return [Night(_name(*latest, zone), first, last + 1.0, zone)]


def cut(series: Series, night: Night) -> Series:
    """The samples of one night."""
    a, b = np.searchsorted(series.stamp_s, [night.first_s, night.last_s])
    text = None if series.text is None else series.text[a:b]
    return replace(
        series, stamp_s=series.stamp_s[a:b], value=series.value[a:b], bad=series.bad[a:b], text=text
    )


def nights_of(plant: Plant) -> list[Night]:
    """The nights of a plant within its span of time, cut at its midnights. Raises InputError if the export has no PV
    of any loop, or nothing within the span."""
    present = [s.pv for s in plant.specs if s.pv is not None]
    if not present:
        wanted = plant.specs[0].wanted_pv or f"{plant.specs[0].loop}.PV"
        raise InputError("no PV tag of any loop is in the export", f"tags such as {wanted}", "check --loops")
    since_s, until_s = plant.span
    spans = [plant.export.span(tag) for tag in present]
    inside = [(max(a, since_s), min(b, until_s - 1.0)) for a, b in spans if a < until_s and b >= since_s]
    if not inside:
        raise InputError("no samples between --since and --until", "a span of the export", "widen it")
    return in_nights(inside, plant.config.nights, plant.zone)


@dataclass(frozen=True)
class Plant:
    """An export and its loops, with the request.

    specs : loops with the tags of the export; config : limits; span : of time, whose samples are used [s since
    1970-01-01 UTC]; changes : times of changed settings, each night has those in force at its end; zone : the plant's
    time zone, which defines the nights; notes : notes on files and tables.
    """

    export: Export
    specs: tuple[LoopSpec, ...]
    config: Config = field(default_factory=Config)
    span: Span = ALWAYS
    changes: Sequence[TuningChange] = ()
    zone: str = UTC_NAME
    notes: tuple[str, ...] = ()

    @property
    def loops(self) -> tuple[str, ...]:
        """Names of the loops."""
        return tuple(spec.loop for spec in self.specs)

    @cached_property
    def spans(self) -> Mapping[str, Night]:
        """Nights by name, oldest first."""
        return {night.name: night for night in nights_of(self)}

    @property
    def nights(self) -> tuple[str, ...]:
        """Names of the nights, oldest first."""
        return tuple(self.spans)

    def loop(self, name: str, night: str | None = None) -> PlantLoop:
        """One loop, over one night or over the whole export. Raises InputError where there is no such loop or night,
        or the loop has no PV; NotAssessedError where its trends have too few samples for a clock."""
        spec = spec_of(self.specs, name)
        if night is not None and night not in self.spans:
            raise InputError(f"night {night}", f"one of {', '.join(self.nights[-3:])}", "see Plant.nights")
        span = None if night is None else self.spans[night]
        spec = in_force(spec, self.changes, self.export.span()[1] if span is None else span.at_end_s)
        prepared = prepare(spec, self.trends(spec.tags, span), self.config.quality)
        return PlantLoop(spec, prepared, self, span)

    def trends(self, tags: Sequence[str], night: Night | None = None) -> dict[str, Series]:
        """The samples of some tags over a night, or over the span."""
        span = Night("", *self.span) if night is None else night
        return {tag: cut(x, span) for tag, x in self.export.read(tags).items()}

    def last_night(self, name: str) -> PlantLoop:
        """One loop over its own last night; errors as of `loop` and `nights_of`."""
        alone = replace(self, specs=(spec_of(self.specs, name),))
        return replace(alone.loop(name, alone.nights[-1]), plant=self)


@dataclass(frozen=True)
class PlantLoop:
    """One loop over one night, or over all of an export.

    spec : its row of loops.csv with the settings in force; prepared : its trends on one clock, with masks and notes;
    plant : its export; night : None for the whole export.
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
        """The stated settings in percent and seconds; None if they are not in loops.csv."""
        return controller_of(self.spec, self.prepared)

    @property
    def earlier(self) -> tuple[Earlier, ...]:
        """Settings that were in force in the record before its last ones, oldest first."""
        stated = spec_of(self.plant.specs, self.spec.loop)
        return earlier_settings(stated, self.plant.changes, self.prepared)
