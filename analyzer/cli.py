"""The command line: parse, call one function, print. Heavy packages are imported where they are needed."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from copy import copy
from datetime import UTC, datetime
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from analyzer.report_cli import COMMANDS
from identification.errors import TriageError

if TYPE_CHECKING:
    from analyzer.history.export import Export
    from analyzer.history.loops_csv import LoopSpec

NOTHING_DONE = 2
SOME_LOST = 1


def told(command: Callable[..., Any]) -> Callable[..., Any]:
    """Errors that are ours, or the system's, as one line on stderr and exit status 2."""

    @wraps(command)
    def wrapped(*args: Any, **kwargs: Any) -> Any:
        try:
            return command(*args, **kwargs)
        except TriageError as error:
            click.echo(f"triage: {error}", err=True)
        except BrokenPipeError:
            sys.stderr.close()
        except OSError as error:
            click.echo(
                f"triage: {error.filename or ''}: {error.strerror}; check path and permissions", err=True
            )
        sys.exit(NOTHING_DONE)

    return wrapped


def export_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """EXPORT..., --loops and how to read text exports."""
    options = [
        click.argument("export", nargs=-1, required=True, type=click.Path(path_type=Path)),
        click.option(
            "--loops", type=click.Path(path_type=Path), help="loops.csv; without it loops are found by tags."
        ),
        click.option(
            "--timezone", help="Time zone of stamps without one, e.g. Europe/Helsinki. Default UTC."
        ),
        click.option("--delimiter", help="Delimiter of text exports. Default: detected."),
        click.option("--decimal", type=click.Choice([".", ","]), help="Decimal mark. Default: detected."),
        click.option("--encoding", help="Encoding of text exports. Default: detected."),
        click.option("--day-first/--month-first", default=None, help="Order in dates such as 03/04/2026."),
        click.option("--date-format", help="Format of the stamps, e.g. '%d-%b-%y %H:%M:%S'."),
        click.option(
            "--good-quality", multiple=True, help="Quality code or text that means good; may be repeated."
        ),
    ]
    for option in reversed(options):
        command = option(command)
    return command


def opened(
    export: Sequence[Path], loops: Path | None, **reading: Any
) -> tuple[Export, tuple[LoopSpec, ...], tuple[str, ...]]:
    """The export, its loops with their tags, and what there is to say about them."""
    from analyzer.history.export import ReadOptions, open_export
    from analyzer.tags import find_loops, match, read_loops

    reading["good_quality"] = tuple(reading.get("good_quality") or ()) or None
    source = open_export(list(export), ReadOptions(**reading))
    if loops is None:
        return source, find_loops(source.tags), ()
    specs, notes = match(read_loops(loops), source.tags)
    return source, specs, notes


def _seconds(at: datetime | None, otherwise: float) -> float:
    return otherwise if at is None else at.replace(tzinfo=UTC).timestamp()


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
@export_options
@click.option(
    "--store", required=True, type=click.Path(path_type=Path), help="Directory that keeps the results."
)
@click.option("--jobs", default=1, show_default=True, type=click.IntRange(1), help="Worker processes.")
@click.option("--resume", is_flag=True, help="Go on with a run that was stopped.")
@click.option("--since", type=click.DateTime(), help="First day or time assessed (UTC).")
@click.option("--until", type=click.DateTime(), help="Day or time (UTC) before which samples are assessed.")
@told
def run(
    export: tuple[Path, ...],
    loops: Path | None,
    store: Path,
    jobs: int,
    resume: bool,
    since: datetime | None,
    until: datetime | None,
    **reading: Any,
) -> None:
    """The nightly batch: assess every loop and keep the results in a store.

    An export of several days is kept day by day; new settings are advised on for the last of them.

    Example: triage run export.parquet --loops loops.csv --store store --jobs 4
    """
    from analyzer import batch
    from analyzer.config import Config
    from analyzer.progress import bar
    from analyzer.store import Store

    source, specs, notes = opened(export, loops, **reading)
    for note in notes:
        click.echo(f"triage: {note}", err=True)
    with bar("loops") as progress:
        span = _seconds(since, -math.inf), _seconds(until, math.inf)
        nights, lost = batch.run(source, specs, Store(store), Config(), jobs, resume, *span, progress)
    for loop, reason in lost:
        click.echo(f"{loop}: {reason}", err=True)
    last = nights[-1].name
    more = f" ({len(nights)} nights from {nights[0].name})" if len(nights) > 1 else ""
    click.echo(
        f"{len(specs) - len(lost)} of {len(specs)} loops assessed, night {last}{more}, in {store}", err=True
    )
    if len(lost) == len(specs):
        sys.exit(NOTHING_DONE)
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
@click.option("--until", type=click.DateTime(), help="Day or time (UTC) before which samples are used.")
@click.option("--out", type=click.Path(path_type=Path), help="Directory for the pictures.")
@told
def tune(
    export: tuple[Path, ...],
    loops: Path | None,
    tag: str,
    until: datetime | None,
    out: Path | None,
    **reading: Any,
) -> None:
    """One loop: model, limit cycle predicted, new Kp and Ti with reasons, forecast, travel map.

    Example: triage tune export.parquet --loops loops.csv --loop LIC2107 --out pictures
    """
    from analyzer.tune_loop import proposal

    source, specs, _ = opened(export, loops, **reading)
    lines, pictures = proposal(source, specs, tag, _seconds(until, math.inf), drawn=out is not None)
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


for page_command in COMMANDS:
    main.add_command(registered(page_command))


if __name__ == "__main__":
    main()
