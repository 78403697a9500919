"""A file of named columns, whatever its format: what layouts read from."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

import pyarrow as pa

from analyzer.history.clock import Clock
from analyzer.history.raw import Raw
from analyzer.history.stray import MainSpan


class Table(Protocol):
    """Columns by position; `read` touches no other column.

    `path` is the file, `names` and `types` are of its columns, `notes` what was found out about its format,
    `decimal` the mark in numbers that stand among texts, `first_row` the number of the first row of data as
    an editor counts them (None for binary files).
    """

    @property
    def path(self) -> Path: ...
    @property
    def names(self) -> tuple[str, ...]: ...
    @property
    def types(self) -> tuple[pa.DataType, ...]: ...
    @property
    def notes(self) -> tuple[str, ...]: ...
    @property
    def decimal(self) -> str: ...
    @property
    def first_row(self) -> int | None: ...

    def head(self, columns: Sequence[int]) -> list[pa.Array]:
        """First rows of some columns, for detection."""

    def read(self, columns: Sequence[int], where: tuple[int, Sequence[str]] | None = None) -> list[pa.Array]:
        """Whole columns, or only the rows where column `where[0]` holds one of `where[1]`."""


class Source(Protocol):
    """One file whose layout is understood; small, picklable, holds no samples."""

    @property
    def path(self) -> Path: ...
    @property
    def tags(self) -> tuple[str, ...]: ...
    @property
    def notes(self) -> tuple[str, ...]: ...

    @property
    def clock(self) -> Clock: ...

    def with_clock(self, clock: Clock) -> Source:
        """The same file, its stamps read by another clock."""

    def read(self, tags: Sequence[str]) -> dict[str, Raw]:
        """Samples of those of `tags` that the file holds."""

    def span(self) -> MainSpan:
        """Where the samples lie in time, stray ones apart [s since 1970-01-01 UTC]."""
