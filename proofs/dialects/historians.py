"""Aspen IP.21, Honeywell PHD and Experion, Emerson DeltaV and Ovation."""

from proofs.dialects.common import case, loop, num, sheet, stamp, text, three

FIC = ["FIC101.PV", "FIC101.SP", "FIC101.OP"]
KEYS = ("pv", "sp", "op")


def long(lp, names, cells, by_tag=True):
    """Rows of a long table; cells(name, i, value, bad) gives one row; by_tag: one tag after another."""
    order = [(n, k, i) for n, k in zip(names, KEYS, strict=False) for i in lp.rows()]
    if not by_tag:
        order.sort(key=lambda x: x[2])
    return [cells(n, i, getattr(lp, k)[i], k == "pv" and i in lp.bad) for n, k, i in order]


@case("ip21", why="SQLplus CSV; QSTATUS Good/Bad, bad value ????????")
def ip21_history_qstatus():
    lp = loop("ip1", 100, 6, bad=4)
    head = ["NAME", "IP_TREND_TIME", "IP_TREND_VALUE", "IP_TREND_QSTATUS"]
    rows = long(
        lp,
        ["FIC101", "FIC101_SP", "FIC101_OP"],
        lambda n, i, v, b: [
            n,
            stamp(lp.t[i], "%d-%b-%y %H:%M:%S.%1f").upper(),
            "????????" if b else num(v, 3),
            "Bad" if b else "Good",
        ],
    )
    return {"ip21.csv": sheet(head, rows)}, three(lp, ["FIC101", "FIC101_SP", "FIC101_OP"], digits=3)


@case("ip21", why="SQLplus listing: fixed columns, a line of dashes, two spaces between, tag names padded")
def ip21_sqlplus_listing():
    lp = loop("ip2", 90, 10, bad=3)
    names = ["FIC101", "FIC101.SP"]
    lines = [
        f"{'NAME':<24} {'IP_TREND_TIME':<20} {'IP_TREND_VALUE':>14} {'IP_TREND_QSTATUS':<16}",
        f"{'-' * 24} {'-' * 20} {'-' * 14} {'-' * 16}",
    ]
    for r in long(
        lp,
        names,
        lambda n, i, v, b: (
            f"{n:<24} {stamp(lp.t[i], '%d-%b-%y %H:%M:%S.%1f').upper():<20} "
            f"{'????????' if b else num(v):>14} {'Bad' if b else 'Good':<16}"
        ),
    ):
        lines.append(r)
    tags = three(lp, names)
    return {"trend.txt": text(lines)}, tags


@case("ip21", why="HISTORY table: status 0 = good, 4-digit codes not; microseconds with Z")
def ip21_history_status_zero_good():
    lp = loop("ip3", 120, 5, bad=5)
    rows = long(
        lp,
        FIC,
        lambda n, i, v, b: [n, stamp(lp.t[i], "%Y-%m-%dT%H:%M:%S.%6fZ"), num(v), -1 if b else 0],
        by_tag=False,
    )
    return {"history.csv": sheet(["name", "ts", "value", "status"], rows)}, three(lp, FIC)


@case("ip21", why="Process Explorer copy: tab separated, tag, description and units rows")
def ip21_process_explorer():
    lp = loop("ip4", 150, 4, bad=3)
    heads = [
        ["Tag", "20FIC101", "20FIC101.SP", "20FIC101.OP"],
        ["Description", "Reflux to C-201", "Reflux setpoint", "Reflux valve"],
        ["Units", "T/H", "T/H", "%"],
    ]
    rows = [
        [
            stamp(lp.t[i], "%d-%b-%y %H:%M:%S.%1f").upper(),
            "????????" if i in lp.bad else num(lp.pv[i]),
            num(lp.sp[i]),
            num(lp.op[i]),
        ]
        for i in lp.rows()
    ]
    return {"plot.txt": sheet(heads, rows, "\t")}, three(lp, heads[0][1:])


@case("phd", why="confidence 0-100: keep 50 and above")
def phd_confidence():
    lp = loop("phd1", 130, 5, bad=6)
    conf = [100, 100, 90, 75, 50]
    low = [0, 20, 49]
    rows = long(
        lp,
        ["20FC101.PV", "20FC101.SP", "20FC101.OP"],
        lambda n, i, v, b: [
            n,
            stamp(lp.t[i], "%m/%d/%Y %H:%M:%S"),
            num(v),
            low[i % 3] if b else (conf[i % 5] if n.endswith("PV") else 100),
        ],
    )
    body = sheet(["TagName", "TimeStamp", "Value", "Confidence"], rows)
    return {"phd.csv": body}, three(lp, ["20FC101.PV", "20FC101.SP", "20FC101.OP"])


