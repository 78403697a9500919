"""A historian's recording of a loop: everyday ways of recording that do not change the fault."""

from __future__ import annotations

import numpy as np

from benchmarks.world.simulate import Floats, Trends

Recording = dict[str, Floats]
"""stamp_s [s from the start], sp, pv, op, shape (m,) each."""
WAYS = (
    *("plain", "every 5 s", "every 10 s", "rounded", "rows missing", "late stamps", "averages"),
    *("by exception", "gaps", "daylight saving"),
)
EXCEPTION = 0.05
"""Change of PV or OP from which a historian by exception keeps a new value [% of span]."""
HOUR_BACK = 0.4
"""Time at which the clock of a historian in local time goes back by an hour, as a share of the day."""
GAPS = ((0.2, 0.215), (0.55, 0.58), (0.8, 0.8035))
"""Gaps of 22, 43 and 5 minutes in a day, as shares of it: two outages of the recorder and a restart."""


def plain(t: Trends, every: int = 1) -> Recording:
    """Snapshots of every `every`-th scan."""
    k = np.arange(0, t.pv.size, every)
    return {"stamp_s": k * t.scan_s, "sp": t.sp[k], "pv": np.round(t.pv[k], 4), "op": np.round(t.op[k], 4)}


def by_exception(x: Floats) -> Floats:
    """A signal recorded by exception: a value is kept when it differs from the last kept one, and held in between."""
    out, held = np.empty_like(x), x[0]
    for k, value in enumerate(x):
        held = value if abs(value - held) > EXCEPTION else held
        out[k] = held
    return out


def recorded(t: Trends, way: str, seed: int) -> Recording:
    """A loop's trends recorded in one of WAYS."""
    rng = np.random.default_rng(seed)
    if way.startswith("every"):
        return plain(t, int(way.split()[1]))
    r = plain(t)
    if way == "rounded":
        return {**r, "pv": np.round(r["pv"], 1), "op": np.round(r["op"], 1)}
    if way == "rows missing":
        keep = rng.random(r["pv"].size) > 0.03
        return {name: x[keep] for name, x in r.items()}
    if way == "by exception":
        return {**r, "pv": by_exception(r["pv"]), "op": by_exception(r["op"])}
    if way == "gaps":
        at = np.arange(r["pv"].size) / r["pv"].size
        keep = ~np.any([(at >= a) & (at < b) for a, b in GAPS], axis=0)
        return {name: x[keep] for name, x in r.items()}
    if way == "daylight saving":
        return {**r, "stamp_s": r["stamp_s"] - 3600.0 * (np.arange(r["pv"].size) >= HOUR_BACK * r["pv"].size)}
    if way == "late stamps":
        late = rng.random(r["pv"].size) < 0.12
        return {**r, "stamp_s": r["stamp_s"] + 0.6 * late}
    if way == "averages":
        m = r["pv"].size // 5 * 5
        return {
            name: (x[:m].reshape(-1, 5).mean(axis=1) if name != "stamp_s" else x[:m:5])
            for name, x in r.items()
        }
    return r
