"""Loops that share an oscillation: one period, coherent, over the same hours.

A wave is compared with those of nearly its period alone. The clearest wave that belongs nowhere yet leads a group;
what moves with it joins, whether or not it would be called an oscillation by itself. A loop may stand in several
groups.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analyzer.config import PlantLimits
from analyzer.plantwide.clock import on_one_clock
from analyzer.plantwide.foresight import foresight
from analyzer.plantwide.wave import Wave
from identification.record import Floats
from identification.signals.cross_spectrum import Whole, band, chance_coherence, coherences, drift, tapered

HARMONIC = 0.03
"""Difference of a period from a whole part of another up to which it is a harmonic; ours."""
ASKED = 12
"""Loops of a group that are asked whom they move with, the most coherent first; ours: more add nothing."""
HEARD = 6
"""Loops of a group that a loop beside it has to foresee, the clearest; ours."""
SHIFTS = 12
"""Shifts of the lines by which chance coherence is told, at most."""


@dataclass(frozen=True, slots=True)
class Member:
    """A loop in a group: its wave and the coherence with the wave that leads [-]."""

    wave: Wave
    coherence: float


@dataclass(frozen=True, slots=True)
class Group:
    """Loops that share an oscillation; the first member's wave leads, the others follow by their coherence."""

    members: tuple[Member, ...]

    @property
    def period_s(self) -> float:
        """Its period [s]."""
        return self.members[0].wave.period_s

    @property
    def loops(self) -> tuple[str, ...]:
        """Names of its loops."""
        return tuple(m.wave.loop for m in self.members)


@dataclass(frozen=True, slots=True)
class _Packed:
    """Waves of one clock, tapered, one after the other as `coherences` takes them, by rising frequency.

    loop numbers their loops; own_noise is the inverse of their prominences [-].
    """

    waves: list[Wave]
    flat: np.ndarray
    offset: Whole
    first: Whole
    count: Whole
    log_line: Floats
    loop: Whole
    own_noise: Floats


def _packed(waves: Sequence[Wave]) -> _Packed:
    rising = sorted(waves, key=lambda w: w.line)
    lines = [tapered(w.lines).astype(np.complex64) for w in rising]
    count = np.array([x.size for x in lines], dtype=np.int64)
    offset = np.concatenate(([0], np.cumsum(count)[:-1])).astype(np.int64)
    first = np.array([w.first + 1 for w in rising], dtype=np.int64)
    log_line = np.log(np.array([w.line for w in rising]))
    numbers = {name: i for i, name in enumerate(dict.fromkeys(w.loop for w in rising))}
    loop = np.array([numbers[w.loop] for w in rising], dtype=np.int64)
    own_noise = 1.0 / np.maximum([w.prominence for w in rising], 1.0)
    return _Packed(rising, np.concatenate(lines), offset, first, count, log_line, loop, own_noise)


def _coherent(p: _Packed, one: int, others: Whole, shift: int = 0) -> Floats:
    span = np.array(band(p.waves[one].line), dtype=np.int64)
    return np.asarray(coherences(p.flat, p.offset, p.first, p.count, one, others, span, shift))


