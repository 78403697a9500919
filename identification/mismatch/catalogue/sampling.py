"""Irregular polling: the true times of values differ from their stamps."""

import numpy as np

from identification.estimation.problem import in_blocks
from identification.estimation.search import simulated_best
from identification.mismatch.effect import Block, Ends, Fault, Finding, Floats, Recording, within
from identification.mismatch.pictures import Axis, Picture, comb

HISTOGRAM = 160
"""Classes of a histogram."""


def scattered_stamps(s: Recording) -> Finding | None:
    """Stamps that scatter about a uniform clock more than logging explains, without gaps."""
    spacing = np.diff(s.stamp_s) / s.dt_s
    spacing = spacing[(spacing > 0.02) & (spacing < 1.98)]
    jitter = float(np.std(spacing)) / np.sqrt(2.0) if spacing.size > 10 else 0.0
    if jitter < s.limits.recorder.jitter or _is_slight(jitter * s.dt_s, s):
        return None
    return Finding({"jitter_samples": jitter}, np.ones(s.stamp_s.size, dtype=bool))


def _is_slight(jitter_s: float, s: Recording) -> bool:
    """Whether a scatter [s] is a small part of the process time constant, in a recording without a stated controller
    that acts on each sample."""
    if s.stated is not None or float(np.ptp(s.op)) == 0.0:
        return False
    process = simulated_best(in_blocks(s.pv, s.op, s.usable, s.dt_s))
    return jitter_s < s.limits.recorder.jitter_lag * process.time_constant_s


def spacings(found: Finding, s: Recording, _: Floats) -> Picture:
    """Number of occurrences of each spacing of two stamps."""
    spacing = np.diff(s.stamp_s)
    count, edge = np.histogram(spacing[(spacing > 0) & (spacing < 2 * s.dt_s)], HISTOGRAM)
    return comb(Axis("time between samples", "s"), 0.5 * (edge[1:] + edge[:-1]), count)


EFFECT = Fault(
    name="sampling",
    block=Block.RECORDER,
    sentence="The time stamps scatter by {jitter_samples}; fast motion of PV is not reliable.",
    check="Poll at a fixed rate, or record at the controller.",
    caption="Time between samples: a regular recorder has one narrow peak.",
    order=1,
    find=scattered_stamps,
    ends=Ends.ALL,
    numbers=lambda found, _: {"jitter_samples": within(0.1, found.values["jitter_samples"], "samples")},
    titles={"jitter_samples": "Scatter of stamps"},
    drawn=spacings,
)
