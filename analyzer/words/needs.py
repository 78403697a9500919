"""What a record needs for an answer and what it has instead, or the error that ended a loop."""

from __future__ import annotations

from collections.abc import Mapping

from analyzer.loop.decisions import Need, Needs

TOO_COARSE = (
    "oscillation needs a sample every {0:.2g} s or faster, has one every {1:g} s; a cycle of this loop would take "
    "about {2:.3g} s"
)
SAYS: Mapping[Need, str] = {
    Need.PV_TAG: "no PV tag {0} in the export",
    Need.GOOD_PV: "needs PV samples, has none that is good",
    Need.MORE_PV: "needs {0} good PV samples, has {1}",
    Need.STAMPS: "needs samples at different times, has one stamp",
    Need.IN_A_ROW: "needs samples that follow each other, has {0}, mostly {1:g} s apart, spread over {2:.1f} days "
    "({3:.1f} % of that time)",
    Need.NUMBERS: "{0} values of {1}, such as '{2}', are not understood as numbers; needs plain numbers: export them "
    "so, or state --decimal and --delimiter",
    Need.SAMPLES: "needs {0} samples, has {1}",
    Need.SAMPLES_IN_TURN: "needs {0} samples, has {1} while it has the valve, {2:.1f} % of the time",
    Need.AUTOMATIC: "needs {0:.0f} % good samples in automatic, has {1:.0f} % (manual {2:.0f} %, gaps and stale "
    "{3:.0f} %)",
    Need.OP: "needs OP, which is not recorded",
    Need.OP_RANGE: "OP runs from {0:.3g} to {1:.3g}, which is no plausible part of {2:g} to {3:g}: state op_lo and "
    "op_hi in loops.csv; without them nothing is told in % of OP",
    Need.MOVING_OP: "needs OP that moves, it stands still",
    Need.MOVING_PV: "needs PV that moves with OP, so that a model can be identified",
    Need.PV_AS_MEASURED: "needs PV as measured; it stands for {0:.0f} % of the samples and else moves by {1:.2g} % "
    "or more: a sensor that sticks, or a historian that keeps large changes alone",
    Need.UNCOMPRESSED: "needs trends without compression, {0:.0f} % lie on straight segments",
    Need.ARCHIVED: "needs trends without compression, or {0:g} archived samples a cycle: there are {1:.2g}, {2:.0f} "
    "% lie on straight segments",
    Need.OFF_LIMITS: "needs OP within its limits, it is at one for {0:.0f} % of the time",
    Need.MODEL: "needs trends from which a model can be identified",
    Need.OF_A_CYCLE: TOO_COARSE,
    Need.UNFOLDED: f"{TOO_COARSE}; what is seen may be such a cycle, folded by the sampling",
    Need.OF_A_LOAD: "a load from outside needs {0:g} samples a cycle to be told from a valve or the tuning, there "
    "are {1:.2g}",
    Need.OF_SETTINGS: "new settings need a sample every {0:.2g} s or faster for an integral time of {1:.3g} s, there "
    "is one every {2:g} s: take this as a hint",
    Need.FINER: "needs finer values: PV is recorded in steps of {0:.2g} % and swings by {1:.2g} %",
    Need.HOURS: "new settings need {0:g} good hours in automatic, there are {1:.3g}: take this as a hint",
    Need.LONGER: "needs a longer record, or one with set point moves, for new settings. {0}",
    Need.LOAD_IN_MANUAL: "a load is likeliest, but by {0:.0f} % alone; needs some periods in manual: a swing that "
    "goes on comes from outside",
    Need.TUNING_IN_MANUAL: "it swings as a loop too tight for its process does, but the one identified is robust (Ms "
    "{0:.2f}); needs some periods in manual: a swing that stops is the loop's own",
    Need.AS_TOLD: "{0}",
}


def said(needs: Needs) -> str:
    """What is needed, in words."""
    return SAYS[needs.need].format(*needs.figures)
