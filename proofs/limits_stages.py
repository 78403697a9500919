"""The stages that limits act on, run on the samples of limits_samples.py; each returns its answers as a list."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from analyzer.comparison.before_after import compare, grade
from analyzer.comparison.before_after import follows as source_of
from analyzer.comparison.measures import Span
from analyzer.config import Config
from analyzer.loop.advice.advise import advise
from analyzer.loop.assess import assess, cause_of, verdict_by_measures
from analyzer.loop.cause.dead_valve import dead_valve
from analyzer.loop.cause.fitness import at_limits
from analyzer.loop.decisions import Finding, OscillationFigures, SignKind, Status
from analyzer.loop.oscillation.detection import counting, detect, subthreshold_period
from analyzer.loop.oscillation.figures import assess_span
from analyzer.loop.record.judged_stretch import differing
from analyzer.loop.record.quality import prepare
from analyzer.loops.changes import behaviour_change
from analyzer.plantwide.night import followers_of, following, likely, swing_of, trace
from analyzer.plantwide.oscillation_lines import error_lines_of
from identification.models import Backlash, Fopdt, Loop, Pid, Stiction
from identification.record import LoopRecord
from proofs.limits_samples import (
    ADVISED,
    DEFAULT,
    OF_FITS,
    REFITTED,
    SETTINGS,
    START_S,
    UNFIT,
    Raw,
    advised,
    detected,
    measured,
    nothing,
    plants,
    raws,
    ready,
    tried,
    weeks,
    wound,
)
from proofs.limits_sealed import of_controller, of_recorder
from proofs.plant import prepared, series, simulate, spec
from proofs.valve_loops import corners
from tuning.recommend import recommend


def of_quality(c: Config) -> list[Any]:
    """Length, masked samples and remarks of each loop."""

    def answer(r: Raw) -> Any:
        p = prepare(r.spec, r.series, c.quality)
        masked = (int(p.record.bad.sum()), int(p.record.mask("saturated").sum()))
        confidences = (p.op_known, p.notes, at_limits(p.record, c.quality) is not None)
        return len(p.record), masked, *confidences, round(p.compressed_share, 6)

    def unfit(r: Raw) -> Any:
        found = tried(lambda: assess(prepare(r.spec, r.series, c.quality), None, c).verdict.needs)
        return str(found)

    return [(tried(lambda r=r: answer(r)), unfit(r) if k < UNFIT else "") for k, r in enumerate(raws())]


def of_oscillation(c: Config) -> list[Any]:
    """Periods and shares of each loop, the same for records in which nothing oscillates, and cycles too fast to
    detect."""

    def answer(r: LoopRecord) -> Any:
        found = detect(r, c.oscillation)
        fast = subthreshold_period(found, c.oscillation)
        shares = ((round(o.period_s, 2), round(o.oscillating_pct)) for o in found.found)
        return *shares, None if fast is None else round(fast, 2)

    return [answer(r) for r in (*(p.record for _, p in ready()), *nothing())]


def _answer_of(v: Any) -> Any:
    """A verdict as an answer."""
    return (
        v
        if isinstance(v, str)
        else (v.cause, v.fault, str(v.needs), *(round(x) for x in v.confidence.values()))
    )


def of_cause(c: Config) -> list[Any]:
    """Cause, fault, needs and confidences: of all loops from their measures, or of a few loops fitted again."""
    if all(getattr(c.cause, n) == getattr(DEFAULT.cause, n) for n in OF_FITS) and c is not DEFAULT:
        dead = [dead_valve(r, c.cause) is not None for r in wound()]
        return [*dead, *(_answer_of(verdict_by_measures(m, p, counting(f), c)) for p, f, m in measured())]
    busy = sorted(detected(), key=lambda t: counting(t[2]) is None)[:REFITTED]
    return [_answer_of(tried(lambda t=t: cause_of(t[1], t[2], t[0].stated, c, t[0].spec.type))) for t in busy]


def of_settings(c: Config) -> list[Any]:
    """Whether stated settings are reported as wrong, for right and wrong ones."""
    out = []
    for r, p, f in detected()[:SETTINGS]:
        first = counting(f)
        scale = first.period_s if first is not None else 20.0 * p.record.dt_s
        for k in (1.0, 1.3, 1.6):
            stated = replace(r.stated, kp=k * r.stated.kp, ti_s=r.stated.ti_s * (2.0 if k > 1.5 else 1.0))
            out.append(differing(p.record, stated, scale, c.settings) is not None)
    return out


def of_advice(c: Config) -> list[Any]:
    """Action and settings for the simulated loops, from whole records and as hints."""
    out = []
    for sketch, found in advised():
        own = spec("L", sketch.kind, kp=sketch.kp, ti=sketch.ti)
        a = advise(found, own, sketch.controller, 100.0, c)
        out.append((a.action, a.kp_new, a.ti_new))
    sketch = ADVISED[1]
    for hours in (0.9, 1.1, 1.7, 2.1):
        made = tried(lambda h=hours: assess(prepared(simulate(sketch, h)), sketch.controller, c))
        out.append(
            made if isinstance(made, str) else tuple(round(x) for x in made.verdict.confidence.values())
        )
    for s in ADVISED:
        valve = Stiction(s.stickband, s.slip_jump) if s.stickband else Backlash(s.backlash)
        loop = Loop(Fopdt(s.process[0], s.process[1], s.process[2]), s.controller, valve)
        found = recommend(loop, s.cause, corners(loop), limits=c.tuning)
        out.append((found.action, found.controller))
    out += [_is_hidden(dt_s, c) for dt_s in range(8, 40, 2)]
    return out


def _is_hidden(dt_s: int, c: Config) -> bool:
    """Whether a loop with an integral time of 20 s is reported as recorded too coarsely at an interval [s]."""
    steady = simulate(replace(ADVISED[4], stickband=0.0, slip_jump=0.0, ti=20.0), 6.0)
    stamp = START_S + np.arange(0.0, steady.pv.size, dt_s)
    trends = {
        f"L.{name.upper()}": series(stamp, getattr(steady, name)[::dt_s]) for name in ("sp", "pv", "op")
    }
    made = prepare(spec("L"), trends, c.quality)
    return assess(made, Pid(0.1, 20.0), c).needs is not None


def of_plant(c: Config) -> list[Any]:
    """Groups, sources and followers of coupled plants, and the answer for each follower."""
    out: list[Any] = []
    for loops in plants():
        by_name = {x.name: x for x in loops}
        oscillations = [w for x in loops for w in error_lines_of(x.name, x.found, x.end_s, c.plant)]
        traced = trace(oscillations, {x.name: x.peer for x in loops}, c.plant)
        out += [(t.group.loops, t.source, tuple(likely(t, c.plant))) for t in traced]
        for loop, (source, oscillation) in sorted(followers_of(traced).items()):
            first = counting(by_name[loop].found)
            swing = OscillationFigures(0.0, first.oscillating_pct) if first else OscillationFigures()
            own, known = by_name[loop].confidence, {"usable_h": 8.0}
            alone = Finding(loop, "", Status.OK, swing=swing, confidence=own, known=known)
            sure = following(alone, source, swing, (SignKind.FOLLOWS, ()), c.plant).confidence
            shown = swing_of(alone, source, oscillation, c.plant) != swing
            confidences = {k: round(v) for k, v in sure.items()}
            out.append((loop, source.loop, confidences, c.plant.follower_sign, shown))
    return out


def of_figures(c: Config) -> list[Any]:
    """Figures of each loop, to three digits."""
    found = (assess_span(p.record, c.figures).as_row() for _, p in ready())
    return [tuple(None if v is None else f"{v:.3g}" for v in f.values()) for f in found]


def of_weeks(c: Config) -> list[Any]:
    """Verdicts and reasons of comparisons."""
    change = START_S + 7 * 86_400.0
    before, after = Span(START_S, change), Span(change, START_S + 14 * 86_400.0)
    out = []
    for hours in weeks():
        found = compare("L", hours, before, after, limits=c.before_after)
        out.append((found.reasons, grade(found), tuple((x.measure.name, x.verdict) for x in found.changes)))
    for named in range(1, 10):
        out.append(source_of(["A"] * named + [None] * (10 - named), [True] * 10, c.before_after))
    return out


def of_changes(c: Config) -> list[Any]:
    """Whether a step in the behaviour of a controller is detected."""
    out = []
    for seed, hours in enumerate(weeks()):
        rng = np.random.default_rng(seed)
        travel = hours["valve_travel_pct_per_h"]
        later = np.arange(travel.size) >= 24 * rng.uniform(1.0, 13.0)
        hours = {**hours, "valve_travel_pct_per_h": travel * np.exp(later * rng.uniform(-1.0, 1.0))}
        out.append(tried(lambda h=hours: behaviour_change("L", h, c)) is not None)
    return out


STAGES: dict[str, Callable[[Config], list[Any]]] = {
    "oscillation": of_oscillation,
    "quality": of_quality,
    "cause": of_cause,
    "plant": of_plant,
    "settings": of_settings,
    "advice": of_advice,
    "tuning": of_advice,
    "figures": of_figures,
    "before_after": of_weeks,
    "changes": of_changes,
    "explain_recorder": of_recorder,
    "explain_controller": of_controller,
}
"""Sections of the limits, and the function that runs the stage of each."""
