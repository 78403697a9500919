"""A load of up to three steps at the inlet of the process."""

from identification.mismatch.effect import SEARCH_PENALTY, Block, Effect, Param, Slot, Variant
from identification.mismatch.pictures import LOAD, Drawing, Picture, course_picture
from identification.simulation.open_loop import load
from identification.simulation.parameters import STEPS

FREE = tuple(
    Param(int(Slot.STEP) + i, f"size_{i + 1}_pct", "% OP", -50.0, 50.0, title=f"{which} load step")
    for i, which in enumerate(("First", "Second", "Third"))
)


def steps_over_time(d: Drawing) -> Picture:
    """The load, with its steps marked."""
    acting = [k for i, k in enumerate(d.inputs.step_at[:STEPS]) if d.best[int(Slot.STEP) + i] != 0]
    return course_picture(d, LOAD, load, places=tuple(float(k * d.inputs.dt_s) for k in acting))


EFFECT = Effect(
    name="load-step",
    block=Block.LOAD,
    sentence="A load came in as a step ({size}); neither OP nor SP caused it.",
    check="Find out what was switched at that time.",
    tests={
        "gain-drift": "A step of OP after the event: a load changes the bias, a drift changes the gain.",
        "controller-logic": "The controller's event log at that time.",
    },
    needs="steps",
    timed=True,
    spoken={"size": ("size_1_pct",)},
    curve=steps_over_time,
    variants=tuple(
        Variant(
            FREE[:count],
            (dict.fromkeys((p.slot for p in FREE[:count]), 0.0),),
            label=f"{count}",
            penalty=SEARCH_PENALTY * count,
        )
        for count in (1, 2, 3)
    ),
)
