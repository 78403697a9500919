"""What the signs of a cause are read from: rivals fitted to one loop's trends, and what they leave."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from analyzer.config import CauseLimits
from analyzer.limits import LOOP
from analyzer.loop.assessments import at_limits_share, noise_band
from analyzer.loop.oscillation import Oscillation
from analyzer.loop.ringing import Ringing, calm_resonance, ringing_of
from identification.controller.pid_regression import fit_pi
from identification.errors import NotAssessedError
from identification.estimation.backlash_stiction import better_linear, fit_linear, fit_play, fit_stick_slip
from identification.estimation.between_samples import Rows, Scans, scans_per_row, settled, with_scans
from identification.estimation.evidence import (
    Trials,
    evidence,
    gains,
    stem_moves,
    trials,
    trials_between_moves,
    with_load_step,
)
from identification.estimation.gauss_newton import descend, residual
from identification.estimation.noise import judged
from identification.estimation.search import prepare, score
from identification.estimation.stem_position import Seen, seen
from identification.estimation.window import Fit, Window, block_means
from identification.limits import FIT
from identification.models import Fopdt, Loop, Pid
from identification.record import Floats, LoopRecord, Mask
from identification.signals.spectrum import (
    Spectrum,
    locked_harmonic,
    peak_prominence,
    size_kurtosis,
    spectrum,
    tapered_power,
)
from identification.simulation.valve import IDEAL
from tuning.frequency_response import is_stable, loop_response

HARMONICS = (2, 3)
"""Harmonics of a cycle that a valve's model must explain: beyond the third few samples a cycle are left."""


@dataclass(frozen=True, slots=True)
class Measured:
    """What the signs are read from.

    linear, play, stick_slip : the fits; evidence [nat] of the better valve over none; size, its stickband over
    OP's range [-]; jump [nat], stick-slip over play; line_linear and line_valve, prominence at the period of the
    load that the plain model and the valve model leave [-]; amplification |S| there [-], None without settings;
    stable, the identified loop; consistency [-], gain outside the period's band over gain with it; harmonic [-],
    locked third over the fundamental; saturated, share of time at limits [-]; moves, how often the stem of the
    better valve sets out; excited, whether set point moves drove the loop; trials, how the stretches between OP's
    turns agree on the better valve, None with too few; kurtosis [-] of the band at the period, 3 for noise, 1.5 where
    the size is kept; wave_left [-], harmonics of PV's cycle that the better valve leaves, over its fundamental;
    steady [-], of a calm loop, how the stretches between moves of the stem agree on the better valve: their mean gain
    over its standard error, and asked, what it gains while PV is due to answer moves of the set point [nat]; ringing,
    whether the loop itself makes the cycle, None without settings; scale_s, the period or another time
    scale of the loop [s].
    """

    linear: Fit
    play: Fit
    stick_slip: Fit | None
    evidence: float
    size: float
    jump: float
    amplification: float | None
    stable: bool
    saturated: float
    controller: Pid | None
    moves: int
    excited: bool
    line_linear: float = 0.0
    line_valve: float = 0.0
    consistency: float = 1.0
    harmonic: float = 0.0
    trials: Trials | None = None
    kurtosis: float = 3.0
    wave_left: float = 0.0
    steady: float = 0.0
    asked: float = 0.0
    ringing: Ringing | None = None
    scale_s: float = 60.0

    @property
    def window(self) -> Window:
        """What all of them are fitted to."""
        return self.linear.window


def _prominence(x: Floats, dt_s: float, period_s: float) -> float:
    s = spectrum(x, dt_s)
    return peak_prominence(tapered_power(s), s.duration_s / period_s)


def _harmonics_left(fit: Fit, period_s: float) -> float:
    """Second and third harmonic locked to PV's cycle in what a fit leaves of PV, over PV's fundamental."""
    window = fit.window
    if window.duration_s < LOOP.harmonic_cycles * period_s:
        return 0.0
    left, cycle = spectrum(residual(fit), window.dt_s), spectrum(window.centred, window.dt_s)
    return math.hypot(*(locked_harmonic(left, period_s, order, cycle) for order in HARMONICS))


