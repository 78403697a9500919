"""LabVIEW, paperless recorders, and IT tools: InfluxDB, Grafana, SQL shells."""

from proofs.dialects.common import case, comma, loop, num, sheet, stamp, text, three, truth, wide
from proofs.dialects.historians import FIC, long

ISO = "%Y-%m-%dT%H:%M:%SZ"


@case("labview", why=".lvm: header, X_Value relative to Date/Time of the header (local = UTC here)")
def labview_lvm():
    lp = loop("l1", 200, 1)
    lines = [
        "LabVIEW Measurement\t",
        "Writer_Version\t2",
        "Reader_Version\t2",
        "Separator\tTab",
        "Decimal_Separator\t.",
        "Multi_Headings\tNo",
        "X_Columns\tOne",
        "Time_Pref\tAbsolute",
        "Operator\tlab",
        "Date\t2024/11/21",
        "Time\t08:00:00.0000000",
        "***End_of_Header***\t",
        "\t",
        "Channels\t2\t\t",
        "Samples\t200\t200\t",
        "Date\t2024/11/21\t2024/11/21\t",
        "Time\t08:00:00\t08:00:00\t",
        "X_Dimension\tTime\tTime\t",
        "X0\t0.0000000000000000E+0\t0.0000000000000000E+0\t",
        "Delta_X\t1.000000\t1.000000\t",
        "***End_of_Header***\t\t\t",
        "X_Value\tFIC101.PV\tFIC101.OP\tComment",
    ]
    lines += [f"{i}.000000\t{lp.pv[i]:.6f}\t{lp.op[i]:.6f}\t" for i in lp.rows()]
    return {"test_001.lvm": text(lines)}, {
        "FIC101.PV": truth(lp.t, lp.pv, digits=6),
        "FIC101.OP": truth(lp.t, lp.op, digits=6),
    }


@case("labview", why="seconds since 1904-01-01 UTC, tab separated")
def labview_1904_seconds():
    lp = loop("l2", 150, 2)
    rows = [[f"{lp.t[i] + 2082844800:.6f}", num(lp.pv[i]), num(lp.sp[i]), num(lp.op[i])] for i in lp.rows()]
    return {"log.txt": sheet(["Time", "FIC101_PV", "FIC101_SP", "FIC101_OP"], rows, "\t")}, three(
        lp, ["FIC101_PV", "FIC101_SP", "FIC101_OP"]
    )


@case("recorder", why="Yokogawa DX: preamble, channel row, tag row, units row; date and time columns")
def yokogawa_dx_text():
    lp = loop("d1", 150, 2)
    lines = [
        "Model,DX1000",
        "Serial No.,S5J501234",
        "Sampling Interval,2.000 sec",
        "Start Time,2024/11/21 08:00:00.000",
        "Stop Time,2024/11/21 08:04:58.000",
        "",
        "Ch.,,,CH001,CH002",
        "Tag,,,FI-101,FV-101",
        "Unit,,,m3/h,%",
        "Date,Time,sec,,",
    ]
    for i in lp.rows():
        d, c = stamp(lp.t[i], "%Y/%m/%d"), stamp(lp.t[i], "%H:%M:%S")
        lines.append(f"{d},{c},0.000,{num(lp.pv[i], 1)},{num(lp.op[i], 1)}")
    tags = {"FI-101": truth(lp.t, lp.pv, digits=1), "FV-101": truth(lp.t, lp.op, digits=1)}
    return {"DX_241121.csv": text(lines)}, tags, {"aliases": {"FI-101": ["CH001"], "FV-101": ["CH002"]}}


@case("recorder", why="Memograph: semicolon, decimal comma, units in brackets in the header, ***** for bad")
def memograph_semicolon():
    lp = loop("d2", 140, 5, bad=4)
    rows = [
        [
            stamp(lp.t[i], "%d.%m.%Y"),
            stamp(lp.t[i], "%H:%M:%S"),
            "*****" if i in lp.bad else comma(lp.pv[i]),
            comma(lp.op[i]),
            "",
        ]
        for i in lp.rows()
    ]
    heads = ["Datum", "Uhrzeit", "Durchfluss 1 [m³/h]", "Stellventil [%]", ""]
    tags = {heads[2]: truth(lp.t, lp.pv, lp.bad), heads[3]: truth(lp.t, lp.op)}
    alias = {heads[2]: ["Durchfluss 1"], heads[3]: ["Stellventil"]}
    return {"memo.csv": sheet(heads, rows, ";", enc="cp1252")}, tags, {"aliases": alias}


@case("recorder", why="Eurotherm: title lines, tab, 'No Data' and dates such as 21/11/24")
def eurotherm_review():
    lp = loop("d3", 150, 2, bad=4)
    names = ["FIC101 PV", "FIC101 SP", "FIC101 OP"]
    lines = ["Review export", "Instrument\t6100A Plant 1", "", "\t".join(["Date/Time", *names])]
    for i in lp.rows():
        pv = "No Data" if i in lp.bad else num(lp.pv[i])
        lines.append(f"{stamp(lp.t[i], '%d/%m/%y %H:%M:%S')}\t{pv}\t{num(lp.sp[i])}\t{num(lp.op[i])}")
    return {"review.txt": text(lines)}, three(lp, names)


