"""Entry point of the command `triage`: a program that cannot be imported ends with its own exit status."""

from __future__ import annotations

import sys

EXIT_NOTHING_DONE = 2
"""Exit status of a program that could not start; Python's own would be 1, which means that a night was written."""


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
        sys.exit(EXIT_NOTHING_DONE)
    commands()
