"""For mypy: the fields that limits.toml gives to each class of limits, with their types (identification/limits.py).

As of a dataclass: attributes, keyword arguments of the class, and those of `dataclasses.replace`.
"""

import hashlib
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mypy.nodes import ARG_NAMED_OPT, Argument, StrExpr, Var
from mypy.plugin import ClassDefContext, Plugin, ReportConfigContext
from mypy.plugins.common import add_attribute_to_class, add_method_to_class
from mypy.types import NoneType

ROOT = Path(__file__).parents[1]
BASE = "identification.limits.Limits"


def filled(ctx: ClassDefContext) -> None:
    """Give a class the fields of its section."""
    section, package = ctx.cls.keywords["section"], ctx.cls.fullname.partition(".")[0]
    assert isinstance(section, StrExpr)
    stated = tomllib.loads((ROOT / package / "limits.toml").read_text("utf-8"))[section.value]
    given = []
    for name, said in stated.items():
        held = tuple if isinstance(said[0], list) else type(said[0])
        kind = ctx.api.named_type(f"builtins.{held.__name__}")
        add_attribute_to_class(ctx.api, ctx.cls, name, kind)
        given.append(Argument(Var(name, kind), kind, None, ARG_NAMED_OPT))
    add_method_to_class(ctx.api, ctx.cls, "__init__", given, NoneType())
    add_method_to_class(ctx.api, ctx.cls, "__mypy-replace", given, NoneType(), is_staticmethod=True)


class LimitsTypes(Plugin):
    """Asks limits.toml what a class of limits holds."""

    def get_base_class_hook(self, fullname: str) -> Callable[[ClassDefContext], None] | None:
        """What is done with a class of such a base."""
        return filled if fullname == BASE else None

    def report_config_data(self, ctx: ReportConfigContext) -> Any:
        """What makes mypy's cache stale: other limits."""
        files = sorted(ROOT.glob("*/limits.toml"))
        return hashlib.sha256(b"".join(f.read_bytes() for f in files)).hexdigest()


def plugin(version: str) -> type[Plugin]:
    """What mypy asks for."""
    return LimitsTypes
