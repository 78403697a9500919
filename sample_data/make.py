"""Write the sample mill: `python sample_data/make.py`.

mill.parquet, loops.csv, changes.csv, mill-day.csv and truth.json, the same bytes of data at every run.
"""

from __future__ import annotations

import json
from datetime import timedelta
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from historian import compressed, grid, reported
from mill import MILL, RETUNED_S, SEED, START, Loop, Trend, simulate
from scipy.signal import welch

HERE = Path(__file__).parent
INTERVAL_S = 10
OP_STEP = 0.05  # historian's resolution of OP [%]
DOOR_PCT = 0.6  # half-width of the swinging door of the compressed loop [% of span]
DAY_LOOPS = ("LIC2102", "TIC2104", "LIC2107", "FIC2110", "TIC2115", "PIC2116")
CYCLING = ("backlash", "stiction", "tuning", "load", "neighbour", "slave")
DAY, DAY_EVERY = 2, 3  # the third day, every third sample: 30 s


def columns(loop: Loop, trend: Trend, interval_s: int = INTERVAL_S) -> dict[str, np.ndarray]:
    """One loop's columns as the historian holds them, in engineering units; NaN where it holds nothing."""
    unit, lo = loop.unit, loop.unit.lo
    span = unit.hi - lo
    sp, pv = (lo + span * x / 100.0 for x in (trend.sp, trend.pv))
    if loop.compressed:
        pv = compressed(pv, DOOR_PCT * span / 100.0, unit.step / 5.0)
        op = compressed(trend.op, DOOR_PCT, OP_STEP / 10.0)
    else:
        pv, op = reported(pv, unit.step), reported(trend.op, OP_STEP)
    out = {"SP": grid(sp, unit.step), "PV": pv, "OP": op}
    if loop.only_last_h:
        for values in out.values():
            values[: values.size - int(loop.only_last_h * 3600 / interval_s)] = np.nan
    if loop.mode:
        out["MODE"] = np.where(trend.manual, "MAN", "AUTO").astype(object)
        out["MODE"][np.isnan(out["PV"])] = None
    return {f"{loop.tag}.{name}": values for name, values in out.items()}


def export(trends: dict[str, Trend]) -> pd.DataFrame:
    """The historian's wide export: timestamp (UTC), then TAG.SP, TAG.PV, TAG.OP and, if any, TAG.MODE."""
    n = next(iter(trends.values())).pv.size
    table = {"timestamp": pd.date_range(START, periods=n, freq=f"{INTERVAL_S}s", unit="ms")}
    for loop in MILL:
        if loop.tag in trends:
            table |= columns(loop, trends[loop.tag])
    return pd.DataFrame(table)


def write_parquet(table: pd.DataFrame, path: Path) -> None:
    """Write the wide export small: dictionaries for the few values there are, deltas for the clock."""
    pq.write_table(
        pa.Table.from_pandas(table, preserve_index=False).replace_schema_metadata(None),
        path,
        compression="zstd",
        compression_level=19,
        use_dictionary=[name for name in table.columns if name != "timestamp"],
        column_encoding={"timestamp": "DELTA_BINARY_PACKED"},
        row_group_size=len(table),
        dictionary_pagesize_limit=1 << 20,
        data_page_size=1 << 22,
    )


def stated(loop: Loop, tuning: tuple[float, float]) -> tuple[float, float]:
    """The settings (kp, ti) in the units the loop's controller uses."""
    kp, ti = tuning
    gain = {"percent": kp, "engineering": kp * 100.0 / (loop.unit.hi - loop.unit.lo), "band": 100.0 / kp}
    time = {"s": ti, "min": ti / 60.0, "repeats/min": 60.0 / ti}
    return float(f"{gain[loop.unit.gain]:.4g}"), float(f"{time[loop.unit.ti]:.4g}")


def loops_table() -> pd.DataFrame:
    """loops.csv: one row per loop, with the settings in force at the start."""
    rows = []
    for loop in MILL:
        unit, (kp, ti) = loop.unit, stated(loop, loop.tuning)
        tags = {name: f"{loop.tag}.{name.upper()}" for name in ("sp", "pv", "op")}
        rows.append(
            {"loop": loop.tag, "description": loop.description, "type": loop.type, "area": loop.area}
            | tags
            | {"mode": f"{loop.tag}.MODE" if loop.mode else ""}
            | {"pv_lo": unit.lo, "pv_hi": unit.hi, "op_lo": 0.0, "op_hi": 100.0, "pv_unit": unit.name}
            | {"kp": kp, "ti": ti, "td": 0.0, "form": unit.form, "gain_unit": unit.gain, "ti_unit": unit.ti}
            | {"scan_s": 1.0, "importance": loop.importance}
        )
    return pd.DataFrame(rows)