def _consistency(fit: Fit, period_s: float) -> float:
    """Gain of the identified process outside the period's band over its gain with it."""
    prepared = prepare(fit.window, IDEAL, fit.ar, period_s / fit.window.dt_s)
    gain = float(score(prepared, fit.time_constant_s, fit.dead_time_s)[2][0])
    return gain / fit.gain if fit.gain else 0.0


Candidates = tuple[Fit, Fit, Fit | None]
"""Fits behind an ideal valve, behind play, and behind stick-slip if that was tried."""
Fits = tuple[Fit, Fit, Fit | None, Fit, float, float]
"""Plain fit, play, stick-slip if it was tried, the better valve, its evidence and that of the jump [nat]."""


def measure(
    record: LoopRecord,
    oscillation: Oscillation | None,
    controller: Pid | None,
    limits: CauseLimits,
    error: Spectrum | None = None,
    kind: str = "",
) -> Measured:
    """Fit the candidates and read what the signs need; see Measured. Raises NotAssessedError where good samples are
    too scattered for a model of how one follows from those before it."""
    scale, calm = time_scale(record, oscillation, controller), oscillation is None
    window = window_of(record, scale, limits, kind, calm)
    _check_judged(window, limits)
    law = controller or recovered(record, scale, limits.law_known)
    controller = controller or recovered(record, scale)
    due = due_to_answer(record, window, scale)
    scans = _scans_of(record, window, law)
    linear, play, stick, best, gained, jump = _fits(window, scale, due, limits, oscillation, scans)
    hopeless = oscillation is None and gained < _hopeful(window, due, limits)
    amplification, stable = _amplification(linear.process, controller, scale)
    fine_linear, fine_play, fine_stick = _refined((linear, play, stick), best, hopeless)
    seen_alone = Measured(
        linear=fine_linear,
        play=fine_play,
        stick_slip=fine_stick,
        evidence=gained,
        size=best.valve.stickband / max(window.cycle_range, 1e-9),
        jump=jump,
        amplification=amplification,
        stable=stable,
        saturated=at_limits_share(record),
        controller=controller,
        moves=stem_moves(best),
        excited=bool(due.any()),
        scale_s=scale,
    )
    if oscillation is None:
        if window.position is not None:
            return replace(seen_alone, steady=math.inf)
        alone = not record.mask("idle").any()  # else another one moves PV too
        return _without_a_cycle(seen_alone, best, linear, due if alone else None)
    return _of_a_cycle(seen_alone, best, linear, law, error)


def ringing_period(m: Measured, limits: CauseLimits) -> float | None:
    """Period [s] at which the identified loop of a calm record rings; None where it is damped, or not known."""
    ms, period_s = calm_resonance(m.linear, m.controller, m.scale_s)
    return period_s if ms >= limits.ringing_ms else None


def _without_a_cycle(m: Measured, best: Fit, linear: Fit, due: Mask | None) -> Measured:
    """What the stretches between moves of the stem show beside, and PV where it is due to answer a set point."""
    shown = trials_between_moves(best, linear)
    asked = 0.0 if due is None else float(gains(best, linear)[due].sum())
    return replace(m, steady=0.0 if shown is None else shown.steadiness, asked=asked)


def _of_a_cycle(m: Measured, best: Fit, linear: Fit, law: Pid | None, error: Spectrum | None) -> Measured:
    """What a cycle of this period shows beside: in the load that the fits leave, in the wave of the error and,
    where the controller's law is known, in the margins of the loop."""
    dt_s, scale = linear.window.dt_s, m.scale_s
    found = replace(
        m,
        ringing=ringing_of(linear, (best,) if m.evidence > 0.0 else (), law, scale),
        line_linear=_prominence(residual(linear), dt_s, scale),
        line_valve=_prominence(residual(best), dt_s, scale),
        consistency=_consistency(linear, scale),
    )
    if error is None:
        return found
    return replace(
        found,
        harmonic=locked_harmonic(error, scale),
        trials=trials(best, linear, scale),
        kurtosis=size_kurtosis(error, error.duration_s / scale),
        wave_left=_harmonics_left(best, scale),
    )


