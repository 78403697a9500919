"""Encodings, packed files, Parquet, small defects of the layout, and files to refuse."""

import gzip
import io
import zipfile
from decimal import Decimal

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from proofs.dialects.common import case, comma, loop, num, sheet, stamp, text, three, wide
from proofs.dialects.generic_time import NAMES
from proofs.dialects.historians import long


def lines_of(lp, **kw):
    return wide(lp, NAMES, **kw).decode().split("\r\n")[:-1]


@case("packed", why=".csv.gz")
def gz_csv():
    lp = loop("k1", 150, 2)
    return {"e.csv.gz": gzip.compress(wide(lp, NAMES), mtime=0)}, three(lp, NAMES)


def zipped(name, body):
    buf = io.BytesIO()
    with zipfile.ZipFile(buf, "w", zipfile.ZIP_DEFLATED) as z:
        z.writestr(zipfile.ZipInfo(name, (2024, 11, 21, 8, 0, 0)), body)
    return buf.getvalue()


@case("packed", why=".zip with one csv inside")
def zip_one_csv():
    lp = loop("k2", 150, 2)
    return {"e.zip": zipped("export.csv", wide(lp, NAMES))}, three(lp, NAMES)


@case("encoding", why="UTF-16 LE with mark, tab separated (Excel 'Unicode text')")
def utf16_tab():
    lp = loop("k3", 150, 2)
    return {"e.txt": wide(lp, NAMES, sep="\t", enc="utf-16")}, three(lp, NAMES)


@case("encoding", why="UTF-16 BE with mark")
def utf16_big_endian():
    lp = loop("k4", 120, 5)
    return {"e.csv": b"\xfe\xff" + wide(lp, NAMES, enc="utf-16-be")}, three(lp, NAMES)


@case("encoding", why="UTF-8 with byte-order mark, quoted header")
def utf8_bom():
    lp = loop("k5", 120, 5)
    body = wide(lp, [f'"{n}"' for n in NAMES], time='"Time"', enc="utf-8-sig")
    return {"e.csv": body}, three(lp, NAMES)


@case("encoding", why="cp1252 umlauts in the tag names")
def cp1252_umlauts():
    lp = loop("k6", 120, 5)
    names = ["Kühlwasser Durchfluß", "Kühlwasser Sollwert", "Ventil öffnen"]
    return {"e.csv": wide(lp, names, "%d.%m.%Y %H:%M:%S", ";", comma, time="Zeit", enc="cp1252")}, three(
        lp, names
    )


@case("encoding", why="bare LF, no line end after the last row")
def lf_no_final_newline():
    lp = loop("k7", 120, 5)
    return {"e.csv": text(lines_of(lp), eol="\n", last=False)}, three(lp, NAMES)


@case("nuisance", why="the header comes again every 50 rows")
def repeated_header():
    lp = loop("k8", 200, 2)
    head, *rows = lines_of(lp)
    out = [x for i in range(0, 200, 50) for x in [head, *rows[i : i + 50]]]
    return {"e.csv": text(out)}, three(lp, NAMES)


@case("nuisance", why="units row under the header")
def units_row():
    lp = loop("k9", 120, 5)
    head, *rows = lines_of(lp)
    return {"e.csv": text([head, ",m3/h,m3/h,%", *rows])}, three(lp, NAMES)


@case("nuisance", why="description row and units row, quoted with commas inside")
def description_row():
    lp = loop("k10", 120, 5)
    head, *rows = lines_of(lp)
    desc = '"","Feed flow, reactor 1","Feed flow, setpoint","Feed valve, position"'
    return {"e.csv": text([head, desc, ",m3/h,m3/h,%", *rows])}, three(lp, NAMES)


@case("nuisance", why="delimiter at the end of every line")
def trailing_delimiter():
    lp = loop("k11", 120, 5)
    lines = [x + ";" for x in lines_of(lp, sep=";", show=comma)]
    return {"e.csv": text(lines)}, three(lp, NAMES)


@case("nuisance", why="footer: blank line, count, statistics, end of report")
def footer_lines():
    lp = loop("k12", 120, 5)
    foot = ["", "Total rows: 120", "Minimum,44.10,44.00,40.00", "*** End of report ***"]
    return {"e.csv": text(lines_of(lp) + foot)}, three(lp, NAMES)


