"""How faults spread: couplings from the sources to neighbours and on, mixing, recycles, and quiet couplings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from proofs.coupled import response
from proofs.coupled.faults import Bench
from proofs.coupled.kernel import Plant
from proofs.coupled.trends import log_uniform

FIRST = (1, 4)
"""Neighbours that a source reaches itself."""
DEPTH = 4
"""Longest chain of followers."""
MOST = 12
"""Loops that one source is led to."""
COVERED = 0.6
"""Share of the plant's loops that sources are led to at most, an equal part each."""
ONWARD = 0.75
"""How likely a follower passes it on; to a second one half as likely."""
MIXED = 0.2
"""How likely a coupling ends at a loop that is fed already."""
STEEPEST = 2.0
"""Largest gain of a coupling [% OP/%]."""
FADING = 0.7
"""Swell above one that is drawn for far followers, over that for near ones."""
WEAK = (1.1, 1.5)
"""Swell that weak followers are drawn for."""
STRONG = (1.8, 7.0)
"""Swell that the others are drawn for; far ones fade."""
WEAK_SHARE = 0.25
"""Share of weak ones."""
FAINTEST = 1.08
"""A coupling that would give its follower a smaller swell is drawn elsewhere."""
RECYCLED = 0.5
"""Share of sources that a follower feeds back to."""
RECYCLE = (0.08, 0.3)
"""Loop gain of a recycle at its most sensitive frequency."""
QUIET = (0.1, 0.4)
"""Couplings between loops that no source reaches, by the number of loops."""
QUIET_GAIN = (0.03, 0.3)
"""Their gains [% OP/%]."""
NEIGHBOURS = 1.0
"""How far followers are like their parents in natural period: one deviation [log]."""
ELSEWHERE = 0.25
"""How likely a follower stands in another area, against the same one."""


@dataclass
class Tree:
    """A source, its period [s], and who it was led to, by chain length."""

    source: int
    turn: float
    depth: dict[int, int]


