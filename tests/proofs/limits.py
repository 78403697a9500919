"""What each number that decides something does when it is moved by a fifth: python -m tests.proofs.limits [--jobs 2]

Every limit of `triage config` is moved down and up by 20 % (whole numbers by one at least, the ends of its range
kept), and the stage that it belongs to is asked again: quality, oscillation and figures of 30 untidy loops
(tests/untidy), the causes of 12 of them, settings of 12 that are stated wrong by half, advice on 10 simulated
loops, groups of two coupled plants (tests/coupled), twelve comparisons of weeks. A limit that no answer notices is
listed. Sections of resources and of how nights are cut (workers, opening, nights) decide no finding and are left
out. Writes tests/proofs/limits.md.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from multiprocessing import Pool
from pathlib import Path
from typing import Any

import numpy as np

from analyzer.advice import advise
from analyzer.assess import Assessment, assess, cause_of
from analyzer.assessments import assess_span
from analyzer.before_after import Span, compare
from analyzer.config import Config
from analyzer.decisions import Cause
from analyzer.history.series import Series
from analyzer.loops.changes import behaviour_change
from analyzer.loops.spec import LoopSpec
from analyzer.oscillation import Oscillations, counting, detect
from analyzer.plantwide.source import Peer
from analyzer.plantwide.verdict import followers_of, trace
from analyzer.plantwide.wave import waves_of
from analyzer.quality import Prepared, prepare
from analyzer.settings_check import differing
from identification.errors import TriageError
from identification.models import Pid
from tests.analyzer.plant import Sketch, prepared, simulate, spec
from tests.coupled.draw import draw as draw_plant
from tests.untidy.draw import draw
from tuning.declare import KEY, Limit

OUT = Path(__file__).with_suffix(".md")
STEP = 0.2
LOOPS, MOST = 30, 12_000
"""Untidy loops, and samples of each at most."""
CAUSES, UNFIT, SETTINGS = 12, 8, 12
"""Of how many of them the cause is asked, whether it can be told at all, and whether settings are wrong."""
START_S = 1_772_409_600.0
ADVISED = (
    Sketch("valve", (40.0, 1200.0, 8.0), 0.8, 100.0, backlash=0.8, load_std=0.1),
    Sketch("valve", (60.0, 1800.0, 9.0), 0.9, 40.0, backlash=2.5),
    Sketch("valve", (2.4, 600.0, 18.0), 3.6, 90.0, backlash=4.0, noise=0.02, load_std=0.3),
    Sketch("valve", (1.2, 8.0, 3.0), 0.4, 20.0, stickband=4.0, slip_jump=3.0, noise=0.08, kind="flow"),
    Sketch("valve", (1.5, 40.0, 8.0), 0.8, 40.0, stickband=3.0, slip_jump=1.5),
    Sketch("valve", (1.5, 400.0, 20.0), 2.0, 150.0, stickband=3.0, slip_jump=1.0),
    Sketch("tuning", (1.2, 260.0, 40.0), 7.8, 170.0, noise=0.03, load_std=0.6, load_s=300.0),
    Sketch("tuning", (1.5, 120.0, 20.0), 4.6, 60.0, noise=0.03, load_std=0.6, load_s=300.0),
    Sketch("tuning", (1.5, 90.0, 10.0), 5.5, 40.0, noise=0.05, load_std=0.6, load_s=300.0),
    Sketch("load", (1.4, 90.0, 10.0), 0.8, 120.0, load_std=0.3, sine=3.0, sine_s=840.0),
)
DEFAULT = Config()


@dataclass(frozen=True)
class Raw:
    """A loop as read."""

    spec: LoopSpec
    series: dict[str, Series]
    stated: Pid | None


@cache
def raws() -> tuple[Raw, ...]:
    """Untidy loops, half of them with gaps, a frozen PV or an OP that stands still."""
    out = []
    for seed in range(700_000, 700_000 + 40 * LOOPS):
        drawn = draw(seed)
        if not 600 <= drawn.pv.size <= MOST:
            continue
        rng = np.random.default_rng(seed)
        stamp = START_S + drawn.step_s * np.arange(drawn.pv.size)
        bad = np.zeros(stamp.size, dtype=bool)
        pv, op = drawn.pv.copy(), drawn.op.copy()
        part = slice(int(0.3 * pv.size), int((0.3 + rng.uniform(0.02, 0.5)) * pv.size))
        match len(out) % 6:
            case 0:
                pv[part] = pv[part.start]
            case 1:
                op[part] = op[part.start]
            case 2:
                bad[rng.random(pv.size) < rng.uniform(0.02, 0.6)] = True
        series = {f"L.{n}": Series(stamp, x, bad) for n, x in (("PV", pv), ("OP", op), ("SP", drawn.sp))}
        own = LoopSpec("L", type=drawn.kind, pv="L.PV", op="L.OP", sp="L.SP", pv_lo=0.0, pv_hi=100.0)
        out.append(Raw(own, series, Pid(drawn.plant.kp, drawn.plant.ti, scan_s=1.0)))
        if len(out) == LOOPS:
            break
    return tuple(out)


def tried(task: Callable[[], Any]) -> Any:
    """What a task gives, or the words of its refusal."""
    try:
        return task()
    except TriageError as error:
        return str(error)


@cache
def ready() -> tuple[tuple[Raw, Prepared], ...]:
    """The loops that prepare well by the defaults."""
    found = ((r, tried(lambda r=r: prepare(r.spec, r.series, DEFAULT.quality))) for r in raws())
    return tuple((r, p) for r, p in found if isinstance(p, Prepared))


@cache
def detected() -> tuple[tuple[Raw, Prepared, Oscillations], ...]:
    """Those with what oscillates in them."""
    return tuple((r, p, detect(p.record, DEFAULT.oscillation)) for r, p in ready())


@cache
def advised() -> tuple[tuple[Sketch, Assessment], ...]:
    """Simulated loops to be advised on, as assessed by the defaults."""
    made = ((s, prepared(simulate(s, 4.0 if s.process[1] < 500 else 8.0))) for s in ADVISED)
    return tuple((s, assess(p, s.controller, DEFAULT, s.kind)) for s, p in made)


@cache
def plants() -> tuple[tuple[tuple[str, Oscillations, float, Peer], ...], ...]:
    """Loops of coupled plants with what oscillates in them and what their own verdicts say."""
    out = []
    for seed in (46, 49):
        loops = []
        for x in draw_plant(seed, 30, 1, 8.0, 10.0).loops:
            stamp, fine = START_S + x.stamp_s, np.zeros(x.pv.size, dtype=bool)
            trends = (("SP", x.sp), ("PV", x.pv), ("OP", x.op))
            series = {f"L.{n}": Series(stamp, v, fine) for n, v in trends}
            own = LoopSpec("L", type=x.kind, pv="L.PV", op="L.OP", sp="L.SP", pv_lo=0.0, pv_hi=100.0)
            a = tried(
                lambda s=series, o=own, x=x: assess(prepare(o, s, DEFAULT.quality), Pid(x.kp, x.ti), DEFAULT)
            )
            if isinstance(a, Assessment):
                m = a.verdict.measured
                peer = Peer(a.verdict.cause, m.evidence if m else 0.0, a.verdict.confidence[Cause.TUNING])
                loops.append((x.name, a.oscillations, a.start_s + a.duration_s, peer))
        out.append(tuple(loops))
    return tuple(out)


@cache
def weeks() -> tuple[dict[str, np.ndarray], ...]:
    """Hourly figures of two weeks of twelve loops, the second week changed by nothing to a half."""
    out = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        n, half = 14 * 24, 7 * 24
        level = np.where(np.arange(n) < half, 1.0, 1.0 - 0.05 * seed)
        noise = np.exp(0.2 * np.convolve(rng.standard_normal(n), np.ones(6) / 6, mode="same"))
        names = ("average_absolute_error_pct", "valve_travel_pct_per_h", "oscillation_significance")
        hours = {name: level * noise * rng.uniform(0.5, 5) for name in (*names, "variability_pct")}
        names = ("pv_variability_pct", "reversals_per_h", "crossings_per_h", "noise_band_pct", "normal_pct")
        hours |= {name: noise * rng.uniform(1, 5) for name in names}
        hours |= {
            "hour_s": START_S + 3600.0 * np.arange(n),
            "usable_h": (rng.random(n) < 0.55 + 0.04 * seed) * 1.0,
        }
        moved = 1.0 + (np.arange(n) >= half) * rng.uniform(-0.7, 0.7)
        hours |= {
            "sp_mean_pct": 50.0 + 3 * moved,
            "pv_mean_pct": 50.0 + 3 * moved,
            "op_mean_pct": 40.0 + 8 * moved,
        }
        hours |= {"sp_travel_pct": 0.2 * moved, "service_pct": 90.0 + 8 * moved, "at_limits_pct": 4 * moved}
        hours |= {"oscillating_pct": 50.0 * moved, "op_variability_pct": noise}
        out.append(hours)
    return tuple(out)


def of_quality(c: Config) -> list[Any]:
    """Length, masked samples and remarks of each loop."""

    def answer(r: Raw) -> Any:
        p = prepare(r.spec, r.series, c.quality)
        return len(p.record), int(p.record.bad.sum()), p.op_known, p.notes, round(p.compressed_share, 6)

    def unfit(r: Raw) -> Any:
        found = tried(lambda: assess(prepare(r.spec, r.series, c.quality), None, c).verdict.needs)
        return str(found)

    return [(tried(lambda r=r: answer(r)), unfit(r) if k < UNFIT else "") for k, r in enumerate(raws())]


def of_oscillation(c: Config) -> list[Any]:
    """Periods and shares of each loop."""
    found = (detect(p.record, c.oscillation).found for _, p in ready())
    return [tuple((round(o.period_s, 2), round(o.oscillating_pct)) for o in f) for f in found]


def of_cause(c: Config) -> list[Any]:
    """Cause, fault and confidences of the loops that oscillate, and of some that do not."""
    busy = sorted(detected(), key=lambda t: counting(t[2]) is None)[:CAUSES]
    out = []
    for r, p, f in busy:
        v = tried(lambda r=r, p=p, f=f: cause_of(p, f, r.stated, c, r.spec.type))
        out.append(
            v if isinstance(v, str) else (v.cause, v.fault, *(round(x) for x in v.confidence.values()))
        )
    return out


def of_settings(c: Config) -> list[Any]:
    """Whether stated settings are told to be wrong, right and wrong ones."""
    out = []
    for r, p, f in detected()[:SETTINGS]:
        first = counting(f)
        scale = first.period_s if first is not None else 20.0 * p.record.dt_s
        for k in (1.0, 1.3, 1.6):
            stated = replace(r.stated, kp=k * r.stated.kp, ti_s=r.stated.ti_s * (2.0 if k > 1.5 else 1.0))
            out.append(differing(p.record, stated, scale, c.settings) is not None)
    return out


def of_advice(c: Config) -> list[Any]:
    """Action and settings of the simulated loops, in whole records and as hints."""
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
    return out


def of_plant(c: Config) -> list[Any]:
    """Groups, sources and followers of coupled plants."""
    out: list[Any] = []
    for loops in plants():
        waves = [w for name, found, end_s, _ in loops for w in waves_of(name, found, end_s, c.plant)]
        traced = trace(waves, {name: peer for name, _, _, peer in loops}, c.plant)
        told = {loop: source.loop for loop, (source, _) in followers_of(traced).items()}
        out += [(t.group.loops, t.source, round(t.candidates[0].confidence_pct)) for t in traced]
        out.append(tuple(sorted(told.items())))
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
        out.append((found.reasons, tuple((x.measure.name, x.verdict) for x in found.changes)))
    return out


def of_changes(c: Config) -> list[Any]:
    """Whether a step of a controller's behaviour is seen."""
    return [tried(lambda h=h: behaviour_change("L", h, c.changes)) is not None for h in weeks()]


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
}
"""Sections of the limits, and what asks the stage that each belongs to."""


