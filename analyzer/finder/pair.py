"""A loop found by data: its tags, the evidence for them, and its settings."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from analyzer.finder.held import LEAST_MOVES, free_moves
from analyzer.finder.law import (
    TINY,
    Matrix,
    Moves,
    blocks,
    explained_share,
    fitted,
    shared_noise,
    widths,
)
from analyzer.finder.tag_set import TagSet

LEAST_NOISE = 0.2  # Share of the innovations that PV and OP have in common at least: proofs/finder.md
SECOND = 0.7  # Weight of the next best tag over that of the pair, at most: proofs/finder.md
TURNED = 2.0  # Signs that show which of two tags is OP: law and set point together: proofs/finder.md
SURE_PCT = 90.0
"""Probability below which a loop is written commented out; that of a pair whose weakest sign is just enough
[%]: proofs/finder.md."""
SUREST_PCT = 99.0  # Largest probability reported [%]: proofs/finder.md
OTHER = 0.9
"""Least ratio of the share of OP that PV and SP explain to that of the best other tag, for a certain pair.
In benchmarks/world (bags of seeds 49 to 56) a sensor that follows PV had .83, and no right pair less than
.94 (proofs/finder.md)."""
ACTS = 5.0  # Standard errors of the integral from which it acts [standard errors]: proofs/finder.md
LEAST_LAW_SHARE = 0.9
"""Share of the moves that the law must explain before its settings are written: proofs/finder.md."""
AGREED = 0.15  # Share by which two estimates of an integral time may differ for a report: proofs/finder.md
ALONE = 0.1  # Integral time over the length of the record from which P acts alone: proofs/finder.md
ACTING = 0.5
"""Share of the weight and of the noise that is enough if a set point supports a pair: proofs/finder.md."""
DIRECT = 0.5
"""Required evidence for a pair whose OP rises with PV and whose law does not show which tag is OP. A
follower of PV appears the same: proofs/finder.md."""


@dataclass(frozen=True, slots=True)
class FoundPair:
    """A loop found by data; indices of tags in the tag set.

    law : share of OP's moves that the law explains, 0 to 1, in blocks of `width` samples; noise : common share of
    the innovations of OP and PV; required_weight : weight required at this width; runner_up : weight of the next
    best tag; direction_evidence : evidence for the law from PV to OP over the reverse; output_evidence : how much
    more OP drifts and rests at limits; nearer : how much nearer SP is to PV than to OP; resolved : whether
    neighbouring averages are similar; acts : whether SP moves OP as PV does; answers : whether OP, and no other
    tag, moves immediately with SP; other : largest share of OP explained by another tag with a moving SP;
    law_share : share that the law explains in blocks of `law_width`, the shortest in which it is valid; kp : gain,
    in units of OP per unit of PV, negative if OP rises with PV; ti_samples : integral time, inf without integral
    action, None if two estimates disagree: noise of PV between its samples affects one of them, but not the other,
    which uses adjacent samples.
    """

    pv: int
    op: int
    sp: int | None
    law: float
    noise: float
    width: int
    required_weight: float
    runner_up: float
    direction_evidence: float = 0.0
    output_evidence: float = 0.0
    nearer: float = 0.0
    resolved: bool = True
    acts: bool = False
    answers: bool = False
    other: float = 0.0
    law_share: float = 0.0
    law_width: int = 1
    kp: float = 0.0
    ti_samples: float | None = None

    @property
    def weight(self) -> float:
        """Similarity of the pair to a controller, 0 to 1."""
        return float(self.law * np.sqrt(self.noise))

    @property
    def sure_pct(self) -> float:
        """Confidence of the pair [%], by its weakest criterion: the weight, the runners-up, and which tag is OP. An
        OP that rises with PV may be the PV of a follower if no other criterion distinguishes them."""
        less = ACTING if self.acts else 1.0
        law = (
            self.weight / (self.required_weight * less),
            self.noise / (LEAST_NOISE * (less if self.resolved else ACTING)),
            SECOND * np.log1p(-min(self.weight, 1.0 - TINY)) / np.log1p(-max(self.runner_up, TINY)),
            np.inf if self.kp >= 0.0 or self.direction_evidence >= 1.0 else DIRECT,
        )
        signs = (
            *(() if self.answers else law),
            self.law / max(OTHER * self.other, TINY),
            (self.direction_evidence + self.output_evidence + self.nearer) / TURNED,
        )
        odds = SURE_PCT / (100.0 - SURE_PCT) * max(min(signs), 0.0) ** 2
        return float(min(100.0 * odds / (1.0 + odds), SUREST_PCT))


def known_pair(values: Matrix) -> FoundPair:
    """The law of a loop with known tags: PV, OP and, if there is one, SP, shape (n, 2) or (n, 3)."""
    sp = 2 if values.shape[1] > 2 else None
    error = values[:, 0] - (0.0 if sp is None else values[:, 2])
    columns, each = np.column_stack([error, values[:, 1]]), widths(len(values))
    moves = [Moves.of(columns, width) for width in each]
    law = np.array([explained_share(m, m)[0, 1] for m in moves])
    shown = int(np.argmax(law >= min(LEAST_LAW_SHARE, law.max())))
    noise = float(shared_noise(moves[shown], moves[shown])[0, 1])
    found = FoundPair(0, 1, sp, float(law[shown]), noise, each[shown], 1.0, 0.0)
    return with_settings(
        TagSet.of(values), replace(found, law_share=float(law[shown]), law_width=each[shown])
    )


def with_settings(bag: TagSet, pair: FoundPair) -> FoundPair:
    """The pair with gain and integral time of the law, from blocks in which it is valid and OP is not at a limit."""
    op, low = bag.values[:, pair.op], 0.0 if pair.sp is None else bag.values[:, pair.sp]
    error = bag.values[:, [pair.pv]] - np.reshape(low, (-1, 1))
    moves, rows = Moves.of(np.column_stack([error, op]), pair.law_width), free_moves(op, pair.law_width)
    rows = rows[(rows > 0) & (rows < len(moves.value) - 1)]
    moved, wanted, summed = moves.value[rows, 0], moves.value[rows, 1], moves.integral[rows, 0]
    if len(rows) < LEAST_MOVES:
        return replace(pair, kp=0.0, ti_samples=None)
    slope, deviation = fitted(wanted, moved, summed)
    kp, repeats = -float(slope[0]), float(slope[1] / (slope[0] or TINY))
    level = blocks(error, pair.law_width)[:, 0]
    outer = level[rows - 1] + level[rows + 2]
    outer = outer - outer.mean()
    other = float(outer @ (wanted - slope[0] * moved) / ((outer @ summed) or TINY) / (slope[0] or TINY))
    surely = abs(slope[0]) / (abs(slope[1]) + ACTS * deviation[1])
    if surely > ALONE * len(bag.values):
        return replace(pair, kp=kp, ti_samples=np.inf)
    agreed = min(repeats, other) > 0.0 and abs(repeats / other - 1.0) < AGREED
    return replace(pair, kp=kp, ti_samples=1.0 / other if agreed else None)
