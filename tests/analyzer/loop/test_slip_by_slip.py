"""The faults of valves with simulated dry friction and with backlash are named; the simulation shares no code."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest

from analyzer.loop.advice.propose import propose
from analyzer.loop.cause.verdict import Verdict
from analyzer.words import sentences
from identification.models import Pid
from proofs.coverage import FAMILIES, Made, assessed, made
from proofs.plant import CONFIG

BACKLASH, STICKS = FAMILIES[:2]


@cache
def seen(family: str, seed: int) -> tuple[Made, Verdict]:
    """A loop and its verdict."""
    loop = made(family, seed)
    return loop, assessed(loop).verdict


@pytest.mark.parametrize("seed", [60_700_009, 60_700_011, 60_700_013])
def test_dry_friction_is_stiction(seed):
    """A stem with mass and dry friction is stiction with a stickband within 10 %, for constant and for scattering
    slips.
    """
    loop, verdict = seen(STICKS, seed)
    assert (verdict.cause, verdict.fault) == ("valve", "stiction")
    assert verdict.measured is not None
    assert verdict.measured.stick_slip is not None
    assert verdict.measured.stick_slip.valve.stickband == pytest.approx(loop.truth["stickband_pct"], rel=0.1)


@pytest.mark.parametrize("seed", [60_800_000, 60_800_001, 60_800_002, 60_800_004])
def test_backlash_is_no_stiction(seed):
    """A stem with backlash is reported as backlash, and no stem movement is decoded for it."""
    _, verdict = seen(BACKLASH, seed)
    assert (verdict.cause, verdict.fault) == ("valve", "backlash")
    assert verdict.measured is not None
    assert not verdict.measured.problem.blocks.decoded


def test_advice_states_the_friction_that_it_is_based_on():
    """Settings are based on the verdict of one friction, and their reason says so; the reason for backlash does
    not.
    """
    for (loop, verdict), says in ((seen(STICKS, 60_700_009), True), (seen(BACKLASH, 60_800_004), False)):
        pid = Pid(loop.pi.kp, loop.pi.ti, scan_s=loop.scan_s)
        found = propose(verdict, pid, 200.0, CONFIG).proposal
        assert found.reason.startswith(sentences("settings")["one_friction"]) == says
        before = propose(verdict.for_settings, pid, 200.0, CONFIG).proposal
        assert replace(found, reason=before.reason) == before
