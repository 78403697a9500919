#!/usr/bin/env python3
"""Seals cases: recordings of loops that contain at most one or two effects; the truths are in a separate file.

make.py OUT --cases 400 --seed 1
"""

import argparse
import json
import multiprocessing
import pathlib
import sys
import time
from functools import partial

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))

import numpy as np
import pandas as pd

from proofs.concealed.acting import scaled
from proofs.concealed.company import add_neighbour, borrow, read_residuals, with_neighbour
from proofs.concealed.effects import CATALOGUE, Effect, apply
from proofs.concealed.grade import LEVELS, Grade, energy_of, fopdt, noise_like, quiet, strength_for
from proofs.concealed.plan import Case, outside_alone, plan
from proofs.concealed.plant import close_loop, open_loop
from proofs.concealed.recorder import leave_out, record
from proofs.concealed.scene import Rng, Scene, draw_scene
from proofs.concealed.strange import ODDITIES, OUTSIDE
from proofs.concealed.unnamed import FIRST_DECK, SECOND_DECK

EFFECTS = CATALOGUE | {e.name: e for e in (*OUTSIDE, *FIRST_DECK, *SECOND_DECK)}
DECKS = {"outside": OUTSIDE, "first": FIRST_DECK, "second": SECOND_DECK}
STARTS = (pd.Timestamp("2026-03-02"), pd.Timestamp("2026-03-09"))
ATTEMPTS = 12
UNSEEN = 4.0  # energy of the baseline relative to a FOPDT, at most


def unseen(scene: Scene) -> Scene:
    """The scene with a small third lag that is indistinguishable from dead time."""
    for _ in range(6):
        if energy_of(scene, scene.plant).energy < UNSEEN:
            return scene
        t3 = 0.6 * scene.plant.T3
        scene = scene.with_plant(T3=t3 if t3 > 0.06 * scene.scan else 0.0)
    return scene


def stage(rng: Rng, case: Case, attempt: int, library: list[np.ndarray]) -> Scene:
    """The baseline scene of a case; later attempts have less load and noise."""
    effects = [EFFECTS[name] for name, _ in case.effects]
    kinds = [k for k in ("flow", "pressure", "temperature", "level") if all(k in e.kinds for e in effects)]
    kind = str(rng.choice(kinds))
    if case.oddity:
        scene = ODDITIES[case.oddity](rng, kind)
    else:
        low = any(e.low_pv for e in effects)
        scene = draw_scene(rng, kind, low=low, span=11.0 if low else rng.uniform(5.0, 9.0))
    if library and rng.random() < 0.5:
        scene = borrow(rng, scene, library)
    if case.effects and attempt:
        scene = scaled(scene, 0.8**attempt)
    if rng.random() < 0.1 or any(e.name == "coupling" for e in effects):
        scene = with_neighbour(rng, scene)
    return unseen(scene)


def graded(effect: Effect, level: str, scene: Scene, seed: int) -> tuple[float, Grade | None] | None:
    """Strength and residual of an effect at a level; None if the scene does not allow it."""
    if effect.sizes:
        return effect.sizes[list(LEVELS).index(level)], None

    def at(s: float) -> Grade:
        return energy_of(apply(effect, scene, s, seed)[0], scene.plant)

    return strength_for(at, LEVELS[level], effect.low, effect.high)


def hide(case: Case, library: list[np.ndarray]) -> tuple[Scene, Scene, list[dict]]:
    """Baseline scene, scene with the effects, and one entry for each hidden effect."""
    for attempt in range(ATTEMPTS):
        rng = np.random.default_rng([case.seed, attempt])
        base = stage(rng, case, attempt, library)
        found = [graded(EFFECTS[n], lv, base, case.seed + i) for i, (n, lv) in enumerate(case.effects)]
        carried = [f for f in found if f is not None]
        if len(carried) == len(found):
            break
    else:
        raise RuntimeError(f"{case.tag} {case.effects}: none of {ATTEMPTS} loops carries it; widen it")
    scene, entries = base, []
    for i, ((name, level), f) in enumerate(zip(case.effects, carried, strict=True)):
        scene, hidden = apply(EFFECTS[name], scene, f[0], case.seed + i)
        entries.append({"effect": name, "level": level, "strength": f[0], "hidden": hidden, "grade": f[1]})
    return base, scene, entries


def later_misfit(scene: Scene, grade: Grade, later: pd.DataFrame, tag: str) -> dict[str, float]:
    """Misfit (rms, %) of the best baseline FOPDT and of the true plant on the later recording, with a free bias."""
    op, pv = (later[f"{tag}.{c}"].to_numpy(float) for c in ("OP", "PV"))
    plain = grade.plain.K * fopdt(op - scene.plant.v0, grade.plain.T, grade.plain.L, scene.scan)
    true = open_loop(scene.plant, op, quiet(scene.later), scene.scan)
    return {"later_plain": float(np.std(pv - plain)), "later_true": float(np.std(pv - true))}


