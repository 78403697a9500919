"""What a sign of a cause says: words for everybody, and figures for an expert."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from analyzer.loop.decisions import Cause, Sign, SignKind
from analyzer.words.units import duration

Told = tuple[str, str]
"""Words for everybody, and figures for an expert, '' where the words hold them."""


def sign_parts(sign: Sign) -> Told:
    """A sign in words and figures."""
    said = SAYS[sign.kind](*sign.figures)
    return (said, "") if isinstance(said, str) else said


def sign_text(sign: Sign) -> str:
    """A sign in words alone."""
    return sign_parts(sign)[0]


def sign_in_full(sign: Sign) -> str:
    """Words and figures in one."""
    text, figures = sign_parts(sign)
    return f"{text} ({figures})" if figures else text


def as_stored(sign: Sign) -> dict[str, Any]:
    """A sign as the store keeps it; one that rests on none of the measures that are weighed has no name."""
    text, figures = sign_parts(sign)
    name = "" if sign.kind in UNNAMED else sign.kind
    told = {"points_to": sign.points_to, "strength": sign.strength}
    return told | {"text": text, "name": name, "figures": figures}


def _evidence_says(evidence: float, agreeing: float = 0.0, count: int | None = None) -> Told:
    """How a faulty valve explains PV against an ideal one."""
    if evidence <= 0:
        return "play or stick-slip explains PV no better than an ideal valve", ""
    where = "" if count is None else f", in {100 * agreeing:.0f} % of {count} stretches between turns of OP"
    return (
        f"play or stick-slip explains PV better than an ideal valve{where}",
        f"log likelihood +{evidence:.0f}",
    )


def _width_says(evidence: float, size: float) -> str:
    if evidence <= 0:
        return "no play or stick-slip is seen in PV"
    return f"the fault that fits best is {100 * size:.0f} % of OP's range wide"


def _load_left_says(linear: float, valve: float) -> Told:
    plain = f"the load that is left has {'a' if linear >= 1.0 else 'no'} peak at the period"
    return plain, f"prominence {linear:.1f}, behind a faulty valve {valve:.1f}"


def _amplification_says(*known: float | None) -> str:
    if not known:
        return "the identified loop is unstable"
    (s,) = known
    if s is None:
        return "how the loop amplifies at the period is not known, for want of its settings"
    verb, times = ("amplifies", s) if s > 1.0 else ("weakens", 1.0 / max(s, 1e-3))
    return f"at the period the loop {verb} load {times:.1f} times"


def _loop_gain_says(gain: float | None = None) -> str:
    if gain is None:
        return "the gain of process and controller together is not known, for want of settings"
    return f"process and controller together have a gain of {gain:.2g}"


def _process_says(consistency: float) -> Told:
    figures = f"{consistency:.1f} times its gain"
    if consistency >= 0.5:
        return "outside the period's band the same process is seen", figures
    return "away from the period another process is seen", figures


def _wave_left_says(left: float) -> str:
    if not left:
        return "a faulty valve leaves few harmonics of the cycle unexplained"
    return f"a faulty valve leaves harmonics of {100 * left:.0f} % of the cycle unexplained"


def _regularity_says(kurtosis: float, third: float) -> Told:
    size, rhythm = kurtosis < 2.0, third >= 0.5
    figures = f"kurtosis {kurtosis:.1f}, noise has 3; rhythm {third:.1f}"
    if size == rhythm:
        return f"the cycle {'keeps' if size else 'changes'} its size and its rhythm", figures
    kept, changed = ("size", "rhythm") if size else ("rhythm", "size")
    return f"the cycle keeps its {kept} and changes its {changed}", figures


def _limits_says(saturated: float) -> str:
    share = 100 * saturated
    return f"OP is at a limit {share:.0f} % of the time" if share >= 1 else "OP stays off its limits"


def _dead_time_says(period_s: float, dead_time_s: float) -> str:
    if period_s > 50 * dead_time_s:
        return "the period is long against the dead time"
    return f"the period is {period_s / dead_time_s:.0f} dead times"


def later(lag_s: float | None) -> str:
    """How much later a loop moves than the one that it follows."""
    return f" {duration(abs(lag_s))} later" if lag_s is not None and lag_s > 0 else ""


def _follows_says(loop: str, lag_s: float | None, coherence: float) -> str:
    start = f"where the oscillation seems to start (coherence {coherence:.2f})"
    return f"moves with {loop}{later(lag_s)}, {start}"


def of_below(loop: str, cause: str | None, tie: str) -> str:
    """What a loop's output hangs on: one that has a fault, or answers as a faulty valve would."""
    what = {Cause.VALVE: "valve is at fault", Cause.TUNING: "tuning is too tight"}.get(
        Cause(cause or Cause.NONE)
    )
    told = f"whose {what}" if what else "which answers as a faulty valve would"
    moves = "moves" if tie == "split" else "is the set point of"
    return f"its output {moves} {loop}, {told}"


def _of_above_says(loop: str, tie: str) -> str:
    brings = {"master": "its set point is the output", "split": "it is moved by the output"}.get(
        tie, "its set point is in a ratio to the PV"
    )
    return f"{brings} of {loop}, which cycles"


SAYS: Mapping[SignKind, Callable[..., Told | str]] = {
    SignKind.EVIDENCE: _evidence_says,
    SignKind.WIDTH: _width_says,
    SignKind.LOAD_LEFT: _load_left_says,
    SignKind.AMPLIFICATION: _amplification_says,
    SignKind.LOOP_GAIN: _loop_gain_says,
    SignKind.PROCESS: _process_says,
    SignKind.HARMONIC: lambda third: f"the wave has a phase-locked third harmonic of {100 * third:.0f} %",
    SignKind.WAVE_LEFT: _wave_left_says,
    SignKind.REGULARITY: _regularity_says,
    SignKind.LIMITS: _limits_says,
    SignKind.DEAD_TIME: _dead_time_says,
    SignKind.CALM_EVIDENCE: _evidence_says,
    SignKind.CALM_WIDTH: lambda size: f"its width is {100 * size:.0f} % of OP's range",
    SignKind.AGAIN: lambda: "stretch after stretch between moves of the stem says so",
    SignKind.DEAD_VALVE: lambda wound: f"OP winds over {wound:.0f} % while PV stands still off the set point",
    SignKind.FOLLOWS: _follows_says,
    SignKind.OF_BELOW: of_below,
    SignKind.OF_ABOVE: _of_above_says,
}
"""What each sign says, of its figures."""
UNNAMED = (
    *(SignKind.CALM_EVIDENCE, SignKind.CALM_WIDTH, SignKind.AGAIN, SignKind.DEAD_VALVE),
    *(SignKind.FOLLOWS, SignKind.OF_BELOW, SignKind.OF_ABOVE),
)
"""Signs that no measure is named for."""
