"""What all commands share: how errors are told, how exports are named and read."""

from __future__ import annotations

import math
import sys
import warnings
from collections.abc import Callable, Mapping
from datetime import datetime
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from analyzer.history.plant_clock import seconds, zone_of
from analyzer.places import place, refused
from identification.errors import InputError, TriageError
from reports.texts import visible, visible_lines
from reports.whole_file import is_full

if TYPE_CHECKING:
    from analyzer.night.asked import Asked


class Place(click.ParamType):
    """A path, or the URL of shared storage."""

    name = "path"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        try:
            return place(value) if isinstance(value, str) else value
        except InputError as error:
            self.fail(str(error), param, ctx)


PLACE = Place()
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
            click.echo(f"triage: {one_line(str(error))}", err=True)
        except MemoryError:
            click.echo("triage: takes more memory than there is; give fewer loops, nights or files", err=True)
        except BrokenPipeError:
            sys.stderr.close()
        except OSError as error:
            remedy = "make room and say it again" if is_full(error) else "check path and permissions"
            click.echo(f"triage: {one_line(what_failed(error))}; {remedy}", err=True)
        except Exception as error:
            if not refused(error):
                raise
            said = one_line(f"{type(error).__name__}: {error}")
            click.echo(f"triage: {said}; check URL, endpoint and credentials of the storage", err=True)
        sys.exit(NOTHING_DONE)

    return wrapped


def what_failed(error: OSError) -> str:
    """What the system says of a file."""
    return f"{error.filename}: {error.strerror}" if error.filename else str(error)


def say(text: str, err: bool = False) -> None:
    """Print a text in which a plant's names may stand, none of which steers the terminal."""
    click.echo(visible_lines(text), err=err)


MOST_SAID = 600
"""Characters of a line that says what is wrong."""


def one_line(text: str) -> str:
    """A message as one line of printable characters, its middle left out where it is very long."""
    shown = " ".join(visible(text).split())
    if len(shown) <= MOST_SAID:
        return shown
    return f"{shown[: MOST_SAID // 2]} ... {shown[-MOST_SAID // 2 :]}"


def utc_seconds(at: datetime | None, zone: str, otherwise: float) -> float:
    """A day or time of the plant's clock, as the command line states it [s since 1970-01-01 UTC]."""
    return otherwise if at is None else seconds(at, zone)


def _asked(
    export: tuple[Path, ...],
    loops: Path | None,
    changes: Path | None,
    since: datetime | None,
    until: datetime | None,
    config: Path | None,
    reading: Mapping[str, Any],
) -> Asked:
    """The command line's options read and checked."""
    from analyzer.config_file import read_config
    from analyzer.loops.changes import read_changes
    from analyzer.night.asked import Asked

    zone = str(zone_of(reading["timezone"]))
    dated = () if changes is None else tuple(read_changes(changes, zone, reading["day_first"]))
    first, last = utc_seconds(since, zone, -math.inf), utc_seconds(until, zone, math.inf)
    if last <= first:
        raise InputError(f"--since {since} --until {until}", "an end after the start", "swap them")
    return Asked(export, loops, dated, first, last, read_config(config), zone, reading)


def config_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """--config."""
    text = "TOML with limits to change; 'triage config' prints all of them."
    return click.option("--config", type=click.Path(path_type=Path), help=text)(command)


TIMES = ("%Y-%m-%d", *(f"%Y-%m-%d{between}%H:%M{end}" for between in "T " for end in (":%S", "")))
"""How --since and --until may be written."""
OPTIONS = (
    click.argument("export", nargs=-1, required=True, type=PLACE),
    click.option(
        "--loops", type=click.Path(path_type=Path), help="loops.csv; without it loops are found by tags."
    ),
    click.option(
        "--changes",
        type=click.Path(path_type=Path),
        help="changes.csv: when settings were changed, old and new.",
    ),
    click.option(
        "--since",
        type=click.DateTime(TIMES),
        metavar="TIME",
        help="First day or time of samples that are used.",
    ),
    click.option(
        "--until",
        type=click.DateTime(TIMES),
        metavar="TIME",
        help="Day or time before which samples are used.",
    ),
    config_option,
    click.option(
        "--timezone",
        help="The plant's time zone, e.g. Europe/Helsinki: of stamps that state none, of nights, pages and "
        "the times given here. Default UTC.",
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
)
"""What every command that reads an export takes."""
READING = (
    *("timezone", "delimiter", "decimal", "encoding", "day_first", "date_format", "time_column"),
    *("quality_column", "good_quality"),
)
"""Options of theirs that say how text exports are read."""
SPAN = ("export", "loops", "changes", "since", "until", "config")


def export_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """EXPORT... and its options, handed over as one `asked`; errors told as by `told`."""

    @wraps(command)
    def collected(**given: Any) -> Any:
        reading = {name: given.pop(name) for name in READING}
        stated = {name: given.pop(name) for name in SPAN}
        return command(asked=_asked(**stated, reading=reading), **given)

    found: Callable[..., Any] = told(collected)
    for option in reversed(OPTIONS):
        found = option(found)
    return found
