"""What a plant writes, made fit for where it goes: a screen, a spreadsheet, a file's name."""

from __future__ import annotations

import hashlib
import re
import unicodedata
from dataclasses import fields, is_dataclass, replace
from typing import Any, TypeVar

T = TypeVar("T")
FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n")
"""First characters by which spreadsheets take a text for a formula (OWASP, CSV injection)."""
LONGEST = 40
"""Characters of a tag that are kept in a file name; ours: readable, and far below any file system's limit."""


def visible(text: str) -> str:
    """The text with characters that steer a terminal or turn the direction of writing as escapes such as \\u202e,
    blanks of any kind as blanks."""
    if text.isprintable():
        return text
    blank = "".join(" " if c.isspace() else c for c in text)
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in blank)


def visible_lines(text: str) -> str:
    """The same of a text of several lines."""
    if text.isprintable():
        return text
    return "\n".join(map(visible, text.split("\n")))


def visible_parts(part: T) -> T:
    """A page, or a part of one, with all its texts visible; the same object where they are."""
    shown: Any = part
    if type(part) is str:
        shown = visible_lines(shown)
    elif isinstance(part, tuple):
        shown = tuple(map(visible_parts, part))
        shown = part if all(a is b for a, b in zip(part, shown, strict=True)) else shown
    elif is_dataclass(part) and not isinstance(part, type):
        held = {f.name: getattr(part, f.name) for f in fields(part)}
        changed = {name: new for name, old in held.items() if (new := visible_parts(old)) is not old}
        shown = replace(part, **changed) if changed else part
    return shown  # type: ignore[no-any-return]


def harmless(text: str) -> str:
    """A text that no spreadsheet takes for a formula: an apostrophe goes before those that it would."""
    return f"'{text}" if text.lstrip(" ").startswith(FORMULA) or text.startswith(FORMULA) else text


def slug(tag: str) -> str:
    """A file name without ending: letters, digits and '-' of the tag, and a hash that keeps different tags
    apart.

    It holds no dot, slash or space and begins with a letter, digit or '-', so it stays inside its folder.
    """
    plain = unicodedata.normalize("NFKD", tag).encode("ascii", "ignore").decode()
    kept = re.sub(r"[^A-Za-z0-9]+", "-", plain).strip("-")[:LONGEST].strip("-")
    digest = hashlib.sha256(tag.encode("utf-8", "surrogatepass")).hexdigest()[:6]
    return f"{kept or 'loop'}-{digest}"
