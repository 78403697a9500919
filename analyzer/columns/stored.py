"""Columns of a loop and night that the store alone holds."""

from __future__ import annotations

from analyzer.columns.column import Column, Kind, Source
from analyzer.columns.figures import FIGURES

STORED = (
    Column(
        "night",
        Kind.TEXT,
        "Night",
        "",
        Source.RUN,
        "The plant's date at the middle of the time that was assessed.",
    ),
    Column(
        "timezone", Kind.TEXT, "Time zone", "", Source.RUN, "The plant's time zone, as --timezone states it."
    ),
    Column(
        "start_s",
        Kind.NUMBER,
        "Start",
        "s since 1970-01-01 UTC",
        Source.EXPORT,
        "First sample of the record.",
    ),
    Column("duration_s", Kind.NUMBER, "Duration", "s", Source.EXPORT, "Length of the record."),
    Column(
        "pv_lo",
        Kind.NUMBER,
        "PV at 0 %",
        "as pv_unit",
        Source.LOOPS,
        "Lower end of the range that percent of span means; of the recorded range where none is stated.",
    ),
    Column("pv_hi", Kind.NUMBER, "PV at 100 %", "as pv_unit", Source.LOOPS, "Upper end of that range."),
    Column(
        "close_first_s",
        Kind.NUMBER,
        "Start of the close view",
        "s since 1970-01-01 UTC",
        Source.OSCILLATION,
        "Start of the last ten periods, of which the trends keep finer buckets.",
    ),
    Column(
        "close_last_s",
        Kind.NUMBER,
        "End of the close view",
        "s since 1970-01-01 UTC",
        Source.OSCILLATION,
        "End of the last ten periods.",
    ),
    Column(
        "turns",
        Kind.JSON,
        "Half-cycles",
        "",
        Source.OSCILLATION,
        "The last ten half-cycles from each turn of OP: OP and PV in percent, and how long the stem stands.",
    ),
    Column(
        "good_h",
        Kind.NUMBER,
        "Good samples",
        "h",
        Source.EXPORT,
        "Time that good samples of PV cover as logged.",
    ),
    *FIGURES,
    Column(
        "periods",
        Kind.JSON,
        "Periods",
        "",
        Source.OSCILLATION,
        "All oscillations found, each with period_s and amplitude_pct.",
    ),
    Column(
        "signs",
        Kind.JSON,
        "Signs",
        "",
        Source.CAUSE,
        "What the cause rests on: what each sign points_to, its strength from 0 to 1, its text.",
    ),
    Column(
        "lack",
        Kind.TEXT,
        "Lack",
        "",
        Source.RUN,
        "What the record lacks for an answer, in a word; reason, advice or notes say how much it needs and has.",
    ),
    Column(
        "group",
        Kind.TEXT,
        "Group",
        "",
        Source.PLANT,
        "Number of the group in which the loop shares an oscillation, the larger one of two; empty for none.",
    ),
    Column(
        "master",
        Kind.TEXT,
        "Master",
        "",
        Source.LOOPS,
        "Loop whose output is this loop's set point, as loops.csv states it.",
    ),
    Column(
        "spectrum",
        Kind.JSON,
        "Spectrum",
        "",
        Source.OSCILLATION,
        "Power of the error in sixths of an octave [dB of % of span], with the period of the first [s].",
    ),
    Column("notes", Kind.TEXT, "About the data", "", Source.EXPORT, "What was noticed about the trends."),
    Column(
        "extra",
        Kind.JSON,
        "Columns of the plant's own",
        "",
        Source.LOOPS,
        "Columns of loops.csv that mean nothing here.",
    ),
)
"""Beside those of the list, in the order in which they are stored."""
