"""The messages for the mistakes of a first hour, as a page: python -m proofs.first_hour > docs/first-hour.md"""

from __future__ import annotations

import csv
import io
import tempfile
from pathlib import Path

from click.testing import CliRunner

from analyzer.cli import main as triage
from proofs.first_hour.cases import MISTAKES, Mistake

HEAD = """# First mistakes and their messages

`python -m proofs.first_hour > docs/first-hour.md` writes this page, and tests/proofs/first_hour repeats each case.
The trends are of a level loop that cycles because of a valve backlash of 4 %. Exit status 2 means that nothing could
be done. Exit status 0 means that a night was written; its list then reports what the trends can show.

| mistake | exit | message | in the list |
|---|---|---|---|"""


def answered(mistake: Mistake, folder: Path) -> tuple[int, str, str, str]:
    """Exit status, the last printed line, and action and reason in the list; '' where there is no list."""
    command = mistake.made(folder)
    done = CliRunner(env={"COLUMNS": "200"}).invoke(triage, command)
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    lines = [line for line in (done.stderr + done.stdout).splitlines() if line.strip()]
    matching = [line for line in lines if mistake.message in line] or lines[-1:]
    action = reason = ""
    if done.exit_code == 0 and command[0] == "run":
        listed = CliRunner().invoke(triage, ["rank", str(folder / "store"), "--format", "csv"])
        row = next(csv.DictReader(io.StringIO(listed.stdout)))
        action, reason = row["action"], row["reason"]
    return done.exit_code, matching[-1].replace(str(folder), "."), action, reason


def quoted(text: str) -> str:
    """Output of the program as inline code in a cell of a table."""
    return f"`{text.replace('|', '/')}`" if text else ""


def main() -> None:
    """Print the page."""
    print(HEAD)
    for mistake in MISTAKES:
        with tempfile.TemporaryDirectory() as folder:
            status, message, action, reason = answered(mistake, Path(folder))
        shown = f"{action}: {reason}" if action else ""
        print(f"| {mistake.what} | {status} | {quoted(message)} | {quoted(shown)} |")


if __name__ == "__main__":
    main()
