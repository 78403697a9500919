"""The commands that write pages: `report` and `pages`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from analyzer.commands import options
from analyzer.commands.options import EXIT_SOME_FAILED, FILE, FOLDER, Command, opened_store, print_visible
from identification.errors import InputError

if TYPE_CHECKING:
    from analyzer.comparison.measures import Span
    from analyzer.config import Config
    from analyzer.loops.changes import TuningChange
    from analyzer.store.store import Store
    from reports.pages import Page

MOST_DAYS = 3660
"""Longest compared span [d]: ten years."""


def into_folder(single_text: str) -> Callable[[Command], Command]:
    """--format, --single-file and --out: the format of pages, whether each is self-contained, and the folder."""
    single = click.option("--single-file", is_flag=True, help=single_text)
    where = click.option("--out", required=True, type=FOLDER, help="Folder to write into.")
    return lambda command: options.formats("html", "markdown")(single(where(command)))


def write(store: Store, pages: Iterable[Page], form: str, single_file: bool, out: Path) -> list[str]:
    """Write a store's pages and their tables one by one, and print where; return the names of their files."""
    from reports.folder import write_csv, write_html, write_markdown

    head, zone = made(store), store.zone()

    def with_tables() -> Iterator[Page]:
        for page in pages:
            shown = replace(page, made=head, zone=zone)
            write_csv(shown, out)
            yield shown

    shown = with_tables()
    paths = write_html(shown, out, single_file) if form == "html" else write_markdown(shown, out)
    click.echo(f"{paths[0]}" + (f" and {len(paths) - 1} more" if len(paths) > 1 else ""))
    return [path.name for path in paths]


def made(store: Store) -> str:
    """Program version, source and time of the pages."""
    import time
    from importlib.metadata import version

    from analyzer.history.plant_clock import stamp

    zone, name = store.zone(), store.path.name or store.path.resolve().name
    return f"triage {version('loop-triage')}, store {name}, made {stamp(time.time(), zone)}; times in {zone}"


@click.command()
@options.STORE
@click.option("--changes", type=FILE, help="CSV: loop, time, kp_old ... ti_new, who.")
@click.option("--loop", help="One loop's tag.")
@click.option("--changed", help="When that loop was changed, e.g. 2026-03-09T08:00Z.")
@click.option("--find", is_flag=True, help="Offer changes seen in the loops' behaviour, for confirmation.")
@click.option(
    "--days", default=7.0, show_default=True, type=click.FloatRange(1, MOST_DAYS), help="Days each side."
)
@click.option("--before", nargs=2, help="Span before, start and end, instead of --days.")
@click.option("--after", nargs=2, help="Span after, start and end, instead of --days.")
@into_folder("Everything in the page itself.")
@options.CONFIG
def report(
    store: Path,
    days: float,
    before: tuple[str, str] | None,
    after: tuple[str, str] | None,
    config: Path | None,
    form: str,
    single_file: bool,
    out: Path,
    **named: Any,
) -> None:
    """Before and after: the effects of controller changes, with intervals and verdicts.

    Example: triage report store --changes changes.csv --out report
    """
    from analyzer.config import read_config
    from analyzer.pages.before_after import changes_page
    from analyzer.pages.change_cases import change_cases

    limits, opened = read_config(config), opened_store(store)
    zone = opened.zone()
    if not days <= MOST_DAYS:  # NaN passes the range check of the option
        raise InputError(f"--days {days}", f"1 to {MOST_DAYS}", "correct it")
    stated = _span_given(before, "--before", zone), _span_given(after, "--after", zone)
    found, missing = change_cases(
        opened, _changes(opened, limits, **named), days, stated, limits.before_after
    )
    if not found:
        why = "; ".join(f"{tag}: {reason}" for tag, reason in missing) or "no change found"
        raise InputError(why, "loops and times that the store holds", "check the tags and times")
    span = "The stated spans" if before or after else f"{days:g} days"
    subtitle = f"{span} before and after the change, from {store.name}."
    page = changes_page(found, missing, subtitle, named["find"], zone)
    write(opened, [page], form, single_file, out)
    for tag, reason in missing:
        print_visible(f"{tag}: {reason}", err=True)
    sys.exit(EXIT_SOME_FAILED if missing else 0)


def _span_given(texts: Sequence[str] | None, option: str, zone: str) -> Span | None:
    from analyzer.comparison.measures import Span
    from analyzer.history.stamps import parse_time

    if not texts:
        return None
    first, last = (parse_time(t, option, zone) for t in texts)
    seen = f"{option} {texts[0]} {texts[1]}"
    if last <= first:
        raise InputError(seen, "an end after the start", "swap them")
    if last - first > MOST_DAYS * 86400.0:
        raise InputError(seen, f"at most {MOST_DAYS} days", "give a shorter span")
    return Span(first, last)


def _changes(
    store: Store,
    config: Config,
    changes: Path | None,
    loop: str | None,
    changed: str | None,
    find: bool,
) -> list[TuningChange]:
    """The changes of the command line, or those detected in the loops' behaviour."""
    from analyzer.history.stamps import parse_time
    from analyzer.loops.changes import TuningChange, read_changes
    from analyzer.pages.change_cases import detected

    if find:
        return detected(store, [loop] if loop else None, config)
    if changes is not None:
        return [c for c in read_changes(changes, store.zone()) if loop in (None, c.loop)]
    if loop is not None and changed is not None:
        return [TuningChange(loop, parse_time(changed, "--changed", store.zone()))]
    raise InputError("no change named", "--changes FILE, --loop TAG --changed TIME, or --find", "name one")


@click.command()
@options.STORE
@options.NIGHT
@click.option(
    "--top",
    default=200,
    show_default=True,
    type=click.IntRange(0),
    help="Loops with a page, the worst first.",
)
@click.option("--loop", "tag", help="Only the pages of this loop; existing pages stay.")
@into_folder("Style and scripts in each page itself.")
def pages(
    store: Path, night: str | None, top: int, tag: str | None, form: str, single_file: bool, out: Path
) -> None:
    """Write the morning page of a night and a page for each of its loops, worst first.

    Example: triage pages store --out pages --top 50
    """
    from analyzer.pages import night as night_pages
    from reports.folder import forget_stale

    opened = opened_store(store)
    if tag is not None:
        write(opened, night_pages.pages_of_loop(opened, night, tag), form, single_file, out)
        return

    def page_of(night: str) -> Path:
        return out / f"{night_pages.name_of(night)}.html"

    def is_up_to_date(night: str) -> bool:
        """Whether a night's dated page was written after its results."""
        page, results = page_of(night), opened.file("nights", night)
        return page.exists() and page.stat().st_mtime > results.stat().st_mtime

    found = night_pages.pages_of_night(opened, night, top)
    dated = night_pages.dated_pages(opened, night, is_up_to_date) if form == "html" else ()
    written = write(opened, chain(found, dated), form, single_file, out)
    if form == "html":
        forget_stale(out, written, kept_names={page_of(night).name for night in opened.nights()})
