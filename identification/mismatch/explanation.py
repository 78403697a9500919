"""What was found in one recording: fits without and with effects, in which order, and how they are proven."""

from __future__ import annotations

from dataclasses import dataclass, field

from identification.controller.pi_regression import ControlLaw
from identification.estimation.candidate import Fitted, Problem
from identification.mismatch.catalogue import EFFECTS, fault
from identification.mismatch.effect import Ends
from identification.mismatch.forward_selection import Candidate
from identification.mismatch.proof import HeldOut, OnOther
from identification.mismatch.recording import Finding, SeenInCycles


@dataclass(frozen=True, slots=True)
class Explanation:
    """What was found.

    recorder, controller : what was found about them; p : the problem that the fits solve; plain, best : fits without
    and with the effects; accepted : the candidates taken, in order; first : the candidates of the first round; law :
    the control law recovered; late_s : PV's lateness that was taken out [s]; left : gain of a flexible model beyond
    its least, 0 where nothing is left; proof : plain and best on held-out data; refuted : names of effects that
    explain the fitted part and not the rest; unproven : whether OP moved once, so that nothing is left to prove the
    effects on; cycles : the faulty valve that the loop's cycles show; others : misfits on other recordings, where
    some were held out whole; by_innovations : in an experiment, what innovations alone explain; outside : physics of
    no name that explains it better than any that has one.
    """

    p: Problem = field(repr=False)
    plain: Fitted
    best: Fitted
    accepted: tuple[Candidate, ...] = ()
    first: tuple[Candidate, ...] = ()
    recorder: Finding | None = None
    controller: Finding | None = None
    law: ControlLaw | None = None
    late_s: float = 0.0
    left: float = 0.0
    proof: HeldOut | None = None
    refuted: tuple[str, ...] = ()
    unproven: bool = False
    cycles: SeenInCycles | None = None
    others: tuple[OnOther, ...] = ()
    outside: Candidate | None = None
    by_innovations: Explanation | None = field(default=None, repr=False)

    @property
    def proven(self) -> HeldOut:
        """The proof, which every explanation that is told of has."""
        if self.proof is None:
            raise ValueError("an explanation that was not put to the proof")
        return self.proof

    @property
    def finding(self) -> Finding | None:
        """The finding about recorder or controller that is named first; None where an effect stands before it, as one
        of valve or process does that is larger than the steps of PV's grid. A load says nothing against the grid."""
        ends = Ends.NOTHING if self.recorder is None else fault(self.recorder.name).ends
        lasting = bool(self.accepted) and not EFFECTS[self.accepted[0].name].timed
        if lasting and self.controller is None and ends is Ends.SMALLER:
            return None
        return self.recorder or self.controller
