"""The command `test-plan`: the step test of one loop that settles what is unknown."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from analyzer.commands.options import PLACE, export_options, of_loop, say

if TYPE_CHECKING:
    from analyzer.night.asked import Asked


@click.command(name="test-plan")
@export_options
@of_loop("The loop to test.")
@click.option("--store", type=PLACE, help="Store whose nights tell what is known of the loop.")
def test_plan(asked: Asked, tag: str, store: Path | None) -> None:
    """The step test that settles what is unknown of a loop: size, levels, times, and what it should tell.

    Example: triage test-plan export.parquet --loops loops.csv --loop TIC2106 --store store
    """
    from analyzer.loop.test_plan import plan_lines
    from analyzer.night.opened import guarded

    for line in plan_lines(guarded(asked).last_night(tag), store):
        say(line)
