"""Columns of the store's other tables: hours, loops that were explained, groups that share an oscillation."""

from __future__ import annotations

from analyzer.columns.column import Column, Kind, Source

NOTED = (
    Column("note", Kind.TEXT, "Note", "", Source.NOTES, "Newest note on the loop, by whom and when."),
    Column(
        "hidden_until",
        Kind.TEXT,
        "Hidden until",
        "",
        Source.NOTES,
        "Night from which the loop is listed again; empty where no note hides it.",
    ),
)
"""What `triage note` keeps, joined when a night is listed."""
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
COMPARED = (
    Column(
        "settings_page",
        Kind.JSON,
        "Settings page",
        "",
        Source.ADVICE,
        "Settings compared and tried on the night's load, as the page is to be drawn.",
    ),
)
"""Of a loop of the newest night for which settings were sought, beside its name and night."""
GROUP = (
    Column(
        "group", Kind.TEXT, "Group", "", Source.PLANT, "Number of a group of loops that share an oscillation."
    ),
    Column(
        "role",
        Kind.TEXT,
        "Role",
        "",
        Source.PLANT,
        "source, candidate (it may start there), follower, or shares (its own verdict stands).",
    ),
    Column(
        "source_pct",
        Kind.NUMBER,
        "Confidence as source",
        "%",
        Source.PLANT,
        "Confidence that the shared oscillation starts at this loop.",
    ),
    Column(
        "group_period_s",
        Kind.NUMBER,
        "Shared period",
        "s",
        Source.PLANT,
        "Time of one cycle of what is shared.",
    ),
    Column(
        "parent",
        Kind.TEXT,
        "Comes from",
        "",
        Source.PLANT,
        "Loop of the group from which this one seems to have it, by coherence; empty for the likeliest source.",
    ),
    Column(
        "coherence",
        Kind.NUMBER,
        "Coherence",
        "",
        Source.PLANT,
        "How far the loop moves with the likeliest source about the period, from 0 to 1.",
    ),
    Column(
        "lag_s",
        Kind.NUMBER,
        "Lag",
        "s",
        Source.PLANT,
        "How much later than the likeliest source the loop moves; empty where that cannot be told.",
    ),
    Column(
        "wave_amplitude_pct",
        Kind.NUMBER,
        "Amplitude of the shared wave",
        "% of span",
        Source.PLANT,
        "Half of peak to peak of the loop's error about the period, over the whole night.",
    ),
    Column(
        "wave_share_pct",
        Kind.NUMBER,
        "Share of the error",
        "%",
        Source.PLANT,
        "Share of the error's power, slow drift left out, that lies about the period.",
    ),
    Column(
        "gain_pct",
        Kind.NUMBER,
        "Error that would go",
        "% of span",
        Source.PLANT,
        "Part of the average absolute error that would go with the shared oscillation.",
    ),
    Column(
        "group_signs",
        Kind.JSON,
        "Signs of a source",
        "",
        Source.PLANT,
        "Each sign of a candidate with its strength, from 0 to 1.",
    ),
)
"""Of a loop in a group, beside its name and night."""
GROUP_LIST = (
    *(c for c in GROUP if c.name in ("group", "group_period_s", "source_pct")),
    Column("loops", Kind.NUMBER, "Loops", "", Source.PLANT, "Loops that share the oscillation."),
    Column(
        "fix_first",
        Kind.TEXT,
        "Fix first",
        "",
        Source.PLANT,
        "Loop at which the oscillation starts; empty where that is not clear.",
    ),
    Column(
        "candidates",
        Kind.JSON,
        "Candidates",
        "",
        Source.PLANT,
        "Loops at which it may start, each with its confidence [%].",
    ),
    Column(
        "unseen_pct",
        Kind.NUMBER,
        "Confidence that it starts elsewhere",
        "%",
        Source.PLANT,
        "Probability that it starts at none of the loops.",
    ),
    Column("source_cause", Kind.TEXT, "Cause there", "", Source.CAUSE, "Cause of the loop to fix first."),
    Column(
        "source_action",
        Kind.TEXT,
        "Action there",
        "",
        Source.ADVICE,
        "What to do at the loop to fix first, with new settings where there are any.",
    ),
    Column(
        "others_gain_pct",
        Kind.NUMBER,
        "What the others gain",
        "% of span",
        Source.PLANT,
        "Average absolute error that would go in the other loops, summed.",
    ),
    Column("members", Kind.JSON, "Members", "", Source.PLANT, "All loops of the group."),
    Column("sentence", Kind.TEXT, "In a sentence", "", Source.PLANT, "The group in one sentence."),
)
"""Of a group, as `triage rank --groups` lists it."""
