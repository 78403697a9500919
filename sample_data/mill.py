"""The mill: which loops there are, what is wrong with each, and the two weeks they run.

Process, valve and tuning are in seconds and percent of span; only `Unit` knows engineering units.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass, fields
from datetime import UTC, datetime

import numpy as np
from physics import Floats, run, run_cascade, swing, wander

SEED = 2101
START = datetime(2026, 3, 2, tzinfo=UTC)
DAYS = 14.0
DAY_S = 86400
RETUNED_S = 7 * DAY_S + 8 * 3600  # 2026-03-09 08:00, the first of the seven retunes


@dataclass(frozen=True)
class Load:
    """What disturbs a loop, at the process input [% OP]: deviations, amplitudes, a neighbour's share."""

    slow: float = 0.3
    fast: float = 0.04
    day: float = 0.3
    sine: float = 0.0
    sine_period_s: float = 900.0
    bias: float = 0.0
    source: str = ""
    coupling: float = 0.0  # % OP per % of the source's PV span


@dataclass(frozen=True)
class Unit:
    """PV unit, range and historian's resolution [PV unit], and how the controller states its settings."""

    name: str = "%"
    lo: float = 0.0
    hi: float = 100.0
    step: float = 0.02
    gain: str = "percent"
    ti: str = "s"
    form: str = "ideal"


@dataclass(frozen=True)
class Loop:
    """One loop: process (gain, time constant, dead time), tuning (kp, ti) before and after, valve, load."""

    tag: str
    description: str
    type: str
    area: str
    cause: str
    process: tuple[float, float, float]
    tuning: tuple[float, float]
    retuned: tuple[float, float] | None = None
    backlash: float = 0.0
    stickband: float = 0.0
    slip_jump: float = 0.0
    noise: float = 0.05
    load: Load = Load()
    unit: Unit = Unit()
    sp: float = 50.0
    op: float = 50.0
    sp_move: float = 0.5
    minute: int = 0  # minutes after the first retune
    mode: bool = True
    manual: str = "never"  # never, mostly
    compressed: bool = False
    only_last_h: float = 0.0
    importance: int = 3
    master: str = ""  # the loop whose output is the set point
    ratio_of: str = ""  # the loop whose PV, times `ratio`, is the set point
    ratio: float = 0.0
    batch: float = 0.0  # how far the set point of a batch rises [% PV]


@dataclass(frozen=True)
class Trend:
    """One loop's two weeks, one value a second, in percent of span; manual is True where in manual."""

    sp: Floats
    pv: Floats
    op: Floats
    stem: Floats
    manual: np.ndarray


def _degrees(hi: float, **kw: str) -> Unit:
    """A temperature from 0 to `hi` [degC]; further words as in `Unit`."""
    return Unit("degC", 0.0, hi, 0.05, **kw)


