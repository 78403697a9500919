"""What historians call things: the words of words.toml, and the names of columns by them."""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from analyzer.limits import HISTORY
from identification.errors import InputError

WORDS: dict[str, Any] = tomllib.loads(Path(__file__).with_name("words.toml").read_text(encoding="utf-8"))
COLUMNS: dict[str, tuple[str, ...]] = {kind: tuple(names) for kind, names in WORDS["columns"].items()}
BELOW_SECOND = {
    name: unit_s
    for kind, unit_s in (("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9))
    for name in WORDS["below_second"][kind]
}
"""Columns that hold the rest of a stamp below the second, and their unit [s]."""
_QUALITIES = (
    r"(?:data|opc)? ?quality(?:[ _]?code|[ _]?detail)?|qstatus|status(?:[ _]?code)?|confidence|qual|q|validity"
    r"|(?:is[ _]?)?(?:good|valid|bad|error|fault|invalid)|err|questionable"
    r"|qualität|qualitaet|qualité|qualita|calidad|güte|gueltig|gültig|laatu|kvalitet|kwaliteit|jakość"
)
QUALITY_OF = (
    re.compile(rf"^(?P<tag>.+?)[ ._:/|#-]?\(?(?:{_QUALITIES})\)?$", re.IGNORECASE),
    re.compile(rf"^(?:{_QUALITIES})(?: of)?[ ._:/|#-]*[(\[]?(?P<tag>.+?)[)\]]?$", re.IGNORECASE),
)
"""Names of quality columns that hold the tag's, in front or behind."""
UNIT_IN_NAME = re.compile(
    r"(?:^|[\s_(\[.,-]+)(?:(?P<ms>ms|msec)|(?P<s>s|secs?|seconds?|sek|sekunden)|(?P<min>mins?|minutes?|minuten)"
    r"|(?P<h>h|hrs?|hours?|std|stunden)|(?P<d>d|days?|tage))[)\].]*$",
    re.IGNORECASE,
)


def plain(name: str) -> str:
    """Name without case, units in brackets, blanks and underscores: ' Time_Stamp (UTC)' is 'timestamp'."""
    return re.sub(r"\([^()]*\)|\[[^\[\]]*\]|[\s_\-\"']", "", name[: HISTORY.name_length]).lower()


def time_unit(name: str) -> str:
    """The unit that a time column's name states, as in 'Time (min)' or 't_h': ms, s, min, h or d; '' where none."""
    found = UNIT_IN_NAME.search(name[: HISTORY.name_length])
    return "" if found is None else str(found.lastgroup)


def without_unit(name: str) -> str:
    """A time column's name without the unit that stands behind it."""
    return UNIT_IN_NAME.sub("", name[: HISTORY.name_length])


def is_stamp(name: str) -> bool:
    """Whether a column is named as stamps are, with or without a unit behind the name."""
    if not plain(name):
        return False
    bare = plain(without_unit(name))
    return plain(name) in COLUMNS["stamp"] or bare in COLUMNS["stamp"] or bare in COLUMNS["elapsed"]


def first_named(names: Sequence[str], wanted: Iterable[str]) -> int | None:
    """Index of the column whose plain name comes first in `wanted`, or None."""
    plains = [plain(name) for name in names]
    return next((plains.index(name) for name in wanted if name in plains), None)


def stated_column(path: Path, names: Sequence[str], stated: str, kind: str) -> int:
    """Index of the column that the user names as that of a kind, time or quality.

    Raises
    ------
    InputError
        There is none of that name.
    """
    if stated not in names:
        seen = f"{path}: no column '{stated}' among {', '.join(names[:8])}"
        expected = f"the name of the {kind} column as it stands in the header"
        raise InputError(seen, expected, f"correct --{kind}-column")
    return names.index(stated)


def check_once(path: Path, names: Sequence[str]) -> None:
    """Raise InputError where a column's name stands twice, for then its tag is not clear."""
    name, count = max(Counter(names).items(), key=lambda item: item[1], default=("", 1))
    if count > 1:
        raise InputError(f"{path}: column '{name}' stands twice", "each tag once", "rename or remove one")


def with_loop(names: Sequence[str], stem: str) -> tuple[str, ...]:
    """Full tags: bare columns such as 'PV' and 'OP' belong to the loop that the file is named for, and a lone column
    of values to the tag that it is named for."""
    if len(names) == 1 and plain(names[0]) in COLUMNS["value"]:
        return (stem,)
    if not names or not all(plain(name) in COLUMNS["bare_ending"] for name in names):
        return tuple(names)
    return tuple(f"{stem}.{plain(name).upper()}" for name in names)
