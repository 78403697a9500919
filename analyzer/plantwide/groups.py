"""Loops with a common oscillation: one period, coherent, in the same hours.

An oscillation is compared only with those of nearly the same period. The clearest one without a group leads a new
group; coherent ones join, whether or not they are significant alone. A loop may be in several groups.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analyzer.config import PlantLimits
from analyzer.plantwide.oscillation_lines import OscillationLines, on_one_clock
from analyzer.plantwide.source import median_granger_f
from identification.record import Floats
from identification.signals.cross_spectrum import Whole, band, chance_coherence, coherences, drift, tapered

HINTS = 4
"""Number of loops with a hint of an oscillation from which it counts if no loop shows it alone:
proofs/plant_wide.py."""
HEARD = 6  # Clearest loops of a group that a further loop has to predict [loops]
MOST_TESTED = 12  # Loops of a group that are tested for the loops they move with, the most coherent first
SHIFTS = 12  # Largest number of shifts of the lines that estimate chance coherence
HARMONIC = 0.03  # Logarithm by which a period may differ from a whole part of another one to be its harmonic
NEAR_PERIOD = 0.25
"""Largest difference of the logarithms of periods at which this is tested: proofs/plant_wide.py."""


@dataclass(frozen=True, slots=True)
class Group:
    """Loops with a common oscillation, each with its oscillation and its coherence with that of the leader [-]; the
    leader is the first, the others follow by coherence."""

    oscillations: Mapping[str, OscillationLines]
    coherence: Mapping[str, float]

    @property
    def period_s(self) -> float:
        """Its period [s]."""
        return next(iter(self.oscillations.values())).period_s

    @property
    def loops(self) -> tuple[str, ...]:
        """Names of its loops."""
        return tuple(self.oscillations)

    def with_lacking(
        self, oscillations: Mapping[str, OscillationLines], coherence: Mapping[str, float]
    ) -> Group:
        """The group with additional loops."""
        lacking = [loop for loop in oscillations if loop not in self.oscillations]
        more = {loop: oscillations[loop] for loop in lacking}, {loop: coherence[loop] for loop in lacking}
        return Group({**self.oscillations, **more[0]}, {**self.coherence, **more[1]})


class _Neighbours:
    """Oscillations of one clock by rising frequency, and which are coherent; each is computed once."""

    def __init__(self, oscillations: Sequence[OscillationLines], limits: PlantLimits) -> None:
        self.oscillations = sorted(oscillations, key=lambda w: w.line)
        self._limits = limits
        lines = [tapered(w.lines).astype(np.complex64) for w in self.oscillations]
        count = np.array([x.size for x in lines], dtype=np.int64)
        offset = np.concatenate(([0], np.cumsum(count)[:-1])).astype(np.int64)
        first = np.array([w.first + 1 for w in self.oscillations], dtype=np.int64)
        self._packed: tuple[np.ndarray, Whole, Whole, Whole] = np.concatenate(lines), offset, first, count
        self._log_line = np.log(np.array([w.line for w in self.oscillations]))
        self._loop = np.array([w.loop for w in self.oscillations])
        self._own_noise = 1.0 / np.maximum([w.prominence for w in self.oscillations], 1.0)
        self._known: dict[int, dict[int, float]] = {}

    def near(self, line: float, reach: float) -> Whole:
        """Indices of the oscillations whose log period differs from that of a line by at most `reach`."""
        at = math.log(line)
        return np.arange(*np.searchsorted(self._log_line, (at - reach, at + reach)))

    def moving_with(self, one: int) -> dict[int, float]:
        """Oscillations coherent with a given one and their coherences, highest first; one per loop."""
        if one not in self._known:
            self._known[one] = self._one_a_loop(self._coherent_with(one))
        return self._known[one]

    def second_ring(self, one: int) -> dict[int, float]:
        """Oscillations coherent with two that are coherent with a leader, though not with the leader itself."""
        joined = self.moving_with(one)
        inside = {self._loop[j] for j in (one, *joined)}
        seen: dict[int, list[float]] = {}
        for j in list(joined)[:MOST_TESTED]:
            for k, level in self.moving_with(j).items():
                if self._loop[k] not in inside:
                    seen.setdefault(k, []).append(level)
        enough = min(2, len(joined))
        return self._one_a_loop((k, max(levels)) for k, levels in seen.items() if len(levels) >= enough)

    def _one_a_loop(self, levels: Iterable[tuple[int, float]]) -> dict[int, float]:
        best: dict[str, tuple[int, float]] = {}
        for k, level in sorted(levels, key=lambda t: -t[1]):
            best.setdefault(self.oscillations[k].loop, (k, level))
        return dict(best.values())

    def _coherent_with(self, one: int) -> Iterable[tuple[int, float]]:
        limits, oscillation = self._limits, self.oscillations[one]
        near = self.near(oscillation.line, limits.same_period)
        near = near[self._loop[near] != oscillation.loop]
        low, high, width = band(oscillation.line)
        strict, loose = (
            max(limits.coherent, chance_coherence(high - low, width, c))
            for c in (limits.chance, limits.chance_in_step)
        )
        found = self._coherences(one, near)
        own = 1.0 - limits.lost - limits.lost_to_noise * (self._own_noise[one] + self._own_noise[near])
        coherent = (found >= loose) & (found >= own)
        near, found = near[coherent], found[coherent]
        over = found / np.maximum(self._by_chance(one, near), 1e-9)
        coherent = over >= limits.over_chance
        near, found, over = near[coherent], found[coherent], over[coherent]
        drifts = self._drifts(oscillation, [self.oscillations[j] for j in near])
        sure = (found >= strict) & (drifts <= limits.drift)
        sure |= (over >= limits.over_chance_in_step) & (drifts <= limits.drift_in_step)
        return zip(near[sure].tolist(), found[sure].tolist(), strict=True)

    def _coherences(self, one: int, others: Whole, shift: int = 0) -> Floats:
        span = np.array(band(self.oscillations[one].line), dtype=np.int64)
        return np.asarray(coherences(*self._packed, one, others, span, shift))

    def _by_chance(self, one: int, others: Whole) -> Floats:
        """The largest coherence of shifted lines, which have only the shape of their band in common, shape (k,)."""
        if not others.size:
            return np.zeros(0)
        low, high, _ = band(self.oscillations[one].line)
        far = max((high - low) // 2, 4)
        shifts = np.unique(np.linspace(3, far, SHIFTS // 2).astype(int))
        found = [self._coherences(one, others, int(sign * s)) for s in shifts for sign in (-1, 1)]
        return np.asarray(np.max(found, axis=0))

    @staticmethod
    def _drifts(one: OscillationLines, others: Sequence[OscillationLines]) -> Floats:
        """Phase drift [turns over the record] of other oscillations against a given one, near its period."""
        if not others:
            return np.zeros(0)
        low, high, _ = band(one.line)
        x, *y = (w.lines[low - w.first : high - w.first] for w in (one, *others))
        return np.abs(drift(x, np.array(y)))


def groups_of(oscillations: Sequence[OscillationLines], limits: PlantLimits) -> list[Group]:
    """Groups of loops with a common oscillation from all oscillations of a night, larger groups first; none of a
    single loop."""
    known = [w for w in on_one_clock(oscillations) if w.line >= limits.follow_cycles and np.any(w.lines)]
    if not known:
        return []
    neighbours = _Neighbours(known, limits)
    merged = (_with_foresight(g, neighbours, limits) for g in _merged(_led(neighbours, limits), limits))
    return sorted(merged, key=lambda g: (-len(g.oscillations), g.loops))


def _shows(oscillation: OscillationLines, limits: PlantLimits) -> bool:
    """Whether an oscillation is found, or indicated, in its loop alone."""
    return oscillation.own or oscillation.prominence >= limits.hint_prominence


def _led(neighbours: _Neighbours, limits: PlantLimits) -> list[Group]:
    """Groups around the clearest oscillations, in that order."""
    leading = [i for i, w in enumerate(neighbours.oscillations) if _shows(w, limits)]
    order = sorted(
        leading, key=lambda i: (not neighbours.oscillations[i].own, -neighbours.oscillations[i].prominence)
    )
    taken: set[int] = set()
    found: list[Group] = []
    for i in order:
        if i in taken:
            continue
        levels = {i: 1.0} | neighbours.moving_with(i) | neighbours.second_ring(i)
        oscillations = {neighbours.oscillations[j].loop: neighbours.oscillations[j] for j in levels}
        if len(oscillations) > 1 and _is_oscillation(list(oscillations.values()), limits):
            taken.update(levels)
            found.append(
                Group(oscillations, {neighbours.oscillations[j].loop: level for j, level in levels.items()})
            )
    return found


def _is_oscillation(oscillations: Sequence[OscillationLines], limits: PlantLimits) -> bool:
    """Whether the common signal is an oscillation, and not the load of neighbours: one loop shows it alone, or
    several indicate it."""
    hints = sum(w.prominence >= limits.hint_prominence for w in oscillations)
    return hints >= HINTS or any(w.own for w in oscillations)


def _merged(groups: Sequence[Group], limits: PlantLimits) -> list[Group]:
    """Merge groups of one period with mostly the same loops, and groups at harmonics of others."""
    merged: list[Group] = []
    for group in sorted(groups, key=lambda g: (-g.period_s, -len(g.oscillations))):
        for k, other in enumerate(merged):
            if _is_same(group, other, limits) or _is_group_of_harmonics(group, other, limits):
                merged[k] = other.with_lacking(group.oscillations, group.coherence)
                break
        else:
            merged.append(group)
    return merged


def _is_same(one: Group, other: Group, limits: PlantLimits) -> bool:
    """Whether two groups have one period and most of the smaller one's loops in common."""
    if abs(math.log(one.period_s / other.period_s)) > limits.same_period:
        return False
    shared = one.oscillations.keys() & other.oscillations.keys()
    return 2 * len(shared) > min(len(one.oscillations), len(other.oscillations))


