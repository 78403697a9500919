"""The catalogue's rows about the valve."""

from __future__ import annotations

from identification.simulation.effect import Param, Row, each
from identification.simulation.parameters import Slot

WIDTH = Param(Slot.STICKBAND, "backlash_pct", "% OP", 1e-4, 2.0, "op", True)
BAND = Param(Slot.STICKBAND, "stickband_pct", "% OP", 1e-4, 2.0, "op", True)
JUMP = Param(Slot.JUMP, "slip_jump_pct", "% OP", 1e-5, 2.0, "op", True)

SPLIT = (
    Param(Slot.SPLIT, "split_pct", "% OP", 0.0, 1.0, "opspan"),
    Param(Slot.RATIO, "gain_ratio", "", -5.0, 5.0),
    Param(Slot.SPLIT_DEAD, "dead_zone_pct", "% OP", 0.0, 0.5, "op"),
    Param(Slot.SPLIT_LAG, "second_valve_lag_s", "s", 0.001, 3.0, "T", True),
)

VALVE = (
    Row("backlash", "valve", (WIDTH,), each(Slot.STICKBAND, 0.01, 0.03, 0.08, 0.2, 0.5), {Slot.JUMP: 0.0}),
    *(
        Row(
            "stiction",
            "valve",
            (BAND, JUMP),
            tuple(
                {Slot.STICKBAND: s, Slot.JUMP: j * s}
                for s in (0.01, 0.03, 0.08, 0.2, 0.5)
                for j in (0.4, 0.8)
            ),
            {Slot.COAST: coast},
            variant=variant,
            likeness=("positioner",),
        )
        for coast, variant in ((-1.0, "rests"), (-0.5, "halts"), (0.0, "slides"))
    ),
    Row(
        "rate-limit",
        "valve",
        (Param(Slot.RATE, "rate_pct_per_s", "%/s", 1e-3, 10.0, "op/dt", True),),
        each(Slot.RATE, 0.005, 0.02, 0.08, 0.3, 1.0),
    ),
    Row(
        "saturation",
        "valve",
        (Param(Slot.STOP_HI, "limit_pct", "% OP", 0.0, 1.0, "opspan"),),
        each(Slot.STOP_HI, 0.6, 0.75, 0.9),
    ),
    Row(
        "saturation",
        "valve",
        (Param(Slot.STOP_LO, "low_limit_pct", "% OP", 0.0, 1.0, "opspan"),),
        each(Slot.STOP_LO, 0.4, 0.25, 0.1),
        variant="low",
    ),
    Row(
        "valve-characteristic",
        "valve",
        (Param(Slot.BEND, "curve", "ln gain per 100 % OP", -6.0, 6.0, "1/op"),),
        each(Slot.BEND, -0.3, 0.3),
        likeness=("nonlinear-gain",),
    ),
    Row(
        "positioner",
        "valve",
        (
            Param(Slot.SERVO, "positioner_lag_s", "s", 0.2, 200.0, "dt", True),
            Param(Slot.DAMPING, "damping", "", 0.1, 1.2),
            Param(Slot.DEADBAND, "deadband_pct", "% OP", 0.0, 0.5, "op"),
        ),
        tuple(
            {Slot.SERVO: w, Slot.DAMPING: 0.45, Slot.DEADBAND: d}
            for w in (0.5, 2.0, 8.0)
            for d in (0.02, 0.08)
        ),
        likeness=("stiction",),
        delays=(Slot.SERVO,),
    ),
    *(
        Row(
            "split-range",
            "valve",
            SPLIT[:count],
            tuple(
                {Slot.SPLIT: s, Slot.RATIO: r, Slot.SPLIT_DEAD: d, Slot.SPLIT_LAG: 0.1}
                for s in (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)
                for r in (0.5, 0.8, 1.25, 2.0)
                for d in (0.005, 0.03)
            ),
            variant=variant,
        )
        for count, variant in ((3, ""), (4, "with a lag"))
    ),
)
