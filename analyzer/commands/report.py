"""The commands that write pages: parse, call, say what was written."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from analyzer.commands.options import PLACE, config_option, say
from identification.errors import InputError

if TYPE_CHECKING:
    from analyzer.comparison.before_after import Span
    from analyzer.config import ChangeLimits
    from analyzer.loops.changes import TuningChange
    from analyzer.pages.changes import Spans
    from analyzer.store.store import Store
    from reports.pages import Page

SOME_LOST = 1
MOST_DAYS = 3660
"""Longest span that is compared [d]: ten years."""


def _span(texts: Sequence[str] | None, option: str, zone: str) -> Span | None:
    from analyzer.comparison.before_after import Span
    from analyzer.history.stamps import parse_time

    if not texts:
        return None
    first, last = (parse_time(t, option, zone) for t in texts)
    if last <= first:
        raise InputError(f"{option} {texts[0]} {texts[1]}", "an end after the start", "swap them")
    if last - first > MOST_DAYS * 86400.0:
        raise InputError(
            f"{option} {texts[0]} {texts[1]}", f"at most {MOST_DAYS} days", "give a shorter span"
        )
    return Span(first, last)


def _asked(
    store: Store,
    changes: Path | None,
    loop: str | None,
    changed: str | None,
    find: bool,
    limits: ChangeLimits,
) -> list[TuningChange]:
    """The changes that the command line names."""
    from analyzer.history.stamps import parse_time
    from analyzer.loops.changes import TuningChange, read_changes
    from analyzer.pages.changes import detected

    if find:
        return detected(store, [loop] if loop else None, limits)
    if changes is not None:
        return [c for c in read_changes(changes, store.zone()) if loop in (None, c.loop)]
    if loop is not None and changed is not None:
        return [TuningChange(loop, parse_time(changed, "--changed", store.zone()))]
    raise InputError("no change named", "--changes FILE, --loop TAG --changed TIME, or --find", "name one")


def made(store: Store) -> str:
    """What pages were made with, of what and when."""
    import time
    from importlib.metadata import version

    from analyzer.history.plant_clock import stamp

    zone, name = store.zone(), store.path.name or store.path.resolve().name
    return f"triage {version('loop-triage')}, store {name}, made {stamp(time.time(), zone)}; times in {zone}"


def _written(store: Store, pages: Sequence[Page], form: str, out: Path, single_file: bool) -> None:
    from dataclasses import replace

    from reports.folder import write_csv, write_html, write_markdown

    head, zone = made(store), store.zone()
    pages = [replace(page, made=head, zone=zone) for page in pages]
    paths = write_html(pages, out, single_file) if form == "html" else write_markdown(pages, out)
    for page in pages:
        write_csv(page, out)
    click.echo(f"{paths[0]}" + (f" and {len(paths) - 1} more" if len(paths) > 1 else ""))


def _subtitle(spans: Spans, store: Path) -> str:
    stated = spans.before is not None or spans.after is not None
    span = "The stated spans" if stated else f"{spans.days:g} days"
    return f"{span} before against after the change, from {store.name}."


@click.command()
@click.argument("store", type=PLACE)
@click.option("--changes", type=click.Path(path_type=Path), help="CSV: loop, time, kp_old ... ti_new, who.")
@click.option("--loop", help="One loop's tag.")
@click.option("--changed", help="When that loop was changed, e.g. 2026-03-09T08:00Z.")
@click.option("--find", is_flag=True, help="Offer changes seen in the loops' behaviour, for confirmation.")
@click.option(
    "--days", default=7.0, show_default=True, type=click.FloatRange(1, MOST_DAYS), help="Days each side."
)
@click.option("--before", nargs=2, help="Span before, start and end, instead of --days.")
@click.option("--after", nargs=2, help="Span after, start and end, instead of --days.")
@click.option("--format", "form", type=click.Choice(["html", "markdown"]), default="html", show_default=True)
@click.option("--single-file", is_flag=True, help="Everything in the page itself.")
@click.option("--out", required=True, type=click.Path(path_type=Path), help="Folder to write into.")
@config_option
def report(
    store: Path,
    changes: Path | None,
    loop: str | None,
    changed: str | None,
    find: bool,
    days: float,
    before: tuple[str, str] | None,
    after: tuple[str, str] | None,
    form: str,
    single_file: bool,
    out: Path,
    config: Path | None,
) -> None:
    """Before and after: what changes of controllers brought, with intervals and verdicts.

    Example: triage report store --changes changes.csv --out report
    """
    from analyzer.config_file import read_config
    from analyzer.pages.before_after import page
    from analyzer.pages.changes import Spans, cases
    from analyzer.store.store import Store

    kept, limits = Store(store), read_config(config)
    kept.require()
    zone = kept.zone()
    if not days <= MOST_DAYS:  # NaN passes the range that the option states
        raise InputError(f"--days {days}", f"1 to {MOST_DAYS}", "correct it")
    spans = Spans(days, _span(before, "--before", zone), _span(after, "--after", zone))
    asked = _asked(kept, changes, loop, changed, find, limits.changes)
    found, missing = cases(kept, asked, spans, limits.before_after)
    if not found:
        why = "; ".join(f"{tag}: {reason}" for tag, reason in missing) or "no change found"
        raise InputError(why, "loops and times that the store holds", "check the tags and times")
    _written(kept, [page(found, missing, _subtitle(spans, store), find, zone)], form, out, single_file)
    for tag, reason in missing:
        say(f"{tag}: {reason}", err=True)
    sys.exit(SOME_LOST if missing else 0)


@click.command()
@click.argument("store", type=PLACE)
@click.option("--night", help="Night to show, e.g. 2026-03-08. Default: the latest.")
@click.option(
    "--top", default=50, show_default=True, type=click.IntRange(0), help="Loops with a page of their own."
)
@click.option("--format", "form", type=click.Choice(["html", "markdown"]), default="html", show_default=True)
@click.option("--single-file", is_flag=True, help="Style and scripts in each page itself.")
@click.option("--out", required=True, type=click.Path(path_type=Path), help="Folder to write into.")
def pages(store: Path, night: str | None, top: int, form: str, single_file: bool, out: Path) -> None:
    """The morning page of a night and a page for each of its worst loops.

    Example: triage pages store --out pages --top 50
    """
    from analyzer.pages import night as night_pages
    from analyzer.store.store import Store

    kept = Store(store)
    kept.require()
    found = list(night_pages.pages(kept, night, top))
    if form == "html":
        found += night_pages.dated_pages(kept, night, lambda name: _stands(kept, out, name))
    _written(kept, found, form, out, single_file)
    if form == "html":
        from reports.folder import forget_stale

        forget_stale(out, [f"{page.name}.html" for page in found], kept_names=_dated(kept))


def _dated(store: Store) -> set[str]:
    from analyzer.pages.night import name_of

    return {f"{name_of(night)}.html" for night in store.nights()}


def _stands(store: Store, out: Path, night: str) -> bool:
    """Whether a night's dated page was written after its results."""
    from analyzer.pages.night import name_of

    page, results = out / f"{name_of(night)}.html", store.path / "nights" / f"{night}.parquet"
    return page.exists() and page.stat().st_mtime > results.stat().st_mtime


COMMANDS = (report, pages)
"""To be added to the command line; errors are told there."""
