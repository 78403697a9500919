"""Stick-slip with irregular slip distances: joint identification of friction, stem and process by stem paths."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from identification.estimation.descent import compass
from identification.estimation.evidence import evidence
from identification.estimation.gauss_newton import descend, disturbance, residual, slow_terms
from identification.estimation.model import Fitted
from identification.estimation.noise import every_lag, judged, whitened
from identification.estimation.slip_beam import Noise, Response, SlipDistances, decoded, log_chance
from identification.record import Floats
from identification.simulation.lag import unit_lag
from identification.simulation.valve import StemLaw, backlash_stem, sticking

WIDTHS = (0.78, 0.88, 0.98, 1.12)
"""Stickbands tried, in widths of the best-fitting backlash [of the backlash]: on 32 simulated stems of dry
friction 0.7 to 1.3."""
JUMPS = (0.35, 0.6, 0.9)  # Slip jumps tried [of the stickband]
ABSURD = 2.0
"""Ratio of the backlash model's gain to the gain that stick-slip needs, from which the latter is taken:
backlash may explain a square PV by a stem that barely moves and an impossible gain."""
LATER = (0.0, 0.8, 1.6, 2.8)
"""Dead times tried, beyond that of the backlash: backlash in place of a jump responds too soon [blocks]."""
SCREENED = 8  # Paths side by side while these are tried: for time
CARRIED = 16  # Paths side by side later: for time
ROUNDS = 5  # Rounds of decoding and fitting: of six followed by hand the last turns gained a few nat
HOPELESS = 0.15
"""Largest deficit of a path to the backlash after two rounds of decoding and fitting, for which it is
continued [nat / judged block]. After two rounds the worst of 40 identified simulated sticking stems had
.04; tanks behind backlash had .21 or more. A sticking valve of the sample mill has .39 after one round,
and is identified."""
HOT = (8.0, 4.0, 2.0, 1.0)
"""Times the innovations' variance in the first rounds, in which the process is not known yet."""
FEWEST = 6  # Slips of a path at least: three cycles
LONGEST_REST = 0.9
"""Longest rest of a stem while the process is not known: a stem at rest explains nothing [periods]."""
STEPS = (0.15, 0.08, 0.04)  # Relative steps of the search for the friction in the end
DEAD_STEPS = 8.0
"""Change of the dead time in a step of one [blocks]. A stem that slips later is equivalent to a longer
dead time."""
WORTH = 1.0  # Gain of a step from which it is taken [nat]
MOST_MOVES = 40  # Steps that are taken at most, for time: on 9 simulated stems some five were

MOVES = (
    *((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)),
    *((1, 0, -1), (-1, 0, 1), (1, -1, -1), (-1, 1, 1)),
)
"""Relative steps of stickband, jump and dead time: a wider band with a smaller jump responds earlier."""


Gains = dict[tuple[float, float], float]
"""Gains under which frictions are tried, by width and jump share; 0 where the friction is not tried."""


class SlipPath(NamedTuple):
    """The fit behind a decoded stem, held in its problem like a recorded one, and its slips' log probability."""

    fit: Fitted
    chance: float

    @property
    def mean(self) -> float:
        """Mean of the stem [% OP]."""
        return float(np.mean(self.fit.p.blocks.position))  # type: ignore[arg-type]

    @property
    def log_likelihood(self) -> float:
        """Log likelihood of fit and slips [nat]."""
        return self.fit.log_likelihood + self.chance


@dataclass(frozen=True, slots=True)
class _Trial:
    """A friction, dead time and gain under which a stem was decoded, with log probability and slips."""

    score: float
    slips: int
    band: float
    share: float
    later: float
    gain: float
    stem: Floats = field(compare=False)


def _decoded(
    fit: Fitted, mean: float, law: StemLaw, rest: int, noise: Noise, most: int, least: float = -math.inf
) -> tuple[Floats, float]:
    """The most probable stem under a fit, and its log probability; none where that is below `least`.

    mean : of the stem [% OP]; law, rest : friction and its longest rest [samples]; most : number of parallel paths.
    """
    problem = fit.p
    lag = unit_lag(fit.time_constant_s, fit.process.dead_time_s, problem.step_s)
    r = Response(lag, fit.gain, slow_terms(fit) - fit.gain * mean)
    f, counts = SlipDistances(law.breakaway, law.sliding, rest), judged(problem.usable, noise.ar.size)
    return decoded(problem.blocks.op, problem.centred, counts, r, noise, f, most, least)


