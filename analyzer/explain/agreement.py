"""Where the night's verdict and the explanation speak of the same valve, and what is said where they differ.

They ask different questions. The verdict asks why a loop oscillates, from the whole night with the controller in
the loop; the explanation asks which physics a simulation of PV from the recorded OP lacks, proven on a part that it
has not seen. The rule: a cause of the oscillation is the verdict's to name, so the explanation asks the verdict on
its own recording first (case.py): a valve that the cycles convict is where its search begins, and friction is not
looked for where they convict none. A kind of fault is the explanation's where it is proven on held-out data. What
still differs, for the night and the recording explained need not be the same, the page says, with what would settle
it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from analyzer.loop.decisions import Fault
from identification.mismatch import effect
from identification.mismatch.catalogue import EFFECTS, fault
from identification.mismatch.effect import Block, Ends
from tuning.decisions import Cause

STROKE = "stroke the valve both ways in steps of a quarter of its band and watch the stem"
"""What settles a question about a valve."""


def is_friction(name: str) -> bool:
    """Whether a verdict of the explanation is play, stick-slip, or what looks like them."""
    return name in EFFECTS and EFFECTS[name].friction is not None


def ends_the_search(name: str) -> bool:
    """Whether a verdict of the explanation leaves the physics unasked."""
    return (
        name in EFFECTS and isinstance(EFFECTS[name], effect.Fault) and fault(name).ends is not Ends.NOTHING
    )


def agreement(row: Mapping[str, Any], verdict: str, block: str) -> str:
    """One sentence on how a night's verdict and its explanation go together; empty where neither is about a valve.

    Parameters
    ----------
    row : mapping
        The loop's row of the night: cause, valve_fault.
    verdict, block : str
        The explanation's name and block.
    """
    valve, kind = row["cause"] == Cause.VALVE, row.get("valve_fault") or Fault.UNDECIDED
    if valve and is_friction(verdict):
        if kind in (verdict, Fault.UNDECIDED, Fault.NONE):
            return "Verdict and explanation agree on the valve."
        return (
            f"Both find the valve; the night's verdict calls it {kind}, the explanation {verdict}, which a sampling "
            f"like this hardly tells apart: {STROKE}."
        )
    if valve and ends_the_search(verdict):
        return "The explanation stops at what the recorder did, so it neither bears out nor contradicts the verdict."
    if valve:
        return (
            "The night's verdict is a valve fault; the explanation does not bear it out on the part of the recording "
            f"that it had not seen: {STROKE} before it is repaired."
        )
    if is_friction(verdict) or block == Block.VALVE:
        return (
            "The explanation finds something at the valve; the night's verdict does not hold it to be what makes the "
            "loop oscillate."
        )
    return ""
