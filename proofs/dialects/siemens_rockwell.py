"""Siemens WinCC, TIA panels, PCS 7; Rockwell; Ignition; Citect; B&R; Beckhoff."""

import numpy as np

from proofs.dialects.common import case, comma, excel, loop, num, sheet, stamp, text, three, truth, wide
from proofs.dialects.historians import long

FIC = ["FIC101_PV", "FIC101_SP", "FIC101_OP"]
HEAD = '"VarName";"TimeString";"VarValue";"Validity";"Time_ms"'


def wincc(lp, names, fmt, micro=2, by_tag=False):
    def row(n, i, v, b):
        ms = f"{float(excel(lp.t[i], 12)) * 1e6:.{micro}f}".replace(".", ",")
        return f'"{n}";"{stamp(lp.t[i], fmt)}";{comma(0.0 if b else v)};{0 if b else 1};{ms}'

    return long(lp, names, row, by_tag)


@case("siemens", why="WinCC flexible archive: two-digit years, decimal comma, Excel days x 10^6")
def wincc_archive_1998():
    lp = loop("w1", 120, 5, "1998-04-01 11:02:52", bad=4)
    names = ["Var_107", "Var_108", "Var_109"]
    lines = [HEAD, *wincc(lp, names, "%d.%m.%y %H:%M:%S")]
    return {"Archiv0.csv": text(lines, "cp1252")}, three(lp, names)


@case("siemens", why="TIA panel, UTF-16, ends with the $RT_OFF$ line")
def wincc_rt_off_utf16():
    lp = loop("w2", 120, 2, "2024-11-21 08:00:00", bad=3)
    lines = [HEAD, *wincc(lp, FIC, "%d.%m.%Y %H:%M:%S")]
    lines.append(f'"$RT_OFF$";"{stamp(lp.t[-1] + 3, "%d.%m.%Y %H:%M:%S")}";0;2;{comma(45617340000.0)}')
    return {"Datenprotokoll.txt": text(lines, "utf-16")}, three(lp, FIC)


@case(
    "siemens", why="the text has whole seconds, Time_ms has the half; truth is Time_ms (0.5 s off the text)"
)
def wincc_time_ms_finer():
    lp = loop("w3", 200, 2, "2024-11-21 08:00:00", bad=0)
    lp.t = lp.t + 0.5
    lines = [HEAD, *wincc(lp, FIC, "%d.%m.%Y %H:%M:%S", 4)]
    return {"Archiv1.csv": text(lines)}, three(lp, FIC)


@case("siemens", why="TIA S7-1500 DataLog: Record, Date, UTC Time, columns; //END line; padded numbers")
def tia_s7_datalog():
    lp = loop("w4", 150, 2)
    lines = ["Record,Date,UTC Time," + ",".join(FIC)]
    for i in lp.rows():
        lines.append(
            f"{i + 1},{stamp(lp.t[i], '%m/%d/%Y')},{stamp(lp.t[i], '%H:%M:%S.%3f')},"
            f"{lp.pv[i]:13.5E},{lp.sp[i]:13.5E},{lp.op[i]:13.5E}"
        )
    lines.append("//END")
    tags = three(lp, FIC)
    for n, k in zip(FIC, ("pv", "sp", "op"), strict=True):
        tags[n]["v"] = [float(f"{x:.5E}") for x in getattr(lp, k)]
    return {"DataLog1.csv": text(lines)}, tags


@case("siemens", why="PCS 7 trend export: pairs of time and value columns, German")
def pcs7_trend_pairs():
    a, b = loop("w5", 150, 2), loop("w6", 90, 5)
    names = ["FIC101/PID.PV_Out#Value", "FIC101/PID.MV#Value"]
    heads = [";".join(f"Zeit {n};{n}" for n in names)]
    rows = []
    for i in range(150):
        left = f"{stamp(a.t[i], '%d.%m.%Y %H:%M:%S.%3f')};{comma(a.pv[i])}"
        right = f"{stamp(b.t[i], '%d.%m.%Y %H:%M:%S.%3f')};{comma(b.op[i])}" if i < 90 else ";"
        rows.append(f"{left};{right}")
    return {"trend.csv": text(heads + rows, "cp1252")}, {
        names[0]: truth(a.t, a.pv),
        names[1]: truth(b.t, b.op),
    }


