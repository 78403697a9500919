"""Text, tables and the figure of the results on sealed cases."""

import pathlib
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import beta

from proofs.concealed.grade import LEVELS

ABSTAINED = ("none", "unexplained", "no answer")


def interval(hits: int, of: int, level: float = 0.95) -> tuple[float, float]:
    """Exact interval of a share (Clopper, Pearson 1934)."""
    tail = (1.0 - level) / 2.0
    low = float(beta.ppf(tail, hits, of - hits + 1)) if hits else 0.0
    high = float(beta.ppf(1 - tail, hits + 1, of - hits)) if hits < of else 1.0
    return low, high


def share(hits: pd.Series) -> str:
    """`7 of 8, 88 % (47–100)`; a dash without cases."""
    n, k = len(hits), int(hits.sum())
    if n == 0:
        return "–"
    low, high = interval(k, n)
    return f"{k} of {n}, {100 * k / n:.0f} % ({100 * low:.0f}–{100 * high:.0f})"


def table(head: list[str], rows: list[list]) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines)


def by_level(rows: pd.DataFrame) -> str:
    """Right names and blocks, and misfit recovered, per level."""
    head = [
        "level",
        "information: name",
        "with indistinguishable effects",
        "size: name",
        "block",
        "misfit recovered",
    ]
    info, size = rows[rows.group == "information"], rows[rows.group == "size"]
    some = rows[rows.group.isin(["information", "size"])]
    lines: list[list] = []
    for lv in LEVELS:
        back = some[some.level == lv].recovered.dropna()
        shown = f"{back.median():.2f} ({len(back)})" if len(back) else "–"
        i, s = info[info.level == lv], size[size.level == lv]
        lines.append(
            [
                lv,
                share(i.strict),
                share(i.lenient),
                share(s.strict),
                share(some[some.level == lv].block),
                shown,
            ]
        )
    return table(head, lines)


def mistakes(rows: pd.DataFrame) -> str:
    """False alarms, wrong names and pairs."""
    none, outside, pair = (rows[rows.group == g] for g in ("none", "outside", "pair"))
    single = rows[rows.group.isin(["information", "size"])]
    due = rows[rows.group.isin(["none", "outside"])]
    named = ~due.verdict.isin(ABSTAINED)
    wrong = ~single.lenient & ~single.verdict.isin(ABSTAINED)
    return table(
        ["what", "share (95 %)"],
        [
            ["false alarms: anything but `none` where nothing is hidden", share(none.verdict != "none")],
            ["a name where `none` or `unexplained` was due", share(named)],
            ["a name for physics outside the catalogue", share(~outside.verdict.isin(ABSTAINED))],
            ["`unexplained` for physics outside the catalogue", share(outside.verdict == "unexplained")],
            ["a wrong name for an effect of the catalogue", share(wrong)],
            ["one of a pair named", share(pair.strict)],
            ["both of a pair named", share(pair.both)],
        ],
    )


def oddities(rows: pd.DataFrame) -> str:
    """False alarms by harmless oddity."""
    none = rows[rows.group == "none"]
    return table(
        ["oddity", "false alarms"], [[o, share(g.verdict != "none")] for o, g in none.groupby("oddity")]
    )


def confusion(rows: pd.DataFrame) -> str:
    """The names given to each effect, single effects of all levels, most frequent first."""
    lines: list[list] = []
    for effect, g in rows[rows.group != "pair"].groupby("effect"):
        counts = g.verdict.value_counts()
        per = [f"{int(g[g.level == lv].lenient.sum())}/{int((g.level == lv).sum())}" for lv in LEVELS]
        lines.append([effect, *per, ", ".join(f"{v} {k}" for v, k in counts.items())])
    return table(["effect", *LEVELS, "called"], lines)


def parameter_table(params: pd.DataFrame) -> str:
    """Errors and interval coverage of the parameters that occur in truth and answer."""
    if params.empty:
        return "No answer shares a parameter with its truth."
    lines: list[list] = []
    for (effect, name), g in params.groupby(["effect", "parameter"]):
        inside = g.inside.dropna().astype(bool)
        middle, worst = 100 * g.error.abs().median(), 100 * g.error.abs().max()
        lines.append([effect, name, len(g), f"{middle:.0f} %", f"{worst:.0f} %", share(inside)])
    lines.append(
        [
            "all",
            "",
            len(params),
            f"{100 * params.error.abs().median():.0f} %",
            "",
            share(params.inside.dropna().astype(bool)),
        ]
    )
    return table(["effect", "parameter", "cases", "median error", "largest", "truth within interval"], lines)


