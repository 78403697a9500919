"""Which loops share an oscillation and where it starts: python -m proofs.plant_wide [--plants 200] [--seed 2000]

The plants are those of proofs/coupled, of seeds on which no limit was set (1 to 39 and 100 to 124 were used for
limits). They have sources whose oscillation spreads through filters, delays, mixing and recycles, and loops that
oscillate independently with nearly the same period. Every loop is assessed as in a night; then the plant-wide pass
runs. Writes proofs/plant_wide.md.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping, Sequence
from multiprocessing import Pool
from pathlib import Path
from typing import Any

import numpy as np

from analyzer.config import Config
from analyzer.history.series import Series
from analyzer.loop.advice.advise import Advice
from analyzer.loop.conclusion import concluded
from analyzer.loop.decisions import Action, Cause, Finding, counts
from analyzer.loop.record.quality import prepare
from analyzer.loops.spec import LoopSpec
from analyzer.night.chunk import assess_loop
from analyzer.plantwide.night import traced_night
from analyzer.store.rows import night_row
from identification.errors import TriageError
from proofs.common import parser_of
from proofs.coupled.draw import Drawn, Recorded, draw

OUT = Path(__file__).with_suffix(".md")
START_S = 1_772_409_600.0
CLEAR, SHOWS = 1.5, 1.25
"""Ratio of a follower's error to that without the source: from 1.5 it is clear, from 1.25 it shows."""
Truth = Mapping[str, Any]


def recorded(x: Recorded) -> tuple[LoopSpec, dict[str, Series]]:
    """One loop as in loops.csv and the export."""
    stamp = START_S + x.stamp_s
    none = np.zeros(stamp.size, dtype=bool)
    series = {f"{x.name}.{n}": Series(stamp, v, none) for n, v in (("SP", x.sp), ("PV", x.pv), ("OP", x.op))}
    tags = {n: f"{x.name}.{n.upper()}" for n in ("sp", "pv", "op")}
    stated = {"pv_lo": 0.0, "pv_hi": 100.0, "kp": x.kp, "ti": x.ti, "scan_s": x.dt, "master": x.master}
    spec = LoopSpec(x.name, type=x.kind, area=x.area, **tags, **stated, stated=frozenset(stated))  # type: ignore[arg-type]
    return spec, series


def assessed(x: Recorded, config: Config) -> tuple[Finding, tuple[Any, ...]] | None:
    """Finding and oscillations of one loop; None where it cannot be assessed."""
    spec, series = recorded(x)
    try:
        found, _ = assess_loop(spec, prepare(spec, series, config.quality), config, advising=False)
    except TriageError:
        return None
    return concluded(found, Advice(Action.NONE), spec, "2026-03-02", config.advice), found.oscillation_lines


def reached(truth: Mapping[str, Truth]) -> dict[str, set[str]]:
    """For every source, the loops coupled to it directly or indirectly."""
    below: dict[str, set[str]] = {}
    for name, t in truth.items():
        for parent in t["coupled_to"]:
            below.setdefault(parent, set()).add(name)
    out = {}
    for name in (n for n, t in truth.items() if t["role"] == "source"):
        seen, open_ = {name}, [name]
        while open_:
            fresh = below.get(open_.pop(), set()) - seen
            seen |= fresh
            open_ += fresh
        out[name] = seen
    return out


def scored(
    drawn: Drawn,
    known: Mapping[str, Finding],
    traced: Mapping[str, Finding],
    shared: Sequence[Mapping[str, Any]],
) -> Counter[str]:
    """Counts of right and wrong answers for one plant."""
    truth, k = drawn.truth, Counter[str]()
    rows, after = ({n: night_row(f) for n, f in loops.items()} for loops in (known, traced))
    groups: dict[str, list[Mapping[str, Any]]] = {}
    for row in shared:
        groups.setdefault(row["group"], []).append(row)
    members = [{r["loop"] for r in g} for g in groups.values()]
    ranks = [[r["loop"] for r in sorted(g, key=lambda r: -r["source_pct"])] for g in groups.values()]
    coupled = reached(truth)
    far = set(truth) - set().union(*coupled.values())
    k["unrelated"] += len(far)
    k["unrelated oscillating"] += sum(counts(rows[n]["oscillating_pct"]) for n in far if n in rows)
    k["unrelated joined"] += sum(any(n in m and m & coupled.keys() for m in members) for n in far)
    k["unrelated follow"] += sum(bool(after[n]["source_loop"]) for n in far if n in rows)
    for name, t in truth.items():
        row = after.get(name)
        if row is None:
            continue
        if t["role"] == "source":
            k["sources"] += 1
            k["sources called followers"] += bool(row["source_loop"])
            own = {
                n
                for n, u in truth.items()
                if u["root"] == name and u["role"] == "follower" and u["swell"] >= SHOWS
            }
            best = max(range(len(members)), key=lambda i: len(own & members[i]), default=None)
            if own:
                k["sources with followers"] += 1
                if best is not None and own & members[best]:
                    place = ranks[best].index(name) if name in ranks[best] else 99
                    k["groups found"] += 1
                    k["first"] += place == 0
                    k["among three"] += place < 3
        elif t["role"] == "follower" and t["swell"] >= SHOWS:
            for kind in ("followers", "clear followers")[: 1 + (t["swell"] >= CLEAR)]:
                k[kind] += 1
                k[f"{kind} traced"] += row["source_loop"] == t["root"]
                k[f"{kind} to another root"] += (
                    bool(row["source_loop"]) and row["source_loop"] not in t["roots"]
                )
                k[f"{kind} blamed"] += row["cause"] in (Cause.VALVE, Cause.TUNING)
    return k


