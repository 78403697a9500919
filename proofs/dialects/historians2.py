"""Yokogawa, Foxboro, AVEVA Historian, GE Proficy, Canary."""

from proofs.dialects.common import case, loop, num, sheet, stamp, text, three, truth, wide
from proofs.dialects.historians import FIC, long

CENTUM = ["FIC101.PV", "FIC101.SV", "FIC101.MV"]


@case("yokogawa", why="CENTUM trend file: preamble, tag row, comment row, units row; mode as text")
def yokogawa_preamble():
    lp = loop("yo1", 240, 1)
    lines = [
        "File Type,Trend Data",
        "Station,HIS0164",
        "Sampling Period,1,sec",
        "Start Time,2024/11/21 08:00:00",
        "Number of Data,240",
        "",
        ",".join(["Tag Name", *CENTUM, "FIC101.MODE"]),
        ",".join(["Comment", "FEED FLOW", "FEED FLOW", "FEED FLOW", "FEED FLOW"]),
        ",".join(["Unit", "M3/H", "M3/H", "%", ""]),
    ]
    for i in lp.rows():
        mode = "MAN" if 100 <= i < 110 else "AUT"
        lines.append(
            ",".join([stamp(lp.t[i], "%Y/%m/%d %H:%M:%S"), num(lp.pv[i]), num(lp.sp[i]), num(lp.op[i]), mode])
        )
    return {"trend.csv": text(lines)}, three(lp, CENTUM)


@case("yokogawa", why="Exaquantum: quality words per tag, tab separated")
def yokogawa_exaquantum():
    lp = loop("yo2", 120, 5, bad=4)
    names = ["Root.FIC101.PV.Value", "Root.FIC101.SV.Value", "Root.FIC101.MV.Value"]
    rows = long(
        lp,
        names,
        lambda n, i, v, b: [n, stamp(lp.t[i], "%Y-%m-%d %H:%M:%S.%3f"), num(v), "Bad" if b else "Good"],
        by_tag=False,
    )
    body = sheet(["ItemPath", "TimeStamp", "Value", "Quality"], rows, "\t")
    return {"exa.txt": body}, three(lp, names)


@case("yokogawa", why="wide; PV that is not good is printed as IOP")
def yokogawa_iop():
    lp = loop("yo3", 150, 2, bad=5)
    body = wide(lp, CENTUM, "%Y/%m/%d %H:%M:%S", badtext="IOP", time="Date/Time", enc="utf-16")
    return {"fic101.csv": body}, three(lp, CENTUM)


FOX = ["CP01:FIC101.MEAS", "CP01:FIC101.SPT", "CP01:FIC101.OUT"]


@case("foxboro", why="compound:block.parameter, .MA as 0/1")
def foxboro_wide():
    lp = loop("fo1", 150, 2)
    lines = [",".join(["TIMESTAMP", *FOX, "CP01:FIC101.MA"])]
    for i in lp.rows():
        ma = "0" if 50 <= i < 60 else "1"
        lines.append(
            ",".join([stamp(lp.t[i], "%m/%d/%Y %H:%M:%S"), num(lp.pv[i]), num(lp.sp[i]), num(lp.op[i]), ma])
        )
    return {"fox.csv": text(lines)}, three(lp, FOX)


@case("foxboro", why="AIM*Historian copy: space-padded columns, statuses OK/BAD after each value")
def foxboro_aim_columns():
    lp = loop("fo2", 110, 5, bad=3)
    lines = [f"{'Time':<22}{FOX[0]:>20}{'Status':>8}{FOX[2]:>20}{'Status':>8}"]
    for i in lp.rows():
        lines.append(
            f"{stamp(lp.t[i], '%Y-%m-%dT%H:%M:%S'):<22}{num(lp.pv[i]):>20}"
            f"{'BAD' if i in lp.bad else 'OK':>8}{num(lp.op[i]):>20}{'OK':>8}"
        )
    return {"aim.txt": text(lines)}, {FOX[0]: truth(lp.t, lp.pv, lp.bad), FOX[2]: truth(lp.t, lp.op)}


@case("aveva", why="Quality 192 = good, bad value NULL")
def aveva_quality_192():
    lp = loop("av1", 120, 5, bad=5)
    rows = long(
        lp,
        FIC,
        lambda n, i, v, b: [
            stamp(lp.t[i], "%Y-%m-%d %H:%M:%S.%7f"),
            n,
            "NULL" if b else num(v),
            0 if b else 192,
        ],
        by_tag=False,
    )
    return {"history.csv": sheet(["DateTime", "TagName", "Value", "Quality"], rows)}, three(lp, FIC)


@case(
    "aveva",
    why="real History table: Quality 0 = good, 1 = bad; QualityDetail 192 and OPCQuality 192 beside it",
)
def aveva_quality_detail():
    lp = loop("av2", 120, 5, bad=5)
    head = ["DateTime", "TagName", "Value", "vValue", "Quality", "QualityDetail", "OPCQuality", "wwTagKey"]
    rows = long(
        lp,
        FIC,
        lambda n, i, v, b: [
            stamp(lp.t[i], "%Y-%m-%d %H:%M:%S.%7f"),
            n,
            "NULL" if b else num(v),
            "NULL" if b else num(v),
            1 if b else 0,
            24 if b else 192,
            0 if b else 192,
            FIC.index(n) + 211,
        ],
    )
    return {"history.csv": sheet(head, rows)}, three(lp, FIC)


