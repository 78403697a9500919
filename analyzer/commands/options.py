"""Common parts of all commands: the reporting of errors, and shared options, each declared once."""

from __future__ import annotations

import os
import sys
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import reduce, wraps
from io import TextIOWrapper
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from analyzer.locations import is_outage, place, refused
from identification.errors import InputError, NotAssessedError, TriageError
from reports.texts import visible, visible_lines
from reports.whole_file import is_full

if TYPE_CHECKING:
    from analyzer.columns import Row
    from analyzer.night.decided import Decided
    from analyzer.night.nights import Plant, PlantLoop
    from analyzer.store.store import Store

OLD_D = 7.0
"""Age of the newest night beyond which run and summary report its age [d]: a week without an export is an
accident."""

Command = Callable[..., Any]
EXIT_SOME_FAILED, EXIT_NOTHING_DONE, EXIT_TRY_LATER = 1, 2, 75
"""Exit status if some loops failed, if nothing could be done, and if a run ended because shared storage
failed. After the last one the same command may succeed later (EX_TEMPFAIL of sysexits)."""
MOST_CHARACTERS = 600
"""Maximum characters of an error line."""


class OneLineErrors(click.Group):
    """Commands whose expected errors, and errors of the system, are one line on stderr with exit status 2."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command."""
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, TextIOWrapper):  # a character missing in a code page is shown as its number
                stream.reconfigure(errors="backslashreplace")
        try:
            with warnings.catch_warnings():
                if not sys.warnoptions:
                    warnings.simplefilter("ignore")  # a library's warning is useless to an engineer
                return super().invoke(ctx)
        except (click.ClickException, click.Abort, click.exceptions.Exit):
            raise
        except BrokenPipeError:
            sys.stderr.close()
        except Exception as error:
            line = what_went_wrong(error)
            if line is None and sys.flags.dev_mode:
                raise
            click.echo(f"triage: {line or unforeseen(error)}", err=True)
        sys.exit(EXIT_NOTHING_DONE)


def what_went_wrong(error: Exception) -> str | None:
    """An error as one line with what to do; None for an unexpected one."""
    if isinstance(error, TriageError):
        return one_line(str(error))
    if isinstance(error, MemoryError):
        return "the command needs more memory than is available; give fewer loops, nights or files"
    if isinstance(error, OSError) and error.filename is None and (error.errno is None or is_outage(error)):
        return (
            f"{one_line(str(error))}; check URL, endpoint and credentials of the storage, or try again later"
        )
    if isinstance(error, OSError):
        remedy = (
            "make room and give the same command again" if is_full(error) else "check path and permissions"
        )
        return f"{one_line(what_failed(error))}; {remedy}"
    if refused(error):
        message = one_line(f"{type(error).__name__}: {error}")
        return f"{message}; check URL, endpoint and credentials of the storage"
    return None


def unforeseen(error: Exception) -> str:
    """An error of the program itself as one line: what, where, and what to do."""
    at = traceback.extract_tb(error.__traceback__)[-1]
    where = f"{Path(at.filename).name}, line {at.lineno}"
    message = one_line(f"{type(error).__name__}: {error}")
    return f"an error of the program ({message}; {where}); report it; 'python -X dev' shows all of it"


def what_failed(error: OSError) -> str:
    """The system's message on a file."""
    return f"{error.filename}: {error.strerror}" if error.filename else str(error)


def one_line(text: str) -> str:
    """A message as one line of printable characters, with its middle left out if it is very long."""
    shown = " ".join(visible(text).split())
    if len(shown) <= MOST_CHARACTERS:
        return shown
    return f"{shown[: MOST_CHARACTERS // 2]} ... {shown[-MOST_CHARACTERS // 2 :]}"


def print_visible(text: str, err: bool = False) -> None:
    """Print a text that may contain a plant's names, without control characters for the terminal."""
    click.echo(visible_lines(text), err=err)


class Place(click.ParamType):
    """A path, or the URL of shared storage."""

    name = "path"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        try:
            return place(value) if isinstance(value, str) else value
        except InputError as error:
            self.fail(str(error), param, ctx)


