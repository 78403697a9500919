"""Plant texts made safe for a screen, a spreadsheet, or a file name."""

from __future__ import annotations

import hashlib
import re
import unicodedata
from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from functools import cache
from typing import Any, TypeVar

T = TypeVar("T")
FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n")
"""First characters by which spreadsheets recognize a formula (OWASP, CSV injection)."""
LONGEST = 40
"""Characters of a tag that are kept in a file name; ours: readable, and far below any file system's limit."""


def visible(text: str) -> str:
    """The text with characters that control a terminal or reverse the text direction as escapes such as \\u202e, and
    blanks of any kind as blanks."""
    if text.isprintable():
        return text
    blank = "".join(" " if c.isspace() else c for c in text)
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in blank)


def visible_lines(text: str) -> str:
    """The same for a text of several lines."""
    if text.isprintable():
        return text
    return "\n".join(map(visible, text.split("\n")))


def visible_parts(part: T) -> T:
    """A page, or a part of one, with all its texts visible; the same object if they already are."""
    shown: Any = part
    if type(part) is str:
        shown = visible_lines(shown)
    elif isinstance(part, tuple):
        shown = tuple(map(visible_parts, part))
        shown = part if all(a is b for a, b in zip(part, shown, strict=True)) else shown
    elif names := _field_names(type(shown)):
        held = ((name, getattr(part, name)) for name in names)
        changed = {name: new for name, old in held if (new := visible_parts(old)) is not old}
        shown = replace(shown, **changed) if changed else part
    return shown  # type: ignore[no-any-return]


def _names_of(kind: Any) -> tuple[str, ...]:
    return tuple(f.name for f in fields(kind)) if is_dataclass(kind) else ()


_field_names: Callable[[Any], tuple[str, ...]] = cache(_names_of)
"""Names of the fields of a dataclass, none of another type."""


def harmless(text: str) -> str:
    """A text that no spreadsheet treats as a formula: an apostrophe is added if necessary."""
    return f"'{text}" if text.lstrip(" ").startswith(FORMULA) or text.startswith(FORMULA) else text


def slug(tag: str) -> str:
    """A file name without ending: letters, digits and '-' of the tag, and a hash that keeps different tags apart.

    It contains no dot, slash or space and begins with a letter, digit or '-', so it stays inside its folder.
    """
    plain = unicodedata.normalize("NFKD", tag).encode("ascii", "ignore").decode()
    kept = re.sub(r"[^A-Za-z0-9]+", "-", plain).strip("-")[:LONGEST].strip("-")
    digest = hashlib.sha256(tag.encode("utf-8", "surrogatepass")).hexdigest()[:6]
    return f"{kept or 'loop'}-{digest}"
