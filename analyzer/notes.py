"""What people write about loops: kept in the store line by line, the newest standing for the loop.

A line is one JSON object; lines are only ever added, so that two writers lose nothing and a night can run meanwhile.
"""

from __future__ import annotations

import getpass
import json
import os
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from analyzer.plant_clock import stamp
from identification.errors import InputError

FILE = "notes.jsonl"
"""Name within the store."""


@dataclass(frozen=True, slots=True)
class Note:
    """A note: the loop, when [s since 1970-01-01 UTC], what, by whom, and the date until which the loop is hidden."""

    loop: str
    time_s: float
    text: str
    owner: str = ""
    hidden_until: str = ""

    def said(self, zone: str | None) -> str:
        """The note in one line, its time on the plant's clock."""
        until = f", hidden until {self.hidden_until}" if self.hidden_until else ""
        return f"{self.text} ({self.owner or 'unknown'}, {stamp(self.time_s, zone)}{until})"


def user() -> str:
    """Who writes, as the system names them; '' where it does not."""
    try:
        return getpass.getuser()
    except (OSError, KeyError, ImportError):
        return ""


def add(store: Path, note: Note) -> None:
    """Add a note to a store, written whole or not at all."""
    line = json.dumps(asdict(note), ensure_ascii=False) + "\n"
    handle = os.open(store / FILE, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
    try:
        os.write(handle, line.encode("utf-8"))
    finally:
        os.close(handle)


def new(loop: str, text: str, owner: str | None, hidden_until: str) -> Note:
    """A note of now.

    Raises
    ------
    InputError
        The text says nothing.
    """
    told = " ".join(text.split())
    if not told:
        raise InputError(
            f"an empty note on {loop}", "what was seen or done", 'say it: triage note STORE LOOP "..."'
        )
    return Note(loop, time.time(), told, user() if owner is None else owner, hidden_until)


def read(store: Path) -> dict[str, tuple[Note, ...]]:
    """The notes of a store by loop, oldest first; lines that are none are passed over."""
    try:
        lines = (store / FILE).read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return {}
    out: dict[str, list[Note]] = {}
    for line in lines:
        try:
            found = Note(**json.loads(line))
        except (ValueError, TypeError):
            continue
        out.setdefault(found.loop, []).append(found)
    return {loop: tuple(sorted(own, key=lambda n: n.time_s)) for loop, own in out.items()}


def last(notes: Mapping[str, tuple[Note, ...]], loop: str) -> Note | None:
    """The newest note of a loop."""
    own = notes.get(loop, ())
    return own[-1] if own else None


def is_hidden(note: Note | None, night: str) -> bool:
    """Whether a note keeps its loop out of the list of a night."""
    return note is not None and bool(note.hidden_until) and night < note.hidden_until
