"""Prometheus, AWS SiteWise, Azure."""

import json

from proofs.dialects.common import case, loop, num, sheet, stamp, three, truth
from proofs.dialects.historians import FIC, long


@case(
    "cloud",
    why="Prometheus query_range answer (JSON); a reader of tables only may refuse it with a clear line",
)
def prometheus_json():
    lp = loop("p1", 120, 5)
    result = [
        {
            "metric": {"__name__": n},
            "values": [[round(float(t)), num(x)] for t, x in zip(lp.t, v, strict=True)],
        }
        for n, v in (("fic101_pv", lp.pv), ("fic101_op", lp.op))
    ]
    body = {"status": "success", "data": {"resultType": "matrix", "result": result}}
    tags = {"fic101_pv": truth(lp.t, lp.pv), "fic101_op": truth(lp.t, lp.op)}
    return {"query_range.json": json.dumps(body).encode()}, tags


@case("cloud", why="AWS SiteWise bulk file: no header, alias, type, seconds, nanos, quality, value")
def sitewise_bulk():
    lp = loop("a1", 120, 5, bad=4)
    names = ["/plant/FIC101/PV", "/plant/FIC101/SP", "/plant/FIC101/OP"]
    rows = long(
        lp, names, lambda n, i, v, b: [n, "DOUBLE", round(lp.t[i]), 0, "BAD" if b else "GOOD", num(v)]
    )
    return {"bulk.csv": sheet(None, rows, eol="\n")}, three(lp, names)


@case("cloud", why="SiteWise cold tier with header; nanosecond offset apart; UNCERTAIN counted as not good")
def sitewise_header_uncertain():
    lp = loop("a2", 120, 5, bad=6)
    names = ["/plant/FIC101/PV", "/plant/FIC101/SP", "/plant/FIC101/OP"]
    lp.t = lp.t + 0.5
    doubt = lp.bad[::3]
    head = ["ALIAS", "DATA_TYPE", "TIMESTAMP_SECONDS", "TIMESTAMP_NANO_OFFSET", "QUALITY", "VALUE"]
    rows = long(
        lp,
        names,
        lambda n, i, v, b: [
            n,
            "DOUBLE",
            int(lp.t[i]),
            500000000,
            ("UNCERTAIN" if i in doubt else "BAD") if b else "GOOD",
            num(v),
        ],
    )
    return {"cold.csv": sheet(head, rows)}, three(lp, names), {"uncertain": {names[0]: doubt}}


@case("cloud", why="Azure Data Explorer: quoted, 100 ns with Z and numbers in quotes")
def azure_adx_long():
    lp = loop("z1", 120, 5)
    rows = long(
        lp,
        FIC,
        lambda n, i, v, b: [f'"{stamp(lp.t[i], "%Y-%m-%dT%H:%M:%S.%7fZ")}"', f'"{n}"', f'"{num(v)}"'],
        by_tag=False,
    )
    return {"export.csv": sheet(["timestamp", "timeSeriesId", "value"], rows)}, three(lp, FIC)
