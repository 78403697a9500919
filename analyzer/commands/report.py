"""The commands that write pages: `report` and `pages`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from analyzer.commands.options import CONFIG, FILE, NIGHT, SOME_LOST, STORE, Command, formats, say
from identification.errors import InputError

if TYPE_CHECKING:
    from analyzer.comparison.before_after import Span
    from analyzer.config import Config
    from analyzer.loops.changes import TuningChange
    from analyzer.store.store import Store
    from reports.pages import Page

MOST_DAYS = 3660
"""Longest span that is compared [d]: ten years."""


@dataclass(frozen=True, slots=True)
class Folder:
    """Where pages are written, in which format, and whether each is to stand by itself."""

    form: str
    single_file: bool
    out: Path

    def write(self, store: Store, pages: Sequence[Page]) -> None:
        """Write a store's pages and their tables, and say where."""
        from reports.folder import write_csv, write_html, write_markdown

        head, zone, html = made(store), store.zone(), self.form == "html"
        pages = [replace(page, made=head, zone=zone) for page in pages]
        paths = write_html(pages, self.out, self.single_file) if html else write_markdown(pages, self.out)
        for page in pages:
            write_csv(page, self.out)
        click.echo(f"{paths[0]}" + (f" and {len(paths) - 1} more" if len(paths) > 1 else ""))


def into_folder(single_text: str) -> Callable[[Command], Command]:
    """--format, --single-file and --out, handed over as one `folder`."""
    single = click.option("--single-file", is_flag=True, help=single_text)
    where = click.option("--out", required=True, type=FILE, help="Folder to write into.")

    def collecting(command: Command) -> Command:
        @wraps(command)
        def collected(form: str, single_file: bool, out: Path, **given: Any) -> Any:
            return command(folder=Folder(form, single_file, out), **given)

        return formats("html", "markdown")(single(where(collected)))

    return collecting


def made(store: Store) -> str:
    """What pages were made with, of what and when."""
    import time
    from importlib.metadata import version

    from analyzer.history.plant_clock import stamp

    zone, name = store.zone(), store.path.name or store.path.resolve().name
    return f"triage {version('loop-triage')}, store {name}, made {stamp(time.time(), zone)}; times in {zone}"


@click.command()
@STORE
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
@CONFIG
def report(
    store: Path,
    days: float,
    before: tuple[str, str] | None,
    after: tuple[str, str] | None,
    folder: Folder,
    config: Path | None,
    **named: Any,
) -> None:
    """Before and after: what changes of controllers brought, with intervals and verdicts.

    Example: triage report store --changes changes.csv --out report
    """
    from analyzer.config import read_config
    from analyzer.pages.before_after import changes_page
    from analyzer.pages.changes import Spans, change_cases
    from analyzer.store.store import Store

    kept, limits = Store(store), read_config(config)
    kept.require()
    zone = kept.zone()
    if not days <= MOST_DAYS:  # NaN passes the range that the option states
        raise InputError(f"--days {days}", f"1 to {MOST_DAYS}", "correct it")
    spans = Spans(days, _span_given(before, "--before", zone), _span_given(after, "--after", zone))
    found, missing = change_cases(kept, _changes(kept, limits, **named), spans, limits.before_after)
    if not found:
        why = "; ".join(f"{tag}: {reason}" for tag, reason in missing) or "no change found"
        raise InputError(why, "loops and times that the store holds", "check the tags and times")
    span = "The stated spans" if before or after else f"{days:g} days"
    subtitle = f"{span} before against after the change, from {store.name}."
    folder.write(kept, [changes_page(found, missing, subtitle, named["find"], zone)])
    for tag, reason in missing:
        say(f"{tag}: {reason}", err=True)
    sys.exit(SOME_LOST if missing else 0)


def _span_given(texts: Sequence[str] | None, option: str, zone: str) -> Span | None:
    from analyzer.comparison.before_after import Span
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
    """The changes that the command line names, or those that the loops' behaviour shows."""
    from analyzer.history.stamps import parse_time
    from analyzer.loops.changes import TuningChange, read_changes
    from analyzer.pages.changes import detected

    if find:
        return detected(store, [loop] if loop else None, config)
    if changes is not None:
        return [c for c in read_changes(changes, store.zone()) if loop in (None, c.loop)]
    if loop is not None and changed is not None:
        return [TuningChange(loop, parse_time(changed, "--changed", store.zone()))]
    raise InputError("no change named", "--changes FILE, --loop TAG --changed TIME, or --find", "name one")


@click.command()
@STORE
@NIGHT
@click.option(
    "--top",
    default=200,
    show_default=True,
    type=click.IntRange(0),
    help="Loops with a page, the worst first.",
)
@into_folder("Style and scripts in each page itself.")
def pages(store: Path, night: str | None, top: int, folder: Folder) -> None:
    """The morning page of a night and a page for each of its loops, the worst first.

    Example: triage pages store --out pages --top 50
    """
    from analyzer.pages import night as night_pages
    from analyzer.store.store import Store

    kept = Store(store)
    kept.require()
    found = list(night_pages.pages_of_night(kept, night, top))
    if folder.form == "html":
        found += night_pages.dated_pages(kept, night, lambda name: _stands(kept, folder.out, name))
    folder.write(kept, found)
    if folder.form == "html":
        from analyzer.pages.night import name_of
        from reports.folder import forget_stale

        dated = {f"{name_of(night)}.html" for night in kept.nights()}
        forget_stale(folder.out, [f"{page.name}.html" for page in found], kept_names=dated)


def _stands(store: Store, out: Path, night: str) -> bool:
    """Whether a night's dated page was written after its results."""
    from analyzer.pages.night import name_of

    page, results = out / f"{name_of(night)}.html", store.path / "nights" / f"{night}.parquet"
    return page.exists() and page.stat().st_mtime > results.stat().st_mtime
