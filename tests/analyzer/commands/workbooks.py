"""Workbooks of the kinds that no installed library writes: binary ones by MS-XLSB, open ones by ODF 1.3."""

from __future__ import annotations

import io
import struct
import zipfile
from collections.abc import Iterable, Mapping

RELATED = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
OASIS = "urn:oasis:names:tc:opendocument:xmlns:"
BINARY = {
    "[Content_Types].xml": '<?xml version="1.0"?><Types xmlns="http://schemas.openxmlformats.org/package/2006/'
    'content-types"><Default Extension="bin" ContentType="application/vnd.ms-excel.sheet.binary.macroEnabled.main"/>'
    "</Types>",
    "xl/_rels/workbook.bin.rels": '<?xml version="1.0"?><Relationships xmlns="http://schemas.openxmlformats.org/'
    f'package/2006/relationships"><Relationship Id="r1" Type="{RELATED}/worksheet" '
    'Target="worksheets/sheet1.bin"/></Relationships>',
}
"""Parts of a binary workbook in addition to its list of sheets and its one sheet."""
Cell = tuple[int, int, float | str]
"""Row and column from 0 on, and the value."""


def packed(members: Mapping[str, bytes | str], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    """A zip archive."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", method) as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    return out.getvalue()


def record(kind: int, data: bytes = b"") -> bytes:
    """A record of a binary workbook: its kind and its length with seven bits in each byte, lowest first, then its
    data.
    """
    head = bytes([kind]) if kind < 128 else bytes([kind & 127 | 128, kind >> 7])
    size = len(data)
    while size > 127:
        head += bytes([size & 127 | 128])
        size >>= 7
    return head + bytes([size]) + data


def counted(text: str) -> bytes:
    """A text of a binary workbook."""
    return struct.pack("<I", len(text)) + text.encode("utf-16-le")


def binary_book(cells: Iterable[Cell]) -> bytes:
    """An xlsb workbook of one sheet; the cells are in the order of their rows."""
    sheets = (
        record(0x8F) + record(0x9C, struct.pack("<II", 0, 1) + counted("r1") + counted("Data")) + record(0x90)
    )
    book = record(0x83) + record(0x99, bytes(8) + counted("")) + sheets + record(0x84)
    rows, last = b"", -1
    for row, column, value in cells:
        if row != last:
            rows, last = rows + record(0, struct.pack("<I", row) + bytes(13)), row
        head = struct.pack("<II", column, 0)
        is_text = isinstance(value, str)
        rows += record(6, head + counted(value)) if is_text else record(5, head + struct.pack("<d", value))
    sheet = record(0x81) + record(0x94, bytes(16)) + record(0x91) + rows + record(0x92) + record(0x82)
    return packed({**BINARY, "xl/workbook.bin": book, "xl/worksheets/sheet1.bin": sheet})


def open_book(rows: str, name: str = "Data") -> bytes:
    """An ods workbook of one sheet with the given rows."""
    spaces = " ".join(f'xmlns:{space}="{OASIS}{space}:1.0"' for space in ("office", "table", "text"))
    sheet = f'<table:table table:name="{name}">{rows}</table:table>'
    body = f"<office:body><office:spreadsheet>{sheet}</office:spreadsheet></office:body>"
    content = f'<?xml version="1.0"?><office:document-content {spaces}>{body}</office:document-content>'
    mime = "application/vnd.oasis.opendocument.spreadsheet"
    manifest = f'<?xml version="1.0"?><manifest:manifest xmlns:manifest="{OASIS}manifest:1.0"/>'
    return packed({"mimetype": mime, "META-INF/manifest.xml": manifest, "content.xml": content})


def open_row(*cells: float | str | int, times: int = 1) -> str:
    """A row of an ods sheet that is repeated `times` times. A cell is a text or a number; a whole number is a count
    of empty cells.
    """
    held = "".join(map(_open_cell, cells))
    return f'<table:table-row table:number-rows-repeated="{times}">{held}</table:table-row>'


def _open_cell(value: float | str) -> str:
    if isinstance(value, int):
        return f'<table:table-cell table:number-columns-repeated="{value}"/>'
    if isinstance(value, str):
        return f'<table:table-cell office:value-type="string"><text:p>{value}</text:p></table:table-cell>'
    return f'<table:table-cell office:value-type="float" office:value="{value!r}"/>'
