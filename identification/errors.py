"""The errors of the project.

Every error shown to a user names what was seen, what was expected and what to do.
"""

from __future__ import annotations


class TriageError(Exception):
    """Base of all errors that this project raises on purpose."""


class InputError(TriageError):
    """An export, a loops.csv or an option cannot be used as it is.

    seen : what was found, with file, tag, column and row if known; expected : what would have been usable; remedy :
    what the user can do.
    """

    def __init__(self, seen: str, expected: str, remedy: str) -> None:
        self.seen, self.expected, self.remedy = seen, expected, remedy
        super().__init__(f"{seen}; expected {expected}; {remedy}")

    def __reduce__(self) -> tuple[type[InputError], tuple[str, str, str]]:
        """Pickling between processes: by the constructor's arguments."""
        return type(self), (self.seen, self.expected, self.remedy)


class NotNowError(TriageError):
    """A file or a storage cannot be read or written now, without evidence of damage: the same command may succeed
    later."""


class NotAssessedError(TriageError):
    """A question cannot be answered from this record; the text gives what it needs and what it has."""
