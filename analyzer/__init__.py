"""Ranking of loops, storage of results, and the command line. Imports all other packages.

`import analyzer as triage` gives a notebook its seven functions (docs/python.md), imported on first use: no command
of the shell waits for modules that it does not use.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from analyzer.api import assess, explain, fit, nights, read, simulate, tune

__all__ = ["assess", "explain", "fit", "nights", "read", "simulate", "tune"]


def __getattr__(name: str) -> Any:
    """One of the seven functions, from analyzer/api.py."""
    if name not in __all__:
        raise AttributeError(f"module 'analyzer' has no attribute {name!r}")
    return getattr(import_module("analyzer.api"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
