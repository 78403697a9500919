"""Known physics without a name in the catalogue. Where it explains a recording best, a text reports it with
`unexplained`, so that no name of the catalogue is used for it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from identification.mismatch import pictures
from identification.mismatch.catalogue import EFFECTS
from identification.mismatch.effect import Act, Block, Effect, Floats, Param, Signal, Slot, Variant, own_slot
from identification.mismatch.pictures import Axis, Drawing, Picture
from identification.simulation.lag import lagged
from identification.simulation.open_loop import gain_over_record, load
from identification.simulation.parameters import bring

HURRY, HURRY_T = own_slot("HURRY"), own_slot("HURRY_T", 1.0)
CHANGES, MEMORIES = (-0.1, 0.1), (8.0, 25.0)
"""Relative changes of gain per 10 % of PV at which its search begins, and memories, in time constants; ours: a
shorter memory than five is the vessel's own dynamics."""
HURRIED = (0.2, 0.6)
"""Duration below which a move counts as fast, at the start of the search, in time constants; ours."""
HURRY_DRAWN = 5.0
"""Length of its picture, in the same unit."""
RETURN_TIMES = tuple(0.8 * 1.12**i for i in range(25))
"""Recycle delays at which the search begins, in time constants; ours: a returning change is as wide as one."""
PLACES, BANDS = tuple(0.05 * i for i in range(2, 19)), (0.5, 3.0)
"""Positions at which a switch is searched, in the span of PV, and bands [% PV]; ours: a start converges from a
twentieth of the span away."""


def with_fast_moves(flow: Floats, c: Floats, dt_s: float) -> Floats:
    """Flow, shape (n,) [% OP], with the signed square of its difference to its own lag added."""
    ahead = flow - lagged(flow, float(c[HURRY_T]), dt_s)
    return flow + c[HURRY] * np.abs(ahead) * ahead / 10.0  # type: ignore[no-any-return]


def flow_after_step(d: Drawing) -> Picture:
    """Flow after a step of OP."""
    fine = HURRY_DRAWN * float(d.best[HURRY_T]) / pictures.POINTS
    time, op = pictures.drawn_step(pictures.step_size(d), pictures.POINTS, fine)
    axes = pictures.TIME, pictures.FLOW
    return pictures.with_baseline(d, "response", axes, time, lambda c: with_fast_moves(op, c, fine), op)


HISTORY = Effect(
    name="gain-with-history",
    block=Block.PROCESS,
    sentence="the process gain depends on PV's past over the last {recall_s}, by {recall} of it per 10 % PV",
    check="Find out what PV changes slowly in the process: coating, wetting, scale, a catalyst, a bed that fills.",
    curve=lambda d: pictures.gain_course(d, gain_over_record),
    variants=(
        Variant(
            (
                Param(Slot.RECALL, "recall", "", -5.0, 5.0, title="Gain per 10 % of PV"),
                Param(Slot.RECALL_T, "recall_s", "s", 5.0, 200.0, "T", True, title="Memory"),
                Param(Slot.HEAD_BIAS, "flow_at_rest_pct", "% OP", -60.0, 60.0, hidden=True),
            ),
            tuple({Slot.RECALL: size, Slot.RECALL_T: memory} for size in CHANGES for memory in MEMORIES),
        ),
    ),
)
RATE = Effect(
    name="gain-with-rate",
    block=Block.VALVE,
    sentence="fast moves have more effect: a sudden move of 10 % adds {hurry} times its size for {hurry_s}",
    check="Look for a booster, a relief port or a feed that overshoots, and compare fast and slow moves of OP.",
    acts=(Act(HURRY, 0.0, Signal.FLOW, with_fast_moves),),
    curve=flow_after_step,
    variants=(
        Variant(
            (
                Param(HURRY, "hurry", "", -20.0, 20.0, title="Extra of a move of 10 %"),
                Param(HURRY_T, "hurry_s", "s", 0.02, 3.0, "T", True, title="Lasts"),
            ),
            tuple({HURRY_T: lag} for lag in HURRIED),
            linear=HURRY,
        ),
    ),
)
RECYCLE = Effect(
    name="recycle",
    block=Block.PROCESS,
    sentence="{returned} of the outflow returns to the inlet after {returns_s}",
    check="Look for a circuit that brings material or heat back: white water, solvent, condensate, a recirculation.",
    curve=lambda d: pictures.course_picture(d, Axis("what comes back", "% OP"), load),
    variants=(
        Variant(
            (
                Param(Slot.RETURNED, "returned", "", -2.0, 2.0, title="Share that comes back"),
                Param(Slot.RETURNS_S, "returns_s", "s", 0.5, 20.0, "T", True, title="Return time"),
            ),
            tuple({Slot.RETURNS_S: time} for time in RETURN_TIMES),
            linear=Slot.RETURNED,
        ),
    ),
)
SWITCH = Effect(
    name="switched-load",
    block=Block.LOAD,
    sentence="a load of {switched_load_pct} switches on where PV passes {switches_at_pct}, off where it falls back",
    check="Look for a switch on PV: a thermostat, a float, a relief valve, a standby pump or fan.",
    curve=pictures.load_over_time,
    variants=(
        Variant(
            (
                Param(Slot.SWITCH, "switched_load_pct", "% OP", -60.0, 60.0, title="Switched load"),
                Param(Slot.SWITCH_AT, "switches_at_pct", "% PV", 0.0, 1.0, "pvspan", title="Switches at"),
                Param(Slot.SWITCH_BAND, "switch_band_pct", "% PV", 0.0, 50.0, title="Band of the switch"),
            ),
            tuple({Slot.SWITCH_AT: at, Slot.SWITCH_BAND: band} for at in PLACES for band in BANDS),
            linear=Slot.SWITCH,
        ),
    ),
)
OUTSIDE: Mapping[str, Effect] = {e.name: e for e in (HISTORY, RATE, RECYCLE, SWITCH)}
"""All of it by its internal name."""
bring(tuple(act for e in OUTSIDE.values() for act in e.acts))
COMPETING_EFFECTS: tuple[Variant, ...] = tuple(v for e in OUTSIDE.values() for v in e.candidates)
"""Candidates that compete with the catalogue and give no name."""


def about(name: str) -> Effect:
    """The effect with that name, in the catalogue or outside."""
    return EFFECTS[name] if name in EFFECTS else OUTSIDE[name]
