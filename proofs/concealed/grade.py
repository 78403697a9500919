"""The information of a recording: doubled log-likelihood gain of the true model with known noise over the best
baseline FOPDT, and the strength of an effect that brings it to a level."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter

from proofs.concealed.plant import Drive, Plant, close_loop, idle, open_loop
from proofs.concealed.scene import Scene

LEVELS = {"plain": 2000.0, "masked": 500.0, "concealed": 120.0, "buried": 40.0}
ORDER = 20  # of the whitener
TOLERANCE = 0.2


@dataclass(frozen=True)
class Baseline:
    """The best baseline FOPDT: gain, time constant [s], dead time [s], bias [%]; `energy` is its residual energy."""

    K: float
    T: float
    L: float
    bias: float
    energy: float


def quiet(d: Drive) -> Drive:
    """The same drive without load and noise; inputs of an effect are kept."""
    return replace(d, load=0.0 * d.load, pre=0.0 * d.pre, post=0.0 * d.post)


def fopdt(op: np.ndarray, T: float, L: float, scan: float) -> np.ndarray:
    """Response of unit gain to OP, shape (n,), relative to rest; OP is held between scans; any L [s]."""
    d, part = divmod(L / scan, 1.0)
    a, b = math.exp(-scan / T), math.exp(-scan * (1 - part) / T)
    late = np.concatenate([np.zeros(int(d) + 2), op])[: len(op) + 1]
    return lfilter([1 - b, b - a], [1, -a], late)[1:]


def whitener(noise: np.ndarray) -> np.ndarray:
    """Filter, shape (21,), that whitens noise of this spectrum, shape (n,), to unit variance."""
    x = noise - noise.mean()
    lagged = np.column_stack([x[ORDER - i - 1 : len(x) - i - 1] for i in range(ORDER)])
    gram = lagged.T @ lagged
    coef = np.linalg.solve(gram + 1e-9 * np.trace(gram) * np.eye(ORDER), lagged.T @ x[ORDER:])
    residual = x[ORDER:] - lagged @ coef
    return np.concatenate([[1.0], -coef]) / np.std(residual)


def project(pv: np.ndarray, op: np.ndarray, T: float, L: float, scan: float, w: np.ndarray) -> tuple:
    """Whitened residual, gain and bias of the best FOPDT with this T and L [s]."""
    g = fopdt(op, T, L, scan)
    cols = np.column_stack([lfilter(w, 1, g), lfilter(w, 1, np.ones(len(g)))])[2 * ORDER :]
    aim = lfilter(w, 1, pv)[2 * ORDER :]
    gram = cols.T @ cols
    k = np.linalg.solve(gram + 1e-12 * np.trace(gram) * np.eye(2), cols.T @ aim)
    return aim - cols @ k, float(k[0]), float(k[1])


def best_baseline(
    pv: np.ndarray,
    op: np.ndarray,
    scan: float,
    w: np.ndarray,
    starts: list[tuple[float, float]],
    t_max: float,
) -> Baseline:
    """The baseline FOPDT with the least whitened residual; `starts` are pairs of T and L [s]."""
    found = []
    for T, L in starts:
        fun = lambda v: project(pv, op, math.exp(v[0]), v[1], scan, w)[0]  # noqa: E731
        low, high = [math.log(0.2 * scan), 0.0], [math.log(t_max), 40 * L + 20 * scan]
        x0 = np.clip([math.log(T), L], np.add(low, 1e-6), np.subtract(high, 1e-6))
        found.append(
            least_squares(fun, x0, bounds=(low, high), x_scale=[0.3, L + scan], diff_step=1e-3, max_nfev=25)
        )
    best = min(found, key=lambda r: r.cost)
    T, L = math.exp(best.x[0]), best.x[1]
    r, k, b = project(pv, op, T, L, scan, w)
    return Baseline(k, T, L, b, float(r @ r))


def noise_like(scene: Scene, base: Plant) -> np.ndarray:
    """Load and noise in PV [%], shape (n,), at constant OP, with the recorder's rounding."""
    own = base._replace(lag=scene.plant.lag, leak=scene.plant.leak)
    d = replace(idle(len(scene.fit.sp), own), load=scene.fit.load, pre=scene.fit.pre, post=scene.fit.post)
    pv = open_loop(own, np.full(len(d.sp), own.v0), d, scene.scan) - own.y0
    step = max(scene.historian.pv_res, 1e-3)
    return pv + np.random.default_rng(0).normal(0, step / math.sqrt(12), len(pv))


@dataclass(frozen=True)
class Grade:
    """The residual energy of the baseline model for an effect of some strength, and that model."""

    energy: float
    plain: Baseline
    op: np.ndarray
    pv: np.ndarray


def energy_of(scene: Scene, base: Plant, start: tuple[float, float] | None = None) -> Grade:
    """Energy of the difference between `scene` and the baseline plant `base`, with the OP of the scene's closed
    loop."""
    pv, op = close_loop(scene.plant, scene.pi, scene.fit, scene.scan)
    clean = open_loop(scene.plant, op, quiet(scene.fit), scene.scan)
    p = scene.plant
    starts = [(p.T, p.L), (1.6 * p.T, p.L + p.T2 + 0.1 * p.T)] if start is None else [start]
    t_max = 0.1 * len(op) * scene.scan if p.leak == 0.0 else 60 * p.T
    plain = best_baseline(clean, op - p.v0, scene.scan, whitener(noise_like(scene, base)), starts, t_max)
    return Grade(plain.energy, plain, op, pv)


def strength_for(
    grade_at: Callable[[float], Grade], target: float, low: float, high: float
) -> tuple[float, Grade] | None:
    """Strength between `low` and `high` whose energy is `target` within tolerance; None if there is none."""
    a, b = math.log(low), math.log(high)
    s = 0.5 * (a + b)
    for _ in range(16):
        g = grade_at(math.exp(s))
        gap = math.log(max(g.energy, 1e-3) / target)
        if abs(gap) < TOLERANCE:
            return math.exp(s), g
        a, b = (s, b) if gap < 0 else (a, s)
        step = s - 0.5 * gap
        s = step if a + 0.05 * (b - a) < step < b - 0.05 * (b - a) else 0.5 * (a + b)
        if b - a < 1e-3:
            return None
    return None