class Web:
    """Adds couplings to both plants of a bench."""

    def __init__(self, rng: np.random.Generator, bench: Bench, areas: list[str]) -> None:
        self.rng, self.bench, self.areas = rng, bench, areas
        self.trees: list[Tree] = []

    def fed(self) -> set[int]:
        """Loops of all trees."""
        return set().union(*(t.depth for t in self.trees))

    def reaches(self, begin: int, end: int) -> bool:
        """Whether couplings and cascades lead from one loop to another."""
        p = self.bench.faulty
        seen, todo = {begin}, [begin]
        while todo:
            i = todo.pop()
            on = {int(x) for x in p.link_to[p.link_from == i]} | {int(p.master[i]), int(p.slave[i])}
            todo += [x for x in on - seen if x >= 0]
            seen |= on
        return end in seen

    def link(self, begin: int, end: int, turn: float, gain: float) -> tuple[float, ...]:
        """A drawn coupling: ends, signal, gain, lag and delay for swings of that period [s]."""
        rng, step = self.rng, self.bench.sound.step
        stem = float(rng.random() < 0.4 and self.bench.sound.slave[begin] < 0)
        delay = max(round(turn * log_uniform(rng, 0.02, 0.6) / step), 1)
        return begin, end, stem, gain, turn * log_uniform(rng, 0.02, 0.3), delay

    def put(self, link: tuple[float, ...]) -> None:
        """Add a coupling."""
        self.bench.sound, self.bench.faulty = (x.linked(*link) for x in (self.bench.sound, self.bench.faulty))

    def led(self, tree: Tree, begin: int, end: int) -> bool:
        """Couple a follower so that it swells as drawn; False: it would not show."""
        bench, rng, depth = self.bench, self.rng, tree.depth[begin] + 1
        shown, link = bench.faults[tree.source][1], self.link(begin, end, tree.turn, 1.0)
        told = (2 * np.pi / tree.turn, tree.source, shown.pv, shown.stem)
        with_it = response.swings(bench.faulty.linked(*link), *told)[2][end]
        answer = abs(with_it - response.swings(bench.faulty, *told)[2][end])
        aim = rng.uniform(*WEAK) if rng.random() < WEAK_SHARE else log_uniform(rng, *STRONG)
        aim = aim if depth == 1 else 1 + FADING * (aim - 1)
        calm = np.sqrt(2) * bench.calm[end]
        gain = min(calm * np.sqrt(aim**2 - 1) / max(answer, 1e-9), STEEPEST)
        if np.hypot(1, gain * answer / calm) < FAINTEST:
            return False
        self.put((*link[:3], gain * rng.choice([-1.0, 1.0]), *link[4:]))
        tree.depth.setdefault(end, depth)
        for partner in (int(bench.sound.master[end]), int(bench.sound.slave[end])):
            if partner >= 0:
                tree.depth.setdefault(partner, depth + 1)
        return True

    def _next(self, tree: Tree, begin: int) -> int:
        """A loop to be fed by another; -1: none is left."""
        bench, fed = self.bench, self.fed()
        mixed = self.rng.random() < MIXED and len(fed) > 3
        shut = {t.source for t in self.trees}
        may = [i for i in range(bench.sound.size) if i not in shut and (i in fed) == mixed]
        may = [i for i in may if not self.reaches(i, begin)]
        if not may:
            return -1
        far = np.log(bench.natural[may, 0] / tree.turn) / NEIGHBOURS
        here = np.array([1.0 if self.areas[i] == self.areas[begin] else ELSEWHERE for i in may])
        weight = here * np.exp(-0.5 * np.clip(far, -5, 5) ** 2)
        return int(self.rng.choice(may, p=weight / weight.sum()))

    def grow(self, tree: Tree) -> None:
        """Lead a source to its neighbours, and them to theirs."""
        rng, todo, tries = self.rng, [tree.source], 0
        most = min(MOST, max(COVERED * self.bench.sound.size / len(self.trees), 2))
        while todo and len(tree.depth) <= most:
            begin = todo.pop(0)
            depth = tree.depth[begin]
            if depth >= DEPTH:
                continue
            ways = int(rng.integers(FIRST[0], FIRST[1] + 1)) if begin == tree.source else 0
            if begin != tree.source and rng.random() < ONWARD:
                ways = 1 + int(rng.random() < ONWARD / 2)
            while ways > 0 and tries < 6 * MOST:
                tries += 1
                end = self._next(tree, begin)
                if end < 0:
                    break
                known = end in tree.depth
                if self.led(tree, begin, end):
                    ways -= 1
                    todo += [] if known else [end]

    def recycle(self, tree: Tree) -> None:
        """Let a late follower feed back to the source or an early follower, well below a loop gain of one."""
        rng = self.rng
        late = [i for i, depth in tree.depth.items() if depth >= 1 and self.reaches(tree.source, i)]
        if not late or rng.random() > RECYCLED:
            return
        begin = max(late, key=lambda i: tree.depth[i] + rng.random())
        early = [i for i in late if i != begin and tree.depth[i] == 1 and self.reaches(i, begin)]
        end = int(rng.choice(early)) if early and rng.random() < 0.3 else tree.source
        link = self.link(begin, end, tree.turn, 1.0)
        most = max(returned(x, link) for x in (self.bench.faulty, self.bench.sound))
        gain = min(rng.uniform(*RECYCLE) / max(most, 1e-9), STEEPEST)
        self.put((*link[:3], gain * rng.choice([-1.0, 1.0]), *link[4:]))

    def quiet(self, alone: set[int]) -> None:
        """Couple loops that no source reaches to one another and to followers, some not at all."""
        rng, p = self.rng, self.bench.sound
        fed = self.fed() | alone
        free = [i for i in range(p.size) if i not in fed]
        ends = [i for i in range(p.size) if i not in alone]
        for _ in range(round(p.size * rng.uniform(*QUIET)) if free else 0):
            begin, end = int(rng.choice(free)), int(rng.choice(ends))
            if not self.reaches(end, begin):
                turn = self.bench.natural[end, 0]
                self.put(self.link(begin, end, turn, log_uniform(rng, *QUIET_GAIN) * rng.choice([-1.0, 1.0])))


def returned(plant: Plant, link: tuple[float, ...]) -> float:
    """Largest gain over all frequencies once round a coupling that closes a recycle."""
    at = sorted({int(link[0]), int(link[1])})
    todo = list(at)
    while todo:
        i = todo.pop()
        on = {int(x) for x in plant.link_to[plant.link_from == i]} | {
            int(x) for x in plant.link_from[plant.link_to == i]
        }
        on = {x for x in on | {int(plant.master[i]), int(plant.slave[i])} if x >= 0} - set(at)
        at, todo = at + list(on), todo + list(on)
    at.sort()
    begin, end = at.index(int(link[0])), at.index(int(link[1]))
    small, one = among(plant, at), plant.part(at).linked(begin, end, *link[2:])
    most = 0.0
    for w in response.frequencies(plant.step)[::4]:
        pv, moved, _ = response.swings(small, w, -1, 0.0, 0.0, end)
        most = max(most, abs(response.passage(one, w)[0] * (moved if link[2] else pv)[begin]))
    return most


def among(plant: Plant, at: list[int]) -> Plant:
    """Those loops with the couplings among them."""
    out = plant.part(at)
    for k in range(plant.link_to.size):
        ends = int(plant.link_from[k]), int(plant.link_to[k])
        if ends[0] in at and ends[1] in at:
            rest = (plant.link_stem[k], plant.link_gain[k], plant.link_lag[k], plant.link_delay[k])
            out = out.linked(at.index(ends[0]), at.index(ends[1]), *rest)
    return out