def _by_chance(p: _Packed, one: int, others: Whole) -> Floats:
    """The largest coherence of shifted lines, which share nothing but the shape of their band, shape (k,)."""
    low, high, _ = band(p.waves[one].line)
    far = max((high - low) // 2, 4)
    shifts = np.unique(np.linspace(3, far, SHIFTS // 2).astype(int))
    found = [_coherent(p, one, others, int(sign * s)) for s in shifts for sign in (-1, 1)]
    return np.asarray(np.max(found, axis=0))


def _expected(p: _Packed, one: int, others: Whole, limits: PlantLimits) -> Floats:
    """Coherence that two parts of one wave have at least, shape (k,): surroundings tell what each adds of its own."""
    return 1.0 - limits.lost - limits.lost_to_noise * (p.own_noise[one] + p.own_noise[others])


def _drift(one: Wave, other: Wave) -> float:
    """Turns over the record by which the phases of two waves drift apart, about the first one's period."""
    low, high, _ = band(one.line)
    x, y = (w.lines[low - w.first : high - w.first] for w in (one, other))
    return abs(drift(x, y))


def _joining(p: _Packed, one: int, limits: PlantLimits) -> list[tuple[int, float]]:
    """Waves that move with one, by falling coherence; one wave a loop."""
    at = p.log_line[one]
    ends = np.searchsorted(p.log_line, (at - limits.same_period, at + limits.same_period))
    near = np.arange(*ends)
    near = near[p.loop[near] != p.loop[one]]
    if not near.size:
        return []
    found = _coherent(p, one, near)
    low, high, width = band(p.waves[one].line)
    strict, loose = (
        max(limits.coherent, chance_coherence(high - low, width, c))
        for c in (limits.chance, limits.chance_in_step)
    )
    enough = (found >= loose) & (found >= _expected(p, one, near, limits))
    near, found = near[enough], found[enough]
    if not near.size:
        return []
    over = found / np.maximum(_by_chance(p, one, near), 1e-9)
    enough = over >= limits.over_chance
    near, found, over = near[enough], found[enough], over[enough]
    drifts = np.array([_drift(p.waves[one], p.waves[j]) for j in near])
    sure = (found >= strict) & (over >= limits.over_chance) & (drifts <= limits.drift)
    sure |= (over >= limits.over_chance_in_step) & (drifts <= limits.drift_in_step)
    ranked = sorted(zip(near[sure].tolist(), found[sure].tolist(), strict=True), key=lambda t: -t[1])
    best: dict[str, tuple[int, float]] = {}
    for j, level in ranked:
        best.setdefault(p.waves[j].loop, (j, level))
    return list(best.values())


def _second_ring(
    p: _Packed, one: int, joined: list[tuple[int, float]], limits: PlantLimits
) -> list[tuple[int, float]]:
    """Waves that move with two of those that a leader has joined, though not with the leader itself."""
    inside = {p.waves[one].loop, *(p.waves[j].loop for j, _ in joined)}
    seen: dict[int, list[float]] = {}
    for j, _ in joined[:ASKED]:
        for k, level in _joining(p, j, limits):
            if p.waves[k].loop not in inside:
                seen.setdefault(k, []).append(level)
    best: dict[str, tuple[int, float]] = {}
    for k, levels in sorted(seen.items(), key=lambda t: -max(t[1])):
        if len(levels) >= min(2, len(joined)):
            best.setdefault(p.waves[k].loop, (k, max(levels)))
    return list(best.values())


def _is_wave(members: Sequence[Wave], limits: PlantLimits) -> bool:
    """Whether it is an oscillation at all that loops share, and not the load of neighbours: one of them shows it by
    itself, or several hint at it."""
    if any(w.own for w in members):
        return True
    hints = sum(w.prominence >= limits.hint_prominence for w in members)
    return hints >= limits.hints


def groups_of(waves: Sequence[Wave], limits: PlantLimits) -> list[Group]:
    """Groups of loops that share an oscillation, those of more loops first; none of a single loop.

    Parameters
    ----------
    waves : sequence of Wave
        Of all loops of a night.
    limits : PlantLimits
    """
    known = [w for w in on_one_clock(waves) if w.cycles >= limits.follow_cycles and np.any(w.lines)]
    if not known:
        return []
    p = _packed(known)
    leading = [i for i, w in enumerate(p.waves) if w.own or w.prominence >= limits.hint_prominence]
    order = sorted(leading, key=lambda i: (not p.waves[i].own, -p.waves[i].prominence))
    taken: set[int] = set()
    found: list[Group] = []
    for i in order:
        if i in taken:
            continue
        joined = _joining(p, i, limits)
        joined += _second_ring(p, i, joined, limits)
        members = [p.waves[i], *(p.waves[j] for j, _ in joined)]
        if not joined or not _is_wave(members, limits):
            continue
        taken.update((i, *(j for j, _ in joined)))
        found.append(Group((Member(p.waves[i], 1.0), *(Member(p.waves[j], c) for j, c in joined))))
    merged = [_with_foresight(g, p, limits) for g in _merged(found, limits)]
    return sorted(merged, key=lambda g: (-len(g.members), g.loops))


def _merged(groups: Sequence[Group], limits: PlantLimits) -> list[Group]:
    """Groups of one period that share most of their loops as one, and groups at harmonics of others within those."""
    kept: list[Group] = []
    for group in sorted(groups, key=lambda g: (-g.period_s, -len(g.members))):
        for k, other in enumerate(kept):
            if _is_same(group, other, limits) or _is_harmonic(group, other, limits):
                kept[k] = _joined(other, group)
                break
        else:
            kept.append(group)
    return kept


def _is_same(one: Group, other: Group, limits: PlantLimits) -> bool:
    """Whether two groups have one period and most of the smaller one's loops in common."""
    if abs(math.log(one.period_s / other.period_s)) > limits.same_period:
        return False
    shared = len(set(one.loops) & set(other.loops))
    return 2 * shared > min(len(one.loops), len(other.loops))


def _is_harmonic(one: Group, other: Group, limits: PlantLimits) -> bool:
    """Whether the waves of a group are harmonics of a loop of another one."""
    ratio = other.period_s / one.period_s
    if round(ratio) < 2 or abs(math.log(ratio / round(ratio))) > HARMONIC:
        return False
    tied = {m.wave.loop for m in one.members if m.wave.harmonic == round(ratio)}
    return bool(tied & set(other.loops))


def _joined(group: Group, more: Group) -> Group:
    """A group with the loops of another one that it lacks."""
    return Group((*group.members, *(m for m in more.members if m.wave.loop not in group.loops)))


def _with_foresight(group: Group, p: _Packed, limits: PlantLimits) -> Group:
    """A group with loops that move with it too loosely to be coherent, and yet foresee it: a source that sticks and
    slips without a rhythm moves others by what of it their filters let through."""
    inside = {m.wave.loop: m.wave for m in group.members}
    clearest = sorted(inside.values(), key=lambda w: -w.prominence)[:HEARD]
    best: dict[str, tuple[float, Wave]] = {}
    at = math.log(group.members[0].wave.line)
    begin, end = np.searchsorted(p.log_line, (at - limits.near_period, at + limits.near_period))
    for wave in p.waves[begin:end]:
        shows = wave.own or wave.prominence >= limits.hint_prominence
        if wave.loop in inside or wave.harmonic != 1 or not shows:
            continue
        level = foresight(wave, clearest)
        if level >= limits.foresight and level > best.get(wave.loop, (0.0, wave))[0]:
            best[wave.loop] = level, wave
    return Group((*group.members, *(Member(wave, 0.0) for _, wave in best.values())))
