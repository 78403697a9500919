"""Couplings through which faults spread: from the sources to neighbours and further, mixing, recycles, and weak
couplings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from proofs.coupled import response
from proofs.coupled.faults import Bench
from proofs.coupled.kernel import Plant
from proofs.coupled.trends import log_uniform

FIRST = (1, 4)
"""Number of neighbours that a source reaches directly."""
DEPTH = 4
"""Longest chain of followers."""
MOST = 12
"""Most loops that one source reaches."""
COVERED = 0.6
"""Largest share of the plant's loops that sources reach, in equal parts."""
ONWARD = 0.75
"""Probability that a follower passes the oscillation on; to a second loop with half of it."""
MIXED = 0.2
"""Probability that a coupling ends at a loop that is already coupled."""
STEEPEST = 2.0
"""Largest gain of a coupling [% OP/%]."""
FADING = 0.7
"""Increase of the error that is drawn for far followers, relative to that for near ones."""
WEAK = (1.1, 1.5)
"""Ratio of errors with and without the source, drawn for weak followers."""
STRONG = (1.8, 7.0)
"""The same for the other followers; for far ones it is smaller."""
WEAK_SHARE = 0.25
"""Share of weak followers."""
FAINTEST = 1.08
"""Least ratio of errors of a follower; a weaker coupling is drawn again elsewhere."""
RECYCLED = 0.5
"""Share of sources with feedback from a follower."""
RECYCLE = (0.08, 0.3)
"""Loop gain of a recycle at its most sensitive frequency."""
QUIET = (0.1, 0.4)
"""Number of couplings between loops that no source reaches, relative to the number of loops."""
QUIET_GAIN = (0.03, 0.3)
"""Their gains [% OP/%]."""
NEIGHBOURS = 1.0
"""One deviation of the difference in natural period between followers and their parents [log]."""
ELSEWHERE = 0.25
"""Probability that a follower is in another area, relative to the same area."""