MILL: tuple[Loop, ...] = (
    Loop("LIC2101", "Brown stock standpipe level", "level", "Washing", "backlash",
         (40.0, 1200.0, 8.0), (0.8, 100.0), (0.8, 140.0), backlash=0.8, minute=0, importance=2),
    Loop("LIC2102", "Filtrate tank level", "level", "Washing", "backlash",
         (80.0, 2000.0, 10.0), (0.8, 48.0), (0.8, 2160.0), backlash=3.0, minute=10,
         unit=Unit(gain="band", ti="min"), importance=4),
    Loop("LIC2103", "White liquor tank level", "level", "Cooking", "neighbour",
         (40.0, 1500.0, 10.0), (0.3, 400.0), (0.2, 1500.0), backlash=0.6, minute=25,
         load=Load(source="FIC2110", coupling=0.4), sp_move=0.0),
    Loop("TIC2104", "Wash water temperature", "temperature", "Washing", "backlash",
         (2.4, 600.0, 18.0), (3.6, 90.0), (3.6, 630.0), backlash=4.0, noise=0.02, minute=40,
         unit=_degrees(120.0, gain="engineering", ti="min"), sp=58.0),
    Loop("LIC2105", "Secondary condensate tank level", "level", "Evaporation", "backlash",
         (60.0, 1800.0, 9.0), (0.9, 40.0), (0.9, 2000.0), backlash=2.5, minute=55,
         unit=Unit(ti="repeats/min"), importance=4),
    Loop("TIC2106", "Cooking liquor temperature", "temperature", "Cooking", "backlash",
         (2.2, 500.0, 15.0), (4.0, 70.0), (4.0, 520.0), backlash=4.0, noise=0.02, minute=70,
         unit=_degrees(200.0, gain="band"), sp=72.0, importance=5),
    Loop("LIC2107", "Blow tank level", "level", "Cooking", "backlash",
         (50.0, 1000.0, 7.0), (0.72, 40.0), (0.72, 1100.0), backlash=3.0, minute=90,
         unit=Unit("m", 0.0, 12.0, 0.005, gain="engineering", ti="s"), importance=4),
    Loop("FIC2110", "White liquor flow to impregnation", "flow", "Cooking", "stiction",
         (1.1, 12.0, 4.0), (0.3, 50.0), stickband=6.0, slip_jump=5.0, noise=0.12,
         load=Load(0.1, 0.3, 0.1, bias=-1.5),
         unit=Unit("t/h", 0.0, 250.0, 0.1), sp_move=2.0, importance=5),
    Loop("TIC2111", "Impregnation feed temperature", "temperature", "Cooking", "neighbour",
         (1.3, 180.0, 25.0), (0.8, 200.0), load=Load(source="FIC2110", coupling=0.6),
         unit=_degrees(150.0), sp=66.0),
    Loop("PIC2112", "Evaporator steam pressure", "pressure", "Evaporation", "tuning",
         (1.2, 260.0, 40.0), (7.8, 170.0), noise=0.03, load=Load(0.6, 1.0, 0.5),
         unit=Unit("kPa", 0.0, 600.0, 0.2), sp=60.0),
    Loop("FIC2113", "Wash water flow", "flow", "Washing", "none",
         (0.9, 15.0, 4.0), (0.8, 16.0), noise=0.15, load=Load(0.8, 0.3, 0.5),
         unit=Unit("t/h", 0.0, 400.0, 0.1, gain="engineering"), sp_move=3.0, mode=False),
    Loop("PIC2114", "Wash press feed pressure", "pressure", "Washing", "none",
         (1.5, 40.0, 8.0), (1.2, 40.0), noise=0.1, load=Load(0.8, 0.3, 0.5),
         unit=Unit("kPa", 0.0, 800.0, 0.2, form="series"), sp=45.0, mode=False),
    Loop("TIC2115", "Clean condensate temperature", "temperature", "Evaporation", "none",
         (1.2, 400.0, 40.0), (2.5, 420.0), noise=0.03, load=Load(1.0, 0.3, 1.0),
         unit=_degrees(120.0, ti="min"), sp=70.0),
    Loop("PIC2116", "Low pressure steam header", "pressure", "Evaporation", "load",
         (1.4, 90.0, 10.0), (0.8, 120.0), noise=0.08,
         load=Load(0.4, 0.15, 0.5, sine=3.0, sine_period_s=840.0),
         unit=Unit("kPa", 0.0, 500.0, 0.2, ti="repeats/min"), sp=62.0, importance=4),
    Loop("FIC2117", "Dilution water flow", "flow", "Washing", "manual",
         (0.8, 20.0, 5.0), (0.6, 22.0), noise=0.12, load=Load(0.8, 0.3, 0.5), manual="mostly",
         unit=Unit("t/h", 0.0, 150.0, 0.05), importance=1),
    Loop("TIC2118", "Hot water tank temperature", "temperature", "Washing", "saturated",
         (1.1, 700.0, 30.0), (2.0, 250.0), noise=0.01, load=Load(1.5, 0.3, 4.0, bias=-18.0),
         unit=_degrees(120.0), sp=66.0, op=88.0),
    Loop("PIC2119", "Thick liquor pump pressure", "pressure", "Evaporation", "compressed",
         (1.3, 60.0, 10.0), (0.9, 60.0), noise=0.15, load=Load(0.8, 0.5, 0.5), compressed=True,
         unit=Unit("kPa", 0.0, 1000.0, 0.2)),
    Loop("FIC2120", "Spill liquor flow", "flow", "Evaporation", "short",
         (1.0, 18.0, 4.0), (0.6, 20.0), noise=0.12, only_last_h=2.5,
         unit=Unit("t/h", 0.0, 80.0, 0.02), importance=1),
    Loop("TIC2121", "Bleach tower temperature", "temperature", "Bleaching", "slave",
         (1.2, 300.0, 30.0), (1.6, 300.0), noise=0.03, load=Load(0.6, 0.1, 0.6),
         unit=_degrees(120.0), sp=62.0, op=45.0, sp_move=1.0, importance=4),
    Loop("FIC2122", "Steam flow to bleach tower", "flow", "Bleaching", "stiction",
         (1.1, 8.0, 2.0), (0.35, 14.0), stickband=5.0, slip_jump=4.0, noise=0.12, load=Load(0.3, 0.15, 0.2),
         unit=Unit("t/h", 0.0, 60.0, 0.02), sp=45.0, sp_move=0.0, master="TIC2121", importance=4),
    Loop("FIC2123", "Chlorine dioxide to pulp", "flow", "Bleaching", "none",
         (0.9, 12.0, 3.0), (0.6, 14.0), noise=0.12, load=Load(0.4, 0.2, 0.3),
         unit=Unit("m3/h", 0.0, 200.0, 0.05), sp=45.0, sp_move=0.0, ratio_of="FIC2113", ratio=0.9),
    Loop("TIC2124", "Batch digester temperature", "temperature", "Cooking", "none",
         (1.5, 500.0, 25.0), (3.0, 400.0), noise=0.03, load=Load(0.4, 0.1, 0.4),
         unit=_degrees(200.0), sp=40.0, op=30.0, sp_move=0.0, batch=30.0),
)  # fmt: skip
BATCH_S, RAMP_S, HELD_S = 5 * 3600, 3000, 7000
"""A batch, its ramp and how long it is held; in the remaining time it has the value of the start, up to a third of
an hour longer."""


