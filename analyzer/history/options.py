"""What a user may state about an export instead of leaving it to detection."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """How exports are written; None means: find out from the file.

    Parameters
    ----------
    delimiter, decimal, encoding : str or None
        Of delimited text: the separator of columns, the decimal mark, the character encoding.
    day_first : bool or None
        True where 03/04/2024 is the third of April.
    date_format : str or None
        Format of the stamps in the notation of `datetime.strptime`.
    timezone : str or None
        IANA name of the zone of stamps that state none; None takes them as UTC.
    time_column, quality_column : str or None
        Names of the columns of stamps and, in long tables, of quality codes as they stand in the header.
    good_quality : tuple of str or None
        Quality codes or texts that count as good, in place of the detected scheme.
    scratch : Path or None
        Directory for plain copies of packed files; None: this process's own, gone with it.
    """

    delimiter: str | None = None
    decimal: str | None = None
    encoding: str | None = None
    day_first: bool | None = None
    date_format: str | None = None
    timezone: str | None = None
    good_quality: tuple[str, ...] | None = None
    time_column: str | None = None
    quality_column: str | None = None
    scratch: Path | None = None
