"""The historian: polls, rounds, omits, compresses and stamps the values of the loop."""

import numpy as np
import pandas as pd
from numba import njit

from proofs.concealed.scene import Historian, Rng, Scene


@njit(cache=True)
def swinging_door(x: np.ndarray, deviation: float) -> np.ndarray:
    """Kept indices, shape (kept,), so that straight lines stay within `deviation` of `x`, shape (n,)."""
    kept = [0]
    low, high = -np.inf, np.inf
    for k in range(1, len(x)):
        base = kept[-1]
        run = k - base
        low = max(low, (x[k] - deviation - x[base]) / run)
        high = min(high, (x[k] + deviation - x[base]) / run)
        if low > high:
            kept.append(k - 1)
            low, high = x[k] - deviation - x[k - 1], x[k] + deviation - x[k - 1]
    kept.append(len(x) - 1)
    return np.array(kept)


@njit(cache=True)
def by_exception(x: np.ndarray, band: float) -> np.ndarray:
    """Values, shape (n,); only changes above `band` are reported."""
    out = x.copy()
    for k in range(1, len(x)):
        if abs(x[k] - out[k - 1]) <= band:
            out[k] = out[k - 1]
    return out


def compress(x: np.ndarray, deviation: float) -> np.ndarray:
    """The values that an archive with that deviation returns at every scan, shape (n,)."""
    if deviation <= 0:
        return x
    kept = swinging_door(x, deviation)
    return np.interp(np.arange(len(x)), kept, x[kept])


def rounded(x: np.ndarray, step: float) -> np.ndarray:
    """`x` on a grid of `step`."""
    return np.round(x / step) * step if step > 0 else x


def poll_times(rng: Rng, n: int, h: Historian) -> np.ndarray:
    """Polling time of each row, in scans, shape (n,), never decreasing."""
    scatter = np.clip(rng.normal(0, h.poll_sd, n), -0.45, 0.45) if h.poll_sd else np.zeros(n)
    return np.arange(n) + scatter


def polled(x: np.ndarray, at: np.ndarray, hold: bool) -> np.ndarray:
    """`x`, shape (n,), read at `at` [scans]: held between scans, or interpolated."""
    if hold:
        return x[np.clip(np.floor(at + 1e-9).astype(int), 0, len(x) - 1)]
    return np.interp(at, np.arange(len(x)), x)


def keep_pv(pv: np.ndarray, at: np.ndarray, scan: float, h: Historian) -> np.ndarray:
    """PV as the archive returns it, shape (n,)."""
    x = polled(pv, at - h.late_s / scan, hold=False)
    x = x + h.alias * np.sin(2 * np.pi * at * (1 + scan / h.alias_s))
    if h.door_pv:
        return compress(x, h.door_pv)
    return by_exception(rounded(x, h.pv_res), h.pv_exc)


def keep_op(op: np.ndarray, at: np.ndarray, h: Historian) -> np.ndarray:
    """OP as the archive returns it, shape (n,)."""
    x = polled(op, at, hold=True)
    return compress(x, h.door_op) if h.door_op else rounded(x, h.op_res)


def stamps(rng: Rng, at: np.ndarray, start: pd.Timestamp, scan: float, h: Historian) -> pd.DatetimeIndex:
    """Time stamps as logged, shape (n,)."""
    logged = at + (np.clip(rng.normal(0, h.stamp_sd, len(at)), -0.2, 0.2) if h.stamp_sd else 0.0)
    return start + pd.to_timedelta(np.round(logged * scan * 1000), unit="ms")


def leave_out(frame: pd.DataFrame, h: Historian) -> pd.DataFrame:
    """The recording without the rows of its gaps."""
    n, keep = len(frame), np.ones(len(frame), bool)
    for start, length in h.gaps:
        keep[int(start * n) : int((start + length) * n)] = False
    return frame[keep].reset_index(drop=True)


def record(
    rng: Rng, tag: str, scene: Scene, sp: np.ndarray, made: np.ndarray, start: pd.Timestamp
) -> pd.DataFrame:
    """One recording before gaps: columns timestamp, TAG.SP, TAG.PV, TAG.OP; `made` has shape (2, n)."""
    h, n = scene.historian, len(sp)
    at = poll_times(rng, n, h)
    pv = keep_pv(made[0], at, scene.scan, h)
    if h.outlier:
        pv[int(rng.uniform(0.2, 0.8) * n)] += h.outlier
    return pd.DataFrame(
        {
            "timestamp": stamps(rng, at, start, scene.scan, h),
            f"{tag}.SP": polled(sp, at, hold=True).astype("float32"),
            f"{tag}.PV": pv.astype("float32"),
            f"{tag}.OP": keep_op(made[1], at, h).astype("float32"),
        }
    )
