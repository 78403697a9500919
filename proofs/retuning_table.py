"""Tables and figure of the proof of the advice, from its outcomes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from proofs.retuning_outcome import ERROR_MOST, Outcome

KINDS = ("backlash", "stiction", "tight", "load", "healthy")
COLOURS = {"backlash": "#1f5fa8", "stiction": "#b5651d"}


def _cut(values: Sequence[float]) -> str:
    return f"{100 * (1 - float(np.mean(values))):.0f}" if values else ""


def _ratios(found: Sequence[Outcome], name: str) -> list[float]:
    """Remaining share of the stem travel under other settings than the proposed [-]."""
    return [getattr(o, name).travel / max(o.old.travel, 1e-9) for o in found if getattr(o, name) is not None]


def groups(found: Sequence[Outcome]) -> str:
    """A Markdown table with a row for each kind of loop."""
    lines = [
        "| loops | number | new settings | stem travel cut % | of those with settings | error better |"
        " worst error % | rule, true T % | rule, identified T % | everything known % |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for kind in KINDS:
        mine = [o for o in found if o.rig.kind == kind]
        tuned = [o for o in mine if o.new is not None]
        worst = 100 * (max((o.error for o in tuned), default=1.0) - 1)
        better = sum(o.error < 1 for o in tuned)
        cells = (
            [_cut([o.travel for o in some]) for some in (mine, tuned)]
            + [f"{better} of {len(tuned)}", f"{worst:+.0f}"]
            if tuned
            else [""] * 4
        )
        others = [_cut(_ratios(mine, n)) if tuned else "" for n in ("rule", "rule_found", "known")]
        lines.append(f"| {kind} | {len(mine)} | {len(tuned)} | {' | '.join(cells + others)} |")
    return "\n".join(lines)


def rejections(found: Sequence[Outcome]) -> str:
    """Load-step rejection of all proposals: median and largest factors."""
    tuned = [o for o in found if o.new is not None]
    ramps = [o.integral for o in tuned if o.rig.lag == 0]
    lags = [o.integral for o in tuned if o.rig.lag > 0]
    rows = {
        "largest deviation": [o.peak for o in tuned],
        "integral, lags": lags,
        "integral, levels": ramps,
    }
    body = [f"| {n} | {np.median(v):.2f} | {max(v):.2f} |" for n, v in rows.items() if v]
    return "\n".join(["| after a load step | median factor | largest |", "|---|---|---|", *body])


def each(found: Sequence[Outcome]) -> str:
    """A line for each loop with a fault."""
    lines = [
        "| loop | fault % OP | T over delay | cause | Kp, Ti | new | travel left % | error % | peak | integral |"
        " fails in |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    return "\n".join(lines + [_line(o) for o in found if o.rig.kind in ("backlash", "stiction", "tight")])


def _line(o: Outcome) -> str:
    r = o.rig
    now = f"{r.kp:.3g}, {r.ti:.3g}"
    new = f"{o.new[0]:.3g}, {o.new[1]:.3g}" if o.new else f"{o.row['action']}"
    ratio = f"{r.lag / r.delay:.0f}" if r.lag > 0 else "level"
    tail = ["", "", "", "", ""]
    if o.new:
        change = f"{100 * (o.error - 1):+.0f}"
        tail = [f"{100 * o.travel:.0f}", change, f"{o.peak:.2f}", f"{o.integral:.2f}", ", ".join(o.failures)]
    cells = [r.name.lower(), f"{r.width:.2g}", ratio, o.row["cause"] or "", now, new, *tail]
    return f"| {' | '.join(cells)} |"


def failures(found: Sequence[Outcome]) -> str:
    """How many proposals violate each requirement."""
    tuned = [o for o in found if o.new is not None]
    names = ("unstable", "error", "sleepy (peak)", "sleepy (integral)")
    counts = [f"{n} {sum(n in o.failures for o in tuned)}" for n in names]
    return f"Of {len(tuned)} proposals: {', '.join(counts)}; error counts from {100 * (ERROR_MOST - 1):.0f} % more."


def draw(found: Sequence[Outcome], path: Path) -> None:
    """Remaining travel against error, for the proposals and for the rule."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.6, 4.4), layout="constrained")
    axes = figure.subplots(1, 2, sharex=True, sharey=True)
    for ax, title, name in zip(
        axes, ("proposed", "rule: Ti = max(Ti, T), true T"), ("after", "rule"), strict=True
    ):
        for kind, colour in COLOURS.items():
            mine = [o for o in found if o.rig.kind == kind]
            x = [100 * getattr(o, name).travel / max(o.old.travel, 1e-9) for o in mine]
            y = [100 * getattr(o, name).error / max(o.old.error, 1e-9) for o in mine]
            ax.plot(x, y, "o", color=colour, alpha=0.7, label=kind)
        ax.axhline(100, color="0.6", linewidth=0.8)
        ax.axvline(100, color="0.6", linewidth=0.8)
        ax.set(title=title, xlabel="stem travel left [%]")
        ax.spines[["top", "right"]].set_visible(False)
    axes[0].set_ylabel("average absolute error left [%]")
    axes[0].legend(frameon=False)
    figure.savefig(path, dpi=110)
