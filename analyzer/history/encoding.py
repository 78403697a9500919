"""Character encoding of a text, from its first bytes."""

from __future__ import annotations

import codecs

ENCODINGS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)


def detect_encoding(head: bytes) -> str:
    """Encoding by byte-order mark, by the zeros of UTF-16, by valid UTF-8; else Windows Latin."""
    for mark, name in ENCODINGS:
        if head.startswith(mark):
            return name
    if head[1:400:2].count(0) > 100 or (len(head) < 400 and head[1::2].count(0) * 3 > len(head)):
        return "utf-16-le"
    if head[0:400:2].count(0) > 100:
        return "utf-16-be"
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head)
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8"