def moved(value: float, said: Limit, way: float) -> float:
    """A limit moved by a fifth within its range; whole numbers by one at least."""
    new = value * (1.0 + way * STEP)
    if isinstance(value, int):
        new = value + (max(round(abs(new - value)), 1) if way > 0 else -max(round(abs(new - value)), 1))
    kept = min(max(new, said.least), said.most)
    return int(kept) if isinstance(value, int) else kept


@dataclass(frozen=True)
class Effect:
    """A limit with how many answers change when it is lowered and raised; None where its range ends there."""

    section: str
    name: str
    value: float
    lower: int | None
    higher: int | None
    answers: int

    @property
    def noticed(self) -> bool:
        """Whether any answer changes."""
        return bool(self.lower) or bool(self.higher)


@cache
def usual(section: str) -> list[Any]:
    """What a stage answers by the defaults."""
    return STAGES[section](DEFAULT)


def effect(job: tuple[str, str]) -> Effect:
    """What moving one limit does."""
    section, name = job
    own = getattr(DEFAULT, section)
    said = next(f.metadata[KEY] for f in fields(own) if f.name == name)
    value, base = getattr(own, name), usual(section)
    counts = []
    for way in (-1.0, 1.0):
        new = moved(value, said, way)
        if new == value:
            counts.append(None)
            continue
        asked = STAGES[section](replace(DEFAULT, **{section: replace(own, **{name: new})}))
        differ = sum(a != b for a, b in zip(base, asked, strict=False)) + abs(len(base) - len(asked))
        counts.append(differ)
    return Effect(section, name, value, counts[0], counts[1], len(base))