class Folder(click.ParamType):
    """A folder to write into that is not a store, because its tables would be mixed with pages."""

    name = "path"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        path = Path(os.fspath(value))
        if path.is_file():
            raise InputError(f"--out {path}: a file", "a folder, or none yet", "give a folder")
        if (path / "store.json").exists() or (path / "nights").is_dir():
            raise InputError(f"--out {path}: a store", "a folder only for pages", "give another folder")
        return path


PLACE, FILE, FOLDER = Place(), click.Path(path_type=Path), Folder()
STORE = click.argument("store", type=PLACE)
NIGHT = click.option("--night", help="Night to show, e.g. 2026-03-08. Default: the latest.")
CONFIG = click.option(
    "--config", type=FILE, help="TOML with limits to change; 'triage config' prints all of them."
)


def opened_store(path: Path) -> Store:
    """A store with at least one night. Raises InputError if there is none."""
    from analyzer.store.store import Store

    opened = Store(path)
    opened.require()
    return opened


DECIDED = click.option(
    "--store", type=PLACE, help="Store whose nights decide; default: only the last night of the export."
)


def decision(one: PlantLoop, store: Path | None) -> Decided:
    """The decision of a loop's night, from a store or from that night alone."""
    from analyzer.night.decided import decided

    assert one.night is not None  # called with a night only
    return decided(one.plant, one.night, one.spec.loop, None if store is None else opened_store(store))


def decision_of(plant: Plant, loop: str, store: Path | None) -> Row | None:
    """The row of a loop's last night in an export; None if that night has too few samples."""
    with suppress(NotAssessedError):
        return decision(plant.last_night(loop), store).row
    return None


TIMES = ("%Y-%m-%d", *(f"%Y-%m-%d{between}%H:%M{end}" for between in "T " for end in (":%S", "")))
"""Formats of --since and --until."""


def finding(command: Command) -> Command:
    """--find-loops, for commands that take their loops from the export without a loops.csv."""
    text = "Without --loops: search the data for loops that the tags' names do not show."
    return click.option("--find-loops", "finding", is_flag=True, help=text)(command)


def of_loop(text: str) -> Callable[[Command], Command]:
    """--loop, the loop of a command."""
    return click.option("--loop", "tag", required=True, help=text)


def formats(*choices: str, text: str | None = None) -> Callable[[Command], Command]:
    """--format, with the first choice as default."""
    kinds = click.Choice(choices)
    return click.option("--format", "form", type=kinds, default=choices[0], show_default=True, help=text)


def _time(name: str, text: str) -> Callable[[Command], Command]:
    return click.option(name, type=click.DateTime(TIMES), metavar="TIME", help=text)


SPAN = (
    click.argument("export", nargs=-1, required=True, type=PLACE),
    click.option("--loops", type=FILE, help="loops.csv; without it loops are found by tags."),
    click.option("--changes", type=FILE, help="changes.csv: when settings were changed, old and new."),
    _time("--since", "First day or time of samples that are used."),
    _time("--until", "Day or time before which samples are used."),
    CONFIG,
)
"""The samples and loops used, and the limits."""
READING = {
    "--timezone": "The plant's time zone, e.g. Europe/Helsinki: of stamps that state none, of nights, pages and "
    "the times given here. Default UTC.",
    "--delimiter": "Delimiter of text exports. Default: detected.",
    "--decimal": "Decimal mark. Default: detected.",
    "--encoding": "Encoding of text exports. Default: detected.",
    "--day-first/--month-first": "Order in dates such as 03/04/2026.",
    "--date-format": "Format of the stamps, e.g. '%d-%b-%y %H:%M:%S'.",
    "--interval": "Time between rows, e.g. 30s, of an export whose stamps do not advance.",
    "--time-column": "Name of the column of stamps. Default: detected.",
    "--quality-column": "Name of a long export's column of quality codes. Default: detected.",
    "--good-quality": "Quality code or text that means good; may be repeated.",
}
"""Format options for text exports."""
KINDS: dict[str, dict[str, Any]] = {
    "--decimal": {"type": click.Choice([".", ","])},
    "--day-first/--month-first": {"default": None},
    "--good-quality": {"multiple": True},
}
"""Export options whose value is not plain text."""


