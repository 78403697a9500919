"""Files that a reader must refuse with one clear line."""

import gzip

from proofs.dialects.common import case, loop, sheet, stamp, text, wide
from proofs.dialects.generic_files import zipped
from proofs.dialects.generic_time import NAMES


def refuse(name, file, body, why):
    case("refuse", "refuse", why, name=name)(lambda: ({file: body}, {}))


SAMPLE = wide(loop("x1", 120, 5), NAMES)
refuse("empty_file", "export.csv", b"", "no bytes")
refuse("blank_lines_only", "export.csv", b"\r\n\r\n   \r\n", "only blank lines")
refuse("header_only", "export.csv", b"Time,FIC101.PV,FIC101.SP\r\n", "a header and no row")
PDF = b"%PDF-1.4\n%\xe2\xe3\xcf\xd3\n1 0 obj\n<< /Type /Catalog /Pages 2 0 R >>\nendobj\n"
refuse("pdf_as_csv", "trend.csv", PDF + bytes(range(256)) * 8 + b"\n%%EOF\n", "a PDF with the name of a csv")
refuse(
    "xls_old_binary", "trend.xls", bytes.fromhex("d0cf11e0a1b11ae1") + bytes(1528), "old binary workbook head"
)
LOGIN = [
    "<!DOCTYPE html>",
    '<html lang="en"><head><title>Sign in - Historian Web</title></head>',
    '<body><form method="post" action="/login"><label>User name <input name="user"></label>',
    '<label>Password <input name="password" type="password"></label>',
    "<button>Sign in</button></form><p>Session expired 2024-11-21 08:00:00</p></body></html>",
]
refuse("html_login_as_csv", "export.csv", text(LOGIN, eol="\n"), "the login page of the web client")
refuse(
    "gzip_cut_short", "export.csv.gz", gzip.compress(SAMPLE, mtime=0)[:700], "gzip that ends in the middle"
)


def locked(body):
    """The same zip with the encryption flag set in both headers."""
    raw = bytearray(body)
    raw[6] |= 1
    raw[raw.rindex(b"PK\x01\x02") + 8] |= 1
    return bytes(raw)


refuse("zip_encrypted", "export.zip", locked(zipped("export.csv", SAMPLE)), "zip says it is encrypted")
ALARMS = [
    [stamp(1732176000 + 17 * i), "FIC101", ["PV HI", "PV HI RTN", "MODE MAN"][i % 3], "ACK"]
    for i in range(60)
]
refuse(
    "alarm_list",
    "alarms.csv",
    sheet(["Time", "Source", "Message", "State"], ALARMS),
    "alarm journal, no numbers",
)
refuse(
    "no_time_column",
    "export.csv",
    b"\r\n".join(b",".join(x.split(b",")[1:]) for x in SAMPLE.split(b"\r\n")),
    "values only, no time column, no rate stated",
)
