"""Valmet DNA and ABB (800xA, PGIM)."""

from proofs.dialects.common import case, comma, loop, num, sheet, stamp, three, wide
from proofs.dialects.historians import long

VALMET = ["320PIC7509:me", "320PIC7509:spa", "320PIC7509:con"]


@case("valmet", why="Finnish: 21.11.2024 8.00.00 (dots in the time), semicolon, decimal comma")
def valmet_finnish():
    lp = loop("va1", 180, 2)
    body = wide(lp, VALMET, "%-d.%-m.%Y %-H.%M.%S", ";", comma, time="Aika", enc="cp1252")
    return {"320PIC7509.csv": body}, three(lp, VALMET)


@case("valmet", why="description row in cp1252, units row, tab separated, bad as ***")
def valmet_description_tab():
    lp = loop("va2", 150, 1, bad=3)
    heads = [
        ["", *VALMET],
        ["", "Höyrynpaine", "Höyrynpaine asetusarvo", "Säätöventtiili"],
        ["", "bar", "bar", "%"],
    ]
    rows = [
        [
            stamp(lp.t[i], "%d.%m.%Y %H:%M:%S"),
            "***" if i in lp.bad else comma(lp.pv[i]),
            comma(lp.sp[i]),
            comma(lp.op[i]),
        ]
        for i in lp.rows()
    ]
    return {"trendi.txt": sheet(heads, rows, "\t", enc="cp1252")}, three(lp, VALMET)


@case("abb", why="800xA history: object:property, OPC quality 192 / 0 / 24, milliseconds")
def abb_800xa_long():
    lp = loop("abb1", 120, 5, bad=4)
    names = ["FIC101:PV", "FIC101:SP", "FIC101:OUT"]
    rows = long(
        lp,
        names,
        lambda n, i, v, b: [
            n,
            stamp(lp.t[i], "%Y-%m-%d %H:%M:%S.%3f"),
            num(v),
            (0, 24)[i % 2] if b else 192,
        ],
    )
    return {"800xa.csv": sheet(["Log", "TimeStamp", "Value", "Quality"], rows)}, three(lp, names)


@case("abb", why="PGIM: semicolon, status word OK/ERR per tag")
def abb_pgim_wide():
    lp = loop("abb2", 140, 5, bad=4)
    names = ["10LAB10CF001|XQ01", "10LAB10CF001|XQ02", "10LAB10AA001|XQ01"]
    head = ["Zeit"]
    for n in names:
        head += [n, "Status"]
    rows = [
        [
            stamp(lp.t[i], "%d.%m.%Y %H:%M:%S"),
            comma(lp.pv[i]),
            "ERR" if i in lp.bad else "OK",
            comma(lp.sp[i]),
            "OK",
            comma(lp.op[i]),
            "OK",
        ]
        for i in lp.rows()
    ]
    return {"pgim.csv": sheet(head, rows, ";")}, three(lp, names)
