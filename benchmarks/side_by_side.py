"""Identification and describing functions compared with other packages, on the same records.

    python -m benchmarks.side_by_side --records 8

Gain, time constant and dead time are identified from closed-loop records by this package, by sippy_unipi (ARX, ARMAX,
OE) and by statsmodels (AutoReg with OP as exogenous input). The constants of the other packages' models are
determined from their step responses. Describing functions are compared with python-control's. Writes side_by_side.md
next to this file. Packages that are not installed are omitted.
"""

from __future__ import annotations

import contextlib
import io
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np

from analyzer.config import Config
from analyzer.loop.identification.fit_data import problem_of
from analyzer.loop.identification.measure import measure, time_scale
from identification.estimation.backlash_stiction import fit_linear
from identification.models import Backlash, Fopdt, Loop, Pid
from identification.record import Floats, LoopRecord
from identification.simulation.closed_loop import closed_loop
from proofs.common import command, command_line, publish
from proofs.plant import START_S, run, wander
from tuning.describing import backlash, stick_slip

SCANS = 3600
"""Scans of a record, one a second."""
ACTUATOR_S = 0.6
"""Lag of the simulated actuator [s], which counts as dead time."""
BACKLASH_PCT = 1.5
REPEATS = 3

Model = tuple[float, float, float]
"""Gain [% PV / % OP], time constant and dead time [s]."""


@dataclass(frozen=True)
class Case:
    """A record and the process that made it."""

    record: LoopRecord
    truth: Model
    controller: Pid


@dataclass(frozen=True)
class Row:
    """Median errors of one method over records: gain, time constant [%], dead time [s]; processor time [ms]."""

    name: str
    gain: float
    lag: float
    delay: float
    time_ms: float
    lost: int