def _slips(stem: Floats) -> int:
    return int((np.diff(stem) != 0).sum())


def _gain(backlash: Fitted, band: float, share: float, half: int) -> float:
    """The gain at which a friction's slips move PV as far in half a period (`half` blocks) as PV moves.

    0 unless it is far smaller than the gain of the backlash fit.
    """
    centred = backlash.p.centred
    stem = residual(backlash.moved(valve=sticking(band, share), gain=-1.0)) - centred
    moved = (float(np.std(x[half:] - x[:-half])) if 0 < half < x.size else 0.0 for x in (centred, stem))
    pv, swing = moved
    found = math.copysign(pv / swing, backlash.gain) if swing > 0.0 else 0.0
    return found if abs(found) < abs(backlash.gain) / ABSURD else 0.0


def _screened(backlash: Fitted, noise: Floats, rest: int, gains: Gains) -> list[_Trial]:
    """Promising frictions and dead times near a backlash fit, each with its decoded stem, best first, under a
    separate noise model."""
    problem = backlash.p
    e = whitened(disturbance(backlash), noise, every_lag(noise.size))[noise.size :]
    sigma2 = float(np.mean(e[problem.usable[noise.size :]] ** 2))
    mean, out = float(backlash_stem(problem.blocks.op, backlash.valve.stickband).mean()), list[_Trial]()
    for later in LATER:
        for (width, share), gain in gains.items():
            if gain:
                band = width * backlash.valve.stickband
                fit = backlash.moved(dead_time_s=backlash.dead_time_s + later * problem.dt_s, gain=gain)
                law, least = sticking(band, share), _bound(out, band, share)
                path, score = _decoded(fit, mean, law, rest, Noise(noise, sigma2), SCREENED, least)
                out = _chosen([*out, _Trial(score, _slips(path), band, share, later, gain, path)])
        if not out:  # a gain without slips at the backlash fit's dead time has none at later dead times
            break
    return out


def _bound(best: list[_Trial], band: float, share: float) -> float:
    """The score below which a trial is neither the best of its width nor the best of its jump share."""
    of_width = max((t.score for t in best if t.band == band), default=-math.inf)
    return min(of_width, max((t.score for t in best if t.share == share), default=-math.inf))


def _chosen(tried: list[_Trial]) -> list[_Trial]:
    """The best trial of each width and of each jump share, best first.

    Ours: this rule finds 13 of 16 simulated stems (tests/identification/estimation/test_slip_paths.py), and 28 of 48
    of other bands, jumps and processes; two of each share at two dead times, which lead to one path, find 11 and 22.
    Widths alone find 16 and 30, but half the jump of a sample mill valve whose jump is most of its band.
    """
    best: dict[tuple[str, float], _Trial] = {}
    for t in sorted(tried, key=lambda t: -t.score):
        if t.slips >= FEWEST:
            best.setdefault(("width", t.band), t)
            best.setdefault(("share", t.share), t)
    return list(dict.fromkeys(best.values()))


def _path(fit: Fitted, valve: StemLaw, stem: Floats) -> SlipPath:
    """The process fitted behind a decoded stem as if that were recorded."""
    given_stem = fit.moved(valve=valve).within(position=stem, decoded=True)
    return SlipPath(descend(given_stem), log_chance(given_stem.p.blocks.op, stem, valve.breakaway))


def _decoded_again(path: SlipPath, fit: Fitted, law: StemLaw, rest: int, hot: float) -> Floats:
    """The most probable stem under a fit near a path, shape of OP; hot : factor of the innovations variance."""
    return _decoded(fit, path.mean, law, rest, Noise(fit.ar, hot * fit.loss), CARRIED)[0]


