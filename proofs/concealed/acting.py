"""Effects that act on inputs, controller or historian rather than on the plant's own physics."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from proofs.concealed.plant import Drive, close_loop
from proofs.concealed.scene import Rng, Scene, wander

Made = tuple[Scene, dict[str, float]]


def both(scene: Scene, change: Callable[[Drive], Drive]) -> Scene:
    """The scene with both recordings' drives changed, fit first."""
    return replace(scene, fit=change(scene.fit), later=change(scene.later))


def scaled(scene: Scene, factor: float) -> Scene:
    """The scene with load and noise multiplied."""
    return both(scene, lambda d: replace(d, load=d.load * factor, pre=d.pre * factor, post=d.post * factor))


def noise_before_sensor(scene: Scene, share: float) -> Scene:
    """The scene with that share of the noise added before the transmitter's filter."""
    return both(scene, lambda d: replace(d, pre=d.pre + share * d.post, post=(1 - share) * d.post))


def compression(scene: Scene, s: float, rng: Rng) -> Made:
    """Swinging door; the deviation is about `s` times the noise."""
    scale = max(float(np.std(scene.fit.post)), 0.05)
    pv, op = 3.0 * s * scale * rng.uniform(0.8, 1.3), 1.5 * s * scale * scene.pi.kp * rng.uniform(0.3, 1.0)
    op = float(np.clip(op, 0.05, 2.0))
    return scene.with_historian(door_pv=pv, door_op=op), {"deviation_pv": pv, "deviation_op": op}


def clock_offset(scene: Scene, s: float, rng: Rng) -> Made:
    """PV with stamps that are `s` scans late."""
    late = s * scene.scan
    return scene.with_historian(late_s=late), {"pv_late_by_s": late}


def sampling(scene: Scene, s: float, rng: Rng) -> Made:
    """Polling at irregular times; in half of the cases also a fast ripple, which the polling aliases."""
    if rng.random() < 0.5:
        return scene.with_historian(poll_sd=0.2 * s, stamp_sd=0.0), {"jitter_scans": 0.2 * s}
    period = rng.uniform(40, 120) * scene.scan
    size = 2.0 * s * max(float(np.std(scene.fit.post)), 0.08)
    return scene.with_historian(alias=size, alias_s=period, poll_sd=0.03), {"alias": size, "period": period}


def controller_settings(scene: Scene, s: float, rng: Rng) -> Made:
    """loops.csv states a gain or an integral time that is wrong by the factor `s`."""
    factor = s if rng.random() < 0.5 else 1.0 / s
    kp, ti = scene.stated
    if rng.random() < 0.6:
        return replace(scene, stated=(kp * factor, ti)), {"Kp": scene.pi.kp}
    return replace(scene, stated=(kp, ti * factor)), {"Ti": scene.pi.ti}


def controller_gap(scene: Scene, s: float, rng: Rng) -> Made:
    """OP is constant while the error is below `s` times the usual error of the baseline loop."""
    pv, _ = close_loop(scene.plant, scene.pi, scene.fit, scene.scan)
    gap = s * 1.5 * float(np.median(np.abs(scene.fit.sp - pv)))
    return replace(scene, pi=scene.pi._replace(gap=gap)), {"gap": gap}


def forced(d: Drive, rng: Rng, share: float, v0: float, style: int) -> Drive:
    """The drive with spans, together `share` of the record, in which logic overrides the controller."""
    n, force, limit = len(d.sp), d.force.copy(), d.op_hi.copy()
    for start in rng.uniform(0.03, 0.9, 4):
        span = slice(int(start * n), int((start + share / 4) * n))
        if style == 0:
            force[span] = np.inf
        elif style == 1:
            force[span] = v0 + rng.uniform(2.0, 5.0) * rng.choice([-1.0, 1.0])
        else:
            limit[span] = v0 + rng.uniform(-2.0, 0.5)
    return replace(d, force=force, op_hi=limit)


def controller_logic(scene: Scene, s: float, rng: Rng) -> Made:
    """Holds, tracking or a lowered limit in four spans that together make 0.2 s of the record."""
    style = int(rng.integers(3))
    made = both(scene, lambda d: forced(d, rng, 0.2 * s, scene.plant.v0, style))
    return made, {"share": 0.2 * s, "style": float(style)}


def stepped(d: Drive, at: np.ndarray, sizes: np.ndarray) -> Drive:
    """The drive with load steps [% OP] at shares `at` of the record."""
    act, n = d.act.copy(), len(d.sp)
    for share, size in zip(at, sizes, strict=True):
        act[int(share * n) :] += size
    return replace(d, act=act)


def load_step(scene: Scene, s: float, rng: Rng) -> Made:
    """One to three steps of `s` % of OP, alternating up and down."""
    count = int(rng.integers(1, 4))
    sizes = s * (-1.0) ** (np.arange(count) + rng.integers(2))
    made = both(scene, lambda d: stepped(d, np.sort(rng.uniform(0.15, 0.9, count)), sizes))
    return made, {"load_step": s, "steps": float(count)}


def load_oscillation(scene: Scene, s: float, rng: Rng) -> Made:
    """A sine of `s` % of OP with a period different from the loop's own."""
    period = rng.uniform(2.5, 9.0) * (scene.plant.T + 2 * scene.plant.L)

    def waved(d: Drive) -> Drive:
        t = np.arange(len(d.sp)) * scene.scan
        return replace(d, act=d.act + s * np.sin(2 * np.pi * (t / period + rng.random())))

    return both(scene, waved), {"load_amplitude": s, "period": period}


def supply_variation(scene: Scene, s: float, rng: Rng) -> Made:
    """A supply head that varies slowly by the share `s` (rms): it changes gain and, by a part of the flow at rest,
    bias."""
    bias = rng.uniform(0.05, 0.25) * scene.plant.v0

    def breathe(d: Drive) -> Drive:
        n = len(d.sp)
        slow = wander(rng, n, n / rng.uniform(8, 20))
        smooth = lfilter([0.02], [1, -0.98], slow - slow[0])
        head = np.clip(1.0 + s * smooth, 0.2, 3.0)
        return replace(d, supply=d.supply * head, act=d.act + bias * (head - 1.0))

    return both(scene, breathe), {"supply_rms": s}


def coupling(scene: Scene, s: float, rng: Rng) -> Made:
    """A neighbour's OP acts through gain `s` and a lag; its trends are in the export."""
    lag = rng.uniform(0.2, 2.0) * scene.plant.T / scene.scan
    a = np.exp(-1.0 / lag)

    def join(d: Drive, other: np.ndarray) -> Drive:
        return replace(d, act=d.act + s * lfilter([1 - a], [1, -a], other[2] - other[2].mean()))

    if not scene.neighbours:
        raise ValueError("coupling needs a scene with a neighbour; saw none; draw it with one")
    fit, later = join(scene.fit, scene.neighbours[0]), join(scene.later, scene.neighbours[1])
    return replace(scene, fit=fit, later=later), {"coupling_gain": s, "coupling_lag": lag * scene.scan}