def baseline_loops(rows: pd.DataFrame) -> str:
    """Errors of the baseline model's constants where there is no effect, or only a load."""
    lines: list[list] = []
    groups = {"nothing hidden": "none", "load step": "load-step", "load oscillation": "load-oscillation"}
    for title, effect in groups.items():
        g = rows[(rows.effect == effect) & (rows.group != "pair")]
        if len(g) == 0 or "K_error" not in g:
            continue
        errors = [g[f"{k}_error"].abs() for k in "KTL"]
        shown = [f"{100 * e.median():.1f} %, {share(e < 0.05)}" for e in errors]
        lines.append([title, *shown])
    head = ["hidden", "gain", "time constant", "dead time"]
    return table(head, lines) if lines else "No model was saved."


def section(rows: pd.DataFrame, params: pd.DataFrame, picture: str | None) -> str:
    """The section of PROOF.md."""
    time = rows.seconds.dropna()
    speed = f" One case took {time.median():.1f} s (largest {time.max():.1f} s)." if len(time) else ""
    parts = [
        "## Sealed cases",
        f"{len(rows)} cases; the truths were opened after the last answer.{speed}",
        by_level(rows),
        mistakes(rows),
        f"![Power against strength]({picture})" if picture else "",
        "### By effect\nRight answers per level (indistinguishable effects count), and every name given.",
        confusion(rows),
        "### Harmless oddities",
        oddities(rows),
        "### Parameters",
        parameter_table(params),
        "### The baseline model\nMedian error, and saved models within 5 %. Set points move under load.",
        baseline_loops(rows),
    ]
    return "\n\n".join(p for p in parts if p) + "\n"


def place(proof: pathlib.Path, text: str) -> None:
    """Put the section of the sealed cases into the file, in place of an older one; the rest of the file is
    unchanged."""
    place_section(proof, "concealed", text)


def place_section(proof: pathlib.Path, name: str, text: str) -> None:
    """Put a named section into the file, in place of an older one; the rest of the file is unchanged."""
    begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
    old = proof.read_text() if proof.exists() else "# Proof\n\n"
    block = f"{begin}\n{text}{end}\n"
    if begin in old and end in old:
        head, rest = old.split(begin, 1)
        proof.write_text(head + block + rest.split(end, 1)[1].lstrip("\n"))
    else:
        proof.write_text(old.rstrip("\n") + "\n\n" + block)


def draw(rows: pd.DataFrame, picture: pathlib.Path) -> None:
    """Power against strength: pooled with intervals, and every case by effect."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    info = rows[rows.group == "information"]
    fig, (left, right) = plt.subplots(1, 2, figsize=(12, 7), width_ratios=[1, 2], layout="constrained")
    pooled(left, info)
    strips(right, info)
    fig.savefig(picture, dpi=110)
    plt.close(fig)


def pooled(ax: Any, info: pd.DataFrame) -> None:
    """Share of right names per level with exact intervals."""
    for column, colour, shift in (("strict", "tab:blue", 0.97), ("lenient", "tab:green", 1.03)):
        for level, energy in LEVELS.items():
            g = info[info.level == level][column]
            if len(g):
                low, high = interval(int(g.sum()), len(g))
                ax.plot([energy * shift] * 2, [low, high], color=colour, lw=1)
                ax.plot(
                    energy * shift, g.mean(), "o", color=colour, label=column if level == "plain" else None
                )
    ax.set(
        xscale="log",
        ylim=(-0.02, 1.02),
        xlabel="information (doubled log-likelihood gain)",
        ylabel="right names",
    )
    ax.legend(frameon=False)


def strips(ax: Any, info: pd.DataFrame) -> None:
    """Every case: its information, and whether the name was right, indistinguishable, withheld or wrong."""
    names = sorted(info.effect.unique(), reverse=True)
    withheld = info.verdict.isin(ABSTAINED)
    looks = {
        "right": (info.strict, "o", "tab:blue"),
        "kin or alternative": (info.lenient & ~info.strict, "o", "tab:green"),
        "withheld": (~info.lenient & withheld, "|", "tab:gray"),
        "wrong": (~info.lenient & ~withheld, "x", "tab:red"),
    }
    for label, (which, marker, colour) in looks.items():
        g = info[which]
        ax.plot(g.energy, [names.index(e) for e in g.effect], marker, color=colour, ls="", label=label)
    ax.set(xscale="log", xlabel="information (doubled log-likelihood gain)", yticks=np.arange(len(names)))
    ax.set_yticklabels(names)
    ax.legend(frameon=False, ncols=4, loc="lower center", bbox_to_anchor=(0.5, 1.0))
