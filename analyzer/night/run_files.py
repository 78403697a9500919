"""What a run writes down of itself: by what it is known, and a log of what it does.

A stopped run is gone on with only by the same run; pieces of two exports are never mixed. The log is one that a
person can grep and a program can split: one line an event, appended, logfmt.

2026-03-03T01:00:02Z triage[4711] lost loop=FIC2101 status="not assessed" reason="no PV tag FIC2101.PV in the export"
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Mapping
from collections.abc import Set as AbstractSet
from dataclasses import fields, is_dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from identification.errors import InputError
from reports.texts import visible

PLAIN = frozenset("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._:/+-%")
"""Characters of values that need no quotes."""


Identity = Mapping[str, Any]
"""A run as it is written down beside its pieces: fingerprint, and words for people (export, loops, begun)."""


def in_one_order(value: object) -> bytes:
    """A value as bytes that are the same in every process: sets and mappings sorted, dataclasses by their fields.

    Raises
    ------
    TypeError
        The value holds something whose text may differ between processes.
    """
    return json.dumps(value, sort_keys=True, default=_plain).encode()


def _plain(value: Any) -> object:
    if is_dataclass(value):
        return [type(value).__name__, {f.name: getattr(value, f.name) for f in fields(value)}]
    if isinstance(value, AbstractSet):
        return sorted(value)
    if isinstance(value, Mapping):
        return dict(value)
    raise TypeError(f"{type(value).__name__} has no stated order")


def require_same(path: Path, run: Identity) -> None:
    """Raise InputError where the pieces at `path` are of another run; nothing where there are none."""
    try:
        stopped = json.loads(path.read_text(encoding="utf-8"))
        begun = f"{stopped['export']} ({stopped['loops']} loops, begun {stopped['begun']})"
        same = stopped["fingerprint"] == run["fingerprint"]
    except (OSError, ValueError, TypeError, KeyError, RecursionError):
        return
    if not same:
        raise InputError(
            f"the run that was stopped read {begun}, this one reads {run['export']} ({run['loops']} loops)",
            "--resume with the same EXPORT, --loops, --changes, --since, --until, --config and version",
            "give them again, or leave out --resume to give up what the stopped run had done",
        )


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
