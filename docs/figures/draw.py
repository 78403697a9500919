"""Draws the source study's Figures 1, 3, 4, 5, 6 and 7 from this project's own computation.

    python docs/figures/draw.py [FOLDER]

writes figure-1.png and so on next to this file, or into FOLDER.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from PIL import Image

from identification.models import Backlash, Fopdt, Loop, Pid, Stiction
from identification.simulation.closed_loop import closed_loop
from proofs.valve_loops import largest_cycling_ratio
from tuning.harmonic_balance import TravelMap, curves, travel_map
from tuning.limit_cycle import confirm

LEVEL = Loop(Fopdt(80, 200, 1), Pid(1.0, 10.0), Backlash(1.0))
FLOW = Loop(Fopdt(1, 2, 1), Pid(0.8, 2.0), Backlash(1.0))
BLUE, GREEN, RED, REST = "#1f5fa8", "#2f8f4e", "#c0392b", "#bfe3c6"
DPI = 110


def continuous(loop: Loop) -> Loop:
    """The loop with the continuous controller that the study's describing functions take."""
    return replace(loop, controller=replace(loop.controller, scan_s=0.0))


def figure_1() -> Figure:
    """The level loop with backlash at Kp 1 and at half of it, from rest through a load step."""
    fig, axes = plt.subplots(2, 1, figsize=(7.5, 4.6), sharex=True, layout="constrained")
    steps = 400
    load = np.where(np.arange(steps) < 20, 0.0, 0.5)
    for kp, color in ((1.0, BLUE), (0.5, GREEN)):
        loop = replace(LEVEL, controller=Pid(kp, 10.0))
        r = closed_loop(loop, np.full(steps, 50.0), load)
        c = confirm(loop).cycle
        label = (
            f"Kp {kp:g}: period {c.period_s:.0f} s, amplitude {c.pv_amplitude:.2f} %" if c else f"Kp {kp:g}"
        )
        axes[0].plot(r.time_s, r.pv, color=color, label=label)
        axes[1].plot(r.time_s, r.op, color=color)
        axes[1].plot(r.time_s, r.position, color=color, linewidth=0.9, linestyle=":")
    axes[0].axhline(50, color="0.5", linewidth=0.7)
    axes[0].set(ylabel="PV [%]", title="Level loop (K 80, T 200 s, L 1 s) with 1 % play, Ti 10 s, scan 1 s")
    axes[0].set_ylim(48.6, 51.9)
    axes[0].legend(loc="upper right", fontsize=8, ncols=2)
    axes[1].set(ylabel="OP, stem (dotted) [%]", xlabel="time [s]", xlim=(0, steps))
    return fig


def figure_3() -> Figure:
    """N(A) of backlash against -1/(G C) of the level loop, with the intersection."""
    c = curves(continuous(LEVEL))
    crossing = next(b for b in c.crossings if b.stable)
    fig, ax = plt.subplots(figsize=(6.2, 4.6), layout="constrained")
    ax.plot(c.valve.real, c.valve.imag, color=BLUE, label="N(A), play")
    ax.plot(c.linear.real, c.linear.imag, color=RED, label="−1/(G$_P$ G$_{PI}$)")
    at = np.interp(2 * np.pi / crossing.period_s, c.omega, c.linear)
    ax.plot(at.real, at.imag, "o", color="black")
    ax.annotate(
        f"A = {crossing.op_amplitude:.3f} % OP, P = {crossing.period_s:.1f} s\n"
        f"PV amplitude {crossing.pv_amplitude:.3f} %",
        (at.real, at.imag),
        xytext=(0.36, -0.14),
        arrowprops={"arrowstyle": "-", "color": "0.4"},
        fontsize=9,
    )
    for a in (0.55, 0.75, 1.0, 2.0, 5.0):
        n = np.interp(a, c.amplitude, c.valve)
        ax.plot(n.real, n.imag, ".", color=BLUE)
        ax.annotate(f"A {a:g}", (n.real, n.imag), xytext=(4, -10), textcoords="offset points", fontsize=7)
    ax.set(xlim=(-0.05, 1.05), ylim=(-0.5, 0.05), xlabel="real part [-]", ylabel="imaginary part [-]")
    ax.set_title("Play of 1 % in the level loop: the curves meet at the limit cycle")
    ax.legend(loc="lower right", fontsize=9)
    return fig


