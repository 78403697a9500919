"""Columns of the store's other tables: hours, and loops that were explained."""

from __future__ import annotations

from analyzer.columns.column import Column, Kind, Source

HOUR = Column("hour_s", Kind.NUMBER, "Hour", "s since 1970-01-01 UTC", Source.RUN, "Start of the clock hour.")
EXPLANATION = (
    Column(
        "verdict",
        Kind.TEXT,
        "Verdict",
        "",
        Source.EXPLAIN,
        "Likeliest effect of the catalogue, none or unexplained.",
    ),
    Column(
        "block",
        Kind.TEXT,
        "Block",
        "",
        Source.EXPLAIN,
        "Where it sits: valve, process, sensor, recorder, controller, load or none.",
    ),
    Column("reason", Kind.TEXT, "Reason", "", Source.EXPLAIN, "What was found and why in one sentence."),
    Column(
        "answer",
        Kind.JSON,
        "Answer",
        "",
        Source.EXPLAIN,
        "The whole answer as triage explain --format json gives it.",
    ),
    Column(
        "page",
        Kind.JSON,
        "Page",
        "",
        Source.EXPLAIN,
        "The answer's page as it is to be drawn, empty without one.",
    ),
)
"""Of a loop and night that was explained, beside its name and night."""
