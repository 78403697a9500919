"""What all commands share: how errors are told, how exports are named and read."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from identification.errors import TriageError

if TYPE_CHECKING:
    from analyzer.history.export import Export
    from analyzer.loops.spec import LoopSpec

NOTHING_DONE = 2
SOME_LOST = 1


def told(command: Callable[..., Any]) -> Callable[..., Any]:
    """Errors that are ours, or the system's, as one line on stderr and exit status 2."""

    @wraps(command)
    def wrapped(*args: Any, **kwargs: Any) -> Any:
        try:
            with warnings.catch_warnings():
                if not sys.warnoptions:
                    warnings.simplefilter("ignore")  # a library's warning says nothing to an engineer
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


def utc_seconds(at: datetime | None, otherwise: float) -> float:
    """A day or time of the command line as UTC [s since 1970-01-01]."""
    return otherwise if at is None else at.replace(tzinfo=UTC).timestamp()


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
        click.option("--time-column", help="Name of the column of stamps. Default: detected."),
        click.option(
            "--quality-column", help="Name of a long export's column of quality codes. Default: detected."
        ),
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
    from analyzer.loops.spec import unknown_columns
    from analyzer.loops.tags import find_loops, match, read_loops

    reading["good_quality"] = tuple(reading.get("good_quality") or ()) or None
    source = open_export(list(export), ReadOptions(**reading))
    if loops is None:
        return source, find_loops(source.tags), ()
    stated = read_loops(loops)
    specs, notes = match(stated, source.tags)
    own = unknown_columns(stated)
    if own:
        notes = (
            f"{loops}: columns {', '.join(own)} mean nothing here and are kept as the plant's own",
            *notes,
        )
    return source, specs, notes
