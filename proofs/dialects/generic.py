"""Dates in different orders, thousands separators, row layouts."""

import numpy as np

from proofs.dialects.common import case, comma, loop, num, sheet, stamp, text, three, truth, wide
from proofs.dialects.generic_time import NAMES, table


@case("dates", why="24-12-31 to 25-01-01: two-digit year first, midnight settles it")
def two_digit_year_first():
    lp = loop("n1", 150, 5, "2024-12-31 23:55:00")
    return {"e.csv": table(lp, lambda t: stamp(t, "%y-%m-%d %H:%M:%S"))}, three(lp, NAMES)


@case("dates", "unknowable", "24-11-21: 21 Nov 2024 or 24 Nov 2021")
def two_digit_year_either_end():
    lp = loop("n2", 120, 5)
    return {"e.csv": table(lp, lambda t: stamp(t, "%y-%m-%d %H:%M:%S"))}, three(lp, NAMES)


@case("dates", "unknowable", "05/04/2024: 5 April or May 4")
def day_month_ambiguous():
    lp = loop("n3", 120, 5, "2024-04-05 08:00:00")
    return {"e.csv": table(lp, lambda t: stamp(t, "%d/%m/%Y %H:%M:%S"))}, three(lp, NAMES)


@case("dates", options={"day_first": True}, why="05/04/2024 is 5 April as stated")
def day_first_stated():
    lp = loop("n4", 120, 5, "2024-04-05 08:00:00")
    return {"e.csv": table(lp, lambda t: stamp(t, "%d/%m/%Y %H:%M:%S"))}, three(lp, NAMES)


@case("dates", options={"day_first": False}, why="05/04/2024 is May 4 as stated")
def month_first_stated():
    lp = loop("n5", 120, 5, "2024-05-04 08:00:00")
    return {"e.csv": table(lp, lambda t: stamp(t, "%m/%d/%Y %H:%M:%S"))}, three(lp, NAMES)


@case("dates", why="12/05 turns into 13/05 at midnight: day first, and only the second half says so")
def day_first_from_second_day():
    lp = loop("n6", 200, 5, "2024-05-12 23:52:00")
    return {"e.csv": table(lp, lambda t: stamp(t, "%d/%m/%Y %H:%M:%S"))}, three(lp, NAMES)


@case("dates", why="04/30 turns into 05/01 at midnight: month first")
def month_first_over_month_end():
    lp = loop("n7", 200, 5, "2024-04-30 23:52:00")
    return {"e.csv": table(lp, lambda t: stamp(t, "%m/%d/%Y %H:%M:%S"))}, three(lp, NAMES)


@case("dates", why="separate date and time columns, not at the left edge")
def date_time_columns():
    lp = loop("n8", 120, 5)
    rows = [
        [
            i + 1,
            stamp(lp.t[i], "%d.%m.%Y"),
            stamp(lp.t[i], "%H:%M:%S"),
            comma(lp.pv[i]),
            comma(lp.sp[i]),
            comma(lp.op[i]),
        ]
        for i in lp.rows()
    ]
    return {"e.csv": sheet(["Nr", "Datum", "Uhrzeit", *NAMES], rows, ";")}, three(lp, NAMES)


@case("dates", why="AM/PM through midnight (12:00:00 AM)")
def am_pm_midnight():
    lp = loop("n9", 200, 5, "2024-11-21 23:52:00")
    return {"e.csv": table(lp, lambda t: stamp(t, "%m/%d/%Y %I:%M:%S %p"))}, three(lp, NAMES)


@case("dates", why="comma as decimal sign of the seconds, semicolon file")
def seconds_decimal_comma():
    lp = loop("n10", 150, 1)
    lp.t = lp.t + 0.25
    body = table(lp, lambda t: stamp(t, "%d.%m.%Y %H:%M:%S,%3f"), "Zeit", ";", comma)
    return {"e.csv": body}, three(lp, NAMES)


@case("dates", why="ISO basic 20241121T080000Z")
def iso_basic():
    lp = loop("n11", 120, 5)
    return {"e.csv": table(lp, lambda t: stamp(t, "%Y%m%dT%H%M%SZ"))}, three(lp, NAMES)


@case("dates", why="nine digits of the second")
def iso_nanoseconds():
    lp = loop("n12", 120, 1)
    lp.t = lp.t + np.round(np.random.default_rng(5).uniform(0, 0.5, 120), 6)
    return {"e.csv": table(lp, lambda t: stamp(t, "%Y-%m-%dT%H:%M:%S.%9fZ"))}, three(lp, NAMES)


@case("dates", "unknowable", "clock only, no date anywhere")
def clock_without_date():
    lp = loop("n13", 120, 5)
    return {"e.csv": table(lp, lambda t: stamp(t, "%H:%M:%S"))}, three(lp, NAMES)


@case("dates", "unknowable", "seconds from an unknown start (0, 5, 10, ...)")
def elapsed_seconds():
    lp = loop("n14", 120, 5)
    return {"e.csv": table(lp, lambda t: f"{t - lp.t[0]:.1f}", "Elapsed (s)")}, three(lp, NAMES)


def grouped(mark, point, quote=False):
    def show(x):
        s = f"{x:,.1f}".replace(",", "\0").replace(".", point).replace("\0", mark)
        return f'"{s}"' if quote else s

    return show


