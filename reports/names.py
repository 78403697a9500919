"""File names from whatever a plant calls its loops."""

from __future__ import annotations

import hashlib
import re
import unicodedata

LONGEST = 40
"""Characters of a tag that are kept in a file name; ours: readable, and far below any file system's limit."""


def slug(tag: str) -> str:
    """A file name without ending: letters, digits and '-' of the tag, and a hash that keeps different tags
    apart.

    It holds no dot, slash or space and begins with a letter, digit or '-', so it stays inside its folder.
    """
    plain = unicodedata.normalize("NFKD", tag).encode("ascii", "ignore").decode()
    kept = re.sub(r"[^A-Za-z0-9]+", "-", plain).strip("-")[:LONGEST].strip("-")
    digest = hashlib.sha256(tag.encode("utf-8", "surrogatepass")).hexdigest()[:6]
    return f"{kept or 'loop'}-{digest}"
