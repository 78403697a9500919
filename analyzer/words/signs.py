"""What a sign of a cause says: words for everybody, and figures for an expert; texts.toml has the sentences, and here
is which of them a sign's figures ask for."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from analyzer.loop.decisions import Cause, Sign, SignKind
from analyzer.words import sentences
from analyzer.words.units import duration

Told = tuple[str, str]
"""Words for everybody, and figures for an expert, '' where the words hold them."""
Chosen = tuple[Any, ...]
"""A sentence of texts.toml by its name, and the figures that it is filled with."""


def sign_parts(sign: Sign) -> Told:
    """A sign in words and figures."""
    which, *figures = SAYS[sign.kind](*sign.figures)
    said, shown = sentences("signs")[which], sentences("figures_of_signs").get(which, "")
    return said.format(*figures), shown.format(*figures)


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


def _evidence(nat: float, agreeing: float = 0.0, count: int | None = None) -> Chosen:
    """How a faulty valve explains PV against an ideal one."""
    if nat <= 0:
        return ("no_evidence",)
    return "evidence" if count is None else "evidence_in_stretches", nat, 100 * agreeing, count


def _amplification(*known: float | None) -> Chosen:
    if not known:
        return ("unstable",)
    (s,) = known
    if s is None:
        return ("no_amplification",)
    return ("amplifies", s) if s > 1.0 else ("weakens", 1.0 / max(s, 1e-3))


def _regularity(kurtosis: float, third: float) -> Chosen:
    size, rhythm = kurtosis < 2.0, third >= 0.5
    if size == rhythm:
        how = f"{'keeps' if size else 'changes'} its size and its rhythm"
    else:
        how = "keeps its size and changes its rhythm" if size else "keeps its rhythm and changes its size"
    return "regularity", kurtosis, third, how


def later(lag_s: float | None) -> str:
    """How much later a loop moves than the one that it follows."""
    return f" {duration(abs(lag_s))} later" if lag_s is not None and lag_s > 0 else ""


def _of_below(loop: str, cause: str | None, tie: str) -> Chosen:
    """What a loop's output hangs on: one that has a fault, or answers as a faulty valve would."""
    own = cause if cause in (Cause.VALVE, Cause.TUNING) else "no"
    return f"below_of_{own}_fault", "moves" if tie == "split" else "is the set point of", loop


SAYS: Mapping[SignKind, Callable[..., Chosen]] = {
    SignKind.EVIDENCE: _evidence,
    SignKind.WIDTH: lambda nat, size: ("no_width" if nat <= 0 else "width", 100 * size),
    SignKind.LOAD_LEFT: lambda plain, valve: ("load_left" if plain >= 1.0 else "no_load_left", plain, valve),
    SignKind.AMPLIFICATION: _amplification,
    SignKind.LOOP_GAIN: lambda gain=None: ("no_loop_gain" if gain is None else "loop_gain", gain),
    SignKind.PROCESS: lambda share: ("same_process" if share >= 0.5 else "another_process", share),
    SignKind.HARMONIC: lambda third: ("harmonic", 100 * third),
    SignKind.WAVE_LEFT: lambda left: ("wave_left" if left else "no_wave_left", 100 * left),
    SignKind.REGULARITY: _regularity,
    SignKind.LIMITS: lambda share: ("at_limits" if 100 * share >= 1 else "off_limits", 100 * share),
    SignKind.DEAD_TIME: lambda period_s, dead_s: (
        ("long_period",) if period_s > 50 * dead_s else ("dead_times", period_s / dead_s)
    ),
    SignKind.CALM_EVIDENCE: _evidence,
    SignKind.CALM_WIDTH: lambda size: ("calm_width", 100 * size),
    SignKind.AGAIN: lambda: ("again",),
    SignKind.DEAD_VALVE: lambda wound: ("dead_valve", wound),
    SignKind.FOLLOWS: lambda loop, lag_s, coherence: ("follows", loop, later(lag_s), coherence),
    SignKind.OF_BELOW: _of_below,
    SignKind.OF_ABOVE: lambda loop, tie: (f"above_by_{tie}", loop),
}
"""Which sentence a sign takes, by its figures, and what is filled into it."""
UNNAMED = (
    *(SignKind.CALM_EVIDENCE, SignKind.CALM_WIDTH, SignKind.AGAIN, SignKind.DEAD_VALVE),
    *(SignKind.FOLLOWS, SignKind.OF_BELOW, SignKind.OF_ABOVE),
)
"""Signs that no measure is named for."""
