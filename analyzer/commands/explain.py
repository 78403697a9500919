"""The commands `explain` and `simulate`: parse, call, print."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from analyzer.commands.options import NOTHING_DONE, PLACE, export_options, say
from identification.errors import NotAssessedError

if TYPE_CHECKING:
    from analyzer.explain.explained import Explained
    from analyzer.night.asked import Asked


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
def main() -> None:
    """What physics a loop's plain model lacks, and the model carried to another recording."""


@main.command()
@export_options
@click.option("--loop", "tag", required=True, help="Loop to explain.")
@click.option(
    "--model", type=click.Path(path_type=Path), help="Your own saved model: judged beside the refitted one."
)
@click.option(
    "--held-out",
    multiple=True,
    type=PLACE,
    help="Another recording of the loop, on which the explanation is proven; may be given again.",
)
@click.option("--save-model", type=click.Path(path_type=Path), help="Write the model found, for `simulate`.")
@click.option(
    "--format",
    "form",
    type=click.Choice(["text", "json", "html", "markdown"]),
    default="text",
    show_default=True,
    help="Output format; html is one file that needs no network.",
)
@click.option("--out", type=click.Path(path_type=Path), help="Folder for the page and Markdown's pictures.")
def explain(
    asked: Asked,
    tag: str,
    model: Path | None,
    held_out: tuple[Path, ...],
    save_model: Path | None,
    form: str,
    out: Path | None,
) -> None:
    """Where recording and plain simulation differ, which physics was left out, and how much it explains.

    Example: triage explain export.parquet --loops loops.csv --loop FIC101
    """
    from analyzer.explain.explained import abstained, explained
    from analyzer.explain.models import read_model, write_model
    from analyzer.explain.recordings import cases

    tell = _Candidates()
    try:
        brought = read_model(model, tag) if model is not None else None
        case, others = cases(asked, tag, held_out)
        found = explained(case, tell, brought, others)
    except NotAssessedError as error:
        _show(abstained(tag, str(error)), None, form, out, asked.zone)
        click.echo(f"triage: {error}", err=True)
        sys.exit(NOTHING_DONE)
    finally:
        tell("")
    if save_model is not None:
        write_model(found.model(), save_model)
    _show(found.data, found, form, out, asked.zone)


def _show(data: dict[str, Any], found: Explained | None, form: str, out: Path | None, zone: str) -> None:
    """Print the answer in a format, or write its page into a folder."""
    if form == "json":
        click.echo(json.dumps(data))
    elif form == "text":
        from analyzer.explain.text import lines

        say("\n".join(lines(data)))
    else:
        _show_page(data, found, form, out, zone)


def _show_page(data: dict[str, Any], found: Explained | None, form: str, out: Path | None, zone: str) -> None:
    from analyzer.explain import page as pages
    from reports import folder, html, markdown

    page = pages.abstention(data) if found is None else pages.page(found, zone)
    if out is None:
        click.echo(html.render(page, True) if form == "html" else markdown.render(page, ""))
        return
    written = folder.write_html([page], out, True) if form == "html" else folder.write_markdown([page], out)
    for path in written:
        click.echo(f"written: {path}", err=True)


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
def simulate(
    model: Path,
    asked: Asked,
    tag: str,
    out: Path,
    closed_loop: bool,
) -> None:
    """Run a saved model over another recording of its loop; a constant bias is freed, nothing else.

    Example: triage simulate model.json week2.parquet --loops loops.csv --loop FIC101 --out week2-sim.parquet
    """
    from analyzer.explain.models import read_model, simulated
    from analyzer.explain.recordings import whole

    case, raw = whole(asked, tag)
    pv, op = simulated(case, read_model(model, tag), raw.stamp_s, closed_loop)
    write_trends(out, raw.stamp_s, pv, op)


QUIET_S = 5.0
"""Seconds between two lines on what is being tried, where nobody looks at a terminal [s]."""


class _Candidates:
    """Tells what is being tried: in a line that wipes itself out on a terminal, in one now and then elsewhere."""

    def __init__(self) -> None:
        self.begun = self.said = time.monotonic()
        if not sys.stderr.isatty():
            click.echo("explain: reading the export, fitting the plain loop", err=True)

    def __call__(self, name: str) -> None:
        if sys.stderr.isatty():
            click.echo(f"\r\033[K{f'trying {name}' if name else ''}", nl=False, err=True)
        elif name and time.monotonic() - self.said >= QUIET_S:
            self.said = time.monotonic()
            click.echo(f"explain: {self.said - self.begun:.0f} s, trying {name}", err=True)


def write_trends(out: Path, stamps: Any, pv: Any, op: Any) -> None:
    """Write columns timestamp, PV and OP."""
    import pandas as pd

    stamp = pd.to_datetime((stamps * 1e6).round().astype("int64"), unit="us")
    pd.DataFrame({"timestamp": stamp, "PV": pv, "OP": op}).to_parquet(out, index=False)


if __name__ == "__main__":
    main()
