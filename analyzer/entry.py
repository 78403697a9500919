"""Where the command `triage` begins: a program that cannot even be imported ends with a status of its own."""

from __future__ import annotations

import sys

NOTHING_DONE = 2
"""Exit status of a program that could not start; Python's own would be 1, which says that a night is there."""


def main() -> None:
    """Run a command."""
    try:
        from analyzer.cli import main as commands
    except Exception as error:
        why = " ".join(f"{type(error).__name__}: {error}".split())[:300]
        print(
            f"triage: cannot start ({why}); expected all that it was installed with; install it again",
            file=sys.stderr,
        )
        sys.exit(NOTHING_DONE)
    commands()