def thousands(name, mark, point, why, sep=";", quote=False, enc="utf-8"):
    @case("numbers", why=why, name=name)
    def make():
        lp = loop(name, 120, 5)
        lp.pv, lp.sp, lp.op = lp.pv * 25, lp.sp * 25, lp.op * 25
        lp.op[40:60] = np.linspace(950, 1050, 20)
        body = table(
            lp, lambda t: stamp(t, "%Y-%m-%d %H:%M:%S"), "Time", sep, grouped(mark, point, quote), enc=enc
        )
        return {"e.csv": body}, three(lp, NAMES, digits=1)


thousands("thousands_german", ".", ",", "1.234,5")
thousands("thousands_french_nbsp", "\u00a0", ",", "1 234,5 with a no-break space, cp1252", enc="cp1252")
thousands("thousands_narrow_nbsp", "\u202f", ",", "1 234,5 with a narrow no-break space, UTF-8")
thousands("thousands_swiss", "'", ".", "1'234.5")
thousands("thousands_english_quoted", ",", ".", '"1,234.5" in a comma file', ",", True)


@case("numbers", why='whole numbers with quoted thousands, "12,312"')
def thousands_whole():
    lp = loop("th1", 120, 5)
    lp.pv, lp.sp, lp.op = lp.pv * 250, lp.sp * 250, lp.op * 250
    body = table(lp, stamp, val=lambda x: f'"{x:,.0f}"')
    return {"e.csv": body}, three(lp, NAMES, digits=0)


@case("numbers", why="a minus behind the number, 12.3-")
def minus_behind():
    lp = loop("th2", 120, 5)
    lp.pv, lp.sp, lp.op = lp.pv - 50, lp.sp - 50, lp.op - 50
    body = table(lp, stamp, val=lambda x: num(abs(x)) + ("-" if x < 0 else ""))
    return {"e.csv": body}, three(lp, NAMES)


@case("layout", why="a preamble as wide as the table")
def preamble_as_wide():
    lp = loop("m7", 120, 5)
    above = b"Trend report;Mill A;Line 3;Shift B\r\nOperator;a;b;c\r\n"
    return {"e.csv": above + wide(lp, NAMES, sep=";")}, three(lp, NAMES)


@case("layout", why="columns parted by one blank, date and time of day under one name")
def parted_by_blanks():
    lp = loop("m8", 120, 5)
    return {"e.txt": wide(lp, NAMES, sep=" ")}, three(lp, NAMES)


@case("layout", why="newest row first")
def newest_first():
    lp = loop("m1", 150, 4)
    lines = wide(lp, NAMES).decode().split("\r\n")
    return {"e.csv": text([lines[0], *lines[-2:0:-1]])}, three(lp, NAMES)


@case("layout", why="a title line with the tag, then its rows; one tag after another")
def blocks_of_tags():
    lp = loop("m2", 100, 6, bad=3)
    lines = []
    for n, k in zip(NAMES, ("pv", "sp", "op"), strict=True):
        lines += [f"Tag: {n}", "Time,Value"]
        v = getattr(lp, k)
        lines += [f"{stamp(lp.t[i])},{'Bad' if k == 'pv' and i in lp.bad else num(v[i])}" for i in lp.rows()]
        lines.append("")
    return {"e.csv": text(lines)}, three(lp, NAMES)


@case("layout", why="blocks with only the tag name on the title line, no header, semicolons")
def blocks_bare_title():
    lp = loop("m3", 90, 6)
    lines = []
    for n, k in zip(NAMES, ("pv", "sp", "op"), strict=True):
        lines.append(n)
        lines += [f"{stamp(lp.t[i], '%d.%m.%Y %H:%M:%S')};{comma(getattr(lp, k)[i])}" for i in lp.rows()]
    return {"e.csv": text(lines)}, three(lp, NAMES)


@case("layout", why="a file per tag, the tag is the file name")
def file_per_tag():
    lp = loop("m4", 120, 5)
    files = {}
    for n, k in zip(NAMES, ("pv", "sp", "op"), strict=True):
        rows = [[stamp(lp.t[i]), num(getattr(lp, k)[i])] for i in lp.rows()]
        files[f"{n}.csv"] = sheet(["Time", "Value"], rows)
    return files, three(lp, NAMES)


@case("layout", why="three files, the same columns, one day part after another")
def file_per_hour():
    lp = loop("m5", 240, 5)
    lines = wide(lp, NAMES).decode().split("\r\n")
    files = {f"part{k + 1}.csv": text([lines[0], *lines[1 + 80 * k : 81 + 80 * k]]) for k in range(3)}
    return files, three(lp, NAMES)


@case("layout", why="blank = no change: truth has only the stored samples of each tag")
def blank_no_change():
    lp = loop("m6", 300, 1)
    kept = {}
    for n, k, band in zip(NAMES, ("pv", "sp", "op"), (0.2, 0.05, 0.3), strict=True):
        v, last, kept[n] = getattr(lp, k), None, []
        for i in lp.rows():
            if last is None or abs(v[i] - last) > band or i % 8 == 7:
                kept[n].append(i)
                last = v[i]
    rows = [
        [
            stamp(lp.t[i]),
            *(
                num(getattr(lp, k)[i]) if i in kept[n] else ""
                for n, k in zip(NAMES, ("pv", "sp", "op"), strict=True)
            ),
        ]
        for i in lp.rows()
        if any(i in kept[n] for n in NAMES)
    ]
    tags = {
        n: truth(lp.t[kept[n]], getattr(lp, k)[kept[n]])
        for n, k in zip(NAMES, ("pv", "sp", "op"), strict=True)
    }
    return {"e.csv": sheet(["Time", *NAMES], rows)}, tags
