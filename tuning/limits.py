"""Limits of new settings; limits.toml states the values."""

from __future__ import annotations

from identification.limits import Limits


class TuningLimits(Limits, section="tuning"):
    """What a proposal must keep.

    Set on the plants of proofs/retuning.py, seeds 1, 2, 11 and 12, and proved on others. A model's forecast of
    the error is within 8 % on nine in ten of those with play, hence error_aim. With stick-slip, gains down to 0.3 of
    the present one nearly doubled some errors, hence gain_down. On an integrator with play Ti of 60 delays leaves 3 %
    of the travel that 10 delays make, so integral_factor_ramp need not be larger.
    """


class MethodLimits(Limits, section="method"):
    """What rules, describing functions, limit cycles and forecasts are computed with; no plant changes it."""


LIMITS = TuningLimits()
"""The limits in force where none are given."""
METHOD = MethodLimits()
"""The same of the method."""
