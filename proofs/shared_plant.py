"""Loops that share a valve or a process: overrides, split ranges, and batches of a programme, with the truth.

Shares no code with the analyzer. Controllers are PI in position form; the one without the valve winds up, or follows
the valve (external reset). Valves stick by He's model, or have backlash. Percent of spans, seconds, one scan a
second.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numba import njit
from numpy.typing import NDArray

from proofs.structure_plant import stem_after, wander

Floats = NDArray[np.float64]
EVERY = 2
"""Every EVERY-th scan is recorded."""
WARM = 3600
"""Scans before the recording."""
FAULT = {"stick": (0.0, 1.0, 0.6), "play": (1.0, 0.0, 0.0)}
"""Backlash, stickband and slip jump of a faulty valve, relative to its width."""


@dataclass
class Plant:
    """Trends by tag, rows of loops.csv, and the truth, by loop."""

    tags: dict[str, Floats] = field(default_factory=dict)
    stated: list[dict[str, object]] = field(default_factory=list)
    truth: dict[str, dict[str, object]] = field(default_factory=dict)

    def keep(self, loop: str, trends: dict[str, Floats], stated: dict[str, object], **true: object) -> None:
        """Keep the recorded trends of a loop, rounded as by a historian, and its truth."""
        for role, x in trends.items():
            self.tags[f"{loop}.{role}"] = np.round(x[WARM::EVERY], 3 if role != "OP" else 2)
        self.stated.append({"loop": loop, "pv_lo": 0.0, "pv_hi": 100.0, **stated})
        self.truth[loop] = true


@njit(cache=True)
def override(
    setting: Floats, sp: Floats, loads: Floats, noises: Floats, valve: Floats, follows: bool
) -> tuple[Floats, Floats, Floats]:
    """PV and OP of two controllers, shape (2, n), and which of them has the valve, shape (n,). The lower output has
    the valve.

        setting: gain, lag, dead time, kp, ti of each, shape (2, 5); sp, shape (2,); valve: backlash, stickband, jump.
    """
    n = loads.shape[1]
    pv, op, has = np.empty((2, n)), np.empty((2, n)), np.empty(n)
    x, total, stem = np.zeros(2), np.full(2, 50.0), 50.0
    late = np.full(64, 50.0)
    for k in range(n):
        for i in range(2):
            pv[i, k] = 50.0 + x[i] + noises[i, k]
            op[i, k] = min(max(total[i] + setting[i, 3] * (sp[i] - pv[i, k]), 0.0), 100.0)
        has[k] = 0.0 if op[0, k] <= op[1, k] else 1.0
        u = min(op[0, k], op[1, k])
        for i in range(2):
            error, kp, ti = sp[i] - pv[i, k], setting[i, 3], setting[i, 4]
            if follows:  # the integral is the lagged output of the valve
                total[i] += (u - total[i]) / ti
            else:
                wanted = total[i] + kp * error
                total[i] += kp * error / ti + (op[i, k] - wanted) / ti
        stem = stem_after(stem, u, valve[0], valve[1], valve[2])
        late[k % 64] = stem
        for i in range(2):
            drive = late[(k - int(setting[i, 2])) % 64] - 50.0 + loads[i, k]
            x[i] += (setting[i, 0] * drive - x[i]) * (1.0 - np.exp(-1.0 / setting[i, 1]))
    return pv, op, has


@njit(cache=True)
def split(
    setting: Floats, at: float, gains: Floats, sp: Floats, load: Floats, noise: Floats, valves: Floats
) -> tuple[Floats, Floats, Floats]:
    """PV and OP of a controller, shape (n,), and the outputs to its two valves, shape (2, n).

    The first valve opens as OP falls below `at`, the second as it rises above.
    setting: lag, dead time, kp, ti; gains: of the two valves, shape (2,); valves: backlash, stickband, jump, (2,
    3).
    """
    n = load.size
    pv, op, out = np.empty(n), np.empty(n), np.empty((2, n))
    x, total, stems = 0.0, at, np.zeros(2)
    late = np.zeros(128)
    for k in range(n):
        pv[k] = 50.0 + x + noise[k]
        error = sp[k] - pv[k]
        wanted = total + setting[2] * error
        op[k] = min(max(wanted, 0.0), 100.0)
        total += setting[2] * error / setting[3] + (op[k] - wanted) / setting[3]
        out[0, k] = min(max(100.0 * (at - op[k]) / at, 0.0), 100.0)
        out[1, k] = min(max(100.0 * (op[k] - at) / (100.0 - at), 0.0), 100.0)
        drive = load[k]
        for i in range(2):
            stems[i] = stem_after(stems[i], out[i, k], valves[i, 0], valves[i, 1], valves[i, 2])
            drive += gains[i] * stems[i]
        late[k % 128] = drive
        x += (late[(k - int(setting[1])) % 128] - x) * (1.0 - np.exp(-1.0 / setting[0]))
    return pv, op, out


def spread(error: Floats, where: NDArray[np.bool_] | None = None) -> float:
    """Spread of an error after the warm-up, over the samples of `where`."""
    late = error[WARM:]
    return float(np.std(late if where is None else late[where[WARM:]]))


def override_pair(out: Plant, rng: np.random.Generator, number: int, n: int) -> None:
    """A flow loop whose valve is taken over by a low-pressure loop from time to time."""
    fault = str(rng.choice(["healthy", "healthy", "stick", "play"]))
    follows = bool(rng.random() < 0.5)
    lag, dead = rng.uniform(4.0, 10.0, 2), rng.integers(1, 4, 2).astype(float)
    gain = np.array([rng.uniform(0.8, 1.5), -rng.uniform(0.8, 1.5)])
    kp, ti = 0.4 / gain, lag * rng.uniform(1.0, 2.0)
    setting = np.column_stack((gain, lag, dead, kp, ti))
    low = np.array([0.0, -rng.uniform(12.0, 18.0)])  # the pressure's set point is well below its usual value
    loads = np.stack((wander(rng, n, 1.0, 1200.0), np.zeros(n)))
    starved = np.zeros(n)
    for begin in range(int(rng.integers(3600, 7200)), n, int(rng.integers(9000, 16000))):
        starved[begin : begin + int(rng.integers(2400, 5400))] = rng.uniform(22.0, 30.0)
    loads[1] = starved + wander(rng, n, 0.8, 900.0)
    noises = rng.uniform(0.1, 0.25, 2)[:, None] * rng.standard_normal((2, n))
    width = rng.uniform(2.0, 4.5)
    valve = width * np.array(FAULT.get(fault, (0.0, 0.0, 0.0)))
    pv, op, has = override(setting, 50.0 + low, loads, noises, valve, follows)
    without_fault = override(setting, 50.0 + low, loads, noises, np.zeros(3), follows)
    for i, name in enumerate((f"FIC{number}", f"PIC{number}")):
        stated = {
            "type": ("flow", "pressure")[i],
            "kp": round(float(kp[i]), 4),
            "ti": round(float(ti[i]), 2),
            "override_with": (f"PIC{number}", f"FIC{number}")[i],
        }
        share = 100.0 * float(np.mean(has[WARM:] == i))
        trends = {"SP": np.full(n, 50.0 + low[i]), "PV": pv[i], "OP": op[i]}
        swell = spread(50.0 + low[i] - pv[i], has == i) / spread(
            50.0 + low[i] - without_fault[0][i], without_fault[2] == i
        )
        out.keep(
            name, trends, stated, kind="override", cause=fault, share=share, winds_up=not follows, swell=swell
        )


def duty(rng: np.random.Generator, n: int, size: float) -> Floats:
    """A load that changes its level every hour or two, with ramps of ten minutes, up and down."""
    goal, out, keep, x = np.zeros(n), np.empty(n), float(np.exp(-1.0 / 600.0)), 0.0
    side, begin = 1.0, 0
    while begin < n:
        goal[begin:] = side * size * rng.uniform(0.5, 1.0)
        side, begin = -side, begin + int(rng.integers(3600, 9000))
    for k in range(n):
        x = keep * x + (1.0 - keep) * goal[k]
        out[k] = x
    return out


def split_range(out: Plant, rng: np.random.Generator, number: int, n: int) -> None:
    """A temperature loop with a cooling and a heating valve; one of them may be faulty, or much stronger."""
    fault = str(rng.choice(["healthy", "stick", "play", "unequal"]))
    lag, dead, at = (
        float(rng.uniform(40.0, 120.0)),
        float(rng.integers(4, 12)),
        float(rng.uniform(35.0, 65.0)),
    )
    times = float(rng.uniform(2.0, 3.0)) if fault == "unequal" else float(rng.uniform(0.9, 1.1))
    per_output = float(rng.uniform(0.8, 1.5))  # PV for a percent of OP on the weaker side
    which = int(rng.integers(0, 2))
    sides = np.array([per_output, per_output])
    sides[which] *= times
    gains = np.array([-sides[0] * at / 100.0, sides[1] * (100.0 - at) / 100.0])
    kp, ti = 0.45 * lag / (dead + 4.0) / per_output / times / 2.0, lag
    valves = np.zeros((2, 3))
    if fault in FAULT:
        valves[which] = rng.uniform(3.0, 6.0) * np.array(FAULT[fault])
    load = wander(rng, n, 1.0 * per_output, 2400.0) + duty(rng, n, 18.0 * per_output)
    sp = np.full(n, 50.0)
    for begin in np.cumsum(rng.exponential(5400.0, 12)).astype(int):
        sp[begin:] = 50.0 + rng.uniform(-4.0, 4.0)
    noise = rng.uniform(0.03, 0.08) * rng.standard_normal(n)
    pv, op, halves = split(np.array([lag, dead, kp, ti]), at, gains, sp, load, noise, valves)
    without_fault = split(np.array([lag, dead, kp, ti]), at, gains, sp, load, noise, np.zeros((2, 3)))
    whole = f"TIC{number}"
    stated = {"type": "temperature", "kp": round(kp, 4), "ti": round(ti, 2)}
    out.keep(whole, {"SP": sp, "PV": pv, "OP": op}, stated, kind="split", cause=fault)
    for i, name in enumerate((f"{whole}A", f"{whole}B")):
        worn = fault if i == which and fault in FAULT else "healthy"
        trends = {"SP": sp, "PV": pv, "OP": halves[i]}
        out.keep(
            name, trends, {"type": "temperature", "split_of": whole}, kind="half", cause=worn, at=at,
            gain=float(gains[i]), lag=lag,
            swell=spread(sp - pv, halves[i] > 0.0) / spread(sp - without_fault[0], without_fault[2][i] > 0.0),
        )  # fmt: skip


@njit(cache=True)
def loop(setting: Floats, sp: Floats, load: Floats, noise: Floats, valve: Floats) -> tuple[Floats, Floats]:
    """PV and OP of a single loop, shape (n,); setting: gain, lag, dead time, ti, followed by kp for each scan."""
    n = sp.size
    pv, op = np.empty(n), np.empty(n)
    x, total, stem = -30.0, 20.0, 20.0
    late = np.full(128, 20.0)
    for k in range(n):
        kp = setting[4 + k]
        pv[k] = 50.0 + x + noise[k]
        error = sp[k] - pv[k]
        wanted = total + kp * error
        op[k] = min(max(wanted, 0.0), 100.0)
        total += kp * error / setting[3] + (op[k] - wanted) / setting[3]
        stem = stem_after(stem, op[k], valve[0], valve[1], valve[2])
        late[k % 128] = stem + load[k]
        drive = late[(k - int(setting[2])) % 128] - 50.0
        x += (setting[0] * drive - x) * (1.0 - np.exp(-1.0 / setting[1]))
    return pv, op


def batch_loop(out: Plant, rng: np.random.Generator, number: int, n: int) -> None:
    """A temperature loop with a repeated programme: fill, a step, a ramp, a hold, and back."""
    fault = str(rng.choice(["healthy", "healthy", "stick", "growing"]))
    lag, dead, gain = (
        float(rng.uniform(50.0, 150.0)),
        float(rng.integers(4, 15)),
        float(rng.uniform(0.7, 1.3)),
    )
    kp = np.full(n, 0.5 * lag / (dead + 10.0) / gain)
    if fault == "growing":
        kp *= np.linspace(1.0, 3.2, n)
    ti = lag * float(rng.uniform(0.8, 1.2))
    long = int(rng.integers(60, 100)) * 60
    t = np.arange(n) % long
    low, middle, high = 20.0, 50.0 + rng.uniform(-5, 5), 75.0 + rng.uniform(-4, 4)
    ramp = 20 * 60
    first, second = int(0.15 * long), int(0.45 * long)
    risen = np.clip((t - second) / ramp, 0.0, 1.0)
    sp = np.where(t < first, low, middle + (high - middle) * risen)
    sp = np.where(t > 0.85 * long, low, sp)
    valve = rng.uniform(3.0, 5.0) * np.array(FAULT.get(fault, (0.0, 0.0, 0.0)))
    load, noise = wander(rng, n, 0.5, 1800.0), rng.uniform(0.03, 0.1) * rng.standard_normal(n)
    setting = np.concatenate(([gain, lag, dead, ti], kp))
    pv, op = loop(setting, sp, load, noise, valve)
    held = np.concatenate(
        (np.zeros(600, dtype=bool), np.abs(sp[600:] - sp[:-600]) < 1e-9)
    )  # ten minutes at least
    swell = spread(sp - pv, held) / spread(sp - loop(setting, sp, load, noise, np.zeros(3))[0], held)
    stated = {"type": "temperature", "kp": round(float(kp[-1]), 4), "ti": round(ti, 2)}
    trends = {"SP": sp, "PV": pv, "OP": op}
    out.keep(
        f"BIC{number}", trends, stated, kind="batch", cause=fault, swell=swell,
        batches=(n - WARM) // long, rise=middle - low,
    )  # fmt: skip


def plant(seed: int, overrides: int = 6, splits: int = 6, batches: int = 6, hours: float = 12.0) -> Plant:
    """A plant drawn from a seed."""
    rng, out, n = np.random.default_rng(seed), Plant(), int(3600 * hours) + WARM
    for k in range(overrides):
        override_pair(out, rng, 100 + k, n)
    for k in range(splits):
        split_range(out, rng, 200 + k, n)
    for k in range(batches):
        batch_loop(out, rng, 300 + k, n)
    return out