def _fits(
    window: Window,
    scale: float,
    due: Mask,
    limits: CauseLimits,
    oscillation: Oscillation | None,
    scans: Scans | None,
) -> Fits:
    """The candidates' fits, by a recorded stem where one shows a fault; with OP at the controller's scan where its
    scans within a row are known."""
    shown = None if window.position is None else seen(window.op, window.position)
    if shown is not None:
        return _stem_shown(window, shown, due, scale)
    rows = _candidates(replace(window, position=None), scale, due, limits, oscillation)
    found = (
        rows
        if scans is None or oscillation is None
        else _at_scans(rows, scale, due, limits, oscillation, scans)
    )
    return *found, *_compared(found, due, limits, oscillation)


def _check_judged(window: Window, limits: CauseLimits) -> None:
    """Raise NotAssessedError where too few blocks follow on as many good ones as the noise model looks back."""
    count = int(judged(window.usable, FIT.ar_order).sum())
    if count < limits.judged:
        raise NotAssessedError(
            f"needs {limits.judged} stretches of {FIT.ar_order + 1} good samples in a row, has {count}"
        )


def _refined(fits: Candidates, best: Fit, hopeless: bool) -> Candidates:
    """Fits at the record's own interval, where the dead time is no shorter than a block; the valve's are left as they
    are where it is `hopeless` to look for its fault."""
    if best.window.factor == 1 or best.dead_time_s + best.window.half_block_s < best.window.dt_s:
        return fits
    linear, play = (replace(f, window=replace(f.window, fine=True)) for f in fits[:2])
    stick = None if fits[2] is None else replace(fits[2], window=replace(fits[2].window, fine=True))
    if not hopeless:
        play = descend(play, free_width=best.window.position is None)
        stick = None if stick is None else descend(stick)
    return descend(linear), play, stick


def _hopeful(window: Window, due: Mask, limits: CauseLimits) -> float:
    """Evidence [nat] from which it is worth looking for the fault of a valve whose loop does not oscillate."""
    count = int(judged(window.usable, FIT.ar_order).sum())
    return limits.hopeless * limits.needed(count, bool(due.any()), False)


def _is_searched(
    linear: Fit, play: Fit, due: Mask, limits: CauseLimits, oscillation: Oscillation | None
) -> bool:
    """Whether a play explains enough for the whole search of the valve's fault."""
    window, calm = play.window, oscillation is None
    if calm and window.y.size < FIT.short:
        return True
    least = _hopeful(window, due, limits) if calm else FIT.screened
    return play.log_likelihood - linear.log_likelihood >= least


def _candidates(
    window: Window, scale_s: float, due: Mask, limits: CauseLimits, oscillation: Oscillation | None
) -> Candidates:
    """The fits of one window."""
    linear = fit_linear(window, scale_s)
    short = oscillation is None and window.y.size < FIT.short
    hopeful = None if oscillation is not None or short else _hopeful(window, due, limits)
    play = fit_play(linear, scale_s, hopeful)
    if not _is_searched(linear, play, due, limits, oscillation):
        return linear, play, None
    gained = play.log_likelihood - linear.log_likelihood
    wide = play.valve.stickband > 0.25 * window.reach
    sticks = short or oscillation is not None or (wide and gained >= limits.evidence)
    return better_linear(linear, play), play, fit_stick_slip(play, scale_s) if sticks else None