def _rng(tag: str, what: int) -> np.random.Generator:
    """A generator of its own for each loop and each thing drawn, so that a shorter run begins the same."""
    return np.random.default_rng([SEED, zlib.crc32(tag.encode()), what])


def _set_point(loop: Loop, n: int) -> Floats:
    """Set point [% PV], shape (n,): once a day away from or back to `loop.sp`, at a time that varies."""
    rng, sp = _rng(loop.tag, 1), np.full(n, loop.sp)
    for day in range(int(n / DAY_S) + 1):
        at = int((day + rng.uniform(0.3, 0.8)) * DAY_S)
        sp[at:] = loop.sp + loop.sp_move * ((day + 1) % 2) * rng.choice([-1.0, 1.0])
    return sp


def _batches(loop: Loop, n: int) -> Floats:
    """What a batch adds to the set point [% PV], shape (n,): a ramp, a time at its end, and back at once."""
    rng, out = _rng(loop.tag, 8), np.zeros(n)
    for begin in np.cumsum(BATCH_S + rng.integers(0, 1200, n // BATCH_S + 1)):
        course = np.concatenate((np.linspace(0.0, 1.0, RAMP_S), np.ones(HELD_S)))[: max(n - int(begin), 0)]
        out[begin : begin + course.size] = loop.batch * course
    return out


def _load(loop: Loop, n: int, trends: dict[str, Trend]) -> Floats:
    """Load at the process input [% OP], shape (n,)."""
    rng, what = _rng(loop.tag, 2), loop.load
    clock = 2.0 * np.pi * np.arange(n) / DAY_S
    load = what.bias + what.day * np.sin(clock + rng.uniform(0.0, 2.0 * np.pi))
    load = load + wander(_rng(loop.tag, 3), n, what.slow, 6.0 * 3600.0)
    load += wander(_rng(loop.tag, 4), n, what.fast, 300.0)
    if what.sine:
        load += swing(_rng(loop.tag, 5), n, what.sine, what.sine_period_s)
    if what.source:
        source = trends[what.source]
        load += what.coupling * (source.pv - source.sp)
    return load


def _manual(loop: Loop, n: int) -> tuple[np.ndarray, Floats]:
    """Where the loop is in manual (shape (n,)), and what the operator adds to OP there [% OP], shape (n,)."""
    rng, second = _rng(loop.tag, 6), np.arange(n)
    manual, push = np.zeros(n, dtype=bool), np.zeros(n)
    if loop.manual == "mostly":
        manual[:] = (second % DAY_S < 11 * 3600) | (second % DAY_S >= 13 * 3600)
        moves = np.cumsum(rng.exponential(2.0 * 3600.0, 400)).astype(int)
        sizes, level = rng.uniform(-4.0, 4.0, 400), 0.0
        for at, goal in zip(moves[moves < n], sizes[moves < n], strict=True):
            push[at], level = goal - level, goal
    return manual, push


def simulate_loop(loop: Loop, n: int, trends: dict[str, Trend]) -> Trend:
    """Two weeks, or the first n seconds of them, of one loop; `trends` holds the loops that disturb it."""
    if loop.master:
        raise ValueError(f"{loop.tag} is simulated with its master, {loop.master}")
    sp, (manual, push) = _set_point(loop, n), _manual(loop, n)
    if loop.ratio_of:
        sp = loop.ratio * trends[loop.ratio_of].pv
    if loop.batch:
        sp = sp + _batches(loop, n)
    kp, ti = (np.full(n, setting) for setting in loop.tuning)
    if loop.retuned:
        at = RETUNED_S + 60 * loop.minute
        kp[at:], ti[at:] = loop.retuned
    noise = loop.noise * _rng(loop.tag, 7).standard_normal(n)
    static, kinetic = 0.5 * (loop.stickband + loop.slip_jump), 0.5 * (loop.stickband - loop.slip_jump)
    valve = (loop.backlash, static, kinetic)
    pv, op, stem = run(sp, _load(loop, n, trends), noise, kp, ti, push, manual, loop.op, valve, loop.process)
    return Trend(sp, pv, op, stem, manual)


def simulate_cascade(master: Loop, slave: Loop, n: int) -> dict[str, Trend]:
    """A master and its slave, by tag, from second to second."""
    pair, never = (master, slave), np.zeros(n, dtype=bool)
    sp, load = _set_point(master, n), np.stack([_load(loop, n, {}) for loop in pair])
    noise = np.stack([loop.noise * _rng(loop.tag, 7).standard_normal(n) for loop in pair])
    static, kinetic = 0.5 * (slave.stickband + slave.slip_jump), 0.5 * (slave.stickband - slave.slip_jump)
    settings, ends = np.array([loop.tuning for loop in pair]), (master.op, slave.op)
    valve = (slave.backlash, static, kinetic)
    pv, op, stem = run_cascade(sp, load, noise, settings, ends, valve, slave.process, master.process)
    of_master = Trend(sp, pv[0], op[0], pv[1], never)
    return {master.tag: of_master, slave.tag: Trend(op[0], pv[1], op[1], stem, never)}


def thin(trend: Trend, every: int) -> Trend:
    """The trend at every `every`-th second."""
    return Trend(*(getattr(trend, field.name)[::every].copy() for field in fields(trend)))


def simulate(days: float = DAYS, tags: tuple[str, ...] = (), every: int = 10) -> dict[str, Trend]:
    """The first `days` of the mill, by tag, a value each `every` seconds.

    Parameters
    ----------
    days : float
        Length [days].
    tags : tuple of str
        The loops wanted; empty for all.
    every : int
        Interval of the samples returned [s]; inside, the mill runs second by second.
    """
    chosen = [loop for loop in MILL if not tags or loop.tag in tags]
    sources = {tag for loop in chosen for tag in (loop.load.source, loop.ratio_of)} - {""}
    n, by_tag = int(days * DAY_S), {loop.tag: loop for loop in MILL}
    full = {loop.tag: simulate_loop(loop, n, {}) for loop in MILL if loop.tag in sources}
    for slave in MILL:
        if slave.master and {slave, by_tag[slave.master]} & set(chosen):
            full |= simulate_cascade(by_tag[slave.master], slave, n)
    trends = {}
    for loop in chosen:
        trend = full[loop.tag] if loop.tag in full else simulate_loop(loop, n, full)
        trends[loop.tag] = thin(trend, every)
    return trends
