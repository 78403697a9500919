"""The commands `explain` and `simulate`: effects outside a loop's baseline model, and simulation of a saved model."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from analyzer.commands.options import (
    DECIDED,
    EXIT_NOTHING_DONE,
    FILE,
    FOLDER,
    PLACE,
    decision_of,
    export_options,
    formats,
    of_loop,
    print_visible,
    trying,
)
from analyzer.loop.decisions import decided_fault
from identification.errors import NotAssessedError

if TYPE_CHECKING:
    from analyzer.night.request import ExportRequest
    from reports.pages import Page


@click.command()
@export_options
@of_loop("Loop to explain.")
@click.option("--model", type=FILE, help="Your own saved model, compared with the refitted one.")
@DECIDED
@click.option(
    "--held-out",
    multiple=True,
    type=PLACE,
    help="Another recording of the loop that tests the explanation; may be repeated.",
)
@click.option("--save-model", type=FILE, help="Write the model found, for `simulate`.")
@formats("text", "json", "html", "markdown", text="Output format; html is one file that needs no network.")
@click.option(
    "--out",
    type=FOLDER,
    help="Folder for the page and Markdown's pictures. Default: HTML for a terminal goes here.",
)
def explain(
    request: ExportRequest,
    tag: str,
    store: Path | None,
    model: Path | None,
    held_out: tuple[Path, ...],
    save_model: Path | None,
    form: str,
    out: Path | None,
) -> None:
    """The night's decision; the difference between the recording and a simulation, the effects that explain it, and
    how much they explain.

    Example: triage explain export.parquet --loops loops.csv --loop FIC101
    """
    from analyzer.explain.case import requested_cases
    from analyzer.explain.explained import abstained, explained, with_night
    from analyzer.explain.models import read_model
    from analyzer.explain.page import abstention, explanation_page
    from analyzer.night.opened import guarded

    decision = None
    try:
        with trying() as report:
            user_model = read_model(model, tag) if model is not None else None
            plant = guarded(request)
            decision = decision_of(plant, tag, store)
            case, others = requested_cases(request, plant, tag, held_out, decided_fault(decision))
            found = explained(case, report, user_model, others)
    except NotAssessedError as error:
        data = with_night(abstained(tag, str(error)), decision)
        _show(data, lambda: abstention(data), form, out)
        click.echo(f"triage: {error}", err=True)
        sys.exit(EXIT_NOTHING_DONE)
    found = replace(found, data=with_night(found.data, decision))
    if save_model is not None:
        save_model.write_text(json.dumps(found.model(), indent=1))
    _show(found.data, lambda: explanation_page(found, request.zone), form, out)


def _show(data: dict[str, Any], page: Callable[[], Page], form: str, out: Path | None) -> None:
    """Print the answer in a format, or write its page into a folder."""
    if form == "json":
        click.echo(json.dumps(data))
    elif form == "text":
        from analyzer.explain.text import answer_lines

        print_visible("\n".join(answer_lines(data)))
    else:
        from analyzer.pages.rank import interactive
        from reports import folder, html, markdown

        if out is None and form == "html" and interactive():
            out = Path()  # a thousand lines of HTML are unreadable on a terminal
        if out is None:
            click.echo(html.render(page(), True) if form == "html" else markdown.render(page(), ""))
            return
        drawn = [page()]
        written = folder.write_html(drawn, out, True) if form == "html" else folder.write_markdown(drawn, out)
        for path in written:
            click.echo(f"written: {path}", err=True)


@click.command()
@click.argument("model", type=FILE)
@export_options
@of_loop("Loop to simulate.")
@click.option("--out", required=True, type=FILE, help="Parquet file: timestamp, PV, OP.")
@click.option(
    "--closed-loop", is_flag=True, help="Run the stated controller from SP instead of the recorded OP."
)
def simulate(model: Path, request: ExportRequest, tag: str, out: Path, closed_loop: bool) -> None:
    """Simulate a saved model on another recording of its loop; only a constant bias is fitted.

    Example: triage simulate model.json week2.parquet --loops loops.csv --loop FIC101 --out week2-sim.parquet
    """
    import pandas as pd

    from analyzer.explain.case import whole
    from analyzer.explain.models import read_model, simulated

    case, raw = whole(request, tag)
    pv, op = simulated(case, read_model(model, tag), raw.stamp_s, closed_loop)
    stamp = pd.to_datetime((raw.stamp_s * 1e6).round().astype("int64"), unit="us")
    pd.DataFrame({"timestamp": stamp, "PV": pv, "OP": op}).to_parquet(out, index=False)
