"""What is named, and that nothing is where nothing hides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mismatch_scenes import PLAY, STICKING, N, subject

from identification.mismatch.answer import answer
from identification.mismatch.explain import explain

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_plain_loop_is_none(seed: int) -> None:
    """A plain loop under load and noise is `none`."""
    s = subject(seed)
    assert answer(explain(s), s).verdict == "none"


def test_one_outlier_and_a_gap_are_none() -> None:
    """One wild value and a hole in the recording are no physics."""
    s = subject(4)
    pv, usable = s.pv.copy(), s.usable.copy()
    pv[2100] += 15.0
    usable[3000:3060] = False
    pv[3000:3060] = pv[2999]
    s = replace(s, pv=pv, usable=usable)
    assert answer(explain(s), s).verdict == "none"


def test_play_is_named_with_its_width() -> None:
    """Play of 2 % is named and its interval lies within 0.2 % of the truth."""
    s = subject(5, PLAY)
    said = answer(explain(s), s)
    assert said.verdict == "backlash"
    assert said.effects[0].parameters["backlash_pct"].value == pytest.approx(2.0, abs=0.2)
    assert said.moved["dead_time_s"][1] == pytest.approx(3.4, abs=0.3)


def test_sticking_is_not_taken_for_play() -> None:
    """A stickband of 2 % with a jump of 1.2 % is stiction, not play."""
    s = subject(6, STICKING)
    said = answer(explain(s), s)
    assert said.verdict == "stiction"
    assert said.effects[0].parameters["slip_jump_pct"].value == pytest.approx(1.2, rel=0.15)


def test_load_step_is_named_where_it_is() -> None:
    """A step of the load is a load, and its span is where it came."""
    load = np.where(np.arange(N) > 2600, 2.5 * (1 - np.exp(-(np.arange(N) - 2600) / 20.0)), 0.0)
    s = subject(7, load=np.nan_to_num(load))
    said = answer(explain(s), s)
    assert said.verdict == "load-step"
    assert any(first <= 2600 <= last for first, last in said.where["spans"])


def test_compressed_trends_end_at_the_recorder() -> None:
    """Straight segments off any grid are the finding; nothing of the valve is said."""
    s = subject(8, PLAY)
    kept = np.arange(0, N, 9)
    pv = np.interp(np.arange(N), kept, s.pv[kept] + 1e-3 * np.random.default_rng(0).normal(size=kept.size))
    s = replace(s, pv=pv)
    said = answer(explain(s), s)
    assert (said.verdict, said.block) == ("compression", "recorder")
    assert len(said.effects) == 1
