"""Parts that all dialects share: simulated samples with known truth, and the list of cases."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from zoneinfo import ZoneInfo

import numpy as np

CASES: list[Case] = []
EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


@dataclass
class Case:
    """One export: its files (relative to the case's folder) and the contents that a reader must find."""

    name: str
    family: str
    files: dict[str, bytes]
    tags: dict[str, dict]
    kind: str = "plain"
    why: str = ""
    options: dict = field(default_factory=dict)
    aliases: dict = field(default_factory=dict)
    uncertain: dict = field(default_factory=dict)


def case(family, kind="plain", why="", options=None, name=None):
    """Register what the function returns: (files, tags) or (files, tags, {extra fields})."""

    def wrap(fn):
        files, tags, *rest = fn()
        extra = rest[0] if rest else {}
        label = name or fn.__name__
        assert all(c.name != label for c in CASES), label
        assert kind in ("plain", "unknowable", "refuse")
        CASES.append(Case(label, family, files, tags, kind, why, dict(options or {}), **extra))
        return fn

    return wrap


@dataclass
class Loop:
    """Samples of one PI loop. t: epoch seconds; bad: indexes of samples that are not good."""

    t: np.ndarray
    pv: np.ndarray
    sp: np.ndarray
    op: np.ndarray
    bad: list[int]

    def __len__(self):
        return len(self.t)

    def rows(self):
        return range(len(self.t))


def at(text, tz=UTC):
    """Epoch seconds of an ISO local time."""
    zone = ZoneInfo(tz) if isinstance(tz, str) else tz
    return datetime.fromisoformat(text).replace(tzinfo=zone).timestamp()


def loop(seed, n=120, dt=5.0, start="2024-11-21 08:00:00", tz=UTC, bad=0, jitter=0.0):
    """A first-order process under PI control, setpoint steps, noise: PV 40-60, OP 20-80."""
    rng = np.random.default_rng(zlib.crc32(str(seed).encode()))
    first = start if isinstance(start, (int, float)) else at(start, tz)
    t = first + np.arange(n) * dt
    if jitter:
        t = t + np.round(rng.uniform(0, jitter * dt, n), 3)
    levels = 50 + rng.choice([-4.0, -2.0, 2.0, 4.0], 8).cumsum() * 0.6
    sp = np.clip(levels[np.minimum(np.arange(n) // max(20, n // 4), 7)], 44, 56)
    pv, op = np.empty(n), np.empty(n)
    x, integral = sp[0] - 1.0, 0.0
    for i in range(n):
        pv[i] = x + rng.normal(0, 0.12)
        e = sp[i] - pv[i]
        integral += 0.05 * e
        op[i] = np.clip(50 + 1.5 * (sp[i] - 50) + 1.2 * e + integral, 20, 80)
        x += 0.12 * (50 + 0.66 * (op[i] - 50) - x)
    picks = sorted(int(i) for i in rng.choice(np.arange(3, n - 3), bad, replace=False)) if bad else []
    return Loop(t, pv, sp, op, picks)


def num(x, digits=2):
    return f"{x:.{digits}f}"


def comma(x, digits=2):
    return num(x, digits).replace(".", ",")


def truth(t, v, bad=(), digits=2):
    """Truth of one tag: the values as printed with `digits` digits, None where the sample is not good."""
    bad = set(bad)
    times = [round(float(x), 6) for x in t]
    times = [int(x) if x == int(x) else x for x in times]
    return {"t": times, "v": [None if i in bad else float(num(x, digits)) for i, x in enumerate(v)]}


def three(lp, names, bad=("pv",), digits=2):
    """Truth of PV, SP, OP under three names with common stamps; `bad` names those with the bad samples."""
    return {
        name: truth(lp.t, getattr(lp, key), lp.bad if key in bad else (), digits)
        for name, key in zip(names, ("pv", "sp", "op"), strict=False)
    }


def stamp(t, fmt="%Y-%m-%d %H:%M:%S", tz=UTC, months=None):
    """Format an epoch time. %3f, %1f, %6f, %7f, %9f: digits of the second; `months`: names for %b."""
    zone = ZoneInfo(tz) if isinstance(tz, str) else tz
    micro = round(t * 1e6)
    d = (EPOCH + timedelta(microseconds=micro)).astimezone(zone)
    for k in (1, 2, 3, 5, 6, 7, 9):
        fmt = fmt.replace(f"%{k}f", f"{d.microsecond:06d}000"[:k])
    if months:
        fmt = fmt.replace("%b", months[d.month - 1])
    return d.strftime(fmt)


def excel(t, digits=10):
    """Excel serial of a UTC epoch time."""
    return f"{t / 86400 + 25569:.{digits}f}"


def text(lines, enc="utf-8", eol="\r\n", last=True):
    body = eol.join(lines) + (eol if last else "")
    return body.encode(enc)


def sheet(header, rows, sep=",", **kw):
    """A delimited text from a header (list or list of lists) and rows."""
    heads = header if header and isinstance(header[0], list) else ([header] if header else [])
    return text([sep.join(map(str, r)) for r in [*heads, *rows]], **kw)


def wide(lp, names, fmt="%Y-%m-%d %H:%M:%S", sep=",", show=num, tz=UTC, badtext=None, time="Time", **kw):
    """One time column and PV, SP, OP columns; badtext replaces the PV of bad samples."""
    rows = []
    for i in lp.rows():
        vals = [show(getattr(lp, k)[i]) for k in ("pv", "sp", "op")[: len(names)]]
        if badtext is not None and i in lp.bad:
            vals[0] = badtext
        rows.append([stamp(lp.t[i], fmt, tz), *vals])
    return sheet([time, *names], rows, sep, **kw)