def export_options(command: Command) -> Command:
    """EXPORT... and the options of every command that reads one, passed as one `request`."""
    names = [name.split("/")[0].lstrip("-").replace("-", "_") for name in READING]

    @wraps(command)
    def collected(
        export: tuple[Path, ...], loops: Path | None, changes: Path | None, config: Path | None, **given: Any
    ) -> Any:
        from analyzer.config import read_config
        from analyzer.night.request import export_request

        reading = {name: given.pop(name) for name in ("since", "until", *names)}
        reading["finding"] = given.pop("finding", False)
        return command(
            request=export_request(export, loops, changes, read_config(config), **reading), **given
        )

    reads = [click.option(name, help=text, **KINDS.get(name, {})) for name, text in READING.items()]
    options: list[Any] = [*SPAN, *reads]
    return reduce(lambda found, option: option(found), reversed(options), collected)


def age_note(night: str, zone: str) -> str:
    """Age of a night, in a sentence; '' if it is recent."""
    from datetime import date

    from analyzer.history.plant_clock import date_of

    days = (date.fromisoformat(date_of(time.time(), zone)) - date.fromisoformat(night)).days
    if days <= OLD_D:
        return ""
    return f"Night {night} is {days} days old: check that the newest export was read."


Report = Callable[[int, int], None]
QUIET_S = 5.0
"""Seconds between two progress lines if the output is no terminal [s]."""


@contextmanager
def bar(what: str) -> Iterator[Report]:
    """A callable that receives the number of finished things and the total."""
    if not sys.stderr.isatty():
        yield _tenths(what)
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn(what), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(what, total=None)
        yield lambda done, total: progress.update(task, completed=done, total=total)


COMPILING_S = 10.0
"""Seconds without a first result after which a line explains the delay [s]; ours: once compiled, a loop takes a tenth
of a second."""


STILL_S = 60.0
"""Seconds after which the progress is printed again [s]."""


def _tenths(what: str) -> Report:
    """A line on stderr at the start, at every tenth, if the first result takes long, and once a minute."""
    reported, begun = set[int](), time.monotonic()
    reported_s = begun

    def report(done: int, total: int) -> None:
        nonlocal reported_s
        now, tenth = time.monotonic(), 10 * done // max(total, 1)
        compiling = done == 0 and now - begun > COMPILING_S and -1 not in reported
        new = -1 if compiling else tenth
        if new in reported and now - reported_s < STILL_S:
            return
        after = f" after {now - begun:.0f} s" if new in reported else ""
        far = "the first run after an installation compiles for minutes"
        click.echo(f"{what}: {far if compiling else f'{done} of {total}{after}'}", err=True)
        reported.add(new)
        reported_s = now

    return report


@contextmanager
def watched(what: str) -> Iterator[None]:
    """Show the current step: on a terminal while it lasts, otherwise as a line on stdout, so that after an error
    stderr has one line only."""
    seen = sys.stderr is not None and sys.stderr.isatty()
    if seen:
        click.echo(f"\r\033[K{visible(what)}", nl=False, err=True)
    else:
        _to_stdout(visible(what))
    try:
        yield
    finally:
        if seen:
            click.echo("\r\033[K", nl=False, err=True)


def _to_stdout(line: str) -> None:
    """Print an optional line: if stdout is closed, only this line is lost."""
    try:
        click.echo(line)
    except OSError:
        sys.stdout = None  # prints nothing at the end of the process either


@contextmanager
def trying() -> Iterator[Callable[[str], None]]:
    """A callable that receives the name of each attempt."""
    watched, begun = sys.stderr.isatty(), time.monotonic()
    shown_s = begun
    if not watched:
        click.echo("explain: reading the export, fitting the baseline model", err=True)

    def show(name: str) -> None:
        nonlocal shown_s
        if watched:
            click.echo(f"\r\033[K{f'trying {name}' if name else ''}", nl=False, err=True)
        elif name and time.monotonic() - shown_s >= QUIET_S:
            shown_s = time.monotonic()
            click.echo(f"explain: {shown_s - begun:.0f} s, trying {name}", err=True)

    try:
        yield show
    finally:
        show("")
