"""The catalogue's rows about the process, its dead time and its changes in time."""

from __future__ import annotations

from identification.estimation.limits import TIE
from identification.simulation.effect import Param, Row, each
from identification.simulation.parameters import Slot

PROCESS = (
    Row(
        "second-lag",
        "process",
        (Param(Slot.T2, "second_lag_s", "s", 0.1, 1e4, "dt", True),),
        each(Slot.T2, 0.7, 1.5, 3.0, 6.0, 12.0, 25.0, 50.0, 100.0),
        likeness=("sensor-lag",),
        delays=(Slot.T2,),
    ),
    Row(
        "second-lag",
        "process",
        (
            Param(Slot.T2, "second_lag_s", "s", 0.1, 1e4, "dt", True),
            Param(Slot.T3, "third_lag_s", "s", 0.1, 1e4, "dt", True),
        ),
        tuple({Slot.T2: t, Slot.T3: 0.5 * t} for t in (1.5, 4.0, 12.0, 40.0)),
        variant="and a third",
        likeness=("sensor-lag",),
        delays=(Slot.T2, Slot.T3),
    ),
    Row(
        "slow-mode",
        "process",
        (
            Param(Slot.SHARE, "slow_share", "", 0.0, 0.95),
            Param(Slot.MODE_T, "slow_time_constant_s", "s", 1.5, 60.0, "T", True),
        ),
        tuple({Slot.SHARE: s, Slot.MODE_T: t} for s in (0.1, 0.4) for t in (4.0, 10.0)),
    ),
    Row(
        "inverse-response",
        "process",
        (
            Param(Slot.SHARE, "opposing_share", "", -5.0, 0.0),
            Param(Slot.MODE_T, "opposing_time_constant_s", "s", 0.1, 1e4, "dt", True),
        ),
        tuple(
            {Slot.SHARE: s, Slot.MODE_T: t}
            for s in (-0.01, -0.03, -0.1, -0.3, -0.8)
            for t in (0.3, 2.0, 8.0, 30.0)
        ),
    ),
    Row(
        "direction-asymmetry",
        "process",
        (Param(Slot.ASYMMETRY, "log_ratio_down_up", "", -4.0, 4.0),),
        each(Slot.ASYMMETRY, -0.3, 0.3),
    ),
    Row(
        "nonlinear-gain",
        "process",
        (Param(Slot.SLOPE, "gain_slope", "per 50 % PV", -1.9, 1.9, "1/pv"),),
        each(Slot.SLOPE, -0.15, 0.15),
        likeness=("valve-characteristic",),
    ),
    *(
        Row(
            "nonlinear-gain",
            "process",
            (Param(Slot.GAIN_SLOPE, "gain_slope", "per 50 % PV", -1.9, 1.9, "1/pv"),),
            each(Slot.GAIN_SLOPE, -0.15, 0.15),
            {Slot.SPEED: speed},
            variant=variant,
            likeness=("valve-characteristic",),
        )
        for speed, variant in ((0.0, "gain alone"), (-1.0, "faster with gain"))
    ),
    Row(
        "sqrt-outflow",
        "process",
        (Param(Slot.ROOT, "root", "", 0.05, 3.0),),
        each(Slot.ROOT, 0.3, 1.0),
        types=("level",),
        likeness=("nonlinear-gain",),
        penalty=-TIE,
    ),
    Row(
        "overflow",
        "process",
        (Param(Slot.CAP, "cap_pct", "% PV", 0.0, 1.0, "pvspan"),),
        each(Slot.CAP, 0.7, 0.85, 0.95),
        types=("level",),
    ),
    Row("integrator", "process", (), ({},), {Slot.LEAK: 0.0}, types=("level", "pressure")),
    Row(
        "flow-dependent-delay",
        "process",
        (Param(Slot.PIPE, "flow_share", "", -0.5, 3.0),),
        each(Slot.PIPE, 0.3, 1.0),
    ),
    Row(
        "gain-drift",
        "process",
        (Param(Slot.DRIFT, "gain_drift", "per record", -1.9, 1.9),),
        each(Slot.DRIFT, -0.2, 0.2),
    ),
)
