"""The catalogue's rows about the load."""

from __future__ import annotations

from identification.simulation.effect import Param, Row
from identification.simulation.parameters import Slot

LOAD = (
    *(
        Row(
            "load-step",
            "load",
            tuple(Param(int(Slot.STEP) + i, f"size_{i + 1}_pct", "% OP", -50.0, 50.0) for i in range(count)),
            (dict.fromkeys((int(Slot.STEP) + i for i in range(count)), 0.0),),
            needs="steps",
            variant=f"{count}",
            penalty=12.0 * count,
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
        penalty=-10.0,
    ),
)
