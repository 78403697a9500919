"""A log of nights that a person can grep and a program can split: one line an event, appended, logfmt.

2026-03-03T01:00:02Z triage[4711] lost loop=FIC2101 status="not assessed" reason="no PV tag FIC2101.PV in the export"
"""

from __future__ import annotations

import os
import sys
from datetime import UTC, datetime
from pathlib import Path

from reports.texts import visible

PLAIN = frozenset("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._:/+-%")
"""Characters of values that need no quotes."""


def logfmt(value: object) -> str:
    """A value as one word or one quoted text, in printable characters alone."""
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    shown = visible(text)
    if shown and set(shown) <= PLAIN:
        return shown
    return '"' + shown.replace("\\", "\\\\").replace('"', '\\"') + '"'


class RunLog:
    """Where a run says what it does; nowhere without a path.

    A log that cannot be written costs one line on stderr, and never the night.
    """

    def __init__(self, path: Path | None) -> None:
        self._path = path

    def say(self, event: str, **facts: object) -> None:
        """Append one line: time [UTC], process, event, and facts as name=value."""
        if self._path is None:
            return
        now = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
        told = "".join(f" {name}={logfmt(value)}" for name, value in facts.items())
        line = f"{now} triage[{os.getpid()}] {event}{told}\n".encode()
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with self._path.open("ab", buffering=0) as file:
                file.write(line)
        except OSError as error:
            print(f"triage: no log is kept: {self._path}: {error.strerror}", file=sys.stderr)
            self._path = None
