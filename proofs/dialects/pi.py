"""OSIsoft / AVEVA PI: DataLink, Web API, SMT, piconfig."""

import json

import numpy as np

from proofs.dialects.common import case, comma, excel, loop, num, sheet, stamp, three, truth, wide

TAGS = ["FIC101.PV", "FIC101.SP", "FIC101.OP"]


def clocks(seed, start="2024-11-21 08:00:00", bad=3, n=(150, 90, 120), tags=TAGS):
    """Three tags with separate stamps: {tag: (t, v, bad)}."""
    out = {}
    for k, (tag, rows, dt, key) in enumerate(zip(tags, n, (3.0, 7.0, 5.0), ("pv", "sp", "op"), strict=True)):
        lp = loop(f"{seed}{k}", rows, dt, start, bad=bad if k == 0 else 0)
        out[tag] = (lp.t + k, getattr(lp, key), lp.bad)
    return out


def pairs(data, show_time, sep=",", heads=None, gap=False, errors=("Bad",), show=num, **kw):
    """Columns time, value per tag; shorter columns end in blanks."""
    depth = max(len(t) for t, _, _ in data.values())
    rows = []
    for i in range(depth):
        row = []
        for t, v, bad in data.values():
            if i >= len(t):
                row += ["", ""]
            else:
                row += [show_time(t[i]), errors[bad.index(i) % len(errors)] if i in bad else show(v[i])]
            row += [""] if gap else []
        rows.append(row[:-1] if gap else row)
    return sheet(heads, rows, sep, **kw)


def heads_over(data, first=True, gap=False):
    row = []
    for tag in data:
        row += ([tag, ""] if first else ["", tag]) + ([""] if gap else [])
    return row[:-1] if gap else row


def truths_of(data):
    return {tag: truth(*d) for tag, d in data.items()}


def english(t):
    return stamp(t, "%d-%b-%y %H:%M:%S")


@case("pi", why="pairs, tag over the time column, Excel serials, ragged ends")
def pi_datalink_serial():
    d = clocks("pi1")
    return {
        "datalink.csv": pairs(d, excel, heads=heads_over(d), errors=("I/O Timeout", "Bad Input"))
    }, truths_of(d)


@case("pi", why="pairs, tag over the value column, 21-Nov-24 08:00:00")
def pi_datalink_text():
    d = clocks("pi2")
    return {"datalink.csv": pairs(d, english, heads=heads_over(d, False), errors=("No Data",))}, truths_of(d)


@case("pi", why="tag, descriptor and units rows before Time/Value header")
def pi_datalink_descriptor_units():
    d = clocks("pi3")
    heads = [
        heads_over(d),
        ["Feed flow to C-101", "", "Feed flow setpoint", "", "Feed valve", ""],
        ["m3/h", "", "m3/h", "", "%", ""],
        ["Time", "Value"] * 3,
    ]
    return {"feed.csv": pairs(d, english, heads=heads, errors=("Scan Off", "Pt Created"))}, truths_of(d)


@case("pi", why="one time column, sampled data, calculation errors as text")
def pi_datalink_sampled_errors():
    lp = loop("pi4", 180, 10, bad=6)
    body = wide(lp, TAGS, "%d-%b-%y %H:%M:%S", badtext="[-11059] No Good Data For Calculation", time="")
    return {"sampled.csv": body}, three(lp, TAGS)


@case("pi", why="empty column between pairs; #N/A and Calc Failed")
def pi_datalink_gap_column():
    d = clocks("pi5", bad=5)
    body = pairs(d, english, heads=heads_over(d, gap=True), gap=True, errors=("#N/A", "Calc Failed"))
    return {"datalink.csv": body}, truths_of(d)


@case("pi", why="German Excel: semicolon, decimal comma, dotted dates")
def pi_datalink_german_excel():
    d = clocks("pi6", tags=["20FIC101.PV", "20FIC101.SP", "20FIC101.OUT"])
    body = pairs(
        d,
        lambda t: stamp(t, "%d.%m.%Y %H:%M:%S"),
        ";",
        heads_over(d, False),
        errors=("Bad Input",),
        show=comma,
        enc="cp1252",
    )
    return {"datalink.csv": body}, truths_of(d)


@case("pi", why="the array was too small: last row says so")
def pi_datalink_resize():
    d = clocks("pi7", n=(120, 120, 120))
    body = pairs(d, english, heads=heads_over(d), errors=("I/O Timeout",))
    return {"datalink.csv": body + b"Resize to show all values,,Resize to show all values,,,\r\n"}, truths_of(
        d
    )


@case("pi", why="states No Data, Pt Created, Scan Off before the first value, 1.#QNAN inside")
def pi_datalink_states_at_start():
    lp = loop("pi8", 140, 6)
    bad = [0, 1, 2, 60, 61]
    words = dict(zip(bad, ["Pt Created", "No Data", "Scan Off", "1.#QNAN", "1.#QNAN"], strict=True))
    rows = [[english(lp.t[i]), words.get(i, num(lp.pv[i])), num(lp.sp[i]), num(lp.op[i])] for i in lp.rows()]
    tags = three(lp, TAGS, ())
    tags[TAGS[0]] = truth(lp.t, lp.pv, bad)
    return {"states.csv": sheet(["Timestamp", *TAGS], rows)}, tags


