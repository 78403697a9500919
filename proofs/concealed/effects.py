"""The entries of the catalogue: for each name, the physics for a given strength. Parameters are drawn at random."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from proofs.concealed import acting
from proofs.concealed.scene import Rng, Scene

Made = tuple[Scene, dict[str, float]]
Apply = Callable[[Scene, float, Rng], Made]
ALL = ("flow", "pressure", "temperature", "level")


@dataclass(frozen=True)
class Effect:
    """A name of the catalogue, its block, and its function.

    `low` and `high` bound the strength when information grades it; `sizes` are the strengths of the four levels when
    size grades it.
    """

    name: str
    block: str
    make: Apply
    low: float = 0.0
    high: float = 0.0
    sizes: tuple[float, ...] = ()
    kinds: tuple[str, ...] = ALL
    low_pv: bool = False


def lag_of(scene: Scene, s: float) -> float:
    """`s` time constants [s], but at least the shortest lag that the fine steps allow."""
    return max(s * scene.plant.T, 0.06 * scene.scan)


def backlash(scene: Scene, s: float, rng: Rng) -> Made:
    """Backlash of `s` % of OP."""
    return scene.with_plant(gap=s), {"backlash": s}


def stiction(scene: Scene, s: float, rng: Rng) -> Made:
    """Stickband `s` %: the sum of static and sliding friction; their difference is the slip jump."""
    jump = s * rng.uniform(0.4, 0.8)
    made = scene.with_plant(static=0.5 * (s + jump), sliding=0.5 * (s - jump))
    return made, {"stick_S": s, "stick_J": jump}


def rate_limit(scene: Scene, s: float, rng: Rng) -> Made:
    """A slew rate of 10 % of OP in `s` time constants."""
    rate = 10.0 / (s * scene.plant.T)
    return scene.with_plant(rate=rate), {"rate": rate}


def saturation(scene: Scene, s: float, rng: Rng) -> Made:
    """A stop that removes the share `s` of the travel above rest."""
    stop = scene.plant.v0 + (scene.reach[1] - scene.plant.v0) * (1.2 - s)
    return scene.with_plant(stop=stop), {"vmax": stop}


def valve_characteristic(scene: Scene, s: float, rng: Rng) -> Made:
    """Equal-percentage or quick-opening trim: gain changes by exp(s) over the full stroke."""
    bend = s if rng.random() < 0.7 else -s
    return scene.with_plant(bend=bend), {"bend": bend}


def positioner(scene: Scene, s: float, rng: Rng) -> Made:
    """An underdamped position loop with a dead zone, both growing with `s`."""
    lag, damping, dead = 0.25 * s * scene.plant.T, rng.uniform(0.3, 0.6), s * rng.uniform(1.0, 2.0)
    made = scene.with_plant(pos_w=1.0 / max(lag, 0.25 * scene.scan), pos_z=damping, pos_dead=dead)
    return made, {"positioner_lag": lag, "deadband": 2 * dead}


def split_range(scene: Scene, s: float, rng: Rng) -> Made:
    """A second valve above a split point: dead zone, other gain, own lag."""
    ratio = math.exp(s * rng.choice([-1.0, 1.0]))
    at, dead = scene.plant.v0 + rng.uniform(-1.5, 1.0), s * rng.uniform(0.5, 1.5)
    made = scene.with_plant(split_at=at, split_dead=dead, split_ratio=ratio, split_s=lag_of(scene, 0.4 * s))
    return made, {"split_at": at, "split_ratio": ratio, "split_dead": dead}


def second_lag(scene: Scene, s: float, rng: Rng) -> Made:
    """One more lag of `s` time constants, sometimes with a third of half its size."""
    t2 = lag_of(scene, s)
    t3 = max(0.5 * t2, scene.plant.T3) if rng.random() < 0.3 else scene.plant.T3
    return scene.with_plant(T2=t2, T3=t3), {"T2": t2, "T3": t3}


def slow_mode(scene: Scene, s: float, rng: Rng) -> Made:
    """A share `s` of the gain with a delay of several time constants."""
    slow_t = rng.uniform(4.0, 10.0) * scene.plant.T
    return scene.with_plant(slow=s, slow_s=slow_t), {"slow_share": s, "slow_T": slow_t}


def inverse_response(scene: Scene, s: float, rng: Rng) -> Made:
    """A small fast response of opposite sign: a right-half-plane zero of `s` time constants."""
    T = scene.plant.T
    beta, fast = s * T, lag_of(scene, 0.25 * s)
    return scene.with_plant(oppose=(beta + fast) / (T - fast), oppose_s=fast), {"inverse": beta}


def direction_asymmetry(scene: Scene, s: float, rng: Rng) -> Made:
    """Different time constants up and down; their ratio is exp(s) or its inverse."""
    asym = s * float(rng.choice([-1.0, 1.0]))
    T = scene.plant.T
    return scene.with_plant(asym=asym), {"T_up": T * math.exp(-asym / 2), "T_down": T * math.exp(asym / 2)}


def nonlinear_gain(scene: Scene, s: float, rng: Rng) -> Made:
    """Gain and lag that change by the share `s` over 50 % of PV."""
    slope = s * float(rng.choice([-1.0, 1.0]))
    return scene.with_plant(slope=slope), {"gain_slope": slope}


def sqrt_outflow(scene: Scene, s: float, rng: Rng) -> Made:
    """Outflow by the square root of the head; `s` is PV at rest over that head (1: the head is PV itself)."""
    return scene.with_plant(root=s), {"root": s}


def overflow(scene: Scene, s: float, rng: Rng) -> Made:
    """A weir below the highest set points; a part of the overflow returns later."""
    cap = (scene.reach[3] - scene.plant.y0) * (1.2 - s)
    back = float(rng.choice([0.0, 0.3]))
    made = scene.with_plant(cap=cap, spill=back, spill_s=rng.uniform(0.5, 2.0) * scene.plant.T)
    return made, {"cap": scene.plant.y0 + cap, "spill": back}


def integrator(scene: Scene, s: float, rng: Rng) -> Made:
    """A process without self-regulation; load and noise are divided by `s`."""
    return acting.scaled(scene.with_plant(leak=0.0), 1.0 / s), {"slope": scene.plant.K / scene.plant.T}


def flow_dependent_delay(scene: Scene, s: float, rng: Rng) -> Made:
    """A pipe whose flow follows the valve with the share `s`."""
    return scene.with_plant(pipe=s), {"flow_delay": s}


def gain_drift(scene: Scene, s: float, rng: Rng) -> Made:
    """Gain that changes by the share `s` from start to end of each recording."""
    drift = s * float(rng.choice([-1.0, 1.0]))
    return scene.with_plant(drift=drift), {"gain_drift": drift}


def sensor_lag(scene: Scene, s: float, rng: Rng) -> Made:
    """A transmitter with a filter of `s` time constants; most of the noise is added before the filter."""
    lag = lag_of(scene, s)
    return acting.noise_before_sensor(scene.with_plant(lag=lag), 0.85), {"lag": lag}


def quantization(scene: Scene, s: float, rng: Rng) -> Made:
    """A converter with steps of `s` %."""
    grid = s * rng.uniform(0.8, 1.25)
    return scene.with_plant(grid=grid), {"quant": grid}


def sensor_clipping(scene: Scene, s: float, rng: Rng) -> Made:
    """A transmitter whose range ends below (or above) a share `s` of the PV values."""
    if rng.random() < 0.7:
        clip = scene.plant.y0 + (scene.reach[3] - scene.plant.y0) * (1.2 - s)
        return scene.with_plant(clip_hi=clip), {"pv_clip": clip}
    clip = scene.plant.y0 + (scene.reach[2] - scene.plant.y0) * (1.2 - s)
    return scene.with_plant(clip_lo=clip), {"pv_clip": clip}


NAMES = (
    Effect("backlash", "valve", backlash, 0.03, 15.0),
    Effect("stiction", "valve", stiction, 0.03, 12.0),
    Effect("rate-limit", "valve", rate_limit, 0.003, 4.0),
    Effect("saturation", "valve", saturation, 0.02, 1.1),
    Effect("valve-characteristic", "valve", valve_characteristic, 0.05, 8.0),
    Effect("positioner", "valve", positioner, 0.01, 2.0),
    Effect("split-range", "valve", split_range, 0.01, 1.5),
    Effect("second-lag", "process", second_lag, 0.004, 0.9),
    Effect("slow-mode", "process", slow_mode, 0.004, 0.6),
    Effect("inverse-response", "process", inverse_response, 0.005, 0.9),
    Effect("direction-asymmetry", "process", direction_asymmetry, 0.01, 2.0),
    Effect("nonlinear-gain", "process", nonlinear_gain, 0.02, 3.0),
    Effect("sqrt-outflow", "process", sqrt_outflow, 0.03, 1.0, kinds=("level",), low_pv=True),
    Effect("overflow", "process", overflow, 0.02, 1.1, kinds=("level",)),
    Effect("integrator", "process", integrator, 0.1, 60.0, kinds=("level", "pressure")),
    Effect("flow-dependent-delay", "process", flow_dependent_delay, 0.02, 1.6),
    Effect("gain-drift", "process", gain_drift, 0.005, 1.6),
    Effect("sensor-lag", "sensor", sensor_lag, 0.004, 0.9),
    Effect("quantization", "sensor", quantization, sizes=(1.2, 0.5, 0.2, 0.1)),
    Effect("sensor-clipping", "sensor", sensor_clipping, 0.02, 1.1),
    Effect("compression", "recorder", acting.compression, sizes=(2.0, 1.0, 0.5, 0.25)),
    Effect("clock-offset", "recorder", acting.clock_offset, sizes=(10.0, 7.0, 3.0, 2.0)),
    Effect("sampling", "recorder", acting.sampling, sizes=(2.0, 1.0, 0.6, 0.4)),
    Effect("controller-settings", "controller", acting.controller_settings, sizes=(2.0, 1.6, 1.3, 1.12)),
    Effect("controller-gap", "controller", acting.controller_gap, sizes=(1.6, 1.0, 0.7, 0.45)),
    Effect("controller-logic", "controller", acting.controller_logic, sizes=(1.0, 0.6, 0.35, 0.2)),
    Effect("load-step", "load", acting.load_step, 0.02, 25.0),
    Effect("load-oscillation", "load", acting.load_oscillation, 0.02, 15.0),
    Effect("supply-variation", "load", acting.supply_variation, 0.004, 0.8),
    Effect("coupling", "load", acting.coupling, 0.01, 6.0),
)
CATALOGUE = {e.name: e for e in NAMES}


def apply(effect: Effect, scene: Scene, strength: float, seed: int) -> Made:
    """The scene with the effect at that strength; nuisance parameters come from `seed` alone."""
    return effect.make(scene, strength, np.random.default_rng(seed))
