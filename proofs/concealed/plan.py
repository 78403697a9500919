"""The cases of a set: a third without an effect, single effects at four levels, pairs, effects outside the
catalogue."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from proofs.concealed.effects import CATALOGUE, NAMES, Effect
from proofs.concealed.grade import LEVELS
from proofs.concealed.strange import ODDITIES, OUTSIDE
from proofs.concealed.unnamed import FIRST_DECK, SECOND_DECK

SHARES = {"none": 1 / 3, "pair": 0.08, "outside": 0.12}
STRANGE = (*OUTSIDE, *FIRST_DECK, *SECOND_DECK)
ALONE = {
    "integrator",
    "sqrt-outflow",
    "coupling",
    "compression",
    "clock-offset",
    "sampling",
    "controller-logic",
}


@dataclass(frozen=True)
class Case:
    """One case to seal: its tag, and its effects with levels, or an oddity."""

    tag: str
    effects: tuple[tuple[str, str], ...] = ()
    oddity: str = ""
    seed: int = 0


def dealt(rng: np.random.Generator, cards: list, count: int) -> list:
    """`count` cards from as many shuffled decks as necessary."""
    hand: list = []
    while len(hand) < count:
        hand += [cards[i] for i in rng.permutation(len(cards))]
    return hand[:count]


def singles(rng: np.random.Generator, count: int) -> list:
    """Every name once per round, each time at its next level."""
    names = [e.name for e in NAMES]
    first = rng.integers(4, size=len(names))
    rounds = [
        [((n, list(LEVELS)[(f + r) % 4]),) for n, f in zip(names, first, strict=True)] for r in range(4)
    ]
    hand: list = []
    while len(hand) < count:
        hand += dealt(rng, rounds[len(hand) // len(names) % 4], len(names))
    return hand[:count]


def one_pair(rng: np.random.Generator) -> tuple:
    """Two effects of different blocks, plain and masked."""
    free = [e for e in NAMES if e.name not in ALONE]
    while True:
        a, b = (free[i] for i in rng.choice(len(free), 2, replace=False))
        if CATALOGUE[a.name].block != CATALOGUE[b.name].block:
            return ((a.name, "plain"), (b.name, "masked"))


def plan(cases: int, seed: int) -> list[Case]:
    """The cases of a set in random order."""
    rng = np.random.default_rng(seed)
    count = {k: round(share * cases) for k, share in SHARES.items()}
    odd = dealt(rng, ["plain", *ODDITIES], count["none"])
    outside = [((e.name, lv),) for e in STRANGE for lv in ("plain", "masked", "concealed")]
    hidden = dealt(rng, outside, count["outside"]) + [one_pair(rng) for _ in range(count["pair"])]
    hidden += singles(rng, cases - len(odd) - len(hidden))
    every = [((), o) for o in odd] + [(h, "") for h in hidden]
    order = rng.permutation(len(every))
    seeds = rng.integers(2**31, size=len(every))
    return [Case(f"L{i:04d}", every[j][0], every[j][1], int(seeds[i])) for i, j in enumerate(order)]


def outside_alone(deck: Sequence[Effect], cases: int, seed: int) -> list[Case]:
    """Cases from a deck of physics outside the catalogue; each kind occurs equally often at each of three levels."""
    rng = np.random.default_rng(seed)
    cards = [((e.name, level),) for e in deck for level in ("plain", "masked", "concealed")]
    hand, seeds = dealt(rng, cards, cases), rng.integers(2**31, size=cases)
    return [Case(f"L{i:04d}", h, "", int(s)) for i, (h, s) in enumerate(zip(hand, seeds, strict=True))]
