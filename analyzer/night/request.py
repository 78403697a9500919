"""The request for an export: files and loops, changes of settings, a span of time, limits. Nothing slow is imported
before it is known."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from analyzer.config import Config
from analyzer.history.plant_clock import utc_seconds, zone_of
from analyzer.loops.changes import TuningChange, read_changes
from identification.errors import InputError

Span = tuple[float, float]
"""Start and end of a span of time [s since 1970-01-01 UTC]."""
ALWAYS: Span = (-math.inf, math.inf)


@dataclass(frozen=True, slots=True)
class ExportRequest:
    """Files, loops.csv, changes of settings, span of time [s since 1970-01-01 UTC] and limits.

    zone : the plant's time zone, of nights, pages and options; reading : format options of text exports, as in
    analyzer.history.table; finding : whether, without loops.csv, loops are also searched in the data.
    """

    export: tuple[Path, ...]
    loops: Path | None
    changes: tuple[TuningChange, ...]
    span: Span
    config: Config
    zone: str
    reading: Mapping[str, Any]
    finding: bool = False


def export_request(
    export: Sequence[Path],
    loops: Path | None,
    changes: Path | None,
    config: Config,
    since: datetime | None = None,
    until: datetime | None = None,
    finding: bool = False,
    **reading: Any,
) -> ExportRequest:
    """The request of a command line or a notebook; times without a stated zone are on the plant's clock."""
    zone = str(zone_of(reading.get("timezone")))
    reading["good_quality"] = tuple(reading.get("good_quality") or ()) or None
    dated = () if changes is None else read_changes(changes, zone, reading.get("day_first"))
    first, last = ALWAYS
    first = first if since is None else utc_seconds(since, zone)
    last = last if until is None else utc_seconds(until, zone)
    if last <= first:
        raise InputError(f"--since {since} --until {until}", "an end after the start", "swap them")
    return ExportRequest(tuple(export), loops, dated, (first, last), config, zone, reading, finding)