def plant(job: tuple[int, int | None, float | None]) -> Counter[str]:
    """One plant drawn, assessed, traced and scored."""
    seed, loops, hours = job
    config, drawn = Config(), draw(seed, loops, hours=hours)
    known = {x.name: a for x in drawn.loops if (a := assessed(x, config)) is not None}
    alone = {name: finding for name, (finding, _) in known.items()}
    oscillations = [w for _, own in known.values() for w in own]
    begun = time.perf_counter()
    k = scored(drawn, alone, *traced_night(alone, oscillations, config.plant))
    k["loops"], k["plants"] = len(drawn.loops), 1
    k["milliseconds"] = round(1000 * (time.perf_counter() - begun))
    return k


def _share(k: Counter[str], part: str, whole: str) -> str:
    return f"{k[part]} of {k[whole]}, {100 * k[part] / max(k[whole], 1):.1f} %"


def table(k: Counter[str], command: str) -> str:
    """The counts as Markdown."""
    lines = [
        ("source in first place, of groups found", _share(k, "first", "groups found"), "85 %"),
        ("source among the first three, of groups found", _share(k, "among three", "groups found"), "97 %"),
        (
            "groups found, of sources whose followers show",
            _share(k, "groups found", "sources with followers"),
            "",
        ),
        ("sources called followers", _share(k, "sources called followers", "sources"), ""),
        ("followers that show, traced to their root", _share(k, "followers traced", "followers"), ""),
        ("… to a loop that is none of their roots", _share(k, "followers to another root", "followers"), ""),
        ("… blamed on valve or tuning", _share(k, "followers blamed", "followers"), ""),
        ("clear followers, traced to their root", _share(k, "clear followers traced", "clear followers"), ""),
        ("unrelated loops joined to a source's group", _share(k, "unrelated joined", "unrelated"), "2 %"),
        ("unrelated loops said to follow any loop", _share(k, "unrelated follow", "unrelated"), ""),
    ]
    body = [f"| {what} | {share} | {aim} |" for what, share, aim in lines]
    head = (
        f"`{command}`: {k['plants']} plants, {k['loops']} loops, {k['sources']} sources; of the unrelated loops "
        f"{k['unrelated oscillating']} oscillate. The plant-wide pass took {k['milliseconds'] / 1000:.1f} s in all."
    )
    return "\n".join([head, "", "| what | share | aim |", "|---|---|---|", *body, ""])


def main() -> None:
    """Draw, assess, count, write."""
    parser = parser_of(__doc__, plants=200, seed=2000, jobs=1, out=OUT)
    parser.add_argument("--loops", type=int, help="Loops of a plant; drawn from 30 to 300 where not given.")
    parser.add_argument(
        "--hours", type=float, help="Length of the records; drawn from 6 to 24 h where not given."
    )
    o = parser.parse_args()
    jobs = [(o.seed + i, o.loops, o.hours) for i in range(o.plants)]
    total: Counter[str] = Counter()
    with Pool(o.jobs) as pool:
        for done, k in enumerate(pool.imap_unordered(plant, jobs), 1):
            total += k
            print(f"\r{done} of {len(jobs)}", end="", flush=True)
    given = "".join(f" --{n} {v:g}" for n, v in (("loops", o.loops), ("hours", o.hours)) if v is not None)
    text = table(total, f"python -m proofs.plant_wide --plants {o.plants} --seed {o.seed}{given}")
    o.out.write_text(f"# Loops that share an oscillation\n\n{text}")
    print("\n" + text)


if __name__ == "__main__":
    main()
