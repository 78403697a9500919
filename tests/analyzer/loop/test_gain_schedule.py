"""A gain scheduled over OP, PV or SP is stated, checked against the record, and unchanged by new settings."""

from __future__ import annotations

import numpy as np
import pytest

from analyzer.config import Config
from analyzer.history.export import open_export
from analyzer.loop.record.judged_stretch import controller_of, shown
from analyzer.loop.record.quality import prepare
from analyzer.loops.gain_schedule import gain_schedule, in_force
from analyzer.loops.spec import LoopSpec, read_loops
from analyzer.loops.tags import as_stated, controller, derivative_as_stated, match
from analyzer.night.chunk import assess_loop
from identification.controller.gain_pieces import gain_pieces
from identification.errors import InputError
from identification.models import Form, Pid
from identification.record import LoopRecord
from proofs.controllers_plant import controlled

UPPER = 0.4


def test_each_piece_has_its_factor():
    """Below all edges the factor is 1; at and above an edge it is the factor of that edge."""
    stated = gain_schedule("PV 50:0.4; 75,5:0,2", "here")
    share = stated.share(np.array([0.0, 49.9, 50.0, 75.4, 75.5, 200.0]))
    assert (stated.over, share.tolist()) == ("pv", [1.0, 1.0, 0.4, 0.4, 0.2, 0.2])


@pytest.mark.parametrize(
    "cell",
    ["op", "50:0.4", "mv 50:0.4", "op 75:0.2 50:0.4", "op 50:0", "op 50:nan", "op 1:1 2:1 3:1 4:1", "op 50"],
)
def test_an_invalid_schedule_is_one_line(tmp_path, cell):
    """A cell that is not a schedule is refused with row, column and an example."""
    (tmp_path / "loops.csv").write_text(f"loop,gain_schedule\nL,{cell}\n")
    with pytest.raises(InputError, match=r"row 2, column 'gain_schedule'.*'op 50:0.4 75:0.2'"):
        read_loops(tmp_path / "loops.csv")


def test_the_factor_in_force_is_that_of_most_good_samples():
    """Bad samples do not count for the factor in force."""
    share = np.array([1.0, 1.0, 1.0, 0.4, 0.4])
    assert in_force(share, np.ones(5, bool)) == 1.0
    assert in_force(share, np.array([1, 0, 0, 1, 1], bool)) == 0.4


@pytest.mark.parametrize(
    "stated",
    [
        LoopSpec("L", kp=2.0, ti=60.0, td=5.0),
        LoopSpec("L", kp=2.0, ti=60.0, td=5.0, form=Form.SERIES),
        LoopSpec("L", kp=2.0, ti=60.0, td=5.0, form=Form.PARALLEL),
        LoopSpec("L", kp=50.0, ti=60.0, gain_unit="band"),
        LoopSpec("L", kp=0.0, ti=60.0),
    ],
)
def test_settings_are_stated_back_without_the_factor(stated):
    """Settings under a factor of 0.4 act with 0.4 times the gain, and are written as they were stated."""
    whole, part = controller(stated, 100.0), controller(stated, 100.0, UPPER)
    assert whole is not None
    assert part is not None
    assert (part.kp, part.ki) == pytest.approx((UPPER * whole.kp, UPPER * whole.ki))
    assert as_stated(part, stated, 100.0) == pytest.approx((stated.kp, stated.ti))
    assert derivative_as_stated(part, stated, 100.0) == pytest.approx(stated.td or 0.0)


@pytest.fixture(scope="module")
def scheduled(tmp_path_factory):
    """A loop with a smaller gain from an OP of 50 % on, simulated without code of the package.

    Returns its true row and a function for its record under a row.
    """
    folder = tmp_path_factory.mktemp("scheduled")
    c = controlled("gain schedule", "set point moves", 7, 1.0)
    c.trends("L", 1).to_parquet(folder / "trends.parquet")
    export = open_export([folder / "trends.parquet"])

    def seen(**changed):
        spec = LoopSpec("L", **{**c.row, **c.extras, **changed})
        spec = match((spec,), export.tags)[0][0]
        p = prepare(spec, export.read(spec.tags), Config().quality)
        stated = controller_of(spec, p)
        return p, spec, stated, shown(p.record, stated, 600.0, Config().settings)

    return c, seen


