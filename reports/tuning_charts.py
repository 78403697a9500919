"""Pictures of a tuning proposal, from plain arrays: describing functions, travel over the Kp-Ti plane, forecast."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

NOW, NEW, STEM, RESTS = "#1f5fa8", "#2f8f4e", "#b5651d", "#bfe3c6"


@dataclass(frozen=True, slots=True)
class CurvesPicture:
    """N(A) and -1/(G C) in the complex plane, shape (m,) and (k,); crossings, shape (c,), with their labels."""

    valve: Complexes
    linear: Complexes
    crossings: Complexes
    labels: Sequence[str]


@dataclass(frozen=True, slots=True)
class MapPicture:
    """Travel [% OP/h], shape (m, n), over ti_s [s] (m,) and kp (n,); rests and unstable, bool, shape (m, n).

    now and new : (kp, ti_s) of both tunings, new None where none is proposed.
    """

    kp: Floats
    ti_s: Floats
    travel: Floats
    rests: NDArray[np.bool_]
    unstable: NDArray[np.bool_]
    now: tuple[float, float]
    new: tuple[float, float] | None


@dataclass(frozen=True, slots=True)
class ForecastPicture:
    """PV, OP and stem [%] under both tunings on one load, each of shape (n,), over hours, shape (n,)."""

    hours: Floats
    pv: tuple[Floats, Floats]
    op: tuple[Floats, Floats]
    stem: tuple[Floats, Floats]


def png(figure: Figure) -> bytes:
    """A figure as PNG."""
    out = BytesIO()
    figure.savefig(out, format="png", dpi=110)
    return out.getvalue()


def curves(picture: CurvesPicture, title: str) -> bytes:
    """Where the describing function meets the loop: a limit cycle."""
    figure = Figure(figsize=(6.4, 4.8), layout="constrained")
    ax: Axes = figure.subplots()
    ax.plot(picture.valve.real, picture.valve.imag, color=STEM, label="valve N(A)")
    reach = 1.4 * float(np.abs(picture.valve).max(initial=1.0))
    inside = np.abs(picture.linear) < 3 * reach
    ax.plot(picture.linear.real[inside], picture.linear.imag[inside], color=NOW, label="−1/(G C)")
    for at, text in zip(picture.crossings, picture.labels, strict=True):
        ax.plot(at.real, at.imag, "o", color="black", markersize=5)
        ax.annotate(text, (at.real, at.imag), textcoords="offset points", xytext=(8, -12), fontsize=8)
    ax.axhline(0, color="0.7", linewidth=0.6)
    ax.axvline(0, color="0.7", linewidth=0.6)
    ax.set(
        xlim=(-0.3 * reach, reach),
        ylim=(-0.8 * reach, 0.25 * reach),
        xlabel="real",
        ylabel="imaginary",
        title=title,
    )
    ax.legend(fontsize=8, loc="lower left")
    return png(figure)


def travel_map(picture: MapPicture, title: str) -> bytes:
    """Valve travel of each pair of settings; green where the loop comes to rest, red where it is unstable."""
    figure = Figure(figsize=(6.4, 4.8), layout="constrained")
    ax: Axes = figure.subplots()
    shown = np.where(picture.travel > 0, picture.travel, np.nan)
    cycling = picture.travel[picture.travel > 0]
    low, high = np.quantile(cycling, [0.02, 0.98]) if cycling.size else (1.0, 10.0)
    norm = LogNorm(max(low, 1e-6), max(high, 2 * low, 1e-5))
    mesh = ax.pcolormesh(picture.kp, picture.ti_s, shown, cmap="YlOrBr", shading="nearest", norm=norm)
    for mask, colour in ((picture.rests, RESTS), (picture.unstable, "#c0392b")):
        area = np.where(mask, 1.0, np.nan)
        ax.pcolormesh(picture.kp, picture.ti_s, area, cmap=_one(colour), shading="nearest")
    ax.plot(*picture.now, "o", color=NOW, label="now")
    if picture.new is not None:
        ax.plot(*picture.new, "*", color=NEW, markersize=13, label="proposed")
    ax.set(xscale="log", yscale="log", xlabel="Kp [%/%]", ylabel="Ti [s]", title=title)
    figure.colorbar(mesh, ax=ax, label="predicted OP amplitude / period [%/h]")
    ax.legend(fontsize=8)
    return png(figure)


def _one(colour: str) -> ListedColormap:
    return ListedColormap([colour])


def forecast(picture: ForecastPicture, title: str) -> bytes:
    """Both tunings on the same reconstructed load."""
    figure = Figure(figsize=(9.0, 4.8), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    for k, (name, colour) in enumerate((("now", NOW), ("proposed", NEW))):
        upper.plot(picture.hours, picture.pv[k], color=colour, linewidth=0.9, label=name)
        lower.plot(picture.hours, picture.op[k], color=colour, linewidth=0.9, label=f"OP, {name}")
        lower.plot(
            picture.hours, picture.stem[k], color=colour, linewidth=0.9, linestyle=":", label=f"stem, {name}"
        )
    upper.set(ylabel="PV − SP [%]", title=title)
    lower.set(ylabel="OP, stem [%]", xlabel="hours")
    upper.legend(fontsize=8, ncols=2)
    lower.legend(fontsize=8, ncols=4)
    return png(figure)
