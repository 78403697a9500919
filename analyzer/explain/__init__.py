"""From a recording to its explanation, stored and told.

The package can be called, and then is `analyzer.api.explain`: once any of its modules is imported, it stands where
`import analyzer as triage` looks for `triage.explain`.
"""

import sys
from types import ModuleType
from typing import Any


class _Callable(ModuleType):
    def __call__(self, *args: Any, **named: Any) -> Any:
        from analyzer.api import explain

        return explain(*args, **named)


sys.modules[__name__].__class__ = _Callable