@case("nuisance", why="everything quoted, decimal comma inside the quotes, comma as separator")
def quoted_decimal_comma():
    lp = loop("k13", 120, 5)
    rows = [
        [f'"{x}"' for x in (stamp(lp.t[i]), comma(lp.pv[i]), comma(lp.sp[i]), comma(lp.op[i]))]
        for i in lp.rows()
    ]
    return {"e.csv": sheet(['"Time"', *(f'"{n}"' for n in NAMES)], rows)}, three(lp, NAMES)


@case("nuisance", why="report title and period lines above the header")
def report_title():
    lp = loop("k14", 120, 5)
    top = ["Trend report: FIC101", "Period: 2024-11-21 08:00:00 - 2024-11-21 08:09:55", "Printed by: op1", ""]
    return {"e.csv": text(top + lines_of(lp))}, three(lp, NAMES)


@case("nuisance", why="every tenth row is there twice, same stamp and values; truth has one of them")
def duplicate_rows():
    lp = loop("k15", 150, 2)
    head, *rows = lines_of(lp)
    out = [x for i, r in enumerate(rows) for x in ([r, r] if i % 10 == 0 else [r])]
    return {"e.csv": text([head, *out])}, three(lp, NAMES)


@case("nuisance", why="blanks and signs: padded cells, +48.20, numbers such as 4.82E+01")
def padded_exponents():
    lp = loop("k16", 120, 5)
    rows = [
        [stamp(lp.t[i]), f"  {num(lp.pv[i])}", f" +{num(lp.sp[i])} ", f" {lp.op[i]:.3E}"] for i in lp.rows()
    ]
    tags = three(lp, NAMES)
    tags[NAMES[2]]["v"] = [float(f"{x:.3E}") for x in lp.op]
    return {"e.csv": sheet(["Time", *NAMES], rows)}, tags


def parquet(table):
    buf = io.BytesIO()
    pq.write_table(table, buf)
    return buf.getvalue()


def frame(lp):
    t = pd.to_datetime([round(x * 1000) for x in lp.t], unit="ms", utc=True)
    cols = {
        n: [float(num(x)) for x in getattr(lp, k)] for n, k in zip(NAMES, ("pv", "sp", "op"), strict=True)
    }
    for i in lp.bad:
        cols[NAMES[0]][i] = None
    return t, cols


@case("parquet", why="wide, timestamps aware of Europe/Berlin")
def parquet_wide_tz():
    lp = loop("k17", 150, 2, bad=4)
    t, cols = frame(lp)
    df = pd.DataFrame({"time": t.tz_convert("Europe/Berlin"), **cols})
    return {"e.parquet": parquet(pa.Table.from_pandas(df, preserve_index=False))}, three(lp, NAMES)


@case("parquet", why="wide, the time is the index of a data frame, no zone")
def parquet_wide_index():
    lp = loop("k18", 150, 2, bad=4)
    t, cols = frame(lp)
    df = pd.DataFrame(cols, index=pd.DatetimeIndex(t.tz_localize(None)))
    return {"e.parquet": parquet(pa.Table.from_pandas(df))}, three(lp, NAMES)


@case("parquet", why="long, tag and quality as dictionary columns, UTC in ns")
def parquet_long_dictionary():
    lp = loop("k19", 120, 5, bad=5)
    rows = long(
        lp, NAMES, lambda n, i, v, b: (n, round(lp.t[i]) * 10**9, float(num(v)), "Bad" if b else "Good")
    )
    tag, t, v, q = (list(x) for x in zip(*rows, strict=True))
    table = pa.table(
        {
            "tag": pa.array(tag).dictionary_encode(),
            "timestamp": pa.array(t, pa.timestamp("ns", "UTC")),
            "value": pa.array(v, pa.float64()),
            "quality": pa.array(q).dictionary_encode(),
        }
    )
    return {"e.parquet": parquet(table)}, three(lp, NAMES)


@case("parquet", why="values as decimal(10,2), time as epoch milliseconds in int64")
def parquet_decimals():
    lp = loop("k20", 120, 5)
    cols = {"ts": pa.array([round(t * 1000) for t in lp.t], pa.int64())}
    for n, k in zip(NAMES, ("pv", "sp", "op"), strict=True):
        cols[n] = pa.array([Decimal(num(x)) for x in getattr(lp, k)], pa.decimal128(10, 2))
    return {"e.parquet": parquet(pa.table(cols))}, three(lp, NAMES)