def draw_map(ax: Axes, m: TravelMap, nominal: Pid, title: str, share: float = 0.97) -> None:
    """Travel in white to red, rest in green; a cross at the nominal tuning; the scale ends at a quantile."""
    travel = np.where(m.travel > 0, m.travel, np.nan)
    top = float(np.nanquantile(travel, share))
    mesh = ax.pcolormesh(m.kp, m.ti_s, travel, cmap="Reds", vmin=0, vmax=top, shading="nearest")
    ax.figure.colorbar(mesh, ax=ax, label="valve travel: OP amplitude / period [% OP / s]", extend="max")
    marks = []
    for mask, color, name in (
        (m.at_rest, REST, "no limit cycle"),
        (m.unstable, "0.55", "unstable without the valve's fault"),
    ):
        if mask.any():
            shade = np.where(mask, 1.0, np.nan)
            ax.pcolormesh(
                m.kp, m.ti_s, shade, cmap=matplotlib.colors.ListedColormap([color]), shading="nearest"
            )
            marks.append(Patch(color=color, label=name))
    (cross,) = ax.plot(nominal.kp, nominal.ti_s, "x", color="black", label="nominal tuning", markersize=8)
    ax.set(xlabel="Kp [% OP / % PV]", ylabel="Ti [s]", title=title)
    ax.legend(handles=[*marks, cross], loc="upper right", fontsize=8)


def map_figure(
    loop: Loop, kp: tuple[float, float], ti: tuple[float, float], title: str, share: float = 0.97
) -> Figure:
    """One travel map of the harmonic balance with a continuous controller."""
    m = travel_map(continuous(loop), np.linspace(*kp, 160), np.linspace(*ti, 160))
    fig, ax = plt.subplots(figsize=(6.8, 4.6), layout="constrained")
    draw_map(ax, m, loop.controller, title, share)
    return fig


def figure_4() -> Figure:
    """Travel of the flow loop with backlash."""
    return map_figure(FLOW, (0.2, 1.6), (0.3, 4.0), "Flow loop (T/L 2) with 1 % play", 0.85)


def figure_5() -> Figure:
    """Travel of the level loop with backlash."""
    return map_figure(LEVEL, (0.3, 1.8), (5.0, 220.0), "Level loop (T/L 200) with 1 % play")


def figure_6() -> Figure:
    """Largest Ti/T at which a loop with backlash still cycles, over T/L, for three gains."""
    ratios = np.geomspace(2, 500, 25)
    fig, ax = plt.subplots(figsize=(6.4, 4.4), layout="constrained")
    for share, color in ((0.5, GREEN), (1.0, BLUE), (1.5, RED)):
        limit = [largest_cycling_ratio(Fopdt(1.0, r, 1.0), share) for r in ratios]
        ax.plot(ratios, limit, color=color, marker=".", label=f"Kp {share:g} × nominal")
    ax.plot(
        ratios, np.minimum(10.0 / ratios, 1.0), color="0.4", linestyle="--", label="Ti of the nominal tuning"
    )
    ax.axhline(1.0, color="black", linewidth=0.8)
    ax.annotate("Ti = T: no cycle above", (60, 1.02), fontsize=8)
    ax.set(xscale="log", xlabel="T/L [-]", ylabel="Ti/T [-]", ylim=(0, 1.1), xlim=(2, 500))
    ax.set_xticks([2, 5, 10, 20, 50, 100, 200, 500], [2, 5, 10, 20, 50, 100, 200, 500])
    ax.set_title("Longest integral time at which a loop with backlash still cycles")
    ax.legend(fontsize=8, loc="lower center")
    return fig


def figure_7() -> Figure:
    """Travel of the flow loop with stick-slip: no rest anywhere."""
    loop = replace(FLOW, valve=Stiction(1.0, 1.0))
    kp, ti = np.linspace(0.1, 1.6, 46), np.linspace(0.5, 6.0, 46)
    return simulated_map(loop, kp, ti, "Flow loop (T/L 2) with stick-slip, S = J = 1 %, as simulated")


def simulated_map(loop: Loop, kp: np.ndarray, ti: np.ndarray, title: str) -> Figure:
    """Travel as simulated, cell by cell."""
    m = travel_map(continuous(loop), kp, ti)
    cycles = [[confirm(continuous(replace(loop, controller=Pid(k, t)))).cycle for k in kp] for t in ti]
    travel = np.array([[c.op_amplitude / c.period_s if c else 0.0 for c in row] for row in cycles])
    fig, ax = plt.subplots(figsize=(6.8, 4.6), layout="constrained")
    draw_map(ax, replace(m, travel=np.where(m.unstable, 0.0, travel)), loop.controller, title)
    return fig


FIGURES: dict[str, Callable[[], Figure]] = {
    "figure-1": figure_1,
    "figure-3": figure_3,
    "figure-4": figure_4,
    "figure-5": figure_5,
    "figure-6": figure_6,
    "figure-7": figure_7,
}


def main(folder: Path) -> None:
    """Draw all figures into a folder."""
    for name, draw in FIGURES.items():
        fig = draw()
        sheet = BytesIO()
        fig.savefig(sheet, dpi=DPI)
        plt.close(fig)
        few = Image.open(sheet).convert("RGB").quantize(96, dither=Image.Dither.NONE)
        few.save(folder / f"{name}.png", optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
