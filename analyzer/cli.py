"""The command line: parse, call one function, print. Heavy packages are imported where they are needed."""

from __future__ import annotations

import math
import os
import sys
from copy import copy
from datetime import datetime
from pathlib import Path
from typing import Any

import click

from analyzer.commands import explain as explain_cli
from analyzer.commands import report as report_cli
from analyzer.commands import run as run_cli
from analyzer.commands.options import SOME_LOST, export_options, opened, told, utc_seconds

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
"""Loops run side by side, one a process, on matrices of a few columns: threads of linear algebra only get in their
way. Set before numpy is imported."""


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.version_option(package_name="loop-triage", prog_name="triage")
def main() -> None:
    """Nightly triage of PID loops: which oscillate, why, what to type in, and whether it helped.

    \b
    triage run export.parquet --loops loops.csv --store store
    triage rank store
    """


@main.command()
@export_options
@told
def check(export: tuple[Path, ...], loops: Path | None, **reading: Any) -> None:
    """What was read: loops, tags, gaps, quality, and which questions it is fit for.

    Example: triage check export.csv --loops loops.csv
    """
    from analyzer.check import lines

    source, specs, notes = opened(export, loops, **reading)
    lost = 0
    for line, bad in lines(source, specs, notes):
        lost += bad
        click.echo(line)
    sys.exit(SOME_LOST if lost else 0)


@main.command()
@click.argument("store", type=click.Path(path_type=Path))
@click.option(
    "--by", "column", default="oscillation_significance", show_default=True, help="Column to sort by."
)
@click.option("--top", type=click.IntRange(1), help="Number of loops shown.")
@click.option("--night", help="Night to show, e.g. 2026-03-08. Default: the latest.")
@click.option("--ascending", is_flag=True, help="Smallest first.")
@click.option(
    "--format",
    "form",
    type=click.Choice(["table", "csv", "json", "markdown"]),
    default="table",
    show_default=True,
    help="Output format.",
)
@told
def rank(store: Path, column: str, top: int | None, night: str | None, ascending: bool, form: str) -> None:
    """The morning list: loops of one night, the worst first.

    Example: triage rank store --top 20 --format markdown
    """
    from analyzer.rank import ranked, rendered
    from analyzer.store import Store

    rows, name = ranked(Store(store), column, top, night, ascending)
    click.echo(rendered(rows, form, name))


@main.command()
@export_options
@click.option("--loop", "tag", required=True, help="The loop to tune.")
@click.option(
    "--changes", type=click.Path(path_type=Path), help="changes.csv: when settings were changed, old and new."
)
@click.option("--until", type=click.DateTime(), help="Day or time (UTC) before which samples are used.")
@click.option("--out", type=click.Path(path_type=Path), help="Directory for the pictures.")
@told
def tune(
    export: tuple[Path, ...],
    loops: Path | None,
    tag: str,
    changes: Path | None,
    until: datetime | None,
    out: Path | None,
    **reading: Any,
) -> None:
    """One loop: model, limit cycle predicted, new Kp and Ti with reasons, forecast, travel map.

    Example: triage tune export.parquet --loops loops.csv --loop LIC2107 --out pictures
    """
    from analyzer.loops.changes import read_changes
    from analyzer.tune_loop import proposal

    source, specs, _ = opened(export, loops, **reading)
    dated = () if changes is None else read_changes(changes)
    lines, pictures = proposal(source, specs, tag, utc_seconds(until, math.inf), out is not None, dated)
    for line in lines:
        click.echo(line)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        for name, picture in pictures.items():
            (out / name).write_bytes(picture)
            click.echo(f"written: {out / name}")


def registered(command: click.Command) -> click.Command:
    """A command of another module with errors told as here."""
    own = copy(command)
    if command.callback is not None:
        own.callback = told(command.callback)
    return own


for page_command in (run_cli.run, *report_cli.COMMANDS):
    main.add_command(registered(page_command))
for model_command in explain_cli.main.commands.values():
    main.add_command(model_command)


if __name__ == "__main__":
    main()