@case("aveva", why="QualityDetail only; bad rows keep a number in Value")
def aveva_quality_detail_only():
    lp = loop("av3", 120, 5, bad=5)
    rows = long(
        lp,
        FIC,
        lambda n, i, v, b: [
            n,
            stamp(lp.t[i], "%Y-%m-%d %H:%M:%S.%3f"),
            "0" if b else num(v),
            24 if b else 192,
        ],
    )
    return {"history.csv": sheet(["TagName", "DateTime", "Value", "QualityDetail"], rows)}, three(lp, FIC)


@case("aveva", why="WideHistory from SSMS: NULL words, BOM")
def aveva_wide_null():
    lp = loop("av4", 150, 2, bad=6)
    body = wide(lp, FIC, "%Y-%m-%d %H:%M:%S.%7f", badtext="NULL", time="DateTime", enc="utf-8-sig")
    return {"wide.csv": body}, three(lp, FIC)


@case("aveva", why="Historian Client trend (US): quality column per tag named '<tag> Quality', words")
def aveva_client_wide_quality():
    lp = loop("av5", 140, 5, bad=4)
    head = ["Date Time"]
    for n in FIC:
        head += [n, f"{n} Quality"]
    rows = [
        [
            stamp(lp.t[i], "%-m/%-d/%Y %-I:%M:%S.%3f %p"),
            num(lp.pv[i]),
            "Bad" if i in lp.bad else "Good",
            num(lp.sp[i]),
            "Good",
            num(lp.op[i]),
            "Good",
        ]
        for i in lp.rows()
    ]
    return {"trend.csv": sheet(head, rows)}, three(lp, FIC)


@case("proficy", why="[Data] before the header; quality words")
def proficy_data_section():
    lp = loop("ge1", 120, 5, bad=4)
    lines = ["[Data]", "Tagname,TimeStamp,Value,DataQuality"]
    lines += long(
        lp,
        FIC,
        lambda n, i, v, b: f"{n},{stamp(lp.t[i], '%m/%d/%Y %H:%M:%S')},{num(v)},{'Bad' if b else 'Good'}",
    )
    return {"proficy.csv": text(lines)}, three(lp, FIC)


@case("proficy", why="[Tags] section first, then [Data]; 'Good,NonSpecific' quoted, 'Bad,CommFailure'")
def proficy_tags_and_data():
    lp = loop("ge2", 120, 5, bad=5)
    lines = ["[Tags]", "Tagname,Description,EngineeringUnits,DataType"]
    lines += [
        f"{n},Feed flow {k},{u},SingleFloat"
        for n, k, u in zip(FIC, ["PV", "SP", "OP"], ["m3/h", "m3/h", "%"], strict=True)
    ]
    lines += ["", "[Data]", "Tagname,TimeStamp,Value,DataQuality"]
    lines += long(
        lp,
        FIC,
        lambda n, i, v, b: (
            f"{n},{stamp(lp.t[i], '%m/%d/%Y %-I:%M:%S.%3f %p')},{num(v)},"
            + ('"Bad,CommFailure"' if b else '"Good,NonSpecific"')
        ),
        by_tag=False,
    )
    return {"proficy.csv": text(lines)}, three(lp, FIC)


@case("proficy", why="ihTrend: quality as percent good 100 / 0")
def proficy_percent_good():
    lp = loop("ge3", 120, 10, bad=4)
    rows = long(
        lp,
        FIC,
        lambda n, i, v, b: [n, stamp(lp.t[i], "%Y-%m-%d %H:%M:%S"), "0" if b else num(v), 0 if b else 100],
    )
    return {"ih.csv": sheet(["tagname", "timestamp", "value", "quality"], rows)}, three(lp, FIC)


@case("canary", why="OPC quality in hex 0xC0 and words, offset in the stamp")
def canary_hex_quality():
    lp = loop("ca1", 120, 5, bad=4)
    names = ["Site.Unit1.FIC101.PV", "Site.Unit1.FIC101.SP", "Site.Unit1.FIC101.OP"]
    rows = long(
        lp,
        names,
        lambda n, i, v, b: [
            n,
            stamp(lp.t[i], "%Y-%m-%dT%H:%M:%S.%7f", "Europe/Berlin") + "+01:00",
            num(v),
            "0x0018" if b else "0x00C0",
        ],
    )
    return {"canary.csv": sheet(["Tag", "Timestamp", "Value", "Quality"], rows)}, three(lp, names)


@case("canary", why="Axiom export: wide, words No Data")
def canary_axiom_wide():
    lp = loop("ca2", 150, 4, bad=6)
    body = wide(lp, FIC, "%m/%d/%Y %H:%M:%S.%3f", badtext="No Data", time="Timestamp")
    return {"axiom.csv": body}, three(lp, FIC)
