"""The user's own model is judged in one line, and wrong units are reported."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from analyzer.explain.models import (
    AS_GOOD,
    against_plain,
    judged,
    plain_start,
    read_model,
    saved_scale,
    within,
    wrong_units,
)
from analyzer.loop.record.quality import Scale
from identification.errors import InputError
from identification.mismatch.baseline import inputs_of, prepared
from identification.mismatch.explanation import Explanation, carried_over
from identification.mismatch.recording import Recording
from identification.models import Fopdt, Loop, Pid
from identification.simulation.closed_loop import closed_loop
from identification.simulation.parameters import Slot, neutral

FOUND = {"gain": 1.2, "time_constant_s": 20.0}
N = 3000


def model(gain: float = 1.2, lag_s: float = 20.0, dead_s: float = 3.0) -> dict:
    """A saved model."""
    return {
        "loop": "A",
        "constants": {"K": gain, "T": lag_s, "L": dead_s},
        "level_pv_pct": 50.0,
        "middle_op_pct": 50.0,
    }


@pytest.fixture(scope="module")
def baseline_fit() -> tuple[Explanation, Recording]:
    """A loop of gain 1.2, time constant 20 s and dead time 3 s with an ideal valve, and its baseline fit."""
    rng = np.random.default_rng(1)
    sp = 50 + np.repeat(rng.uniform(-7, 7, N // 150), 150)
    r = closed_loop(Loop(Fopdt(1.2, 20.0, 3.0), Pid(1.8, 20.0)), sp, rng.normal(0, 0.1, N))
    s = Recording(r.sp, r.pv, r.op, np.ones(N, dtype=bool), 1.0, r.time_s)
    p, plain = prepared(inputs_of(s), r.pv - r.pv.mean(), s.usable)
    return carried_over(Explanation(p, plain, plain)), s


def test_right_model_does_as_well(baseline_fit: tuple[Explanation, Recording]) -> None:
    """The true model leaves the noise of 0.1 % as residual, as the refitted baseline does, and no unit is
    questioned.
    """
    own = judged(model(), *baseline_fit)
    assert own.held_out.rmse == pytest.approx(0.1, rel=0.1)
    assert "it is as good as the baseline model" in own.note
    assert "off" not in own.note


@pytest.mark.parametrize(
    ("wrong", "expected"),
    [
        (model(gain=120.0), "100 times off"),
        (model(gain=0.012), "100 times off"),
        (model(lag_s=20.0 / 60), "minutes"),
        (model(lag_s=1200.0), "minutes"),
        (model(gain=-1.2), "another sign"),
    ],
)
def test_wrong_units_are_reported(
    baseline_fit: tuple[Explanation, Recording], wrong: dict, expected: str
) -> None:
    """A gain wrong by a factor of a hundred, minutes instead of seconds, and a wrong sign are each reported in the
    one line.
    """
    assert expected in judged(wrong, *baseline_fit).note


def test_refits_are_not_called_wrong_units() -> None:
    """Gains and time constants within a factor of ten are differences of the fit and not of units."""
    c = neutral()
    for gain, lag in ((0.15, 3.0), (11.0, 190.0), (1.2, 20.0)):
        c[Slot.K], c[Slot.T] = gain, lag
        assert wrong_units(c, FOUND) == ""


def test_ratios_count_both_ways() -> None:
    """A ratio and its inverse are the same mistake; a ratio of zero is no mistake."""
    assert within(100.0, (60, 160))
    assert within(-0.01, (60, 160))
    assert not within(0.0, (60, 160))


def test_comparison_has_three_outcomes() -> None:
    """The results worse, equal and better are separated at 5 %."""
    expected = [against_plain(x, 1.0, AS_GOOD).split()[2] for x in (1.06, 1.04, 0.94)]
    assert expected == ["worse", "as", "better"]


def test_only_the_baseline_part_of_a_model_starts_the_search() -> None:
    """Backlash in a user's model does not enter the baseline model that it is compared with."""
    data = model() | {"constants": {"K": 1.0, "T": 5.0, "L": 1.0, "STICKBAND": 3.0}}
    c = plain_start(data)
    assert c[Slot.STICKBAND] == 0.0
    assert c[Slot.T] == 5.0


@pytest.mark.parametrize(
    "text",
    [
        "no json",
        "[]",
        json.dumps({"loop": "A"}),
        json.dumps(model() | {"loop": "B"}),
        json.dumps(model(lag_s=-1.0)),
        json.dumps(model() | {"level_pv_pct": "fifty"}),
        json.dumps(model() | {"constants": {"K": 1.0, "T": 5.0, "L": 1.0, "RATE": "fast"}}),
        json.dumps(model() | {"constants": {"K": 1.0, "T": 5.0, "L": 1.0, "STICKBAND": float("nan")}}),
        json.dumps(model() | {"constants": {"GAIN": 1.0}}),
        json.dumps(model() | {"constants": [1, 2]}),
    ],
)
def test_unusable_models_are_one_line(tmp_path: Path, text: str) -> None:
    """A file that is not a model, belongs to another loop, or has an invalid number is refused in one line."""
    path = tmp_path / "m.json"
    path.write_text(text)
    with pytest.raises(InputError) as refused:
        read_model(path, "A")
    assert "\n" not in str(refused.value)


def test_a_model_keeps_the_ranges_of_its_fit() -> None:
    """A saved model keeps the range of its fit, 20 to 60, although the new recording has a range of 30 to 40."""
    now = Scale(30.0, 10.0, 0.0, 100.0, recorded=True)
    kept = {"scale": {"pv_low": 20.0, "pv_span": 40.0, "op_low": 0.0, "op_span": 10.0}}
    assert saved_scale(kept, now) == Scale(20.0, 40.0, 0.0, 10.0, recorded=True)
    assert saved_scale({}, now) == now
    assert saved_scale({"scale": {"pv_low": "x"}}, now) == now