def case(seed: int, width_pct: float) -> Case:
    """A loop in automatic with set point steps under a coloured load; its dead time is not a whole number of
    scans."""
    rng = np.random.default_rng(seed)
    gain, lag, dead = rng.uniform(0.6, 2.0), rng.uniform(20.0, 60.0), rng.uniform(3.0, 9.0)
    kp, ti = 0.5 * lag / (gain * 2.5 * dead), lag
    sp = 50.0 + np.repeat(rng.uniform(-4, 4, SCANS // 200 + 1), 200)[:SCANS]
    sp[:100] = 50.0
    load, noise = wander(rng, SCANS, 0.6, 300.0), 0.05 * rng.standard_normal(SCANS)
    fixed = np.full(SCANS, kp), np.full(SCANS, ti), np.zeros(SCANS), np.zeros(SCANS, dtype=bool)
    pv, op, _ = run(sp, load, noise, *fixed, 50.0, (width_pct, 0.0, 0.0), (gain, lag, dead))
    record = LoopRecord("L", START_S, 1.0, sp, pv, op, np.zeros(SCANS, dtype=bool))
    return Case(record, (gain, lag, dead + ACTUATOR_S), Pid(kp, ti))


def ours(made: Case) -> Model:
    """The baseline process, or the process behind backlash where the evidence of backlash is sufficient; without
    prior information."""
    limits = Config().cause
    m = measure(made.record, None, made.controller, limits)
    fit = m.backlash if m.evidence >= limits.evidence_unexcited else m.linear
    p = fit.process
    return p.gain, p.time_constant_s, p.dead_time_s


def plain(made: Case) -> Model:
    """The process behind an ideal valve."""
    problem = problem_of(made.record, time_scale(made.record, None, made.controller), Config().cause)
    p = fit_linear(problem, time_scale(made.record, None, made.controller)).process
    return p.gain, p.time_constant_s, p.dead_time_s


def read_off(step: Floats) -> Model:
    """Gain, time constant and dead time from a unit step response, one value a second from 0, shape (n,).

    By the times of 28.3 and 63.2 % (Smith, Corripio 1985).
    """
    gain = float(step[-1])
    share = step / gain
    early, late = (float(np.interp(1.0, *_rise(share, level))) for level in (0.283, 0.632))
    lag = 1.5 * (late - early)
    return gain, lag, late - lag


def _rise(share: Floats, level: float) -> tuple[Floats, Floats]:
    """First crossing of a level by a response: the two samples around it, scaled to the level, and their times."""
    k = max(int(np.argmax(share >= level)), 1)
    return share[k - 1 : k + 1] / level, np.array([k - 1.0, float(k)])


def from_polynomials(a: Floats, b: Floats, delay: int) -> Model:
    """The model y[k] = -a1 y[k-1] - ... + b1 u[k-1-delay] + ..., by its step response."""
    n = 3000
    y, u = np.zeros(n), np.ones(n)
    for k in range(1, n):
        past = sum(-a[i] * y[k - 1 - i] for i in range(a.size) if k - 1 - i >= 0)
        y[k] = past + sum(b[i] * u[k - 1 - delay - i] for i in range(b.size) if k - 1 - delay - i >= 0)
    return read_off(y)


def statsmodels_arx(made: Case) -> Model:
    """AutoReg of one lag with two lags of OP; the whole scans of dead time are given."""
    from statsmodels.tsa.ar_model import AutoReg

    r, delay = made.record, int(made.truth[2])
    y, u = r.pv - r.pv.mean(), r.op - r.op.mean()
    first = delay + 3
    lags = np.stack([u[first - 1 - delay - i : u.size - 1 - delay - i] for i in range(2)], axis=1)
    fit = AutoReg(y[first:], 1, exog=lags, trend="c").fit()
    return from_polynomials(-fit.params[1:2], fit.params[2:4], delay)


def sippy(method: str) -> Callable[[Case], Model]:
    """A model of sippy_unipi with the true structure; the whole scans of dead time are given."""

    def identified(made: Case) -> Model:
        from sippy_unipi import system_identification

        d = int(made.truth[2])
        chosen = {"IC": "AIC", "na_ord": [1, 2], "nb_ord": [1, 2], "delays": [0, 12]}
        orders = {"ARX": [1, 2, d], "ARMAX": [1, 2, 1, d], "OE": [2, 1, d]}
        given = chosen if method == "AIC" else {f"{method}_orders": orders[method]}
        with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            r = made.record
            found = system_identification(
                r.pv, r.op, "ARX" if method == "AIC" else method, centering="MeanVal", tsample=1.0, **given
            )
        b, a = (np.ravel(np.asarray(x[0][0], dtype=float)) for x in (found.G.num, found.G.den))
        return read_off(_response(b, a, 3000))

    return identified


def _response(b: Floats, a: Floats, n: int) -> Floats:
    """Unit step response of b(z)/a(z), shape (n,)."""
    from scipy.signal import lfilter

    padded = np.concatenate((np.zeros(a.size - b.size), b))
    return np.asarray(lfilter(padded / a[0], a / a[0], np.ones(n)), dtype=np.float64)


def methods() -> dict[str, Callable[[Case], Model]]:
    """All methods that are installed."""
    found: dict[str, Callable[[Case], Model]] = {
        "this package": ours,
        "this package, valve taken as ideal": plain,
    }
    if find_spec("sippy_unipi"):
        found["sippy_unipi ARX, orders and delay by AIC"] = sippy("AIC")
        found |= {f"sippy_unipi {m}": sippy(m) for m in ("ARX", "ARMAX", "OE")}
    found["statsmodels AutoReg"] = statsmodels_arx
    return found


def row(name: str, method: Callable[[Case], Model], cases: Sequence[Case]) -> Row:
    """Errors and time of one method; a model without a stable, rising step response is lost."""
    method(cases[0])
    errors, times = [], []
    for made in cases:
        begun = time.process_time()
        model = np.array(method(made))
        times.append(1000 * (time.process_time() - begun))
        off = np.abs(model - np.array(made.truth)) / np.array([made.truth[0] / 100, made.truth[1] / 100, 1.0])
        errors.append(off if np.all(np.isfinite(off)) and model[1] > 0 else np.full(3, np.inf))
    lost = sum(not np.isfinite(e[0]) for e in errors)
    return Row(name, *(float(v) for v in np.median(errors, axis=0)), float(np.median(times)), lost)


def identification(records: int) -> dict[str, list[Row]]:
    """All methods on records without and with backlash."""
    out = {}
    for title, width_pct in (
        ("ideal valve", 0.0),
        (f"backlash of {BACKLASH_PCT:g} % in the valve", BACKLASH_PCT),
    ):
        cases = [case(seed, width_pct) for seed in range(records)]
        out[title] = [row(name, method, cases) for name, method in methods().items()]
    return out


def identification_table(found: dict[str, list[Row]]) -> str:
    """The table in Markdown."""
    lines = [
        "| records | method | gain, error % | time constant, error % | dead time, error s | time ms | lost |",
        "|---|---|---|---|---|---|---|",
    ]
    for title, rows in found.items():
        for r in rows:
            figures = f"{r.gain:.1f} | {r.lag:.1f} | {r.delay:.2f} | {r.time_ms:.0f} | {r.lost}"
            lines.append(f"| {title} | {r.name} | {figures} |")
    return "\n".join(lines)


def fourier(amplitude: float, width: float, relay: bool, points: int = 200_000) -> complex:
    """Describing function of backlash, or of a relay with height and hysteresis `width`/2, by a sum over one
    period."""
    angle = 2 * np.pi * np.arange(2 * points) / points
    sine = amplitude * np.sin(angle)
    half, now = 0.5 * width, 0.0
    out = np.empty_like(sine)
    for k, x in enumerate(sine):
        switched = half if x > half else -half if x < -half else now
        now = switched if relay else min(max(now, x - half), x + half)
        out[k] = now
    return complex(2j * np.mean(out[points:] * np.exp(-1j * angle[points:])) / amplitude)


def describing_table() -> str:
    """Largest deviation from the sum over a period, and time for 1000 amplitudes, of both packages."""
    import control

    amplitude = np.linspace(0.6, 4.0, 1000)
    gap, relay = control.friction_backlash_nonlinearity(1.0), control.relay_hysteresis_nonlinearity(0.5, 0.5)
    rows = {
        "backlash, this package": (lambda a: backlash(a, 1.0), False),
        "backlash, python-control": (lambda a: control.describing_function(gap, a), False),
        "relay, this package": (lambda a: stick_slip(a, 1.0, 1.0), True),
        "relay, python-control": (lambda a: control.describing_function(relay, a), True),
    }
    lines = ["| describing function | largest error | ms for 1000 amplitudes |", "|---|---|---|"]
    for name, (function, is_relay) in rows.items():
        some = amplitude[::200] if not is_relay else amplitude[amplitude < 1.5][::60]
        exact = np.array([fourier(float(a), 1.0, is_relay) for a in some])
        got = np.asarray(function(some))
        taken, _ = fastest(lambda function=function: function(amplitude))
        lines.append(f"| {name} | {np.abs(got - exact).max():.1e} | {1000 * taken:.2f} |")
    return "\n".join(lines)


def fastest(task: Callable[[], object]) -> tuple[float, object]:
    """Least processor time of a few runs [s] without the first, and the result of the last one."""
    made = task()
    least = np.inf
    for _ in range(REPEATS):
        begun = time.process_time()
        made = task()
        least = min(least, time.process_time() - begun)
    return float(least), made


FRESH = """
import time
import numpy as np
from identification.models import Backlash, Fopdt, Loop, Pid
from identification.simulation.closed_loop import closed_loop
from identification.estimation.backlash_stiction import fit_linear
loop = Loop(Fopdt(80, 200, 1), Pid(1, 10), Backlash(1.0))
n = np.zeros(86400)
for _ in range(2):
    begun = time.process_time()
    closed_loop(loop, n, n)
    print(1000 * (time.process_time() - begun))
"""


def first_calls() -> tuple[float, float]:
    """First and second simulation of a day in a fresh process [ms of processor time], kernels compiled before."""
    for _ in range(2):
        done = subprocess.run([sys.executable, "-c", FRESH], capture_output=True, text=True, check=True)
    first, second = (float(x) for x in done.stdout.split())
    return first, second


def day() -> tuple[LoopRecord, Pid]:
    """A day of a tank with backlash, one value a second."""
    rng = np.random.default_rng(1)
    pid, n = Pid(0.9, 40.0), 86_400
    load = wander(rng, n, 0.5, 1800.0) + 0.05 * rng.standard_normal(n)
    record = closed_loop(Loop(Fopdt(60.0, 1800.0, 9.0), pid, Backlash(2.5)), np.full(n, 50.0), load)
    return record, pid


def speed_table() -> str:
    """Times of a simulation and of an identification of a day, relative to floors."""
    from scipy.signal import lfilter

    from analyzer.loop.oscillation.detection import detect

    loop, zero = Loop(Fopdt(80, 200, 1), Pid(1, 10), Backlash(1.0)), np.zeros(86_400)
    noise = np.random.default_rng(0).standard_normal(86_400)
    record, pid = day()
    found = detect(record, Config().oscillation)
    floor, _ = fastest(lambda: lfilter([0.1], [1.0, -0.9], noise))
    simulated, _ = fastest(lambda: closed_loop(loop, zero, 0.1 * noise))
    transform, _ = fastest(lambda: [np.fft.rfft(x) for x in (record.sp, record.pv, record.op)])
    identified, _ = fastest(lambda: measure(record, found.first, pid, Config().cause, found.spectrum))
    first, second = first_calls()
    return "\n".join(
        [
            "| what | ms | over |",
            "|---|---|---|",
            f"| closed loop of 86,400 scans with backlash | {1000 * simulated:.2f} | {simulated / floor:.1f} times"
            " one first-order filter over as many |",
            f"| identification of a day at 1 s, with all candidates of the valve | {1000 * identified:.0f} |"
            f" {identified / transform:.0f} times a transform of its trends |",
            f"| first closed loop of a fresh process, kernels cached | {first:.0f} | the second takes {second:.1f} |",
        ]
    )


def main() -> None:
    """Measure and write the tables next to this file."""
    options = command_line(__doc__, records=8)
    about = (
        f"Medians over {options.records} records of {SCANS} scans in closed loop, set point steps under coloured\n"
        "load; the dead times are not whole scans. The other methods, except AIC, get the structure and the whole\n"
        "scans of dead time; this package gets neither. The time is that of one record; with this package it\n"
        "includes the search for a valve fault. Processor time, after one call that is not counted."
    )
    missing = "" if find_spec("sippy_unipi") else "\n\nsippy_unipi is not installed and was left out."
    tables = [identification_table(identification(options.records)), describing_table(), speed_table()]
    publish(__file__, "Side by side", command(__file__, records=options.records), about + missing, *tables)


if __name__ == "__main__":
    main()
