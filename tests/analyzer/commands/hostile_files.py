"""Files that were damaged by accident or made as an attack, one of each kind; none is an export that can be assessed.

`python tests/analyzer/commands/hostile_files.py FOLDER` writes all of them.
"""

from __future__ import annotations

import bz2
import gzip
import io
import json
import lzma
import sys
import tarfile
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from tests.analyzer.commands.workbooks import binary_book, open_book, open_row, packed

KINDS: dict[str, Callable[[], bytes]] = {}
"""File names, and the function that makes the bytes of each."""
ROWS = [f"2026-03-02 00:{k // 60:02d}:{k % 60:02d},{50 + k % 7},{40 + k % 5}" for k in range(300)]
HEAD = "timestamp,FIC1.PV,FIC1.OP\n"
TEXT = HEAD + "\n".join(ROWS) + "\n"
START_US = 1_772_409_600_000_000
BOOK = {
    "[Content_Types].xml": '<?xml version="1.0"?><Types xmlns="http://schemas.openxmlformats.org/package/2006/'
    'content-types"><Default Extension="xml" ContentType="application/xml"/><Default Extension="rels" '
    'ContentType="application/vnd.openxmlformats-package.relationships+xml"/><Override PartName="/xl/workbook.xml" '
    'ContentType="application/vnd.openxmlformats-officedocument.spreadsheetml.sheet.main+xml"/></Types>',
    "_rels/.rels": '<?xml version="1.0"?><Relationships xmlns="http://schemas.openxmlformats.org/package/2006/'
    'relationships"><Relationship Id="r1" Type="http://schemas.openxmlformats.org/officeDocument/2006/relationships/'
    'officeDocument" Target="xl/workbook.xml"/></Relationships>',
    "xl/workbook.xml": '<?xml version="1.0"?><workbook xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/'
    'main" xmlns:r="http://schemas.openxmlformats.org/officeDocument/2006/relationships"><sheets><sheet name="Data" '
    'sheetId="1" r:id="r1"/></sheets></workbook>',
    "xl/_rels/workbook.xml.rels": '<?xml version="1.0"?><Relationships xmlns="http://schemas.openxmlformats.org/'
    'package/2006/relationships"><Relationship Id="r1" Type="http://schemas.openxmlformats.org/officeDocument/2006/'
    'relationships/worksheet" Target="worksheets/sheet1.xml"/><Relationship Id="r2" Type="http://schemas.'
    'openxmlformats.org/officeDocument/2006/relationships/sharedStrings" Target="sharedStrings.xml"/>'
    "</Relationships>",
}
"""Parts of a workbook in addition to its one sheet."""


def kind(name: str) -> Callable[[Callable[[], bytes]], Callable[[], bytes]]:
    """Register the file whose bytes a function makes."""

    def named(made: Callable[[], bytes]) -> Callable[[], bytes]:
        KINDS[name] = made
        return made

    return named


def texts(**of: str) -> None:
    """Text files; in each name, `_` replaces the point before the ending."""
    for name, text in of.items():
        stem, _, ending = name.rpartition("_")
        KINDS[f"{stem}.{ending}"] = lambda text=text: text.encode("utf-8", "surrogatepass")  # type: ignore


def book(cells: str, **more: str) -> bytes:
    """A workbook whose sheet has the given XML of rows."""
    main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
    sheet = f'<?xml version="1.0"?><worksheet xmlns="{main}"><sheetData>{cells}</sheetData></worksheet>'
    return packed({**BOOK, "xl/worksheets/sheet1.xml": sheet, **more})