def _is_group_of_harmonics(one: Group, other: Group, limits: PlantLimits) -> bool:
    """Whether the oscillations of a group are harmonics of a loop of another one."""
    ratio = other.period_s / one.period_s
    if round(ratio) < 2 or abs(math.log(ratio / round(ratio))) > HARMONIC:
        return False
    return any(
        w.harmonic == round(ratio) and loop in other.oscillations for loop, w in one.oscillations.items()
    )


def _with_foresight(group: Group, neighbours: _Neighbours, limits: PlantLimits) -> Group:
    """A group with further loops that are not coherent enough but predict it: a source with irregular stick-slip
    moves others by the part of it that their filters pass."""
    clearest = sorted(group.oscillations.values(), key=lambda w: -w.prominence)[:HEARD]
    near = (
        neighbours.oscillations[k]
        for k in neighbours.near(next(iter(group.oscillations.values())).line, NEAR_PERIOD)
    )
    tested = [w for w in near if w.loop not in group.oscillations and w.harmonic == 1 and _shows(w, limits)]
    best: dict[str, tuple[float, OscillationLines]] = {}
    for oscillation, level in zip(tested, median_granger_f(tested, clearest), strict=True):
        if level >= limits.foresight and level > best.get(oscillation.loop, (0.0, oscillation))[0]:
            best[oscillation.loop] = level, oscillation
    return group.with_lacking(
        {loop: oscillation for loop, (_, oscillation) in best.items()}, dict.fromkeys(best, 0.0)
    )