@case("pi", why="US Excel: 11/21/2024 8:00:00 AM, mixed with errors")
def pi_datalink_us():
    lp = loop("pi9", 200, 2, "2024-11-21 11:57:00", bad=4)
    body = wide(lp, TAGS, "%-m/%-d/%Y %-I:%M:%S %p", badtext="Bad Input")
    return {"us.csv": body}, three(lp, TAGS)


@case("pi", why="serials shown with five decimals (0.864 s steps): truth is what the file says")
def pi_datalink_serial_short():
    lp = loop("pi10", 100, 10, bad=2)
    rows = [
        [excel(lp.t[i], 5), "#N/A" if i in lp.bad else num(lp.pv[i]), num(lp.sp[i]), num(lp.op[i])]
        for i in lp.rows()
    ]
    lp.t = np.array([round((float(r[0]) - 25569) * 86400, 3) for r in rows])
    return {"sampled.csv": sheet(["Date/Time", *TAGS], rows)}, three(lp, TAGS)


@case("pi", why="two tags only, value column labelled with full PI path")
def pi_datalink_server_path():
    tags = [r"\\PISRV01\FIC101.PV", r"\\PISRV01\FIC101.SP", r"\\PISRV01\FIC101.OP"]
    d = clocks("pi11", tags=tags)
    body = pairs(d, english, "\t", heads_over(d), errors=("I/O Timeout",))
    alias = {t: [t.rsplit("\\", 1)[1]] for t in tags}
    return {"datalink.txt": body}, truths_of(d), {"aliases": alias}


def web_rows(d):
    rows = []
    for tag, (t, v, bad) in d.items():
        for i in range(len(t)):
            rows.append((tag, stamp(t[i], "%Y-%m-%dT%H:%M:%S.%7fZ"), v[i], i not in bad))
    return rows


@case("pi", why="flattened Web API stream sets: Good true/false, 100 ns stamps")
def pi_webapi_csv():
    d = clocks("pi12")
    head = [
        "Name",
        "Timestamp",
        "UnitsAbbreviation",
        "Good",
        "Questionable",
        "Substituted",
        "Annotated",
        "Value",
    ]
    rows = [
        [n, t, "m3/h", g, False, False, False, num(v) if g else "I/O Timeout"] for n, t, v, g in web_rows(d)
    ]
    return {"streams.csv": sheet(head, rows, eol="\n")}, truths_of(d)


@case("pi", why="Web API answer as saved (JSON); a reader of tables only may refuse it with a clear line")
def pi_webapi_json():
    d = clocks("pi13")
    items = {tag: [] for tag in d}
    for n, t, v, g in web_rows(d):
        value = round(float(v), 2) if g else {"Name": "I/O Timeout", "Value": 246, "IsSystem": True}
        items[n].append(
            {"Timestamp": t, "Value": value, "UnitsAbbreviation": "", "Good": g, "Questionable": False}
        )
    body = {
        "Links": {},
        "Items": [{"WebId": f"F1Ab{i}", "Name": n, "Items": x} for i, (n, x) in enumerate(items.items())],
    }
    return {"recorded.json": json.dumps(body, indent=1).encode()}, truths_of(d)


@case("pi", why="archive editor copy, one file per tag, the tag is the file name")
def pi_smt_archive_editor():
    d = clocks("pi14")
    files = {}
    for tag, (t, v, bad) in d.items():
        rows = [
            [stamp(t[i], "%d-%b-%y %H:%M:%S.%3f"), "Bad" if i in bad else num(v[i]), "", "", ""]
            for i in range(len(t))
        ]
        files[f"{tag}.txt"] = sheet(
            ["Timestamp", "Value", "Questionable", "Annotated", "Substituted"], rows, "\t"
        )
    return files, truths_of(d)


@case("pi", why="piconfig output: tag,time,value without a header")
def pi_piconfig_no_header():
    d = clocks("pi15")
    rows = []
    for tag, (t, v, bad) in d.items():
        rows += [
            [tag, stamp(t[i], "%d-%b-%y %H:%M:%S.%5f"), "Bad Input" if i in bad else num(v[i])]
            for i in range(len(t))
        ]
    return {"piarc.txt": sheet(None, rows, eol="\n")}, truths_of(d)


@case("pi", why="PI Vision table: newest first, questionable column stays empty")
def pi_vision_newest_first():
    lp = loop("pi16", 120, 5, bad=2)
    names = ["Unit1|FIC101|PV", "Unit1|FIC101|SP", "Unit1|FIC101|OP"]
    lines = wide(lp, names, "%-m/%-d/%Y %-I:%M:%S %p", badtext="Bad").decode().split("\r\n")
    body = "\r\n".join([lines[0], *lines[-2:0:-1], ""])
    return {"vision.csv": ("\ufeff" + body).encode()}, three(lp, names)
