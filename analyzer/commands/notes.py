"""The commands `note` and `summary`: parse, call, print."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

import click

from analyzer.commands.options import NIGHT, STORE, formats, say, told


@click.command()
@STORE
@click.argument("loop")
@click.argument("text", required=False)
@click.option("--owner", help="Who looks after it. Default: the user of this computer.")
@click.option(
    "--hide-until",
    type=click.DateTime(("%Y-%m-%d",)),
    metavar="DATE",
    help="Leave the loop out of lists until this night.",
)
@told
def note(store: Path, loop: str, text: str | None, owner: str | None, hide_until: datetime | None) -> None:
    """What was seen or done about a loop, kept in the store and shown in lists and on pages.

    The newest note of a loop counts; without TEXT its notes are printed.

    Example: triage note store FIC2110 "stroked, packing tight, ordered" --hide-until 2026-04-01
    """
    from analyzer.store import notes
    from analyzer.store.store import Store
    from identification.errors import InputError

    kept = Store(store)
    night = kept.require()
    known = kept.read("nights", night, ["loop"]).column(0).to_pylist()
    if loop not in known:
        from difflib import get_close_matches

        near = ", ".join(get_close_matches(loop, known, n=3)) or "none is near"
        raise InputError(f"loop {loop} is not in night {night}", f"one of its loops ({near})", "correct LOOP")
    if text is None:
        own = notes.read(store).get(loop, ())
        zone = kept.zone()
        say("\n".join(n.said(zone) for n in own) or f"{loop}: no notes")
        return
    until = "" if hide_until is None else hide_until.strftime("%Y-%m-%d")
    written = notes.new(loop, text, owner, until)
    notes.add(store, written)
    say(f"{loop}: {written.said(kept.zone())}")


@click.command()
@STORE
@NIGHT
@formats("text", "html", "markdown", text="html is one mail without scripts.")
@told
def summary(store: Path, night: str | None, form: str) -> None:
    """The morning on one screen, to be mailed: what to do first, what changed, the worst loops.

    Example: triage summary store --format html > mail.html
    """
    from dataclasses import replace

    from analyzer.commands.report import made
    from analyzer.pages.summary import page
    from analyzer.store.store import Store
    from reports import html, markdown, plain

    kept = Store(store)
    kept.require()
    found = replace(page(kept, night), made=made(kept), zone=kept.zone())
    draw = {"text": plain.render, "html": html.mail, "markdown": lambda p: markdown.render(p, "")}[form]
    click.echo(draw(found).rstrip("\n"))
