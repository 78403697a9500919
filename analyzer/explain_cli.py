"""The commands `explain` and `simulate`: parse, call, print."""

from __future__ import annotations

import base64
import html
import io
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from analyzer.options import NOTHING_DONE, export_options, opened, told


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
def main() -> None:
    """What physics a loop's plain model lacks, and the model carried to another recording."""


def _case(export: tuple[Path, ...], loops: Path | None, tag: str, reading: dict[str, Any]) -> Any:
    from analyzer.config import Config
    from analyzer.explain import case, loop_of

    source, specs, _ = opened(export, loops, **reading)
    spec = loop_of(specs, tag)
    if spec.pv is None:
        from identification.errors import InputError

        raise InputError(f"{tag}: no PV tag in the export", f"{tag}.PV", "check --loops and the export")
    others = [s.op for s in specs if s.loop != tag and s.op][:8]
    series = source.read(list(dict.fromkeys([*spec.tags, *others])))
    return case(spec, specs, series, Config()), series[spec.pv]


@main.command()
@export_options
@click.option("--loop", "tag", required=True, help="Loop to explain.")
@click.option(
    "--model", type=click.Path(path_type=Path), help="A saved model to start from and to be judged."
)
@click.option("--save-model", type=click.Path(path_type=Path), help="Write the model found, for `simulate`.")
@click.option(
    "--format",
    "form",
    type=click.Choice(["text", "json", "html", "markdown"]),
    default="text",
    show_default=True,
    help="Output format.",
)
@told
def explain(
    export: tuple[Path, ...],
    loops: Path | None,
    tag: str,
    model: Path | None,
    save_model: Path | None,
    form: str,
    **reading: Any,
) -> None:
    """Where recording and plain simulation differ, which physics was left out, and how much it explains.

    Example: triage explain export.parquet --loops loops.csv --loop FIC101
    """
    from analyzer.explain import abstained, explained, read_model, write_model
    from identification.errors import NotAssessedError

    try:
        case, _ = _case(export, loops, tag, reading)
        brought = read_model(model, tag) if model is not None else None
        answer, found = explained(case, _told_rival, brought)
    except NotAssessedError as error:
        click.echo(rendered(abstained(tag, str(error)), form))
        click.echo(f"triage: {error}", err=True)
        sys.exit(NOTHING_DONE)
    if save_model is not None:
        write_model(found, save_model)
    click.echo(rendered(answer, form, lambda: picture(case, found)))


@main.command()
@click.argument("model", type=click.Path(path_type=Path))
@export_options
@click.option("--loop", "tag", required=True, help="Loop to simulate.")
@click.option(
    "--out", required=True, type=click.Path(path_type=Path), help="Parquet file: timestamp, PV, OP."
)
@click.option(
    "--closed-loop", is_flag=True, help="Run the stated controller from SP instead of the recorded OP."
)
@told
def simulate(
    model: Path,
    export: tuple[Path, ...],
    loops: Path | None,
    tag: str,
    out: Path,
    closed_loop: bool,
    **reading: Any,
) -> None:
    """Run a saved model over another recording of its loop; a constant bias is freed, nothing else.

    Example: triage simulate model.json week2.parquet --loops loops.csv --loop FIC101 --out week2-sim.parquet
    """
    from analyzer.explain import read_model, simulated

    case, raw = _case(export, loops, tag, reading)
    pv, op = simulated(case, read_model(model, tag), raw.stamp_s, closed_loop)
    write_trends(out, raw.stamp_s, pv, op)


def _told_rival(name: str) -> None:
    """Show on a terminal what is being tried."""
    if sys.stderr.isatty():
        click.echo(f"\r\033[Ktrying {name}", nl=False, err=True)


def write_trends(out: Path, stamps: Any, pv: Any, op: Any) -> None:
    """Write columns timestamp, PV and OP."""
    import pandas as pd

    stamp = pd.to_datetime((stamps * 1e6).round().astype("int64"), unit="us")
    pd.DataFrame({"timestamp": stamp, "PV": pv, "OP": op}).to_parquet(out, index=False)


def _shown(x: dict[str, Any]) -> str:
    low, high = (f"{x[k]:.3g}" if x[k] is not None else "?" for k in ("low", "high"))
    return f"{x['value']:.4g} ({low} to {high}) {x['unit']}".strip()


def lines(said: dict[str, Any]) -> list[str]:
    """The answer as lines of text."""
    out = [f"{said['loop']}: {said['verdict']} ({said['block']})", said["reason"]]
    for effect in said["effects"]:
        out.append(f"- {effect['name']} ({effect['block']})")
        out += [f"  - {name}: {_shown(value)}" for name, value in effect["parameters"].items()]
        if effect["held_out_share"] is not None:
            out.append(f"  - removes {100 * effect['held_out_share']:.0f} % of the misfit on held-out spans")
        if effect["alternatives"]:
            out.append(f"  - could also be: {', '.join(effect['alternatives'])}")
    for name, part in said["fit"].items():
        fitted, held = part["fitted"], part["held_out"]
        out.append(f"- {name}: rms misfit {fitted['rmse']:.3g} % fitted, {held['rmse']:.3g} % held out")
    out += [f"- {name} moved from {a:.4g} to {b:.4g}" for name, (a, b) in said["moved"].items()]
    return out


def rendered(said: dict[str, Any], form: str, draw: Callable[[], str] | None = None) -> str:
    """The answer in one of the formats; `draw` gives a picture (base64 PNG) where pages want one."""
    if form == "json":
        return json.dumps(said)
    if form == "text":
        return "\n".join(lines(said))
    if form == "markdown":
        head, reason, *rest = lines(said)
        return "\n".join([f"# {head}", "", reason, "", *rest])
    body = "".join(f"<p>{html.escape(line)}</p>\n" for line in lines(said))
    image = f'<img alt="trends" src="data:image/png;base64,{draw()}">' if draw is not None else ""
    title = html.escape(said["loop"])
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{title}</title>\n{body}{image}</html>'
    )


def picture(case: Any, model: dict[str, Any]) -> str:
    """Recording and simulation above their difference, as a base64 PNG."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    from analyzer.explain import simulated

    r = case.prepared.record
    stamps = r.start_s + r.time_s
    pv, _ = simulated(case, model, stamps, False)
    fig, (above, below) = plt.subplots(2, 1, sharex=True, figsize=(11, 6), layout="constrained")
    own = case.prepared.scale.low + r.pv * case.prepared.scale.span / 100.0
    above.plot(r.time_s, own, lw=0.8, label="recorded")
    above.plot(r.time_s, pv, lw=0.8, label="model")
    below.plot(r.time_s, own - pv, lw=0.8)
    above.set_ylabel("PV")
    below.set(ylabel="difference", xlabel="time [s]")
    above.legend(frameon=False)
    buffer = io.BytesIO()
    fig.savefig(buffer, dpi=90)
    plt.close(fig)
    return base64.b64encode(buffer.getvalue()).decode()


if __name__ == "__main__":
    main()
