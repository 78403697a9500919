"""One or two additional lags, between valve and process or in the transmitter; the data cannot distinguish these."""

from identification.mismatch.effect import Block, Effect, Param, Slot, Start, Variant, each
from identification.mismatch.pictures import pv_response

SECOND = Param(Slot.T2, "second_lag_s", "s", 0.1, 1e4, "dt", True, title="Second lag")
THIRD = Param(Slot.T3, "third_lag_s", "s", 0.1, 1e4, "dt", True)
BEGUN = Param(Slot.BEGUN, "begun_pct", "% PV", -300.0, 300.0, hidden=True)
LAGS = each(Slot.T2, 0.7, 1.5, 3.0, 6.0, 12.0, 25.0, 50.0, 100.0)
PAIRS: tuple[Start, ...] = tuple({Slot.T2: t, Slot.T3: 0.5 * t} for t in (1.5, 4.0, 12.0, 40.0))

EFFECT = Effect(
    name="second-lag",
    block=Block.PROCESS,
    sentence="The process has another lag of {second_lag_s}; transmitter damping would have the same effect.",
    check="Find out what is between valve and transmitter; look at the transmitter's damping.",
    tests={
        "sensor-lag": (
            "SP, PV and OP cannot distinguish them: use a separate gauge, or change the transmitter's "
            "damping; then only a sensor's lag changes."
        ),
        "inverse-response": "One clean step of OP in manual, sampled at a tenth of the lag or faster.",
        "slow-mode": "A step of OP held for five of the longer time constants.",
        "rate-limit": "A step of OP twice as large: a slewing valve takes twice as long, a lag does not.",
        "positioner": "A recorded stem position; or steps of OP of several sizes, because a lag scales.",
        "clock-offset": "Check whether OP responds before the recorded PV moves: then the two clocks differ.",
    },
    indistinguishable=("sensor-lag",),
    curve=lambda d: pv_response(d, faster=Slot.T2),
    variants=(
        Variant((SECOND,), LAGS, delays=(Slot.T2,)),
        Variant((SECOND, THIRD), PAIRS, label="and a third", delays=(Slot.T2, Slot.T3)),
        Variant((SECOND, BEGUN), LAGS, label="begun elsewhere", delays=(Slot.T2,), needs="experiment"),
    ),
)