def _members(data: bytes) -> dict[str, bytes]:
    """The members of an archive by name."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def cell(at: str, value: object = 1) -> str:
    """A cell that holds a number."""
    return f'<c r="{at}"><v>{value}</v></c>'


def table(columns: dict[str, object], **how: object) -> bytes:
    """A Parquet file."""
    out = io.BytesIO()
    pq.write_table(pa.table(columns), out, **how)
    return out.getvalue()


def stamps(rows: int, step_us: int = 1_000_000) -> np.ndarray:
    """Time stamps at a constant step."""
    return (START_US + step_us * np.arange(rows)).astype("datetime64[us]")


def good() -> bytes:
    """A complete Parquet export."""
    n = 300
    return table(
        {"timestamp": stamps(n), "FIC1.PV": np.arange(n) % 7 + 50.0, "FIC1.OP": np.arange(n) % 5 + 40.0}
    )


texts(
    empty_csv="",
    blank_lines_csv="\n" * 5000,
    only_header_csv=HEAD,
    one_row_csv=HEAD + ROWS[0] + "\n",
    no_stamps_csv="timestamp,FIC1.PV,FIC1.OP\n" + "x,1,2\n" * 300,
    words_for_values_csv=HEAD + "".join(f"2026-03-02 00:00:{k % 60:02d},good,bad\n" for k in range(300)),
    repeated_header_csv=HEAD * 400,
    twice_the_column_csv="timestamp,FIC1.PV,FIC1.PV\n" + "\n".join(ROWS),
    stamps_of_1601_csv=HEAD + "1601-01-01 00:00:00,1,2\n" * 300,
    stamps_of_9999_csv=HEAD + "9999-12-31 23:59:59,1,2\n" * 300,
    one_stamp_csv=HEAD + "2026-03-02 00:00:00,1,2\n" * 300,
    infinite_csv=HEAD + "".join(f"2026-03-02 00:{k // 60:02d}:{k % 60:02d},inf,-inf\n" for k in range(300)),
    long_digits_csv=HEAD + f"2026-03-02 00:00:00,{'9' * 100_000},1\n" * 20,
    one_long_line_csv="a," * 200_000,
    thousands_of_columns_csv=",".join(f"c{k}" for k in range(50_000)) + "\n" + "1," * 49_999 + "1\n",
    ragged_csv=HEAD + "".join("2026-03-02" + "," * (k % 50) + "\n" for k in range(2000)),
    open_quote_csv=HEAD + '"2026-03-02 00:00:00,1,2\n' + "\n".join(ROWS[:2]),
    quotes_csv='"' * 100_000,
    long_cell_csv=HEAD + f"2026-03-02 00:00:00,{'x' * 1_000_000},1\n" * 5,
    long_tag_csv=f"timestamp,{'T' * 300_000}.PV\n2026-03-02 00:00:00,1\n",
    escapes_csv="timestamp,\x1b[2J\x07.PV,\u202eabc.OP\n" + "x,1,2\n" * 50,
    html_csv="<!doctype html><html><body>" + "<tr><td>1</td></tr>" * 500 + "</body></html>",
    login_page_csv="<html><head><title>Sign in</title></head><body><form></form></body></html>",
    xml_csv='<?xml version="1.0"?>' + "<row><t>2026-03-02</t><v>1</v></row>\n" * 500,
    json_csv=json.dumps([{"t": "2026-03-02T00:00:00Z", "v": k} for k in range(500)]),
    deep_json_csv="[" * 100_000,
    script_csv="#!/bin/sh\nrm -rf /nothing\n" * 200,
    formula_csv=HEAD + "=cmd|' /C calc'!A0,1,2\n" * 300,
    error_of_sql_csv="ORA-00942: table or view does not exist\n",
    marks_only_csv=",,,,\n" * 3000,
    semicolons_csv=";" * 300_000,
    name_too_long_txt="timestamp\t" + "\t".join(f"{'n' * 3000}{k}.PV" for k in range(50)) + "\n",
    pickle_csv="\x80\x04cposix\nsystem\n(S'true'\ntR.",
    lone_surrogate_csv="timestamp,\ud800.PV\n" + "\n".join(ROWS[:20]),
    yaml_csv="a: &a [x,x]\n" + "b: &b [*a,*a]\n" * 60,
)


@kind("nul-bytes.csv")
def _() -> bytes:
    return b"\0" * 300_000


@kind("random.csv")
def _() -> bytes:
    return np.random.default_rng(1).bytes(100_000)


@kind("random.parquet")
def _() -> bytes:
    return np.random.default_rng(2).bytes(100_000)


@kind("utf16-cut.csv")
def _() -> bytes:
    return TEXT.encode("utf-16")[:3001] + b"\xff"


@kind("utf32.csv")
def _() -> bytes:
    return HEAD.encode("utf-32")[:-2]


@kind("picture.csv")
def _() -> bytes:
    return b"\x89PNG\r\n\x1a\n" + np.random.default_rng(3).bytes(50_000)


@kind("pdf.csv")
def _() -> bytes:
    return b"%PDF-1.7\n" + np.random.default_rng(4).bytes(50_000)


@kind("program.csv")
def _() -> bytes:
    return b"\x7fELF" + np.random.default_rng(5).bytes(50_000)


@kind("archive.tar.gz")
def _() -> bytes:
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode="w:gz") as archive:
        archive.addfile(tarfile.TarInfo("../x.csv"), io.BytesIO())
    return out.getvalue()


@kind("bomb.csv.gz")
def _() -> bytes:
    return gzip.compress(b"0" * 150_000_000, 6)


@kind("bomb.csv.bz2")
def _() -> bytes:
    return bz2.compress(b"0" * 150_000_000, 9)


@kind("bomb.csv.xz")
def _() -> bytes:
    return lzma.compress(b"0" * 150_000_000, preset=1)


@kind("bomb.zip")
def _() -> bytes:
    return packed({"x.csv": b"0" * 150_000_000})


@kind("cut.csv.gz")
def _() -> bytes:
    return gzip.compress(TEXT.encode())[:200]


@kind("gz-of-gz.csv.gz")
def _() -> bytes:
    return gzip.compress(gzip.compress(gzip.compress(b"x" * 1000)))


@kind("two-files.zip")
def _() -> bytes:
    return packed({"a.csv": TEXT, "b.csv": TEXT})


@kind("climbing.zip")
def _() -> bytes:
    return packed({"../../../../etc/evil.csv": "no,table\n"})


@kind("no-file.zip")
def _() -> bytes:
    return packed({"folder/": ""})


@kind("cut.zip")
def _() -> bytes:
    return packed({"a.csv": TEXT})[:-30]


@kind("seven.7z")
def _() -> bytes:
    return b"7z\xbc\xaf\x27\x1c" + bytes(500)


@kind("far-cell.xlsx")
def _() -> bytes:
    return book(f'<row r="1">{cell("A1")}{cell("B1")}</row><row r="200000">{cell("BZZ200000")}</row>')


@kind("last-cell.xlsx")
def _() -> bytes:
    return book(f'<row r="1">{cell("A1")}</row><row r="1048576">{cell("XFD1048576")}</row>')


@kind("beyond-last-cell.xlsx")
def _() -> bytes:
    return book(f'<row r="1">{cell("A1")}</row><row r="4294967295">{cell("ZZZZZZ4294967295")}</row>')


@kind("far-cell.xlsb")
def _() -> bytes:
    return binary_book([(0, 0, 1.0), (0, 1, 1.0), (199_999, 2000, 1.0)])


@kind("beyond-last-cell.xlsb")
def _() -> bytes:
    return binary_book([(0, 0, 1.0), (2**32 - 1, 2**32 - 1, 1.0)])


@kind("cut-sheet.xlsb")
def _() -> bytes:
    members = {name: data[: len(data) - 9] for name, data in _members(binary_book([(0, 0, 1.0)])).items()}
    return packed(members)


@kind("far-cell.ods")
def _() -> bytes:
    return open_book(open_row(1.0, 1.0) + open_row(1, times=200_000) + open_row(2000, 1.0))


@kind("cells-without-end.ods")
def _() -> bytes:
    one = '<table:table-cell table:number-columns-repeated="99999999999" office:value-type="float" office:value="1"/>'
    return open_book(f'<table:table-row table:number-rows-repeated="999999999999">{one}</table:table-row>')


@kind("rows-without-end.ods")
def _() -> bytes:
    return open_book(open_row(1.0, 1.0, times=10**18))


@kind("laughs.ods")
def _() -> bytes:
    entities = "".join(f'<!ENTITY l{k} "{f"&l{k - 1};" * 10}">' for k in range(1, 10))
    return packed({"content.xml": f'<!DOCTYPE x [<!ENTITY l0 "lol">{entities}]><x>&l9;</x>'})


@kind("cut-xml.ods")
def _() -> bytes:
    content = _members(open_book(open_row(1.0, 1.0) * 50))["content.xml"]
    return packed(
        {"mimetype": "application/vnd.oasis.opendocument.spreadsheet", "content.xml": content[:3000]}
    )


@kind("flipped.xlsx")
def _() -> bytes:
    data = bytearray(book("".join(f'<row r="{k}">{cell(f"A{k}", k)}</row>' for k in range(1, 3000))))
    for at in range(data.find(b"sheet1.xml"), len(data) // 2, 97):
        data[at] ^= 0x5A
    return bytes(data)


@kind("far-cell-elsewhere.xlsx")
def _() -> bytes:
    members = _members(book(f'<row r="1">{cell("A1")}</row><row r="1048576">{cell("XFD1048576")}</row>'))
    sheet, listed = "xl/worksheets/sheet1.xml", "xl/_rels/workbook.xml.rels"
    members["xl/elsewhere"] = members.pop(sheet)
    return packed({**members, listed: members[listed].replace(b"worksheets/sheet1.xml", b"elsewhere")})


@kind("false-shared-strings.xlsx")
def _() -> bytes:
    main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
    count = 18_446_744_073_709_551_615
    text = f'<sst xmlns="{main}" count="{count}" uniqueCount="{count}"><si><t>x</t></si></sst>'
    return book(f'<row r="1">{cell("A1")}</row>', **{"xl/sharedStrings.xml": text})


@kind("many-shared-strings.xlsx")
def _() -> bytes:
    main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
    text = f'<sst xmlns="{main}" count="100000000000" uniqueCount="100000000000"><si><t>x</t></si></sst>'
    return book('<row r="1"><c r="A1" t="s"><v>99999999</v></c></row>', **{"xl/sharedStrings.xml": text})


@kind("laughs.xlsx")
def _() -> bytes:
    entities = "".join(f'<!ENTITY l{k} "{f"&l{k - 1};" * 10}">' for k in range(1, 10))
    head = f'<?xml version="1.0"?><!DOCTYPE x [<!ENTITY l0 "lol">{entities}]>'
    return packed(
        {**BOOK, "xl/worksheets/sheet1.xml": f"{head}<worksheet><sheetData>&l9;</sheetData></worksheet>"}
    )


@kind("bomb.xlsx")
def _() -> bytes:
    return packed({**BOOK, "xl/worksheets/sheet1.xml": " " * 150_000_000})


@kind("no-sheet.xlsx")
def _() -> bytes:
    return packed(BOOK)


@kind("cut.xlsx")
def _() -> bytes:
    return book(cell("A1"))[:-100]


@kind("empty-sheet.xlsx")
def _() -> bytes:
    return book("")


@kind("old-book.xls")
def _() -> bytes:
    return b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + np.random.default_rng(6).bytes(20_000)


@kind("cut.parquet")
def _() -> bytes:
    return good()[:-300]


@kind("half.parquet")
def _() -> bytes:
    data = good()
    return data[: len(data) // 2]


@kind("magic-only.parquet")
def _() -> bytes:
    return b"PAR1PAR1"


@kind("footer-too-long.parquet")
def _() -> bytes:
    return b"PAR1" + bytes(100) + (2**31 - 1).to_bytes(4, "little") + b"PAR1"


@kind("flipped-footer.parquet")
def _() -> bytes:
    data = bytearray(good())
    for at in range(len(data) - 400, len(data) - 8, 3):
        data[at] ^= 0x5A
    return bytes(data)


@kind("flipped-pages.parquet")
def _() -> bytes:
    data = bytearray(good())
    for at in range(4, len(data) // 2, 2):
        data[at] ^= 0x5A
    return bytes(data)


@kind("no-rows.parquet")
def _() -> bytes:
    return table({"timestamp": stamps(0), "FIC1.PV": np.zeros(0)})


@kind("no-columns.parquet")
def _() -> bytes:
    return table({})


@kind("constants.parquet")
def _() -> bytes:
    return _constant(20_000_000)


@kind("padded-constants.parquet")
def _() -> bytes:
    return _constant(20_000_000, {b"padding": np.random.default_rng(7).bytes(2_000_000).hex().encode()})


def _constant(rows: int, meta: dict[bytes, bytes] | None = None) -> bytes:
    """Identical rows that compress to very few bytes."""
    out, block = io.BytesIO(), 10_000_000
    schema = pa.schema([("timestamp", pa.int64()), ("FIC1.PV", pa.float64())], meta)
    part = pa.table([pa.repeat(pa.scalar(START_US), block), pa.repeat(pa.scalar(1.0), block)], schema=schema)
    with pq.ParquetWriter(out, schema, compression="zstd") as writer:
        for _ in range(rows // block):
            writer.write_table(part, row_group_size=block)
    return out.getvalue()


@kind("long-shared-tags.parquet")
def _() -> bytes:
    n = 100_000
    tags = pa.DictionaryArray.from_arrays(np.zeros(n, dtype=np.int32), ["T" * 30_000])
    return table({"tag": tags, "timestamp": stamps(n), "value": np.arange(n) * 1.0}, compression="zstd")


@kind("long-texts.parquet")
def _() -> bytes:
    n = 5
    return table(
        {"timestamp": stamps(n), "note": ["x" * 12_000_000] * n, "FIC1.PV": np.ones(n)}, compression="zstd"
    )


@kind("nested.parquet")
def _() -> bytes:
    return table({"timestamp": stamps(300), "FIC1": [{"PV": 1.0, "OP": [1.0] * 3}] * 300})


@kind("binary.parquet")
def _() -> bytes:
    return table({"timestamp": [b"\0\xff"] * 300, "FIC1.PV": [b"1"] * 300})


@kind("null-columns.parquet")
def _() -> bytes:
    return table({"timestamp": pa.nulls(300), "FIC1.PV": pa.nulls(300)})


@kind("twice.parquet")
def _() -> bytes:
    out = io.BytesIO()
    part = pa.Table.from_arrays([pa.array([1.0])] * 3, names=["timestamp", "FIC1.PV", "FIC1.PV"])
    pq.write_table(part, out)
    return out.getvalue()


@kind("feather.parquet")
def _() -> bytes:
    out = io.BytesIO()
    with pa.ipc.new_file(out, pa.schema([("x", pa.int8())])):
        pass
    return out.getvalue()


@kind("text.parquet")
def _() -> bytes:
    return TEXT.encode()


@kind("parquet-in-csv.csv")
def _() -> bytes:
    return good()[:400]


def written(folder: Path) -> Iterator[Path]:
    """All files, written into a folder, plus an empty folder, links without a target, and a missing path."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, made in KINDS.items():
        (folder / name).write_bytes(made())
        yield folder / name
    (folder / "empty-folder").mkdir(exist_ok=True)
    yield folder / "empty-folder"
    for name, to in {"loop.csv": "loop.csv", "nowhere.csv": "nothing"}.items():
        if not (folder / name).is_symlink():
            (folder / name).symlink_to(folder / to)
        yield folder / name
    yield folder / "missing.csv"


if __name__ == "__main__":
    for path in written(Path(sys.argv[1])):
        print(path)
