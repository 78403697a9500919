"""Every threshold of the advice, with its unit and source."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class TuningLimits:
    """What a proposal must keep.

    | name | unit | source |
    |---|---|---|
    | ms_most | - | 2.0: Astrom, Hagglund (2006) ask for 1.4 to 2.0; SIMC has 1.6 to 1.7 |
    | ms_most_sample | - | 2.5, on every uncertainty sample: gain margin 1.7 is left; ours |
    | peak_factor | - | PV's peak after a load step at the valve over nominal; ours, for reality under 2 |
    | integral_factor | - | Ti/Kp over nominal gain with Ti = max(T, nominal Ti); ours, for reality under 3.5 |
    | integral_factor_ramp | - | Ti/Kp over nominal on an integrator or a slow lag; ours, for reality under 10 |
    | gain_up | - | most that the gain is raised in one step; ours |
    | gain_down | - | least gain over the present one; ours |
    | gain_down_play, gain_down_stick | - | least gain over nominal, where that is lower, by valve; ours |
    | error_growth | - | error on the model, and its mean over all samples, over the present one |
    | error_growth_sample, travel_growth_sample | - | error and travel on the worst uncertainty sample; ours: what is
    worse on any plant that the data allow is not told |
    | error_weight | - | weight of ln(error) beside ln(travel) in the score; ours |
    | error_aim, error_beyond | - | error up to which error_weight holds, and the weight added above; ours |
    | travel_floor | - | travel over the present one below which less counts little; ours |
    | worth_travel, worth_error | - | least cut in travel or error for which a change is proposed; ours |
    | cycle_growth | - | PV amplitude of the new limit cycle over the old one's with play; ours |
    | cycle_growth_stick | - | the same with stick-slip, whose slower cycle lets PV go further; ours |
    | band_beyond | % OP | play or stickband from which the valve is to be repaired first; ours |
    | stick_ratio | - | T over effective delay below which a sticking stem gets no settings: on plants of another make
    (tests/proofs/retuning.py, seeds 31, 32, 41, 42) their error grew by more than 5 % in one of three |
    | spread_slope, spread_delay, spread_band | - | half widths of the uncertainty assumed for want of any |
    | most_steps | scans | load used in the search; ours, for the answer within 2 s |
    | least_steps | scans | a shorter load does not tell tunings apart; ours |
    | warm_up | - | share of a simulated record left out at its start; ours |

    Set on the plants of tests/proofs/retuning.py, seeds 1, 2, 11 and 12, and proved on others. A model's forecast of
    the error is within 8 % on nine in ten of those with play, hence error_aim. With stick-slip, gains down to 0.3 of
    the present one nearly doubled some errors, hence gain_down. On an integrator with play Ti of 60 delays leaves 3 %
    of the travel that 10 delays make, so integral_factor_ramp need not be larger.
    """

    ms_most: float = 2.0
    ms_most_sample: float = 2.5
    peak_factor: float = 1.7
    integral_factor: float = 2.4
    integral_factor_ramp: float = 6.5
    gain_up: float = 1.3
    gain_down: float = 0.85
    gain_down_play: float = 0.85
    gain_down_stick: float = 0.95
    error_growth: float = 1.0
    error_growth_sample: float = 1.05
    travel_growth_sample: float = 1.05
    error_weight: float = 0.3
    error_aim: float = 0.92
    error_aim_stick: float = 0.85
    error_beyond: float = 5.0
    travel_floor: float = 0.03
    worth_travel: float = 0.2
    worth_error: float = 0.1
    cycle_growth: float = 1.05
    cycle_growth_stick: float = 1.5
    band_beyond: float = 10.0
    stick_ratio: float = 10.0
    spread_slope: float = 0.15
    spread_delay: float = 0.25
    spread_band: float = 0.15
    most_steps: int = 30_000
    least_steps: int = 1_000
    warm_up: float = 0.1


LIMITS = TuningLimits()
"""The limits in force."""
