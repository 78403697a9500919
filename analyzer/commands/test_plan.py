"""The command `test-plan`: design of a step test for the unknown parameters of one loop."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from analyzer.commands.options import PLACE, export_options, of_loop, print_visible

if TYPE_CHECKING:
    from analyzer.night.request import ExportRequest


@click.command(name="test-plan")
@export_options
@of_loop("The loop to test.")
@click.option("--store", type=PLACE, help="Store whose nights describe the loop.")
def test_plan(request: ExportRequest, tag: str, store: Path | None) -> None:
    """The step test for the unknown parameters of a loop: size, levels, times, and expected precision.

    Example: triage test-plan export.parquet --loops loops.csv --loop TIC2106 --store store
    """
    from analyzer.loop.experiments.test_plan import plan_lines
    from analyzer.night.opened import guarded

    for line in plan_lines(guarded(request).last_night(tag), store):
        print_visible(line)