def test_a_correctly_stated_schedule_is_accepted(scheduled):
    """Correctly stated settings and a correctly stated schedule give no finding."""
    _, seen = scheduled
    p, spec, stated, found = seen()
    assert p.record.gain_share is not None
    assert set(np.unique(p.record.gain_share * p.gain_share)) == set(spec.schedule.factors)
    assert (found.other, found.scheduled_over) == (None, None)
    assert stated.kp == pytest.approx(spec.kp * p.gain_share)


@pytest.mark.parametrize("wrong", [{"kp": 3.0}, {"kp": 1 / 3}, {"ti": 1 / 60}])
def test_a_wrong_setting_under_a_schedule_is_found(scheduled, wrong):
    """A gain three times too high or too low, or minutes instead of seconds, is reported.

    The recorded settings are given as those below the first edge.
    """
    c, seen = scheduled
    p, spec, _, found = seen(**{name: factor * c.row[name] for name, factor in wrong.items()})
    assert found.other is not None
    kp, ti = as_stated(found.other, spec, p.scale.span)
    assert (kp, ti) == pytest.approx((c.row["kp"], c.row["ti"]), rel=0.1)


def test_a_record_in_one_piece_has_one_gain(scheduled):
    """An edge that is never reached changes nothing: the record has no factors."""
    _, seen = scheduled
    p, *_ = seen(gain_schedule="pv 500:0.1")
    assert (p.gain_share, p.record.gain_share) == (1.0, None)


@pytest.mark.parametrize("seed", [5, 6, 7, 8])
@pytest.mark.parametrize("upper", [False, True])
def test_an_unstated_schedule_is_found_with_its_edge(seed, upper):
    """If a gain is scheduled over PV and only the gain of one side is stated, edge and factor are found.

    The control law is made from its definition, without code of the package.
    """
    rng = np.random.default_rng(seed)
    n, edge, factor = 20_000, 52.0, 0.5
    pv = 50.0 + np.cumsum(rng.normal(0.0, 0.05, n)) % 8.0 + rng.normal(0.0, 0.2, n)
    error = 51.0 - pv
    moves = 0.8 * np.diff(error, prepend=error[0]) + 0.8 / 30.0 * error
    op = 50.0 + np.cumsum(np.where(pv < edge, 1.0, factor) * moves) * 0.05
    record = LoopRecord("L", 0.0, 1.0, np.full(n, 51.0), pv, op, np.zeros(n, bool))
    found = gain_pieces(record, Pid(0.8 * 0.05 * (factor if upper else 1.0), 30.0))
    assert found is not None
    assert (found.over, found.edge) == ("pv", pytest.approx(edge, abs=0.05))
    assert found.above / found.below == pytest.approx(factor, rel=0.02)
    assert (found.above if upper else found.below) == pytest.approx(1.0, rel=0.02)


@pytest.mark.parametrize("wrong", [1.0, 0.3, 3.0])
def test_one_gain_has_no_edge(wrong):
    """A control law with one gain, stated correctly or not, is no schedule, and noise is no schedule."""
    rng = np.random.default_rng(3)
    pv = 50.0 + np.cumsum(rng.normal(0.0, 0.05, 20_000)) % 8.0
    error = 51.0 - pv
    op = 50.0 + 0.04 * error + 0.04 / 30.0 * np.cumsum(error)
    record = LoopRecord("L", 0.0, 1.0, np.full(pv.size, 51.0), pv, op, np.zeros(pv.size, bool))
    assert gain_pieces(record, Pid(wrong * 0.04, 30.0)) is None
    noise = LoopRecord("L", 0.0, 1.0, record.sp, pv, rng.normal(50.0, 1.0, pv.size), record.bad)
    assert gain_pieces(noise, Pid(0.04, 30.0)) is None


def test_new_settings_under_a_schedule_are_those_of_its_gain(tmp_path):
    """A loop that always works at 0.4 times Kp gets the same new settings as a loop with that gain.

    The new Kp is stated in the same way as the old one, divided by 0.4.
    """
    c = controlled("PI", "healthy", 17, 0.5, 5.0)
    c.trends("L", 1).to_parquet(tmp_path / "trends.parquet")
    export, config = open_export([tmp_path / "trends.parquet"]), Config()

    def advised(**row):
        spec = match((LoopSpec("L", **{**c.row, **row}),), export.tags)[0][0]
        return assess_loop(spec, prepare(spec, export.read(spec.tags), config.quality), config)[1]

    plain = advised()
    under = advised(kp=c.row["kp"] / UPPER, gain_schedule=f"op -10:{UPPER}")
    assert plain.kp_new is not None
    assert (under.kp_new, under.ti_new) == pytest.approx((plain.kp_new / UPPER, plain.ti_new), rel=0.005)
