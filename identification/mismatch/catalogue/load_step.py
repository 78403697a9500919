"""Load that comes in as up to three steps at the process's inlet."""

from __future__ import annotations

from identification.mismatch.curves.course import course, load_over_time, over_record
from identification.mismatch.curves.drawn import Axis, Drawing, Shape
from identification.mismatch.effect import Block, Effect
from identification.simulation.effect import Param, Variant
from identification.simulation.parameters import STEPS, Slot

PLACE = 6.0
"""Log likelihood [nat] that the choice of a step's place costs; ours: the largest of many by chance."""
FREE = tuple(
    Param(int(Slot.STEP) + i, f"size_{i + 1}_pct", "% OP", -50.0, 50.0, title=title)
    for i, title in enumerate(("First load step", "Second load step", "Third load step"))
)


def steps_over_time(d: Drawing) -> Shape:
    """The load, with the places of its steps."""
    at = over_record(d.inputs)
    acting = [k for i, k in enumerate(d.inputs.step_at[:STEPS]) if d.best[int(Slot.STEP) + i] != 0]
    places = tuple(float(k * d.inputs.dt_s) for k in acting)
    return course(d, at, load_over_time(d, at), Axis("load at the inlet", "% OP"), places=places)


EFFECT = Effect(
    name="load-step",
    block=Block.LOAD,
    sentence="A load came in as a step ({size}); neither OP nor SP caused it.",
    check="Ask what was switched at that time.",
    tests={
        "gain-drift": "A step of OP after the event: a load moved the bias, a drift the gain.",
        "controller-logic": "The controller's event log at that time.",
    },
    needs="steps",
    timed=True,
    spoken={"size": ("size_1_pct",)},
    curve=steps_over_time,
    variants=(
        *(
            Variant(
                FREE[:count],
                (dict.fromkeys((p.slot for p in FREE[:count]), 0.0),),
                label=f"{count}",
                penalty=PLACE * count,
            )
            for count in (1, 2, 3)
        ),
    ),
)
