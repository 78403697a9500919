"""Physics that no code names, neither the catalogue nor the other generators. An explanation must report it as
`unexplained`, because of its residual. The second deck was not used before the thresholds were set on the first."""

from dataclasses import replace

import numpy as np

from proofs.concealed.acting import both
from proofs.concealed.effects import Effect, Made
from proofs.concealed.plant import Drive
from proofs.concealed.scene import Rng, Scene


def flow_regimes(scene: Scene, s: float, rng: Rng) -> Made:
    """Above a certain flow the gain is different, until the flow falls well below it: two regimes with a
    hysteresis."""
    sign, at = float(rng.choice([-0.5, 1.0])), float(rng.uniform(-1.0, 1.0))
    band = float(rng.uniform(2.0, 6.0))
    made = scene.with_plant(regime=sign * s, regime_at=at, regime_band=band)
    return made, {"regime": sign * s, "band": band}


def clocked_pump(scene: Scene, s: float, rng: Rng) -> Made:
    """A second pump that runs at a constant frequency."""
    period, duty = rng.uniform(0.03, 0.1), rng.uniform(0.2, 0.5)

    def runs(d: Drive) -> Drive:
        n = len(d.sp)
        return replace(d, act=d.act + s * ((np.arange(n) / n + rng.random()) % period < duty * period))

    return both(scene, runs), {"pump": s}


def fatigue(scene: Scene, s: float, rng: Rng) -> Made:
    """A gain that decreases with travel and recovers at rest."""
    rest = rng.uniform(8.0, 30.0) * (scene.plant.T + scene.plant.L)
    return scene.with_plant(tired=s, tired_s=rest), {"tired": s}


def zeroing(scene: Scene, s: float, rng: Rng) -> Made:
    """A sensor that drifts and is reset to zero at constant intervals."""
    period = rng.uniform(0.04, 0.12)

    def drifts(d: Drive) -> Drive:
        n = len(d.sp)
        return replace(d, pre=d.pre + s * ((np.arange(n) / n + rng.random()) % period / period - 0.5))

    return both(scene, drifts), {"drift": s}


def two_ways(scene: Scene, s: float, rng: Rng) -> Made:
    """Flow above its value at rest takes a longer path."""
    late = s * (scene.plant.T + scene.plant.L)
    return scene.with_plant(detour=late), {"detour": late}


def foaming(scene: Scene, s: float, rng: Rng) -> Made:
    """A surface that foams while it moves, in either direction."""
    return scene.with_plant(foam=s), {"foam": s}


def relay(scene: Scene, s: float, rng: Rng) -> Made:
    """A load that acts for a set time whenever PV passes a threshold."""
    at = float(rng.uniform(0.0, 2.5))
    lasts = rng.uniform(1.0, 6.0) * (scene.plant.T + scene.plant.L)
    return scene.with_plant(relay=s, relay_at=at, relay_s=lasts), {"relay": s}


def slow_actuator(scene: Scene, s: float, rng: Rng) -> Made:
    """An actuator that takes a new position only at intervals."""
    wait = s * (scene.plant.T + scene.plant.L)
    return scene.with_plant(hold_s=wait), {"hold_s": wait}


def purge(scene: Scene, s: float, rng: Rng) -> Made:
    """A sensor that is purged at intervals; its value is constant during a purge."""
    period = rng.uniform(10.0, 30.0) * (scene.plant.T + scene.plant.L)
    return scene.with_plant(purge=s, purge_s=period), {"purge": s}


FIRST_DECK = (
    Effect("flow-regimes", "process", flow_regimes, 0.01, 2.0),
    Effect("clocked-pump", "load", clocked_pump, 0.02, 25.0),
    Effect("fatigue", "process", fatigue, 0.002, 1.0),
    Effect("zeroing", "sensor", zeroing, sizes=(3.0, 1.5, 0.7, 0.35)),
)
SECOND_DECK = (
    Effect("two-ways", "process", two_ways, 0.01, 2.0),
    Effect("foaming", "sensor", foaming, 0.01, 4.0),
    Effect("relay", "load", relay, 0.02, 25.0),
    Effect("slow-actuator", "valve", slow_actuator, sizes=(1.0, 0.5, 0.25, 0.12)),
    Effect("purge", "sensor", purge, sizes=(0.3, 0.15, 0.08, 0.04)),
)
