"""The commands for a store: parse, call, print findings or actions."""

from __future__ import annotations

import re
import sys
from datetime import datetime
from pathlib import Path

import click

from analyzer.commands.options import (
    CONFIG,
    EXIT_SOME_FAILED,
    NIGHT,
    PLACE,
    STORE,
    age_note,
    formats,
    opened_store,
    print_visible,
)
from analyzer.store.notes import STATES
from identification.errors import InputError

DAYS = {"d": 1, "w": 7, "y": 365}
SHOWN = 20
"""Maximum number of listed files; the others are counted."""


def days(text: str, option: str) -> int:
    """Days in a text such as 400d, 26w or 2y. Raises InputError for other texts."""
    found = re.fullmatch(r"(\d{1,5})([dwy])", text.strip())
    if found is None or int(found[1]) == 0:
        expected = "a number of days, weeks or years such as 400d, 26w or 2y"
        raise InputError(f"{option} {text}", expected, "correct it")
    return int(found[1]) * DAYS[found[2]]


@click.group()
def store() -> None:
    """Maintain a store: check it, delete old nights.

    Example: triage store check store
    """


@store.command("check")
@click.argument("path", metavar="STORE", type=PLACE)
@CONFIG
def check_store(path: Path, config: Path | None) -> None:
    """Read every table of a store and report damage, leftover and unfinished files, and beliefs that do not follow
    from the nights.

    Exit status: 0 no problem, 1 a problem, 2 there is no store.

    Example: triage store check store
    """
    from analyzer.belief.nights import inconsistent_beliefs
    from analyzer.config import read_config
    from analyzer.store import maintenance
    from analyzer.store.store import Store

    opened, limits = Store(path), read_config(config)
    found = 0
    for problem in (*maintenance.problems(opened), *inconsistent_beliefs(opened, limits)):
        found += 1
        click.echo(f"{problem.seen}: {problem.remedy}")
    click.echo(
        f"{path}: {maintenance.size_text(opened)}; " + (f"problems: {found}" if found else "no problem")
    )
    sys.exit(EXIT_SOME_FAILED if found else 0)


@store.command()
@click.argument("path", metavar="STORE", type=PLACE)
@click.option("--keep", required=True, help="How long nights are kept, before the latest: 400d, 60w, 2y.")
@click.option("--keep-trends", help="How long trends and hours are kept. Default: as long as nights.")
@click.option("--dry-run", is_flag=True, help="Only report what would be deleted.")
def prune(path: Path, keep: str, keep_trends: str | None, dry_run: bool) -> None:
    """Delete nights older than some time before the latest, and files of terminated processes. Notes are kept.

    Example: triage store prune store --keep 400d --keep-trends 90d
    """
    from analyzer.store import maintenance
    from analyzer.store.lock import locked

    opened = opened_store(path)
    detail = None if keep_trends is None else days(keep_trends, "--keep-trends")
    with locked(path):
        pruned = maintenance.pruned(opened, days(keep, "--keep"), detail, dry_run)
    done = "would be deleted" if dry_run else "deleted"
    for file in pruned[:SHOWN]:
        click.echo(f"{done}: {file.relative_to(path)}")
    if len(pruned) > SHOWN:
        click.echo(f"and {len(pruned) - SHOWN} more")
    click.echo(f"{path}: {len(pruned)} files {done}, {len(opened.nights())} nights kept")


@store.command()
@click.argument("path", metavar="STORE", type=PLACE)
@CONFIG
def beliefs(path: Path, config: Path | None) -> None:
    """Recompute the beliefs of a store, the joint results of its nights for each loop.

    Every run updates them; use this after changed limits, and after late notes on repairs.

    Example: triage store beliefs store
    """
    from analyzer.belief.nights import recompute_beliefs
    from analyzer.config import read_config
    from analyzer.store.lock import locked

    opened = opened_store(path)
    with locked(path):
        lost = recompute_beliefs(opened, read_config(config))
    for line in lost:
        click.echo(line)
    click.echo(f"{path}: beliefs of {len(opened.nights())} nights computed again")
    sys.exit(EXIT_SOME_FAILED if lost else 0)


@click.command()
@STORE
@click.argument("loop")
@click.argument("text", required=False)
@click.option("--owner", help="Who is responsible. Default: the user of this computer.")
@click.option(
    "--hide-until",
    type=click.DateTime(("%Y-%m-%d",)),
    metavar="DATE",
    help="Leave the loop out of lists until this night.",
)
@click.option("--state", type=click.Choice(STATES), help="State of the work.")
@click.option("--due", type=click.DateTime(("%Y-%m-%d",)), metavar="DATE", help="Due date of the work.")
def note(
    store: Path,
    loop: str,
    text: str | None,
    owner: str | None,
    hide_until: datetime | None,
    state: str | None,
    due: datetime | None,
) -> None:
    """Add a note on a loop to the store, shown in lists and on pages.

    The newest note of a loop counts; without TEXT its notes are printed. Notes make the work list, a page of `triage
    pages`, with owner, state and due date, and the results of the nights since.

    Example: triage note store FIC2110 "stroked, packing tight" --state ordered --due 2026-04-01 --owner Laine
    """
    from analyzer.store import notes

    opened = opened_store(store)
    night = opened.nights()[-1]
    known = opened.read("nights", night, ["loop"]).column(0).to_pylist()
    if loop not in known:
        from difflib import get_close_matches

        near = ", ".join(get_close_matches(loop, known, n=3)) or "none is near"
        raise InputError(f"loop {loop} is not in night {night}", f"one of its loops ({near})", "correct LOOP")
    if text is None and state is None and due is None:
        own = notes.read_notes(store).get(loop, ())
        zone = opened.zone()
        print_visible("\n".join(n.as_line(zone) for n in own) or f"{loop}: no notes")
        return
    until, by = ("" if day is None else day.strftime("%Y-%m-%d") for day in (hide_until, due))
    written = notes.new(loop, text or state or f"due {by}", owner, until, state or "", by)
    notes.add(store, written)
    print_visible(f"{loop}: {written.as_line(opened.zone())}")


@click.command()
@STORE
@NIGHT
@formats("text", "html", "markdown", text="html is one mail without scripts.")
def summary(store: Path, night: str | None, form: str) -> None:
    """The morning on one screen, for mail: first actions, changes, the worst loops.

    Example: triage summary store --format html > mail.html
    """
    from dataclasses import replace

    from analyzer.commands.report import made
    from analyzer.pages.summary import summary_page
    from reports import html, markdown, plain

    opened = opened_store(store)
    zone = opened.zone()
    old = age_note(night or opened.nights()[-1], zone)
    found = replace(summary_page(opened, night), made=made(opened), zone=zone, subtitle=old)
    draw = {"text": plain.render, "html": html.mail, "markdown": lambda p: markdown.render(p, "")}[form]
    click.echo(draw(found).rstrip("\n"))