def flux(lp, names):
    lines = []
    for k, (n, key) in enumerate(zip(names, ("pv", "sp", "op"), strict=True)):
        lines += [
            "#group,false,false,true,true,false,false,true,true",
            "#datatype,string,long,dateTime:RFC3339,dateTime:RFC3339,dateTime:RFC3339,double,string,string",
            "#default,_result,,,,,,,",
            ",result,table,_start,_stop,_time,_value,_field,_measurement",
        ]
        a, b = stamp(lp.t[0], ISO), stamp(lp.t[-1] + 60, ISO)
        v = getattr(lp, key)
        lines += [f",,{k},{a},{b},{stamp(lp.t[i], ISO)},{num(v[i])},{n},loops" for i in lp.rows()]
        lines.append("")
    return text(lines)


@case("influxdb", why="annotated CSV, one table per field, header repeated after a blank line")
def influx_annotated_tables():
    lp = loop("f1", 120, 5)
    return {"query.csv": flux(lp, ["FIC101_PV", "FIC101_SP", "FIC101_OP"])}, three(
        lp, ["FIC101_PV", "FIC101_SP", "FIC101_OP"]
    )


@case("influxdb", why="annotated CSV after pivot(): fields as columns")
def influx_pivoted():
    lp = loop("f2", 150, 2)
    lines = [
        "#group,false,false,false,true,false,false,false",
        "#datatype,string,long,dateTime:RFC3339,string,double,double,double",
        "#default,_result,,,,,,",
        ",result,table,_time,_measurement," + ",".join(["FIC101_OP", "FIC101_PV", "FIC101_SP"]),
    ]
    for i in lp.rows():
        t = stamp(lp.t[i], "%Y-%m-%dT%H:%M:%S.%9fZ")
        lines.append(f",,0,{t},loops,{num(lp.op[i])},{num(lp.pv[i])},{num(lp.sp[i])}")
    return {"pivot.csv": text(lines)}, three(lp, ["FIC101_PV", "FIC101_SP", "FIC101_OP"])


@case("influxdb", why="v1 shell CSV: name,time in nanoseconds, fields")
def influx_v1_cli():
    lp = loop("f3", 120, 5)
    rows = [
        ["loops", f"{round(lp.t[i])}000000000", num(lp.pv[i]), num(lp.sp[i]), num(lp.op[i])]
        for i in lp.rows()
    ]
    return {"v1.csv": sheet(["name", "time", "pv", "sp", "op"], rows, eol="\n")}, three(
        lp, ["pv", "sp", "op"]
    )


@case("grafana", why="Excel option: first line sep=, and quoted header")
def grafana_wide_sep():
    lp = loop("g1", 140, 5)
    body = wide(lp, [f'"{n}"' for n in FIC], time='"Time"', eol="\n")
    return {"panel.csv": b"sep=,\n" + body}, three(lp, FIC)


@case("grafana", why="series as rows: Series;Time;Value with offset, null for missing")
def grafana_series_rows():
    lp = loop("g2", 120, 5, bad=4)
    rows = long(
        lp,
        FIC,
        lambda n, i, v, b: [
            f'"{n}"',
            stamp(lp.t[i], "%Y-%m-%dT%H:%M:%S", "Europe/Berlin") + "+01:00",
            "null" if b else num(v),
        ],
    )
    return {"grafana_data_export.csv": sheet(["Series", "Time", "Value"], rows, ";", eol="\n")}, three(
        lp, FIC
    )


@case("sql", why="psql aligned output: | and dashes, (n rows) footer, timestamptz with +01")
def psql_aligned():
    lp = loop("s1", 120, 5, bad=3)
    lines = [f" {'ts':^26} | {'fic101_pv':^9} | {'fic101_op':^9} ", f"{'-' * 28}+{'-' * 11}+{'-' * 11}"]
    for i in lp.rows():
        pv = "" if i in lp.bad else num(lp.pv[i])
        t = stamp(lp.t[i], "%Y-%m-%d %H:%M:%S.%3f", "Europe/Berlin") + "+01"
        lines.append(f" {t:<26} | {pv:>9} | {num(lp.op[i]):>9}")
    lines += ["(120 rows)", ""]
    tags = {"fic101_pv": truth(lp.t, lp.pv, lp.bad), "fic101_op": truth(lp.t, lp.op)}
    return {"out.txt": text(lines, eol="\n")}, tags


@case("sql", why="mysql box output: +---+ lines, NULL")
def mysql_box():
    lp = loop("s2", 100, 10, bad=3)
    bar = f"+{'-' * 21}+{'-' * 11}+{'-' * 8}+"
    lines = [bar, f"| {'ts':<19} | {'tag':<9} | {'value':<6} |", bar]
    lines += long(
        lp,
        FIC,
        lambda n, i, v, b: f"| {stamp(lp.t[i])} | {n:<9} | {'NULL' if b else num(v):>6} |",
        by_tag=False,
    )
    lines += [bar, "300 rows in set (0.01 sec)"]
    return {"out.txt": text(lines, eol="\n")}, three(lp, FIC)
