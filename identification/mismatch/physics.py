"""The catalogue: each row a small model in constants of the loop model, with starts, bounds and look-alikes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from identification.mismatch.slots import Slot


@dataclass(frozen=True, slots=True)
class Param:
    """A constant that a row frees.

    slot : its place; name, unit : as answered; low, high : bounds in its own unit, times the scale named by
    `scale` (scales() in fitting.py); log : searched by its logarithm.
    """

    slot: int
    name: str
    unit: str
    low: float
    high: float
    scale: str = "1"
    log: bool = False


Start = Mapping[int, float]


@dataclass(frozen=True, slots=True)
class Row:
    """One piece of physics as a rival: its name, block, constants, and starts in units of their scales.

    delays : constants whose start is taken off the dead time, which stood for them in the plain loop.
    types : loop types that can have it, any where empty or the type is not known.
    fixed : constants set, not searched; needs : what the record must hold (steps, neighbour) for it to be tried.
    """

    name: str
    block: str
    params: tuple[Param, ...]
    starts: tuple[Start, ...]
    fixed: Start | None = None
    needs: str = ""
    variant: str = ""
    types: tuple[str, ...] = ()
    likeness: tuple[str, ...] = ()
    delays: tuple[int, ...] = ()
    price: float = 0.0


def _each(slot: int, *values: float) -> tuple[Start, ...]:
    return tuple({int(slot): v} for v in values)


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
    Row("backlash", "valve", (WIDTH,), _each(Slot.STICKBAND, 0.01, 0.03, 0.08, 0.2, 0.5), {Slot.JUMP: 0.0}),
    Row(
        "stiction",
        "valve",
        (BAND, JUMP),
        tuple(
            {Slot.STICKBAND: s, Slot.JUMP: j * s} for s in (0.01, 0.03, 0.08, 0.2, 0.5) for j in (0.4, 0.8)
        ),
        {Slot.COAST: -1.0},
        likeness=("positioner",),
    ),
    Row(
        "stiction",
        "valve",
        (BAND, JUMP),
        tuple(
            {Slot.STICKBAND: s, Slot.JUMP: j * s} for s in (0.01, 0.03, 0.08, 0.2, 0.5) for j in (0.4, 0.8)
        ),
        {Slot.COAST: 0.0},
        variant="slides",
        likeness=("positioner",),
    ),
    Row(
        "rate-limit",
        "valve",
        (Param(Slot.RATE, "rate_pct_per_s", "%/s", 1e-3, 10.0, "op/dt", True),),
        _each(Slot.RATE, 0.005, 0.02, 0.08, 0.3, 1.0),
    ),
    Row(
        "saturation",
        "valve",
        (Param(Slot.STOP_HI, "limit_pct", "% OP", 0.0, 1.0, "opspan"),),
        _each(Slot.STOP_HI, 0.6, 0.75, 0.9),
    ),
    Row(
        "saturation",
        "valve",
        (Param(Slot.STOP_LO, "low_limit_pct", "% OP", 0.0, 1.0, "opspan"),),
        _each(Slot.STOP_LO, 0.4, 0.25, 0.1),
        variant="low",
    ),
    Row(
        "valve-characteristic",
        "valve",
        (Param(Slot.BEND, "curve", "ln gain per 100 % OP", -6.0, 6.0, "1/op"),),
        _each(Slot.BEND, -0.3, 0.3),
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
PROCESS = (
    Row(
        "second-lag",
        "process",
        (Param(Slot.T2, "second_lag_s", "s", 0.1, 1e4, "dt", True),),
        _each(Slot.T2, 0.7, 1.5, 3.0, 6.0, 12.0, 25.0, 50.0, 100.0),
        likeness=("sensor-lag",),
        delays=(Slot.T2,),
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
        _each(Slot.ASYMMETRY, -0.3, 0.3),
    ),
    Row(
        "nonlinear-gain",
        "process",
        (Param(Slot.SLOPE, "gain_slope", "per 50 % PV", -1.9, 1.9, "1/pv"),),
        _each(Slot.SLOPE, -0.15, 0.15),
        likeness=("valve-characteristic",),
    ),
    *(
        Row(
            "nonlinear-gain",
            "process",
            (Param(Slot.GAIN_SLOPE, "gain_slope", "per 50 % PV", -1.9, 1.9, "1/pv"),),
            _each(Slot.GAIN_SLOPE, -0.15, 0.15),
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
        _each(Slot.ROOT, 0.3, 1.0),
        types=("level",),
    ),
    Row(
        "overflow",
        "process",
        (Param(Slot.CAP, "cap_pct", "% PV", 0.0, 1.0, "pvspan"),),
        _each(Slot.CAP, 0.7, 0.85, 0.95),
        types=("level",),
    ),
    Row("integrator", "process", (), ({},), {Slot.LEAK: 0.0}, types=("level", "pressure")),
    Row(
        "flow-dependent-delay",
        "process",
        (Param(Slot.PIPE, "flow_share", "", -0.5, 3.0),),
        _each(Slot.PIPE, 0.3, 1.0),
    ),
    Row(
        "gain-drift",
        "process",
        (Param(Slot.DRIFT, "gain_drift", "per record", -1.9, 1.9),),
        _each(Slot.DRIFT, -0.2, 0.2),
    ),
)
LOAD = (
    *(
        Row(
            "load-step",
            "load",
            tuple(Param(int(Slot.STEP) + i, f"size_{i + 1}_pct", "% OP", -50.0, 50.0) for i in range(count)),
            (dict.fromkeys((int(Slot.STEP) + i for i in range(count)), 0.0),),
            needs="steps",
            variant=f"{count}",
            price=6.0 * count,
        )
        for count in (1, 2, 3)
    ),
    Row(
        "load-oscillation",
        "load",
        (
            Param(Slot.SINE, "sine_pct", "% OP", -30.0, 30.0),
            Param(Slot.COSINE, "cosine_pct", "% OP", -30.0, 30.0),
            Param(Slot.OMEGA, "angular_frequency", "rad/s", 0.0, 10.0),
        ),
        ({Slot.SINE: 0.0, Slot.COSINE: 0.0},),
        needs="line",
    ),
    Row(
        "coupling",
        "load",
        (
            Param(Slot.NEIGHBOUR, "coupling_gain", "% OP per % OP", -20.0, 20.0),
            Param(Slot.NEIGHBOUR_T, "coupling_lag_s", "s", 0.02, 20.0, "T", True),
        ),
        ({Slot.NEIGHBOUR: 0.0, Slot.NEIGHBOUR_T: 0.3}, {Slot.NEIGHBOUR: 0.0, Slot.NEIGHBOUR_T: 2.0}),
        needs="neighbour",
    ),
    Row(
        "supply-variation",
        "load",
        (
            Param(Slot.HEAD_BIAS, "flow_at_rest_pct", "% OP", -60.0, 60.0),
            *(Param(int(Slot.HEAD) + i, f"head_{i + 1}", "", -2.0, 2.0) for i in range(12)),
        ),
        ({Slot.HEAD_BIAS: 8.0},),
        price=-10.0,
    ),
)
CATALOGUE = (*VALVE, *PROCESS, *LOAD)