def jobs(sections: Sequence[str]) -> list[tuple[str, str]]:
    """Every limit that is one number."""
    found = []
    for section in sections:
        for f in fields(getattr(DEFAULT, section)):
            if KEY in f.metadata and isinstance(getattr(getattr(DEFAULT, section), f.name), int | float):
                found.append((section, f.name))
    return found


def table(found: Sequence[Effect]) -> str:
    """Effects as Markdown, those that nothing notices first by name."""
    silent = [f"`{e.section}.{e.name}`" for e in found if not e.noticed]
    head = (
        f"{len(found)} limits moved by a fifth; {len(found) - len(silent)} change an answer of this sample. What "
        f"none of its answers notices: {', '.join(silent) or 'nothing'}."
    )
    lines = ["| limit | value | lowered | raised | of answers |", "|---|--:|--:|--:|--:|"]
    for e in found:
        cells = ("–" if n is None else str(n) for n in (e.lower, e.higher))
        lines.append(f"| {e.section}.{e.name} | {e.value:g} | {' | '.join(cells)} | {e.answers} |")
    return "\n".join([head, "", *lines, ""])


def main() -> None:
    """Move every limit, ask, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--sections", nargs="+", choices=list(STAGES), default=list(STAGES))
    parser.add_argument("--out", type=Path, default=OUT)
    options = parser.parse_args()
    todo, found = jobs(options.sections), []
    with Pool(options.jobs) as pool:
        for e in pool.imap(effect, todo):
            found.append(e)
            print(
                f"\r{len(found)} of {len(todo)} {e.section}.{e.name} {e.lower} {e.higher}      ",
                end="",
                flush=True,
            )
    text = table(found)
    asked = "" if options.sections == list(STAGES) else " --sections " + " ".join(options.sections)
    options.out.write_text(f"# What each limit does\n\n`python -m tests.proofs.limits{asked}`: {text}")
    print("\n" + text)


if __name__ == "__main__":
    main()
