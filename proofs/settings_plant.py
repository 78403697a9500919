"""Recordings of controllers of many kinds, simulated without code of the package, for the check of settings.

Controllers are P, PI and PID in ideal, series or parallel form, as position algorithm. The derivative acts on the
error or on PV behind a filter; PV is filtered or not. The scan is faster than the log, equal to it, or slower. OP is
clamped and rounded; PV is noisy and quantised. The set point is constant, steps, ramps or oscillates. Some loops are
in manual for a time.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
import pandas as pd


@dataclass(frozen=True, slots=True)
class Recorded:
    """One recording: its columns, its row of loops.csv with the true settings, and the kind of its controller."""

    tag: str
    trends: pd.DataFrame
    row: dict[str, object]
    kind: str


def _controller(rng: np.random.Generator, lag_s: float, dead_s: float, gain: float) -> dict[str, float | str]:
    """Settings by internal model control, from tight to slow, in the form of the controller."""
    kind = str(rng.choice(["P", "PI", "PI", "PID", "PID"]))
    closed = dead_s * rng.uniform(0.6, 4.0)
    kp = lag_s / (gain * (closed + dead_s)) * rng.uniform(0.7, 1.2)
    ti = min(lag_s, 4.0 * (closed + dead_s)) * rng.uniform(0.6, 1.5)
    form = str(rng.choice(["ideal", "series", "parallel"])) if kind == "PID" else "ideal"
    td = dead_s * rng.uniform(0.25, 0.8) if kind == "PID" else 0.0
    return {
        "kind": kind,
        "form": form,
        "kp": kp,
        "ti": 0.0 if kind == "P" else ti,
        "td": td,
        "narrow": td / rng.choice([4.0, 8.0, 15.0]) if kind == "PID" else 0.0,
        "on_pv": float(rng.random() < 0.5),
        "smooth": float(rng.choice([0.0, 0.0, 0.1])) * dead_s,
    }


def _parts(c: dict[str, float | str]) -> tuple[float, float, float]:
    """Proportional, integral and derivative gain of the control law, all on the error."""
    kp, ti, td = float(c["kp"]), float(c["ti"]), float(c["td"])
    if c["form"] == "series":
        return kp * (1.0 + td / ti), kp / ti, kp * td
    return kp, kp / ti if ti > 0 else 0.0, kp * td


def _set_point(rng: np.random.Generator, n: int, scan_s: float, slow_s: float) -> np.ndarray:
    """A set point that is constant, steps, ramps or oscillates, about 50 %."""
    t = np.arange(n) * scan_s
    kind = rng.choice(["rests", "rests", "steps", "ramps", "waves"])
    if kind == "rests":
        return np.full(n, 50.0)
    if kind == "waves":
        return 50.0 + rng.uniform(0.5, 3.0) * np.sin(2 * np.pi * t / (slow_s * rng.uniform(8, 30)))
    edges = np.linspace(0, t[-1] + scan_s, int(rng.integers(4, 9)))
    levels = 50.0 + np.cumsum(rng.uniform(-4, 4, edges.size - 1))
    if kind == "steps":
        return levels[np.searchsorted(edges, t, side="right") - 1]
    return np.interp(t, edges, np.append(levels, levels[-1]))


def _loads(rng: np.random.Generator, n: int, scan_s: float, slow_s: float) -> np.ndarray:
    """The load of the process [% OP]: a slow random walk, steps, sometimes a sine."""
    walk = np.cumsum(rng.standard_normal(n)) * math.sqrt(scan_s / slow_s) * rng.uniform(0.2, 1.0)
    walk -= np.linspace(0, walk[-1], n) * 0.7
    at = rng.random(n) < scan_s / (60 * slow_s)
    steps = np.cumsum(np.where(at, rng.uniform(-6, 6, n), 0.0))
    sine = rng.choice([0.0, rng.uniform(1, 5)])
    moved = walk + steps + sine * np.sin(2 * np.pi * np.arange(n) * scan_s / (slow_s * rng.uniform(5, 20)))
    return np.clip(moved, -45, 45)


def _rounded(x: float, step: float) -> float:
    return round(x / step) * step if step > 0 else x


def _loop(
    rng: np.random.Generator,
    c: dict[str, float | str],
    process: tuple[float, float, float],
    scan_s: float,
    n: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """SP, PV, OP and whether the loop was in manual, at every scan."""
    lag_s, dead_s, gain = process
    kp, ki, kd = _parts(c)
    sp, load = _set_point(rng, n, scan_s, lag_s), _loads(rng, n, scan_s, lag_s)
    noise = rng.standard_normal(n) * rng.choice([0.003, 0.02, 0.08])
    pv_step, op_step = rng.choice([0.0, 0.02, 0.1]), rng.choice([0.0, 0.1, 100.0 / 255.0])
    backlash = rng.choice([0.0, 0.0, rng.uniform(0.3, 3.0)])
    top = rng.choice([100.0, 100.0, 50.0 + rng.uniform(2, 12)])
    manual = np.zeros(n, dtype=bool)
    if rng.random() < 0.3:
        first = int(rng.uniform(0.1, 0.7) * n)
        manual[first : first + int(rng.uniform(0.05, 0.25) * n)] = True
    pole, fast = math.exp(-scan_s / lag_s), math.exp(-scan_s / max(float(c["narrow"]), 1e-9))
    smooth = math.exp(-scan_s / max(float(c["smooth"]), 1e-9))
    waiting: deque[float] = deque([50.0] * max(round(dead_s / scan_s), 1))
    y, stem, seen, slope, last, op, integral = 50.0, 50.0, sp[0], 0.0, None, 50.0, 50.0
    pvs, ops = np.empty(n), np.empty(n)
    for k in range(n):
        waiting.append(stem)
        u = waiting.popleft()
        y = 50.0 + (y - 50.0) * pole + (1.0 - pole) * gain * (u - 50.0 + load[k])
        pvs[k] = _rounded(y + noise[k], pv_step)
        seen = smooth * seen + (1.0 - smooth) * pvs[k]
        e = sp[k] - seen
        of = -seen if c["on_pv"] else e
        slope = fast * slope + (1.0 - fast) * ((of - last) / scan_s if last is not None else 0.0)
        last = of
        if manual[k]:
            integral = op - kp * e - kd * slope if ki > 0 else integral
        else:
            trial = integral + ki * e * scan_s
            wanted = kp * e + trial + kd * slope
            if 0.0 < wanted < top or (wanted - 50.0) * e < 0:
                integral = trial
            op = _rounded(min(max(kp * e + integral + kd * slope, 0.0), top), op_step)
        ops[k] = op
        stem = min(max(stem, op - backlash / 2), op + backlash / 2) if backlash else op
    return sp, pvs, ops, manual


def recordings(seed: int, count: int) -> list[Recorded]:
    """`count` recordings of one seed."""
    return [_recording(np.random.default_rng([seed, k]), f"S{seed}K{k:03d}") for k in range(count)]


def _recording(rng: np.random.Generator, tag: str) -> Recorded:
    """One loop at its own scan, logged every few scans, or more often than it is scanned."""
    log_s = float(rng.choice([1.0, 2.0, 5.0]))
    scans, held = [(1, 1), (1, 1), (3, 1), (10, 1), (1, 2)][int(rng.integers(5))]
    dead_s = log_s * 10 ** rng.uniform(0.5, 1.3)
    process = (dead_s * 10 ** rng.uniform(0.1, 1.2), dead_s, float(rng.uniform(0.4, 2.5)))
    scan_s, samples = log_s * held / scans, int(rng.integers(3000, 8000))
    c = _controller(rng, *process)
    sp, pv, op, manual = _loop(rng, c, process, scan_s, samples * scans // held)
    at = np.minimum(np.arange(samples) * scans // held, pv.size - 1)
    times = pd.Timestamp("2026-01-05") + pd.to_timedelta(np.arange(samples) * log_s, unit="s")
    trends = {f"{tag}.SP": sp[at], f"{tag}.PV": pv[at], f"{tag}.OP": op[at]}
    trends |= {f"{tag}.MODE": np.where(manual[at], "MAN", "AUTO")} if rng.random() < 0.6 else {}
    row = {"loop": tag, "type": "temperature", "pv_lo": 0, "pv_hi": 100, "kp": c["kp"], "form": c["form"]}
    row |= _stated_times(c) | {"scan_s": scan_s}
    return Recorded(tag, pd.DataFrame({"timestamp": times, **trends}), row, str(c["kind"]))


def _stated_times(c: dict[str, float | str]) -> dict[str, float]:
    """Integral and derivative time as the form states them; in the parallel form they are separate gains."""
    kp, ti, td = float(c["kp"]), float(c["ti"]), float(c["td"])
    return {"ti": ti / kp, "td": kp * td} if c["form"] == "parallel" else {"ti": ti, "td": td}
