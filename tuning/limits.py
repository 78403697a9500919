"""Limits of new settings; limits.toml states the values."""

from __future__ import annotations

from identification.limits import Limits


class TuningLimits(Limits, section="tuning"):
    """Limits of a proposal.

    Set on the plants of proofs/retuning.py, seeds 1, 2, 11 and 12, and verified on others. A model's forecast of the
    error is within 8 % for nine in ten of those with backlash, hence error_aim. With stick-slip, gains down to 0.3 of
    the present one nearly doubled some errors, hence gain_down. On an integrator with backlash Ti of 60 delays leaves
    3 % of the travel of 10 delays, so integral_factor_ramp need not be larger.
    """


LIMITS = TuningLimits()
"""The default limits."""
