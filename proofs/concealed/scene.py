"""A loop before it is recorded: plant, controller, inputs, settings of the historian."""

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from proofs.concealed.plant import Drive, Pi, Plant, close_loop

Rng = np.random.Generator
KINDS = {  # scan [s], then ranges of T [s], L [s], K
    "flow": (0.5, (3.0, 6.0), (1.0, 2.6), (0.7, 1.6)),
    "pressure": (1.0, (12.0, 40.0), (3.0, 8.0), (0.5, 2.0)),
    "temperature": (2.0, (80.0, 220.0), (15.0, 50.0), (0.6, 2.4)),
    "level": (2.0, (180.0, 380.0), (4.0, 12.0), (2.0, 6.0)),
}
SCANS = (5000, 18000)  # fewest and most a recording has


@dataclass(frozen=True)
class Historian:
    """The way of recording; with the defaults all values are kept unchanged."""

    pv_res: float = 0.01
    op_res: float = 0.01
    pv_exc: float = 0.0  # exception deadband [% PV]
    late_s: float = 0.0  # PV's clock behind OP's
    door_pv: float = 0.0  # swinging-door deviation [%]
    door_op: float = 0.0
    poll_sd: float = 0.0  # scatter of the polling [scans], stamps as polled
    alias: float = 0.0  # fast ripple that the polling aliases [% PV]
    alias_s: float = 600.0  # its apparent period
    stamp_sd: float = 0.0  # scatter of the stamps alone [scans]
    gaps: tuple[tuple[float, float], ...] = ()  # start and length as shares of the record
    outlier: float = 0.0


@dataclass(frozen=True)
class Scene:
    """One loop and its two future recordings; `reach` holds the OP and PV extremes of the baseline loop [%]."""

    kind: str
    scan: float
    plant: Plant
    pi: Pi
    stated: tuple[float, float]
    fit: Drive
    later: Drive
    historian: Historian
    reach: tuple[float, float, float, float]
    neighbours: tuple[np.ndarray, ...] = ()  # SP, PV, OP of another loop, per recording

    def with_plant(self, **changes: float) -> "Scene":
        """The same scene with other physics."""
        return replace(self, plant=self.plant._replace(**changes))

    def with_historian(self, **changes: object) -> "Scene":
        """The same scene with other settings of the historian."""
        return replace(self, historian=replace(self.historian, **changes))  # type: ignore[arg-type]


def log_uniform(rng: Rng, low: float, high: float) -> float:
    """A number between `low` and `high`, uniform in its logarithm."""
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def wander(rng: Rng, n: int, corner: float) -> np.ndarray:
    """Ornstein-Uhlenbeck path, shape (n,), of unit variance and time constant `corner` [scans]."""
    a = math.exp(-1.0 / corner)
    start = rng.normal()
    return lfilter([math.sqrt(1 - a * a)], [1, -a], rng.normal(size=n), zi=[a * start])[0]


def setpoints(rng: Rng, n: int, y0: float, settle: float, span: float, ramps: float) -> np.ndarray:
    """Steps (a share of them ramps) within `span` of `y0` [%], shape (n,), for some `settle` [scans] each."""
    sp, k, now = np.full(n, y0), int(settle * rng.uniform(0.5, 1.0)), y0
    while k < n - settle / 2:
        aim = y0 + float(rng.uniform(-span, span))
        if abs(aim - now) < 1.5:
            continue
        wait = int(settle * rng.uniform(0.4, 1.8))
        length = int(wait * 0.4) if rng.random() < ramps else 0
        sp[k:] = aim
        sp[k : k + length] = np.linspace(now, aim, length)[: max(n - k, 0)]
        k, now = k + wait, aim
    return sp


def load_path(rng: Rng, n: int, plant: Plant, scan: float, size: float) -> np.ndarray:
    """Coloured load and slow drift [% OP], shape (n,), that move PV by about `size` [%] rms in open loop."""
    corner = plant.T / scan
    raw = sum(
        rng.uniform(0.4, 1.0) * wander(rng, n, max(corner * c, 1.0)) * c**0.3 for c in (0.1, 0.6, 3.0, 12.0)
    )
    a = math.exp(-1.0 / corner)
    seen = plant.K * lfilter([1 - a], [1, -a], raw)
    return raw * size / float(np.std(seen))


def noise_path(rng: Rng, n: int, size: float, colour: float) -> np.ndarray:
    """Measurement noise [%], shape (n,): white with a little colour."""
    return size * lfilter([math.sqrt(1 - colour**2)], [1, -colour], rng.normal(size=n))


