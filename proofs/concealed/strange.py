"""Physics outside the catalogue (right answer: unexplained) and harmless oddities (right answer: none)."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from proofs.concealed.acting import both, scaled
from proofs.concealed.effects import Effect, Made
from proofs.concealed.plant import Drive
from proofs.concealed.scene import Rng, Scene, draw_scene, log_uniform


def rate_gain(scene: Scene, s: float, rng: Rng) -> Made:
    """A gain that increases with the rate of the move."""
    return scene.with_plant(hurry=s), {"hurry": s}


def swinging_mount(scene: Scene, s: float, rng: Rng) -> Made:
    """A share `s` of the reading comes from an oscillating mount."""
    w = 2.0 / (scene.plant.T * rng.uniform(0.5, 1.0) + scene.plant.L)
    return scene.with_plant(mount=s, mount_w=w, mount_z=rng.uniform(0.05, 0.15)), {"mount": s}


def hidden_controller(scene: Scene, s: float, rng: Rng) -> Made:
    """A second controller acts on another input at times."""

    def awake(d: Drive) -> Drive:
        on, n = d.helper.copy(), len(d.sp)
        for start in rng.uniform(0.05, 0.85, 4):
            on[int(start * n) : int((start + 0.08) * n)] = 1.0
        return replace(d, helper=on)

    return both(scene.with_plant(helper=s), awake), {"helper": s}


def recycle(scene: Scene, s: float, rng: Rng) -> Made:
    """A share `s` of the outflow returns after several time constants."""
    delay = rng.uniform(3.0, 7.0) * (scene.plant.T + scene.plant.L)
    return scene.with_plant(echo=s, echo_s=delay), {"echo": s, "echo_s": delay}


def bursts(scene: Scene, s: float, rng: Rng) -> Made:
    """One-sided bursts of noise."""

    def burst(d: Drive) -> Drive:
        n, on = len(d.sp), np.zeros(len(d.sp))
        for start in rng.uniform(0.02, 0.95, 12):
            on[int(start * n) : int((start + rng.uniform(0.003, 0.015)) * n)] = 1.0
        return replace(d, post=d.post + s * on * rng.exponential(1.0, n))

    return both(scene, burst), {"burst": s}


def long_memory(scene: Scene, s: float, rng: Rng) -> Made:
    """A gain that depends on the average of PV over many time constants."""
    slow = rng.uniform(15.0, 40.0) * (scene.plant.T + scene.plant.L)
    return scene.with_plant(recall=s, recall_s=slow), {"recall": s, "recall_s": slow}


def sticking_sensor(scene: Scene, s: float, rng: Rng) -> Made:
    """A sensor whose value is constant until PV differs by some percent, and then jumps."""
    return scene.with_plant(grip=s), {"grip": s}


def switched_load(scene: Scene, s: float, rng: Rng) -> Made:
    """A load that PV switches on when it is high, and off when it is low."""
    at = float(rng.uniform(-1.5, 1.5))
    return scene.with_plant(switch=s, switch_at=at, switch_band=1.0), {"switch": s, "switch_at": at}


OUTSIDE = (
    Effect("rate-gain", "valve", rate_gain, 0.002, 5.0),
    Effect("swinging-mount", "sensor", swinging_mount, 0.01, 0.9),
    Effect("hidden-controller", "load", hidden_controller, 0.01, 30.0),
    Effect("recycle", "process", recycle, 0.005, 0.6),
    Effect("bursts", "sensor", bursts, sizes=(3.0, 1.5, 0.7, 0.35)),
    Effect("long-memory", "process", long_memory, 0.002, 3.0),
    Effect("sticking-sensor", "sensor", sticking_sensor, sizes=(3.0, 2.0, 1.2, 0.8)),
    Effect("switched-load", "load", switched_load, 0.01, 20.0),
)


def plain(rng: Rng, kind: str) -> Scene:
    """No oddity."""
    return draw_scene(rng, kind)


def with_gaps(rng: Rng, kind: str) -> Scene:
    """Some sections are missing."""
    gaps = tuple((float(rng.uniform(0.1, 0.9)), log_uniform(rng, 0.001, 0.02)) for _ in range(3))
    return draw_scene(rng, kind).with_historian(gaps=gaps)


def with_outlier(rng: Rng, kind: str) -> Scene:
    """One outlier of PV."""
    return draw_scene(rng, kind).with_historian(outlier=float(rng.choice([-1, 1]) * rng.uniform(5, 25)))


def with_ramps(rng: Rng, kind: str) -> Scene:
    """Most setpoint changes are ramps."""
    return draw_scene(rng, kind, ramps=0.7)


def sluggish(rng: Rng, kind: str) -> Scene:
    """A slow controller."""
    return draw_scene(rng, kind, speed=float(rng.uniform(8.0, 20.0)))


def brisk(rng: Rng, kind: str) -> Scene:
    """A controller near its stability limit, with little damping."""
    return draw_scene(rng, kind, speed=float(rng.uniform(0.5, 0.8)))


def many_moves(rng: Rng, kind: str) -> Scene:
    """Set points that change almost before the loop settles."""
    return draw_scene(rng, kind, settle=float(rng.uniform(70.0, 120.0)))


def big_load(rng: Rng, kind: str) -> Scene:
    """A large but stationary load."""
    return scaled(draw_scene(rng, kind), float(rng.uniform(2.0, 3.5)))


def small_moves(rng: Rng, kind: str) -> Scene:
    """Set points with small changes."""
    return draw_scene(rng, kind, span=float(rng.uniform(2.0, 3.0)))


ODDITIES: dict[str, Callable[[Rng, str], Scene]] = {
    "plain": plain,
    "gaps": with_gaps,
    "outlier": with_outlier,
    "ramps": with_ramps,
    "sluggish": sluggish,
    "brisk": brisk,
    "many-moves": many_moves,
    "big-load": big_load,
    "small-moves": small_moves,
}