def _followed(backlash: Fitted, begun: _Trial, rest: int) -> SlipPath:
    """Fit process and stem alternately from a trial; return the most probable path."""
    valve, stem = sticking(begun.band, begun.share), begun.stem
    later_s = begun.later * backlash.p.dt_s
    fit = backlash.moved(dead_time_s=backlash.dead_time_s + later_s, gain=begun.gain)
    best = path = _path(fit, valve, stem)
    hopeless = backlash.log_likelihood - HOPELESS * backlash.count
    for k in range(1, ROUNDS):
        longest, hot = rest if k == 1 else stem.size, HOT[min(k - 1, len(HOT) - 1)]
        stem = _decoded_again(path, path.fit, valve, longest, hot)
        if _slips(stem) < FEWEST:
            break
        path = _path(path.fit, valve, stem)
        best = max(best, path, key=lambda p: p.log_likelihood)
        if k > 1 and path.log_likelihood < hopeless:
            break
    return best


def _settled(best: SlipPath) -> SlipPath:
    """Move stickband, jump and dead time by decreasing steps to the most probable path."""
    return compass(None, best, -best.log_likelihood, _moved, MOVES, STEPS, worth=WORTH, most=MOST_MOVES)[0]


def _moved(_: None, best: SlipPath, move: tuple[int, int, int], step: float) -> tuple[SlipPath, float]:
    """The path with another stickband, jump and dead time; an infinite loss where no path has slips."""
    problem = best.fit.p
    v, (wider, jumpier, later) = best.fit.valve, (step * m for m in move)
    band, share = v.stickband * (1.0 + wider), v.slip_jump / v.stickband + 2.0 * jumpier
    dead_s = best.fit.dead_time_s + later * DEAD_STEPS * problem.dt_s
    if not 0.0 < share <= 1.0 or dead_s < 0.0:
        return best, math.inf
    gain = best.fit.gain * v.slip_jump / (band * share)  # a slip moves PV by gain times jump
    fit, law = best.fit.moved(dead_time_s=dead_s, gain=gain), sticking(band, share)
    stem = _decoded_again(best, fit, law, problem.blocks.op.size, 1.0)
    if _slips(stem) < FEWEST:
        return best, math.inf
    path = _path(fit, law, stem)
    return path, -path.log_likelihood


def fit_irregular(backlash: Fitted, noise: Floats, period_s: float, any_gain: bool = True) -> SlipPath | None:
    """The most probable path of a sticking stem in a cycling loop; None where no path is as likely as backlash.

    backlash : the best one, fitted in blocks, without a recorded stem; noise : shape (order,), a noise model that
    favours no valve, used at the start; period_s : period of the cycle [s]; any_gain : whether gains far below that
    of the backlash fit are also tried when its own gain finds no path. If another stick-slip is known, they lead to
    narrower bands with longer dead times.
    """
    if backlash.gain == 0.0:
        return None
    problem = backlash.p
    rest = max(int(LONGEST_REST * period_s / problem.step_s), 1)
    bands, half = backlash.valve.stickband, rest // (problem.blocks.factor * problem.blocks.steps) // 2
    usual: Gains = {(w, s): backlash.gain for w in WIDTHS for s in JUMPS}
    best = _likeliest(backlash, noise, rest, usual)
    if best is None and any_gain:
        smaller = {(w, s): _gain(backlash, w * bands, s, half) for w, s in usual}
        best = _likeliest(backlash, noise, rest, smaller)
    return None if best is None else _settled(best)


def near_path(backlash: Fitted, path: SlipPath) -> Fitted:
    """A fit to the backlash fit's problem with a path's process and mean friction: a start for regular slips."""
    found = path.fit
    t, dead, gain = found.time_constant_s, found.dead_time_s, found.gain
    share = min(found.valve.slip_jump / max(found.valve.stickband, 1e-9), 1.0)
    valve = sticking(found.valve.stickband, share)
    moved = backlash.moved(gain=gain, time_constant_s=t, dead_time_s=dead, valve=valve)
    return replace(moved, slow=found.slow)


def _likeliest(backlash: Fitted, noise: Floats, rest: int, gains: Gains) -> SlipPath | None:
    """The most probable path from the best trials; None where none is as likely as backlash."""
    paths = [_followed(backlash, t, rest) for t in _screened(backlash, noise, rest, gains)]
    best = max(paths, key=lambda p: p.log_likelihood, default=None)
    return None if best is None or best.log_likelihood < backlash.log_likelihood else best


def path_evidence(path: SlipPath, alternative: Fitted) -> float:
    """Log likelihood [nat] of a path and its slips over a fit of the same problem without it."""
    return evidence(path.fit, alternative) + path.chance
