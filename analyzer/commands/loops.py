"""The command `loops`: a draft of loops.csv from an unordered list of tags."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from analyzer.commands.options import bar, export_options, print_visible

if TYPE_CHECKING:
    from analyzer.night.request import ExportRequest


@click.command()
@export_options
@click.option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    help="File that the draft is written to. Default: stdout.",
)
def loops(request: ExportRequest, out: Path | None) -> None:
    """Write a draft of loops.csv: the loops of an export, found by their tags' names and by the data.

    Loops stated with --loops are kept. A loop with low confidence is written after a #, with the evidence for it.

    Example: triage loops export.parquet --out loops.csv
    """
    from analyzer.finder.as_csv import as_csv
    from analyzer.night.opened import drafted
    from reports.whole_file import whole_file

    with bar("tags") as progress:
        rows = drafted(request, progress)
    text = as_csv(rows)
    if out is None:
        click.echo(text, nl=False)
    else:
        with whole_file(out) as path:
            path.write_text(text, encoding="utf-8")
    sure = [row for row in rows if row.sure]
    kinds = ", ".join(
        f"{n} {by}" for by in ("stated", "names", "data") if (n := sum(r.found_by == by for r in sure))
    )
    more = f"; {len(rows) - len(sure)} less sure, behind #" if len(rows) > len(sure) else ""
    print_visible(f"{len(sure)} loops ({kinds or 'none'}){more}{f', in {out}' if out else ''}", err=True)
