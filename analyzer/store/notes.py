"""Users' notes on loops: stored line by line, the newest valid for the loop.

A line is one JSON object; lines are only appended, so that two writers lose nothing and a night can run meanwhile.
"""

from __future__ import annotations

import errno
import getpass
import json
import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from analyzer.history.plant_clock import stamp
from analyzer.locations import is_remote
from identification.errors import InputError
from reports.texts import visible

FILE = "notes.jsonl"
"""Name within the store."""
STATES = ("open", "ordered", "done", "checked")
"""States of the work on a loop."""
FINISHED = STATES[2:]
"""States of finished work: the nights after it are compared with those before."""
LATEST_S = 32503680000.0
"""Times of notes after the year 3000 are invalid [s since 1970-01-01 UTC]."""


@dataclass(frozen=True, slots=True)
class Note:
    """A note: the loop, time [s since 1970-01-01 UTC], text, author, the date until which the loop is hidden, the
    state of the work (STATES) and its due date, each '' if not given."""

    loop: str
    time_s: float
    text: str
    owner: str = ""
    hidden_until: str = ""
    state: str = ""
    due: str = ""

    def as_line(self, zone: str | None) -> str:
        """The note in one line, with its time on the plant's clock."""
        more = f", {self.state}" if self.state else ""
        more += f", due {self.due}" if self.due else ""
        more += f", hidden until {self.hidden_until}" if self.hidden_until else ""
        return f"{self.text} ({self.owner or 'unknown'}, {stamp(self.time_s, zone)}{more})"


def user() -> str:
    """User name from the system; '' if there is none."""
    try:
        return getpass.getuser()
    except (OSError, KeyError, ImportError):
        return ""


def add(store: Path, note: Note) -> None:
    """Append a note to a store, on its own line also after an incomplete one.
    Raises OSError if it could not be written
    completely, on a full disk for example."""
    line = (json.dumps(asdict(note), ensure_ascii=False) + "\n").encode("utf-8")
    if is_remote(store):  # an object cannot be appended to
        path = store / FILE
        before = path.read_bytes() if path.exists() else b""
        path.write_bytes(before + (b"" if before[-1:] in (b"", b"\n") else b"\n") + line)
        return
    with (store / FILE).open("ab+", buffering=0) as file:
        if file.tell():
            file.seek(-1, os.SEEK_END)
            line = line if file.read(1) == b"\n" else b"\n" + line
        if file.write(line) != len(line):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(store / FILE))


def new(
    loop: str, text: str, owner: str | None, hidden_until: str = "", state: str = "", due: str = ""
) -> Note:
    """A note with the present time. Raises InputError where the text is empty."""
    words, by = " ".join(visible(text).split()), visible(user() if owner is None else owner)
    if not words:
        remedy = 'state it: triage note STORE LOOP "..."'
        raise InputError(f"an empty note on {loop}", "what was seen or done", remedy)
    return Note(loop, time.time(), words, by, hidden_until, state, due)


def _note_lines(store: Path) -> list[str]:
    try:
        return (store / FILE).read_text(encoding="utf-8", errors="replace").split("\n")
    except OSError:
        return []


def read_notes(store: Path) -> dict[str, tuple[Note, ...]]:
    """The notes of a store by loop, oldest first; invalid lines are skipped."""
    out: dict[str, list[Note]] = {}
    for note in filter(None, map(_parsed_note, _note_lines(store))):
        out.setdefault(note.loop, []).append(note)
    return {loop: tuple(sorted(own, key=lambda n: n.time_s)) for loop, own in out.items()}


def broken(store: Path) -> int:
    """Number of invalid lines in a store's notes."""
    return sum(bool(line.strip()) and _parsed_note(line) is None for line in _note_lines(store))


def _parsed_note(line: str) -> Note | None:
    """The note of a line; None for an invalid line of any kind."""
    try:
        data = json.loads(line)
        parts = [data.get(k, "") for k in ("loop", "text", "owner", "hidden_until", "state", "due")]
        at_s = float(data["time_s"])
    except (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError):
        return None
    if not all(isinstance(x, str) for x in parts) or not 0.0 <= at_s <= LATEST_S:
        return None
    loop, *texts = parts
    return Note(loop, at_s, *map(visible, texts))


def last(notes: Mapping[str, tuple[Note, ...]], loop: str) -> Note | None:
    """The newest note of a loop."""
    own = notes.get(loop, ())
    return own[-1] if own else None


@dataclass(frozen=True, slots=True)
class Work:
    """The work on a loop from its notes: the newest note, the owner, the state, its time [s since 1970-01-01 UTC],
    and the due date, '' for none."""

    note: Note
    owner: str
    state: str
    since_s: float
    due: str


def work_on(notes: Sequence[Note]) -> Work:
    """The state of work from a loop's notes, oldest first: each part from the newest note that contains it.

    The time of work that was done and then checked is that of done.
    """
    states = [n for n in notes if n.state] or [notes[0]]
    reached = states[-1]
    since = next((n for n in reversed(states) if n.state not in FINISHED), None)
    first = states[states.index(since) + 1] if since is not None and since is not reached else states[0]
    owner = next((n.owner for n in reversed(notes) if n.owner), "")
    due = next((n.due for n in reversed(notes) if n.due), "")
    since_s = first.time_s if reached.state in FINISHED else reached.time_s
    return Work(notes[-1], owner, reached.state or STATES[0], since_s, due)


def is_hidden(note: Note | None, night: str) -> bool:
    """Whether a note hides its loop from the list of a night."""
    return note is not None and hides(note.hidden_until, night)


def hides(until: str | None, night: str) -> bool:
    """Whether a night is before the date until which a loop is hidden, if any."""
    return bool(until) and night < str(until)
