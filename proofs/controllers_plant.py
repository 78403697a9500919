"""Three days of loops with typical plant controllers, simulated without code of the package.

There are fifteen controllers in position form. Their integral stops or tracks at a limit. The process is a lag with
dead time under a load that wanders and steps. The valve has no fault or has backlash; the set point is constant or
steps. The loops are recorded every second or every tenth second.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numba import njit

FORMS = (
    "PI",
    "ideal PID",
    "series PID",
    "parallel PID",
    "P only",
    "integral only",
    "gap",
    "error squared",
    "PV filter",
    "slow scan",
    "limit of OP's rate",
    "limit of OP",
    "set point weight",
    "fast PI",
    "gain schedule",
)
SCENES = ("healthy", "worn", "set point moves")
SCAN_S, DAY_S = 1.0, 86_400


@dataclass(frozen=True, slots=True)
class Controlled:
    """One loop: SP, PV and OP at every second, its row of loops.csv with the true settings, and the features that a
    list may omit."""

    form: str
    scene: str
    sp: np.ndarray
    pv: np.ndarray
    op: np.ndarray
    row: dict[str, object]
    extras: dict[str, object] = field(default_factory=dict)
    ideal: tuple[float, float, float] = (0.0, math.inf, 0.0)
    """Kp [%/%], Ti and Td [s] of the ideal form."""

    def trends(self, tag: str, every: int) -> pd.DataFrame:
        """The recording with one sample every `every` seconds."""
        time = pd.Timestamp("2026-03-02", tz="UTC") + pd.to_timedelta(
            np.arange(0, self.sp.size, every), unit="s"
        )
        columns = {"SP": np.round(self.sp, 3), "PV": np.round(self.pv, 3), "OP": np.round(self.op, 3)}
        return pd.DataFrame({"timestamp": time, **{f"{tag}.{k}": v[::every] for k, v in columns.items()}})


@njit(cache=True)
def _run(sp, load, noise, plant, gains, extras, limits, out):  # type: ignore[no-untyped-def]
    """Fill PV and OP, shape (2, n), one scan of a second after the other."""
    gain, lag, dead, play = plant
    kp, ki, kd, slope_lag = gains
    filter_s, gap, squared, weight, hold, upper = extras
    low, high, rate, tracks = limits
    n, late = sp.size, int(dead)
    op = integral = stem = 50.0
    y, seen, last, slope = sp[0], sp[0], sp[0], 0.0
    integral -= kp * (weight - 1.0) * sp[0]
    share = 1.0
    for k in range(n):
        behind = out[2, k - late] if k >= late else 50.0
        y += (50.0 + gain * (behind - 50.0) + load[k] - y) / lag
        pv = y + noise[k]
        seen += (pv - seen) / (1.0 + filter_s)
        if k % int(hold) == 0:
            h = hold
            e = sp[k] - seen
            if gap > 0.0:
                e = 0.0 if abs(e) < gap else e - math.copysign(gap, e)
            if squared > 0.0:
                e = e * abs(e) / 100.0
            slope += (-(seen - last) / h - slope) * h / (slope_lag + h)
            last = seen
            proportional = kp * (e + (weight - 1.0) * sp[k])
            now = upper if op > 50.0 else 1.0
            integral, share = integral + (share - now) * proportional, now
            proportional *= share
            trial = integral + share * ki * e * h
            wanted = proportional + trial + kd * slope
            held = min(max(wanted, low, op - rate * h), high, op + rate * h)
            if wanted == held or ki == 0.0:
                integral = trial
            elif tracks > 0.0:
                integral = trial + held - wanted
            op = held
        stem = min(max(stem, op - play / 2), op + play / 2)
        out[0, k], out[1, k], out[2, k] = pv, op, stem


def _walk(rng: np.random.Generator, n: int, size: float, memory_s: float) -> np.ndarray:
    """A load that wanders about 0 with occasional steps [% PV]."""
    pole = math.exp(-1.0 / memory_s)
    drive = rng.standard_normal(n) * size * math.sqrt(1 - pole * pole)
    walk = np.empty(n)
    _lag(drive, pole, walk)
    at = np.sort(rng.choice(n, max(n // 20_000, 1), replace=False))
    steps = np.zeros(n)
    steps[at] = rng.normal(0, size, at.size)
    fades = np.empty(n)
    _lag(steps, math.exp(-1.0 / (10 * memory_s)), fades)
    return walk + fades


@njit(cache=True)
def _lag(drive, pole, out):  # type: ignore[no-untyped-def]
    x = 0.0
    for k in range(drive.size):
        x = pole * x + drive[k]
        out[k] = x


@dataclass
class _Law:
    """A controller as simulated and as stated in loops.csv.

    gains kp, ki, kd; filter of PV [s], gap, squared, set point weight, scan [s], gain above an OP of 50 %;
    highest OP and its rate; the row, the features that it omits, and the settings of the ideal form.
    """

    kp: float
    ki: float
    kd: float
    ideal: tuple[float, float, float]
    row: dict[str, object]
    extra: dict[str, object] = field(default_factory=dict)
    filter_s: float = 0.0
    gap: float = 0.0
    squared: float = 0.0
    weight: float = 1.0
    hold: float = 1.0
    upper: float = 1.0
    high: float = 100.0
    rate: float = math.inf


def _with_derivative(law: _Law, form: str, settings: tuple[float, float, float], narrow: float) -> None:
    """The three forms of a PID."""
    kp, ti, td = settings
    law.extra = {"td_filter": narrow}
    if form == "series PID":
        law.ideal = (kp * (1 + td / ti), ti + td, ti * td / (ti + td))
        law.row["form"], law.kp = "series", law.ideal[0]
    elif form == "parallel PID":
        law.row |= {"form": "parallel", "ti": ti / kp, "td": kp * td}


def _with_form(
    law: _Law, form: str, plant: Plant, load: np.ndarray, rng: np.random.Generator, tight: float
) -> None:
    """The features of a form in addition to gain and integral time."""
    gain, lag, dead = plant
    kp, ti, _ = law.ideal
    match form:
        case "P only":
            law.ki, law.row["ti"], law.ideal = 0.0, 0.0, (kp, math.inf, 0.0)
        case "integral only":
            law.ki = (
                0.5 / (gain * (lag + dead) * rng.uniform(1.0, 2.0)) * tight**2
            )  # of a lag: damping by its root
            law.row |= {"kp": 0.0, "ti": 1.0 / law.ki}
            law.kp, law.ideal = 0.0, (0.0, 1.0 / law.ki, 0.0)
        case "gap":
            law.gap = round(rng.uniform(0.1, 0.5), 2)
            law.extra = {"gap": law.gap}
        case "error squared":
            law.squared, law.kp = 1.0, float(f"{kp * rng.uniform(15, 60):.3g}")
            law.ki, law.ideal, law.extra = law.kp / ti, (law.kp, ti, 0.0), {"error_form": "squared"}
            law.row["kp"] = law.kp
        case "PV filter":
            law.filter_s = round(dead * rng.uniform(0.2, 1.0), 1)
            law.extra = {"pv_filter_s": law.filter_s}
        case "slow scan":
            law.hold = float(rng.choice([2, 5]))
        case "limit of OP's rate":
            law.rate = round(rng.uniform(0.05, 0.5), 2)
            law.extra = {"op_rate": law.rate}
        case "limit of OP":
            law.high = round(50 + rng.uniform(0.3, 2.0) * load.std() / gain, 1)
            law.extra = {"op_hi_limit": law.high}
        case "set point weight":
            law.weight = round(rng.uniform(0.0, 0.6), 1)
            law.extra = {"sp_weight": law.weight}
        case "gain schedule":  # the gain stated is that below an OP of 50 %
            law.upper = round(rng.uniform(0.2, 0.6), 1)
            law.extra = {"gain_schedule": f"op 50:{law.upper}"}


Plant = tuple[float, float, float]
"""Gain [% PV/% OP], lag and dead time [s]."""


def _drawn(rng: np.random.Generator, form: str, tight: float) -> tuple[Plant, tuple[float, float, float]]:
    """A plant, with gain, integral time and derivative time of its controller."""
    gain, lag, dead = rng.uniform(0.7, 2.0), 10 ** rng.uniform(1.7, 2.7), 10 ** rng.uniform(0.7, 1.5)
    aim = dead * rng.uniform(1.2, 3.0)
    kp = tight * min(lag / (gain * (aim + dead)), 12.0)
    ti = min(lag, 4 * (aim + dead)) * rng.uniform(0.8, 1.3)
    td = dead * rng.uniform(0.3, 1.0) if "PID" in form else 0.0
    if form == "fast PI":
        lag, dead = rng.uniform(3.0, 10.0), 1.0
        kp, ti = round(rng.uniform(0.2, 0.6) / gain, 2), round(lag * rng.uniform(0.5, 1.2), 1)
        return (gain, lag, dead), (kp, ti, td)
    return (gain, lag, dead), (float(f"{kp:.3g}"), float(f"{ti:.3g}"), float(f"{td:.3g}"))


def _set_points(rng: np.random.Generator, n: int, scene: str) -> np.ndarray:
    """SP at each second [% PV], shape (n,)."""
    if scene != "set point moves":
        return np.full(n, 50.0)
    sp = 50.0 + np.repeat(rng.uniform(-4, 4, math.ceil(n / 7200)), 7200)[:n]
    sp[:7200] = 50.0
    return sp


def controlled(
    form: str,
    scene: str,
    seed: int,
    days: float = 3.0,
    tight: float = 1.0,
    typed: tuple[float, float] | None = None,
) -> Controlled:
    """One loop of a form in a scene, with `tight` times the gain. Where other settings are given, the controller uses
    their gain and integral time under the same load."""
    rng = np.random.default_rng([seed, FORMS.index(form), SCENES.index(scene)])
    n = int(days * DAY_S)
    plant, settings = _drawn(rng, form, tight)
    (gain, lag, dead), (kp, ti, td) = plant, settings
    noise = rng.standard_normal(n) * rng.choice([0.01, 0.02, 0.04])
    load = _walk(rng, n, rng.uniform(0.5, 2.0), lag * rng.uniform(1, 4))
    sp, narrow = _set_points(rng, n, scene), rng.choice([4.0, 8.0, 10.0])
    law = _Law(kp, kp / ti, kp * td, settings, {"kp": kp, "ti": ti, "td": td, "form": "ideal"})
    if "PID" in form:
        _with_derivative(law, form, settings, narrow)
    _with_form(law, form, plant, load, rng, tight)
    law.row["scan_s"] = SCAN_S * law.hold
    if typed is not None:
        law.row["kp"], law.row["ti"] = typed
        law.kp, law.ki = typed[0], (typed[0] or 1.0) / typed[1] if typed[1] else 0.0
    play = rng.uniform(0.5, 2.5) if scene == "worn" else 0.0
    out, tracks = np.empty((3, n)), float(rng.random() < 0.5)
    gains = law.kp, law.ki, law.kd, float(td / narrow)
    extras = law.filter_s, law.gap, law.squared, law.weight, law.hold, law.upper
    _run(
        sp, load, noise, (gain, lag, round(dead), play), gains, extras, (0.0, law.high, law.rate, tracks), out
    )
    law.row |= {"pv_lo": 0, "pv_hi": 100, "type": "temperature"}
    return Controlled(form, scene, sp, out[0], out[1], law.row, law.extra, law.ideal)