def _at_scans(
    rows: Candidates, scale_s: float, due: Mask, limits: CauseLimits, oscillation: Oscillation, scans: Scans
) -> Candidates:
    """The fits with OP at the controller's scan, each as its own model makes it, unless those of OP at the rows are
    clearly likelier: a controller that computes no faster holds it between them."""
    first = _likeliest(rows)
    within = with_scans(settled(first, scans), scans).window
    linear, play, stick = _candidates(within, scale_s, due, limits, oscillation)
    stick = None if stick is None else settled(stick, scans)
    found = settled(linear, scans), settled(play, scans), stick
    gained = _likeliest(found).log_likelihood - first.log_likelihood
    return found if gained > -limits.evidence else rows


def _likeliest(fits: Candidates) -> Fit:
    return max((f for f in fits if f is not None), key=lambda f: f.log_likelihood)


def _compared(
    found: Candidates, due: Mask, limits: CauseLimits, oscillation: Oscillation | None
) -> tuple[Fit, float, float]:
    """The better valve, its evidence over an ideal one, and that of the jump over a play [nat]."""
    linear, play, stick = found
    if stick is None and not _is_searched(linear, play, due, limits, oscillation):
        return play, play.log_likelihood - linear.log_likelihood, 0.0
    best, jump = play, 0.0
    if stick is not None:
        jump = evidence(stick, play) - max(play.log_likelihood - stick.log_likelihood, 0.0)
        best = stick if jump > limits.evidence_jump else play
    gained = evidence(best, with_load_step(linear, due, best.ar))
    return best, gained - (limits.evidence_jump if best is stick else 0.0), jump


def _stem_shown(window: Window, shown: Seen, due: Mask, scale_s: float) -> Fits:
    """The same where the stem is recorded: its fault is seen, and PV answers the stem itself."""
    linear = fit_linear(window, scale_s)
    behind = window if window.position is None else replace(window, op=window.position)
    play = descend(replace(fit_linear(behind, scale_s), window=window, valve=shown.play))
    stick = None if shown.jumping is None else replace(play, valve=shown.jumping)
    best = play if stick is None else stick
    gained = evidence(best, with_load_step(linear, due, best.ar))
    return linear, play, stick, best, gained, 0.0 if stick is None else math.inf


def recovered(record: LoopRecord, scale_s: float, least: float = 0.5) -> Pid | None:
    """PI settings recovered from the record where they explain at least so much of OP's moves [-], None where not."""
    found = fit_pi(record, scale_s)
    if found is None or found.explained < least or not math.isfinite(found.ti_s):
        return None
    return Pid(found.kp, found.ti_s, scan_s=record.dt_s)


def _amplification(process: Fopdt, controller: Pid | None, period_s: float) -> tuple[float | None, bool]:
    """|S| of the identified loop at the period, and whether the loop is stable."""
    if controller is None or process.gain * controller.kp <= 0:
        return None, True
    loop = Loop(process, controller)
    omega = np.array([2 * math.pi / period_s])
    return float(1 / abs(1 + loop_response(loop, omega)[0])), is_stable(loop)


def time_scale(record: LoopRecord, oscillation: Oscillation | None, controller: Pid | None) -> float:
    """The period [s], or a guess of the loop's time scale where it does not oscillate.

    Four integral times where they are stated (the cycle of a PI loop with play is of that order), else sixty
    samples, so that blocks are samples.
    """
    if oscillation is not None:
        return oscillation.period_s
    top = len(record) * record.dt_s / 8
    if controller is not None and math.isfinite(controller.ti_s) and controller.ti_s > 0:
        return min(max(4 * controller.ti_s, 10 * record.dt_s), top)
    return min(60 * record.dt_s, top)