@case("siemens", why="Process Historian: quality code 128 = good (PCS 7: 0x80), 0/40 bad")
def pcs7_quality_128():
    lp = loop("w7", 120, 5, bad=4)
    names = ["Unit1/FIC101/PV", "Unit1/FIC101/SP", "Unit1/FIC101/MV"]
    rows = long(
        lp,
        names,
        lambda n, i, v, b: [n, stamp(lp.t[i], "%Y-%m-%d %H:%M:%S.%3f"), comma(v), "0x00" if b else "0x80"],
    )
    return {"ph.csv": sheet(["Variable", "Zeitstempel", "Wert", "Quality Code"], rows, ";")}, three(lp, names)


@case("rockwell", why="FactoryTalk View float table: Millitm column, Status E on bad, Marker B/E")
def factorytalk_datalog():
    lp = loop("r1", 120, 2, bad=4)
    names = [r"PLC1\FIC101.PV", r"PLC1\FIC101.SP", r"PLC1\FIC101.CV"]
    rows = long(
        lp,
        names,
        lambda n, i, v, b: [
            stamp(lp.t[i], "%m/%d/%Y"),
            stamp(lp.t[i], "%H:%M:%S"),
            (i * 7) % 1000,
            n,
            num(v),
            "E" if b else "",
            "B" if i == 0 else "",
        ],
        by_tag=False,
    )
    lp.t = lp.t + np.array([(i * 7) % 1000 / 1000 for i in lp.rows()])
    head = ["Date", "Time", "Millitm", "Tagname", "Value", "Status", "Marker"]
    return {"datalog.csv": sheet(head, rows)}, three(lp, names)


@case(
    "rockwell",
    why="Studio 5000 trend: preamble, Header:/Data: in the first column, date, time;ms apart by ';'",
)
def studio5000_trend():
    lp = loop("r2", 180, 1)
    lp.t = lp.t + 0.25
    names = ["FIC101.PV", "FIC101.SP", "FIC101.CV"]
    lines = [
        '"Controller Name:","PLC1"',
        '"Trend Name:","FIC101"',
        '"Trend Tags:",3',
        '"Sample Period:","1000 ms"',
        '"Start Time:","11/21/2024;08:00:00"',
        '"Stop Time:","11/21/2024;08:03:00"',
        '"Header:","Date","Time",' + ",".join(f'"{n}"' for n in names),
    ]
    for i in lp.rows():
        lines.append(
            f"Data,{stamp(lp.t[i], '%m/%d/%Y')},{stamp(lp.t[i], '%H:%M:%S;%3f')},"
            f"{num(lp.pv[i])},{num(lp.sp[i])},{num(lp.op[i])}"
        )
    return {"trend.csv": text(lines)}, three(lp, names)


@case("ignition", why="wide with t_stamp in milliseconds of the epoch, blank PV for bad")
def ignition_wide_epoch_ms():
    lp = loop("i1", 150, 2, bad=4)
    names = ["[default]Unit1/FIC101/PV", "[default]Unit1/FIC101/SP", "[default]Unit1/FIC101/OP"]
    rows = [
        [f"{lp.t[i] * 1000:.0f}", "" if i in lp.bad else num(lp.pv[i]), num(lp.sp[i]), num(lp.op[i])]
        for i in lp.rows()
    ]
    return {"ignition.csv": sheet(["t_stamp", *names], rows)}, three(lp, names)