def changes_table() -> pd.DataFrame:
    """changes.csv: the seven retunes, in the controllers' units."""
    rows = []
    for loop in (loop for loop in MILL if loop.retuned):
        at = START + timedelta(seconds=RETUNED_S + 60 * loop.minute)
        (kp_old, ti_old), (kp_new, ti_new) = stated(loop, loop.tuning), stated(loop, loop.retuned)
        rows.append((loop.tag, f"{at:%Y-%m-%dT%H:%M:%SZ}", kp_old, ti_old, kp_new, ti_new, "M. Laine"))
    return pd.DataFrame(rows, columns=["loop", "time", "kp_old", "ti_old", "kp_new", "ti_new", "who"])


def period(trend: Trend) -> float:
    """Period of the strongest cycle before the retunes [s], from the spectrum of the error."""
    error = (trend.sp - trend.pv)[: RETUNED_S // INTERVAL_S]
    frequency, power = welch(error, 1.0 / INTERVAL_S, nperseg=8192)
    fast = frequency > 1.0 / 3600.0
    return float(np.round(1.0 / frequency[fast][np.argmax(power[fast])], -1))


def truth(trends: dict[str, Trend]) -> dict[str, dict]:
    """What was simulated, by tag, in seconds and percent of span."""
    names = ("gain", "time_constant_s", "dead_time_s")
    slaves = {loop.master: loop.tag for loop in MILL if loop.master}
    out = {}
    for loop in MILL:
        out[loop.tag] = {
            "cause": loop.cause,
            "period_s": period(trends[loop.tag]) if loop.cause in CYCLING else None,
            "source_loop": loop.load.source or slaves.get(loop.tag),
            "master": loop.master or None,
            "ratio_of": loop.ratio_of or None,
            "process": dict(zip(names, loop.process, strict=True)),
            "valve": {"backlash": loop.backlash, "stickband": loop.stickband, "slip_jump": loop.slip_jump},
            "before": {"kp": loop.tuning[0], "ti_s": loop.tuning[1]},
            "after": {"kp": loop.retuned[0], "ti_s": loop.retuned[1]} if loop.retuned else None,
            "noise": loop.noise,
        }
    return out


def _spoil(cells: np.ndarray, rng: np.random.Generator) -> None:
    """Put texts and blanks among the numbers of an export, in place; shape (rows, tags)."""
    rows, tags = cells.shape
    for text, times in (("Bad Input", 25), ("I/O Timeout", 15), ("", 120)):
        cells[rng.integers(0, rows, times), rng.integers(0, tags, times)] = text
    first, tag = int(rng.integers(0, rows - 20)), int(rng.integers(0, tags))
    cells[first : first + 12, tag] = "I/O Timeout"


def write_day(table: pd.DataFrame, path: Path) -> None:
    """One day of six loops with a real export's warts: comma decimals, newest first, texts, a gap."""
    rng, per_day = np.random.default_rng([SEED, DAY]), 86400 // INTERVAL_S
    day = table.iloc[DAY * per_day : (DAY + 1) * per_day : DAY_EVERY]
    names = [name for name in table.columns if name.split(".")[0] in DAY_LOOPS]
    cells = np.empty((len(day), len(names)), dtype=object)
    for k, name in enumerate(names):
        values = day[name]
        cells[:, k] = values if name.endswith("MODE") else [f"{v:.10g}".replace(".", ",") for v in values]
    _spoil(cells, rng)
    stamps = day["timestamp"].dt.strftime("%d.%m.%Y %H:%M:%S")
    lines = [";".join([stamp, *row]) for stamp, row in zip(stamps, cells, strict=True)]
    lines = lines[:1580] + lines[1630:]  # 25 minutes in which nothing was logged
    for at in sorted(rng.integers(0, len(lines), 20), reverse=True):
        lines.insert(at, lines[at])
    text = "\r\n".join([";".join(["Timestamp", *names]), *reversed(lines)]) + "\r\n"
    path.write_bytes(text.encode("utf-8-sig"))


def main() -> None:
    """Simulate the two weeks and write every file."""
    trends = simulate(every=INTERVAL_S)
    table = export(trends)
    write_parquet(table, HERE / "mill.parquet")
    write_day(table, HERE / "mill-day.csv")
    loops_table().to_csv(HERE / "loops.csv", index=False)
    changes_table().to_csv(HERE / "changes.csv", index=False)
    (HERE / "truth.json").write_text(json.dumps(truth(trends), indent=1) + "\n")


if __name__ == "__main__":
    main()
