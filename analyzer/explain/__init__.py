"""Explanation of a recording, with storage, pages and text.

A call of the package is a call of `analyzer.api.explain`. After the import of one of its modules, the package
has the name `triage.explain` in `import analyzer as triage`, so it must be callable.
"""

import sys
from types import ModuleType
from typing import Any


class _Callable(ModuleType):
    def __call__(self, *args: Any, **named: Any) -> Any:
        from analyzer.api import explain

        return explain(*args, **named)


sys.modules[__name__].__class__ = _Callable