@case("ignition", why="dataset export with #NAMES, #TYPES, #ROWS")
def ignition_dataset_names_types():
    lp = loop("i2", 120, 5)
    names = ["FIC101/PV", "FIC101/SP", "FIC101/OP"]
    lines = [
        '"#NAMES"',
        '"t_stamp","' + '","'.join(names) + '"',
        '"#TYPES"',
        '"date","D","D","D"',
        '"#ROWS","120"',
    ]
    for i in lp.rows():
        row = [stamp(lp.t[i], "%Y-%m-%d %H:%M:%S.%3f"), num(lp.pv[i]), num(lp.sp[i]), num(lp.op[i])]
        lines.append(",".join(f'"{x}"' for x in row))
    return {"dataset.csv": text(lines, eol="\n")}, three(lp, names)


@case("ignition", why="sqlth_data: tagid instead of names, floatvalue, dataintegrity 192")
def ignition_sqlth_data():
    lp = loop("i3", 120, 5, bad=4)
    head = ["tagid", "intvalue", "floatvalue", "stringvalue", "datevalue", "dataintegrity", "t_stamp"]
    rows = long(
        lp,
        ["17", "18", "19"],
        lambda n, i, v, b: [n, "", num(v), "", "", 500 if b else 192, f"{lp.t[i] * 1000:.0f}"],
        by_tag=False,
    )
    return {"sqlt_data_1_2024_11.csv": sheet(head, rows)}, three(lp, ["17", "18", "19"])


@case("citect", why="Process Analyst: date, time, milliseconds as three columns, <NA> for bad")
def citect_process_analyst():
    lp = loop("c1", 120, 2, "2024-11-21 08:00:00", bad=4)
    lp.t = lp.t + 0.125
    rows = [
        [
            stamp(lp.t[i], "%d/%m/%Y"),
            stamp(lp.t[i], "%H:%M:%S"),
            stamp(lp.t[i], "%3f"),
            "<NA>" if i in lp.bad else num(lp.pv[i]),
            num(lp.sp[i]),
            num(lp.op[i]),
        ]
        for i in lp.rows()
    ]
    return {"pa.csv": sheet(["Date", "Time", "Milliseconds", *FIC], rows)}, three(lp, FIC)


@case("br", why="B&R MpData recorder: semicolon, decimal point, milliseconds after a colon")
def br_logger_semicolon():
    lp = loop("b1", 150, 1)
    body = wide(lp, FIC, "%Y-%m-%d %H:%M:%S:%3f", ";", time="Timestamp", eol="\n")
    return {"mpDataRecorder.csv": body}, three(lp, FIC)


@case(
    "beckhoff", why="TwinCAT Scope: preamble with FILETIME start, a pair of ms offset and value per channel"
)
def twincat_scope_filetime():
    lp = loop("k1", 200, 1)
    start = (round(lp.t[0]) + 11644473600) * 10**7
    lines = [
        "Name\tFIC101 scope",
        "File\tC:\\Scope\\FIC101.svdx",
        f"Starttime of export\t{start}\t{stamp(lp.t[0], '%A, %B %d, %Y %H:%M:%S')}",
        f"Endtime of export\t{start + 199 * 10**7}\t{stamp(lp.t[-1], '%A, %B %d, %Y %H:%M:%S')}",
        "",
        "Name\tFIC101.PV\tName\tFIC101.OP",
        "Data-Type\tLREAL\tData-Type\tLREAL",
        "SampleTime[ms]\t1000\tSampleTime[ms]\t1000",
        "",
    ]
    for i in lp.rows():
        lines.append(f"{i * 1000}\t{num(lp.pv[i], 4)}\t{i * 1000}\t{num(lp.op[i], 4)}")
    tags = {"FIC101.PV": truth(lp.t, lp.pv, digits=4), "FIC101.OP": truth(lp.t, lp.op, digits=4)}
    return {"scope.csv": text(lines)}, tags