@case("phd", why="no header; tag, time, value, confidence 100 or 0 in the last column")
def phd_no_header():
    lp = loop("phd2", 120, 5, bad=4)
    names = ["FC101.PV", "FC101.SP", "FC101.OP"]
    rows = long(
        lp, names, lambda n, i, v, b: [n, stamp(lp.t[i], "%m/%d/%Y %H:%M:%S"), num(v), 0 if b else 100]
    )
    return {"phd.txt": sheet(None, rows)}, three(lp, names)


@case("phd", why="wide with a confidence column after each tag")
def phd_wide_confidence_columns():
    lp = loop("phd3", 120, 10, bad=4)
    head = ["TIMESTAMP"]
    for n in FIC:
        head += [n, f"{n} Confidence"]
    rows = [
        [
            stamp(lp.t[i], "%d-%b-%Y %H:%M:%S"),
            num(lp.pv[i]),
            0 if i in lp.bad else 100,
            num(lp.sp[i]),
            100,
            num(lp.op[i]),
            100,
        ]
        for i in lp.rows()
    ]
    return {"phd_wide.csv": sheet(head, rows)}, three(lp, FIC)


@case("experion", why="date and time columns, dashes for bad")
def experion_trend_export():
    lp = loop("exp1", 120, 5, bad=3)
    rows = [
        [
            stamp(lp.t[i], "%m/%d/%Y"),
            stamp(lp.t[i], "%H:%M:%S"),
            "------" if i in lp.bad else num(lp.pv[i]),
            num(lp.sp[i]),
            num(lp.op[i]),
        ]
        for i in lp.rows()
    ]
    names = ["FIC101.DACA.PV", "FIC101.PIDA.SP", "FIC101.PIDA.OP"]
    return {"trend.csv": sheet(["Date", "Time", *names], rows)}, three(lp, names)


@case("deltav", why="# comment header, quoted values, mode as text")
def deltav_hash_header():
    lp = loop("dv1", 200, 1, bad=0)
    names = ["FIC1601/PID1/PV.CV", "FIC1601/PID1/SP.CV", "FIC1601/PID1/OUT.CV"]
    lines = [
        "# DeltaV Continuous Historian export",
        "# Node: APP1   Area: AREA_A",
        "# From: 11/21/2024 08:00:00  To: 11/21/2024 08:03:20",
        ",".join(f'"{x}"' for x in ["Date/Time", *names, "FIC1601/PID1/MODE.ACTUAL"]),
    ]
    for i in lp.rows():
        mode = "MAN" if 80 <= i < 90 else "AUTO"
        row = [
            stamp(lp.t[i], "%m/%d/%Y %H:%M:%S.%3f"),
            num(lp.pv[i], 4),
            num(lp.sp[i], 4),
            num(lp.op[i], 4),
            mode,
        ]
        lines.append(",".join(f'"{x}"' for x in row))
    return {"dv.csv": text(lines)}, three(lp, names, digits=4)


@case("deltav", why="Process History View: long, status words GoodNonCascade / BadDeviceFailure")
def deltav_phv_status():
    lp = loop("dv2", 150, 2, bad=5)
    names = ["FIC1601/PID1/PV.CV", "FIC1601/PID1/SP.CV", "FIC1601/PID1/OUT.CV"]
    rows = long(
        lp,
        names,
        lambda n, i, v, b: [
            n,
            stamp(lp.t[i], "%m/%d/%Y %-I:%M:%S %p"),
            num(v),
            "BadDeviceFailure" if b else ("GoodCascade" if n.endswith("SP.CV") else "GoodNonCascade"),
        ],
        by_tag=False,
    )
    return {"phv.csv": sheet(["Parameter", "Timestamp", "Value", "Status"], rows)}, three(lp, names)


@case(
    "ovation", why="Ovation historian: one time column, point names with unit/drop suffix, value and status"
)
def ovation_status_letters():
    lp = loop("ov1", 120, 5, bad=4)
    names = ["1FIC101PV.UNIT1@NET0", "1FIC101SP.UNIT1@NET0", "1FIC101OUT.UNIT1@NET0"]
    head = ["Date Time"]
    for n in names:
        head += [n, "Status"]
    rows = []
    for i in lp.rows():
        rows.append(
            [
                stamp(lp.t[i], "%m/%d/%Y %H:%M:%S.%3f"),
                num(lp.pv[i]),
                "B" if i in lp.bad else "G",
                num(lp.sp[i]),
                "G",
                num(lp.op[i]),
                "G",
            ]
        )
    return {"ovation.csv": sheet(head, rows)}, three(lp, names)
