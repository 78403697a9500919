"""What a change of 20 % of each limit does to the answers: python -m proofs.limits [--jobs 2]

Every limit of `triage config` is lowered and raised by 20 % (whole numbers by one at least, within the range of the
limit). Then the stage of the limit runs again on its samples. They are: quality, oscillation and figures of 240
untidy loops (proofs/untidy); oscillation of 900 records without any (nulls.py); the causes of loops with a fitted
model; settings of 60 loops that are stated wrong by half; advice on 30 simulated loops; groups of coupled plants
(proofs/coupled); comparisons of weeks; recorder, controller and effects of sealed cases (proofs/concealed). A limit
that changes no answer is set to both ends of its range, where most limits have no effect. If an answer changes then,
the limit is a guard far from this sample. Limits that change no answer even then are listed separately. Sections of
resources and of the cutting of nights (workers, opening, nights) decide no finding and are omitted. Writes
proofs/limits.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from multiprocessing import Pool
from pathlib import Path
from typing import Any

from identification.limits import KEY, Limit
from proofs.common import parser_of
from proofs.limits_samples import DEFAULT, OF_FITS
from proofs.limits_stages import STAGES

OUT = Path(__file__).with_suffix(".md")
STEP = 0.2


def moved(value: float, limit: Limit, way: float) -> float:
    """A limit changed by a fifth within its range; whole numbers by one at least."""
    new = value * (1.0 + way * STEP)
    if isinstance(value, int):
        new = value + (max(round(abs(new - value)), 1) if way > 0 else -max(round(abs(new - value)), 1))
    bounded = min(max(new, limit.least), limit.most)
    return int(bounded) if isinstance(value, int) else bounded


@dataclass(frozen=True)
class Effect:
    """A limit, and how many answers change when it is lowered and raised; None where its range ends there.

    at_ends: how many change at the end of its range with more changes; None where a change of a fifth has an
    effect.
    """

    section: str
    name: str
    value: float
    lower: int | None
    higher: int | None
    answers: int
    at_ends: int | None = None

    @property
    def noticed(self) -> bool:
        """Whether any answer changes."""
        return bool(self.lower) or bool(self.higher)


@cache
def usual(section: str, by_measures: bool = False) -> list[Any]:
    """The answers of a stage with the defaults; by_measures: causes from the measures, without a new fit."""
    return STAGES[section](replace(DEFAULT) if by_measures else DEFAULT)


def effect(job: tuple[str, str]) -> Effect:
    """The effect of a change of one limit."""
    section, name = job
    own = getattr(DEFAULT, section)
    limit = next(f.metadata[KEY] for f in fields(own) if f.name == name)
    value, base = getattr(own, name), usual(section, section == "cause" and name not in OF_FITS)

    def changed(new: float) -> int | None:
        if new == value:
            return None
        arguments = STAGES[section](replace(DEFAULT, **{section: replace(own, **{name: new})}))
        return sum(a != b for a, b in zip(base, arguments, strict=False)) + abs(len(base) - len(arguments))

    lower, higher = (changed(moved(value, limit, way)) for way in (-1.0, 1.0))
    found = Effect(section, name, value, lower, higher, len(base))
    if found.noticed:
        return found
    ends = [changed(type(value)(end)) for end in (limit.least, limit.most)]
    return replace(found, at_ends=max(n or 0 for n in ends))


def jobs(sections: Sequence[str]) -> list[tuple[str, str]]:
    """Every limit that is one number."""
    found = []
    for section in sections:
        for f in fields(getattr(DEFAULT, section)):
            if KEY in f.metadata and isinstance(getattr(getattr(DEFAULT, section), f.name), int | float):
                found.append((section, f.name))
    return found


def table(found: Sequence[Effect]) -> str:
    """Effects as Markdown; limits without any effect are named first."""
    clear = [e for e in found if e.at_ends]
    silent = [f"`{e.section}.{e.name}`" for e in found if e.at_ends == 0]
    head = (
        f"{len(found)} limits changed by a fifth; {len(found) - len(clear) - len(silent)} change an answer of this "
        f"sample, {len(clear)} more do so at an end of their range. Limits that change no answer: "
        f"{', '.join(silent) or 'none'}."
    )
    lines = ["| limit | value | lowered | raised | at an end | of answers |", "|---|--:|--:|--:|--:|--:|"]
    for e in found:
        cells = ("–" if n is None else str(n) for n in (e.lower, e.higher, e.at_ends))
        lines.append(f"| {e.section}.{e.name} | {e.value:g} | {' | '.join(cells)} | {e.answers} |")
    return "\n".join([head, "", *lines, ""])


def main() -> None:
    """Change every limit, run its stage, write the page."""
    parser = parser_of(__doc__, jobs=2, out=OUT)
    parser.add_argument("--sections", nargs="+", choices=list(STAGES), default=list(STAGES))
    options = parser.parse_args()
    todo, found = jobs(options.sections), []
    with Pool(options.jobs) as pool:
        for e in pool.imap(effect, todo):
            found.append(e)
            print(
                f"\r{len(found)} of {len(todo)} {e.section}.{e.name} {e.lower} {e.higher}      ",
                end="",
                flush=True,
            )
    text = table(found)
    arguments = "" if options.sections == list(STAGES) else " --sections " + " ".join(options.sections)
    options.out.write_text(f"# What each limit does\n\n`python -m proofs.limits{arguments}`: {text}")
    print("\n" + text)


if __name__ == "__main__":
    main()
