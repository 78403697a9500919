"""Explanation of a recording, with storage, pages and text.

The package is callable and then is `analyzer.api.explain`: once any of its modules is imported, it occupies the name
`triage.explain` of `import analyzer as triage`.
"""

import sys
from types import ModuleType
from typing import Any


class _Callable(ModuleType):
    def __call__(self, *args: Any, **named: Any) -> Any:
        from analyzer.api import explain

        return explain(*args, **named)


sys.modules[__name__].__class__ = _Callable