def drive(rng: Rng, n: int, plant: Plant, scan: float, sizes: dict[str, float]) -> Drive:
    """All inputs of the loop in one recording of `n` scans."""
    zero = np.zeros(n)
    late = (rng.random(n) < sizes["late"]).astype(float)
    sp = setpoints(rng, n, plant.y0, sizes["settle"], sizes["span"], sizes["ramps"])
    load = load_path(rng, n, plant, scan, sizes["load"])
    post = noise_path(rng, n, sizes["noise"], sizes["colour"])
    return Drive(sp, load, zero + 1, zero, post, late, zero + np.nan, zero + 100.0, zero, zero)


def tune(rng: Rng, p: Plant, scan: float, speed: float) -> Pi:
    """A PI tuned by internal model control with scatter; `speed` is the closed-loop time over L."""
    wish = speed * (p.L + scan)
    kp = min(p.T / (p.K * (wish + p.L)), 8.0)
    ti = min(p.T, 4.0 * (wish + p.L)) * log_uniform(rng, 0.75, 1.4)
    filt = scan * rng.uniform(0.1, 0.4) if rng.random() < 0.25 else 0.0
    res = float(rng.choice([0.0, 0.01, 0.025]))
    return Pi(kp * log_uniform(rng, 0.8, 1.2), ti, filt, res=res, hold_windup=float(rng.random() < 0.5))


def draw_plant(rng: Rng, kind: str, y0: tuple[float, float] = (42.0, 58.0)) -> Plant:
    """A baseline loop of that kind with a third lag that is too small to be identified."""
    scan, t, l, k = KINDS[kind]
    T, L = rng.uniform(*t), rng.uniform(*l)
    return Plant(
        K=log_uniform(rng, *k),
        T=T,
        L=L,
        v0=rng.uniform(40.0, 60.0),
        y0=rng.uniform(*y0),
        T3=max(rng.uniform(0.0, 0.04) * L, 0.06 * scan),
    )


def sizes_of(rng: Rng, plant: Plant, pi: Pi, scan: float) -> dict[str, float]:
    """Size of load and noise [% PV], and duration of a set point [scans]."""
    quick = (plant.T / (plant.K * pi.kp) + 2 * plant.L) / scan
    return {
        "load": rng.uniform(0.15, 0.5),
        "noise": rng.uniform(0.03, 0.15),
        "colour": rng.uniform(0.0, 0.3),
        "span": rng.uniform(5.0, 9.0),
        "ramps": 0.0,
        "late": float(rng.choice([0.0, 0.0, 0.02, 0.05])),
        "settle": float(np.clip(6 * quick + 0.5 * pi.ti / scan, 100, 700)),
    }


def reach_of(plant: Plant, pi: Pi, d: Drive, scan: float) -> tuple[float, float, float, float]:
    """Lowest and highest OP and PV of the baseline loop [%], without outliers."""
    pv, op = close_loop(plant, pi, d, scan)
    return (*np.quantile(op, [0.0005, 0.9995]), *np.quantile(pv, [0.0005, 0.9995]))  # type: ignore[return-value]


def draw_scene(rng: Rng, kind: str, low: bool = False, speed: float | None = None, **sizes: float) -> Scene:
    """A baseline scene, at low PV if `low`; `speed` and `sizes` replace the drawn values."""
    scan, plant = KINDS[kind][0], draw_plant(rng, kind, (20.0, 32.0) if low else (42.0, 58.0))
    pi = tune(rng, plant, scan, log_uniform(rng, 1.0, 5.0) if speed is None else speed)
    chosen = sizes_of(rng, plant, pi, scan) | sizes
    moves = rng.integers(26, 42)
    n = int(np.clip(moves * chosen["settle"], *SCANS))
    fit = drive(rng, n, plant, scan, chosen)
    later = drive(rng, n, plant, scan, chosen | {"settle": chosen["settle"] * log_uniform(rng, 0.7, 1.4)})
    hist = Historian(
        pv_res=float(rng.choice([0.01, 0.02, 0.05])),
        op_res=float(rng.choice([0.01, 0.05, 0.1])),
        pv_exc=float(rng.choice([0.0, 0.0, 0.01])),
        stamp_sd=float(rng.choice([0.0, 0.0, 0.0, 0.01])),
    )
    return Scene(kind, scan, plant, pi, (pi.kp, pi.ti), fit, later, hist, reach_of(plant, pi, fit, scan))