@dataclass
class Tree:
    """A source, its period [s], and its followers by chain length."""

    source: int
    cycle: float
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
        """Whether couplings and cascades connect one loop to another."""
        p = self.bench.faulty
        seen, todo = {begin}, [begin]
        while todo:
            i = todo.pop()
            on = {int(x) for x in p.link_to[p.link_from == i]} | {int(p.master[i]), int(p.slave[i])}
            todo += [x for x in on - seen if x >= 0]
            seen |= on
        return end in seen

    def link(self, begin: int, end: int, cycle: float, gain: float) -> tuple[float, ...]:
        """A drawn coupling: ends, signal, gain, lag and delay for an oscillation of that period [s]."""
        rng, step = self.rng, self.bench.without_fault.step
        stem = float(rng.random() < 0.4 and self.bench.without_fault.slave[begin] < 0)
        delay = max(round(cycle * log_uniform(rng, 0.02, 0.6) / step), 1)
        return begin, end, stem, gain, cycle * log_uniform(rng, 0.02, 0.3), delay

    def put(self, link: tuple[float, ...]) -> None:
        """Add a coupling."""
        self.bench.without_fault, self.bench.faulty = (
            x.linked(*link) for x in (self.bench.without_fault, self.bench.faulty)
        )

    def led(self, tree: Tree, begin: int, end: int) -> bool:
        """Couple a follower so that its error increases as drawn; False where the increase would not be visible."""
        bench, rng, depth = self.bench, self.rng, tree.depth[begin] + 1
        shown, link = bench.faults[tree.source][1], self.link(begin, end, tree.cycle, 1.0)
        swing = (2 * np.pi / tree.cycle, tree.source, shown.pv, shown.stem)
        with_it = response.swings(bench.faulty.linked(*link), *swing)[2][end]
        answer = abs(with_it - response.swings(bench.faulty, *swing)[2][end])
        aim = rng.uniform(*WEAK) if rng.random() < WEAK_SHARE else log_uniform(rng, *STRONG)
        aim = aim if depth == 1 else 1 + FADING * (aim - 1)
        calm = np.sqrt(2) * bench.calm[end]
        gain = min(calm * np.sqrt(aim**2 - 1) / max(answer, 1e-9), STEEPEST)
        if np.hypot(1, gain * answer / calm) < FAINTEST:
            return False
        self.put((*link[:3], gain * rng.choice([-1.0, 1.0]), *link[4:]))
        tree.depth.setdefault(end, depth)
        for partner in (int(bench.without_fault.master[end]), int(bench.without_fault.slave[end])):
            if partner >= 0:
                tree.depth.setdefault(partner, depth + 1)
        return True

    def _next(self, tree: Tree, begin: int) -> int:
        """A loop to be coupled to another one; -1 where none remains."""
        bench, fed = self.bench, self.fed()
        mixed = self.rng.random() < MIXED and len(fed) > 3
        shut = {t.source for t in self.trees}
        may = [i for i in range(bench.without_fault.size) if i not in shut and (i in fed) == mixed]
        may = [i for i in may if not self.reaches(i, begin)]
        if not may:
            return -1
        far = np.log(bench.natural[may, 0] / tree.cycle) / NEIGHBOURS
        here = np.array([1.0 if self.areas[i] == self.areas[begin] else ELSEWHERE for i in may])
        weight = here * np.exp(-0.5 * np.clip(far, -5, 5) ** 2)
        return int(self.rng.choice(may, p=weight / weight.sum()))

    def grow(self, tree: Tree) -> None:
        """Couple a source to its neighbours, and these to theirs."""
        rng, todo, tries = self.rng, [tree.source], 0
        most = min(MOST, max(COVERED * self.bench.without_fault.size / len(self.trees), 2))
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
        """Add feedback from a late follower to the source or an early follower, with a loop gain well below one."""
        rng = self.rng
        late = [i for i, depth in tree.depth.items() if depth >= 1 and self.reaches(tree.source, i)]
        if not late or rng.random() > RECYCLED:
            return
        begin = max(late, key=lambda i: tree.depth[i] + rng.random())
        early = [i for i in late if i != begin and tree.depth[i] == 1 and self.reaches(i, begin)]
        end = int(rng.choice(early)) if early and rng.random() < 0.3 else tree.source
        link = self.link(begin, end, tree.cycle, 1.0)
        most = max(returned(x, link) for x in (self.bench.faulty, self.bench.without_fault))
        gain = min(rng.uniform(*RECYCLE) / max(most, 1e-9), STEEPEST)
        self.put((*link[:3], gain * rng.choice([-1.0, 1.0]), *link[4:]))

    def quiet(self, alone: set[int]) -> None:
        """Couple loops that no source reaches to each other and to followers; some are not coupled at all."""
        rng, p = self.rng, self.bench.without_fault
        fed = self.fed() | alone
        free = [i for i in range(p.size) if i not in fed]
        ends = [i for i in range(p.size) if i not in alone]
        for _ in range(round(p.size * rng.uniform(*QUIET)) if free else 0):
            begin, end = int(rng.choice(free)), int(rng.choice(ends))
            if not self.reaches(end, begin):
                cycle = self.bench.natural[end, 0]
                self.put(
                    self.link(begin, end, cycle, log_uniform(rng, *QUIET_GAIN) * rng.choice([-1.0, 1.0]))
                )


def returned(plant: Plant, link: tuple[float, ...]) -> float:
    """Largest loop gain over all frequencies around a recycle that this coupling closes."""
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
    """Those loops with the couplings between them."""
    out = plant.part(at)
    for k in range(plant.link_to.size):
        ends = int(plant.link_from[k]), int(plant.link_to[k])
        if ends[0] in at and ends[1] in at:
            rest = (plant.link_stem[k], plant.link_gain[k], plant.link_lag[k], plant.link_delay[k])
            out = out.linked(at.index(ends[0]), at.index(ends[1]), *rest)
    return out