def comparable(truth: dict) -> bool:
    """Whether an open-loop simulation over the later recording is usable; that of an integrator would drift."""
    return truth["block"] in ("valve", "process", "sensor") and truth["effect"] != "integrator"


def truth_of(case: Case, base: Scene, scene: Scene, entries: list[dict], later: pd.DataFrame) -> dict:
    """All information that the scorer may use about a case."""
    p, c = scene.plant, scene.pi
    truth = {
        "effect": entries[0]["effect"] if entries else "none",
        "block": EFFECTS[entries[0]["effect"]].block if entries else "none",
        "level": entries[0]["level"] if entries else "plain",
        "kind": scene.kind,
        "floor": float(np.std(noise_like(base, base.plant))),
        "base": {
            "K": p.K,
            "T": p.T,
            "L": p.L,
            "Kp": c.kp,
            "Ti": c.ti,
            "scan": scene.scan,
            "v0": p.v0,
            "y0": p.y0,
        },
        "hidden": entries[0]["hidden"] if entries else {},
    }
    if case.oddity:
        truth["oddity"] = case.oddity
    if not entries:
        return truth
    truth["strength"], grade = entries[0]["strength"], entries[0]["grade"]
    if entries[0]["effect"] not in CATALOGUE:
        truth["outside"] = True
    if len(entries) > 1:
        truth["pair"] = [e["effect"] for e in entries]
        truth["pair_hidden"] = entries[1]["hidden"]
    if grade is not None:
        truth["energy"] = grade.energy
        if len(entries) == 1 and comparable(truth):
            truth |= later_misfit(scene, grade, later, case.tag)
    return truth


def rows_of(tag: str, scene: Scene) -> list[dict]:
    """The rows of loops.csv for the loop and its neighbour."""
    rest = {"scan_s": scene.scan, "pv_lo": 0, "pv_hi": 100, "op_lo": 0, "op_hi": 100}
    known = {tag: scene.stated} | ({f"N{tag[1:]}": (None, None)} if scene.neighbours else {})
    return [{"loop": t, "type": scene.kind, "kp": kp, "ti": ti, **rest} for t, (kp, ti) in known.items()]


def seal(out: pathlib.Path, library: list[np.ndarray], case: Case) -> tuple[list[dict], str, dict]:
    """Write both recordings of a case; returns its rows of loops.csv, its tag and its truth."""
    base, scene, entries = hide(case, library)
    rng = np.random.default_rng([case.seed, 99])
    frames = []
    for i, (d, name) in enumerate(((scene.fit, "fit"), (scene.later, "later"))):
        made = close_loop(scene.plant, scene.pi, d, scene.scan)
        frame = record(rng, case.tag, scene, d.sp, made, STARTS[i])
        if scene.neighbours:
            frame = add_neighbour(frame, f"N{case.tag[1:]}", scene.neighbours[i])
        leave_out(frame, scene.historian).to_parquet(out / f"{case.tag}-{name}.parquet", index=False)
        frames.append(frame)
    return rows_of(case.tag, scene), case.tag, truth_of(case, base, scene, entries, frames[1])


def write(out: pathlib.Path, sealed: list[tuple[list[dict], str, dict]]) -> None:
    """loops.csv and truth.json of a set."""
    rows = [row for s in sealed for row in s[0]]
    pd.DataFrame(rows).to_csv(out / "loops.csv", index=False)
    (out / "truth.json").write_text(json.dumps({tag: truth for _, tag, truth in sealed}, indent=1))


def make(out: pathlib.Path, todo: list[Case], residuals: pathlib.Path | None, jobs: int) -> None:
    """Seal a whole set with `jobs` processes."""
    out.mkdir(parents=True, exist_ok=True)
    cases, begun, sealed = len(todo), time.time(), []
    work = partial(seal, out, read_residuals(residuals))
    with multiprocessing.Pool(jobs) as pool:
        for i, s in enumerate(pool.imap(work, todo, chunksize=1), 1):
            sealed.append(s)
            print(f"\r{i} of {cases}", end="", file=sys.stderr)
    write(out, sealed)
    print(f"\n{cases} cases in {time.time() - begun:.0f} s", file=sys.stderr)


def main() -> None:
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("out", type=pathlib.Path)
    ap.add_argument("--cases", type=int, default=400)
    ap.add_argument("--seed", type=int, default=1)
    ap.add_argument("--residuals", type=pathlib.Path, help="folder of residual series to take loads from")
    ap.add_argument("--jobs", type=int, default=2)
    ap.add_argument("--deck", choices=list(DECKS), help="physics outside the catalogue alone")
    a = ap.parse_args()
    todo = outside_alone(DECKS[a.deck], a.cases, a.seed) if a.deck else plan(a.cases, a.seed)
    make(a.out, todo, a.residuals, a.jobs)


if __name__ == "__main__":
    main()