def latest_fit_stretch(record: LoopRecord, n: int, calm: bool = False) -> int:
    """First sample of the latest stretch of n samples with the fewest out of use, or, of a calm loop, with few more
    where the set point moves farther in it: its moves tell the process apart from load and valve. In a cycle they do
    not: of a tight loop of the sample mill they left the time constant unsure by three times."""
    firsts = np.arange(len(record) - n, -1, -max(n // 4, 1))

    def within(x: Floats) -> Floats:
        total = np.concatenate(([0.0], np.cumsum(x)))
        return np.asarray(total[firsts + n] - total[firsts])

    out = within((~record.usable).astype(np.float64))
    if not calm:
        return int(firsts[int(np.argmin(out))])
    moved = np.abs(np.diff(record.sp, prepend=record.sp[:1]))
    far, least = within(np.where(record.usable, moved, 0.0)), out <= out.min()
    farther = (out <= out.min() + LOOP.few_more * n) & (far > far[least].max())
    among = np.flatnonzero(farther if farther.any() else least)
    return int(firsts[among[far[among] >= far[among].max() - 1e-9][0]])


def bridged(usable: Mask, period: float) -> Mask:
    """Usable samples, shape (n,), and those in holes shorter than a share of a period [samples]."""
    most = int(LOOP.bridged * period)
    out = usable.copy()
    edges = np.flatnonzero(np.diff(np.concatenate(([1], usable.astype(np.int8), [1]))))
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        if last - first <= most:
            out[first:last] = True
    return out


def across(x: Floats, hole: Mask) -> Floats:
    """A signal, shape (n,), with a straight line from end to end of each hole."""
    if not hole.any() or hole.all():
        return x
    at = np.flatnonzero(~hole)
    return np.where(hole, np.interp(np.arange(x.size), at, x[at]), x)


def window_of(
    record: LoopRecord, scale_s: float, limits: CauseLimits, kind: str = "", calm: bool = False
) -> Window:
    """The latest stretch with the fewest samples out of use, in blocks of a fraction of the period."""
    factor = max(round(scale_s / limits.blocks_per_period / record.dt_s), 1)
    n = min(len(record) // factor, limits.window) * factor
    first = latest_fit_stretch(record, n, calm)
    part = record.span(first, first + n)
    whole = bridged(part.usable, scale_s / record.dt_s)
    usable = block_means(whole.astype(np.float64), factor) > 0.99
    known = {name: (t, dead) for name, t, dead in limits.fast_process}
    most = known.get(kind.lower(), (math.inf, math.inf))
    op = np.ascontiguousarray(part.op)
    stem = None if part.position is None else np.ascontiguousarray(part.position)
    return Window(
        block_means(across(part.pv, whole & ~part.usable), factor),
        op,
        usable,
        record.dt_s * factor,
        factor,
        *most,
        position=stem,
        first=first,
        sp=None if part.sp_estimated or not np.ptp(part.sp) else block_means(part.sp, factor),
        turn=0 if calm else max(round(2 * scale_s / record.dt_s), 2),
    )


def _scans_of(record: LoopRecord, window: Window, law: Pid | None) -> Scans | None:
    """What the controller did within the rows of a window; None where it computes no faster than they come, or what
    it acts on is not known."""
    count = scans_per_row(law, record.dt_s)
    if law is None or count == 1 or record.sp_estimated:
        return None
    part = record.span(window.first, window.first + window.y.size * window.factor)
    pv, sp, op = across(part.pv, ~part.usable), np.ascontiguousarray(part.sp), np.ascontiguousarray(part.op)
    return Scans(Rows(pv, sp, op), law, count)


def due_to_answer(record: LoopRecord, window: Window, scale_s: float) -> Mask:
    """True where PV is due to answer a set point move, shape of the window.

    From a move for scale_s [s], and on until PV has come to the set point, however long the valve takes.
    """
    sp = record.sp[window.first :: window.factor][: window.y.size]
    moves = np.flatnonzero(np.abs(np.diff(sp)) > 1e-6) + 1
    out = np.zeros(window.y.size, dtype=bool)
    if record.sp_estimated or not 0 < moves.size <= window.y.size / 10:
        return out
    reach = max(round(scale_s / window.dt_s), 1)
    error = np.abs(sp - window.y)
    near = error <= 3 * noise_band(window.y)
    for at, end in zip(moves, [*moves[1:], window.y.size], strict=True):
        there = np.flatnonzero(near[at + 1 : end])
        out[at : max(at + reach, at + 2 + int(there[0]) if there.size else end)] = True
    return out
