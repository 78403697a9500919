"""Frequency responses of loops and couplings, exact for the scans of the kernel while valves are linear."""

from __future__ import annotations

import numpy as np

from proofs.coupled.kernel import Plant, shares

GRID = 400
"""Number of frequencies."""
LONGEST = 40_000.0
"""Longest period [s]."""


def frequencies(step: float) -> np.ndarray:
    """Frequencies from the longest period to two and a half scans a cycle [rad/s]."""
    return np.geomspace(2 * np.pi / LONGEST, 2 * np.pi / (2.5 * step), GRID)


def _parts(plant: Plant, i: int, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Process and controller of a loop."""
    z = np.exp(1j * w * plant.step)
    if plant.integrating[i]:
        first = plant.step / plant.first[i] / (z - 1)
    else:
        pace = float(shares(plant.step, plant.first[i]))
        first = pace / (z - 1 + pace)
    pace = float(shares(plant.step, plant.second[i]))
    process = plant.gain[i] * first * pace * z / (z - 1 + pace) * z ** (-float(plant.dead[i]))
    return process, plant.kp[i] * (1 + plant.step / plant.ti[i] * z / (z - 1))


def opened(plant: Plant, i: int, w: np.ndarray) -> np.ndarray:
    """Loop gain, through the slave where one exists."""
    process, control = _parts(plant, i, w)
    slave = int(plant.slave[i])
    if slave < 0:
        return process * control
    inner = opened(plant, slave, w)
    return process * control * inner / (1 + inner)


def load_to_error(plant: Plant, i: int, w: np.ndarray) -> np.ndarray:
    """Response of the error to a load at the process input [% per %]."""
    return -_parts(plant, i, w)[0] / (1 + opened(plant, i, w))


def natural(plant: Plant, i: int) -> tuple[float, float]:
    """Period [s] at which loads disturb a loop most, and the response there [% per %]."""
    w = frequencies(plant.step)
    size = np.abs(load_to_error(plant, i, w))
    return float(2 * np.pi / w[np.argmax(size)]), float(size.max())


def critical_gain(plant: Plant, i: int) -> float:
    """Controller gain at the stability limit, with the integral time unchanged; 0: none found."""
    loop = opened(plant, i, np.geomspace(2 * np.pi / LONGEST, np.pi / plant.step, 8 * GRID)) / plant.kp[i]
    at = np.flatnonzero((loop.imag[:-1] < 0) & (loop.imag[1:] >= 0) & (loop.real[1:] < 0))
    return float(1 / np.max(-loop.real[at])) if at.size else 0.0


def passage(plant: Plant, w: float) -> np.ndarray:
    """Response of each coupling at that frequency, shape (links,)."""
    z = np.exp(1j * w * plant.step)
    pace = shares(plant.step, plant.link_lag)
    return plant.link_gain * pace * z / (z - 1 + pace) * z ** (-plant.link_delay)


def _moves(plant: Plant, w: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Processes (n,); responses of the OPs and of the process inputs to the PVs, (n, n): the stem, or the slave's
    PV."""
    n = plant.size
    process, ops = np.empty(n, complex), np.zeros((n, n), complex)
    for i in range(n):
        process[i], control = (x[0] for x in _parts(plant, i, np.array([w])))
        master = int(plant.master[i])
        if master >= 0:
            ops[i] = control * ops[master]
        ops[i, i] -= control
    acts = ops.copy()
    for i in np.flatnonzero(plant.slave >= 0):
        acts[i] = 0
        acts[i, int(plant.slave[i])] = 1
    return process, ops, acts


def swings(
    plant: Plant, w: float, source: int, pv: float, stem: float, load: int = -1
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """PVs, process inputs, and errors at frequency w, shape (n,), while a source oscillates as given.

    source, pv, stem: its place and amplitudes [%]; -1: none; load: a loop with a unit load at its input; -1: none.
    """
    process, ops, acts = _moves(plant, w)
    put, matrix = np.zeros(plant.size, complex), acts.copy()
    if load >= 0:
        put[load] = 1
    ends = zip(plant.link_from, plant.link_to, plant.link_stem, passage(plant, w), strict=True)
    for begin, end, by_stem, gain in ((int(a), int(b), c, d) for a, b, c, d in ends):
        if by_stem and begin == source:
            put[end] += gain * stem
        elif by_stem:
            matrix[end] += gain * acts[begin]
        else:
            matrix[end, begin] += gain
    matrix, put = np.eye(plant.size) - process[:, None] * matrix, process * put
    if source >= 0:
        matrix[source] = 0
        matrix[source, source] = 1
        put[source] = pv
    out = np.linalg.solve(matrix, put)
    moved, errors = acts @ out, -out
    if source >= 0:
        moved[source] = stem
    slaves = np.flatnonzero(plant.master >= 0)
    errors[slaves] += ops[plant.master[slaves].astype(int)] @ out
    return out, moved, errors
