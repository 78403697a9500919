"""Limits in a file: read and checked, and printed with what each of them means."""

from __future__ import annotations

import textwrap
import tomllib
from collections.abc import Mapping
from dataclasses import Field, fields, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from analyzer.config import Config
from identification.errors import InputError
from identification.limits import KEY, Limit

REMEDY = "correct it; 'triage config' prints all limits with their ranges"
WIDTH = 100
"""Characters of a comment's line."""


def read_config(path: Path | None) -> Config:
    """The limits of a file, defaults where it is silent; the defaults alone without one.

    Raises
    ------
    InputError
        Where the file is not TOML, or has an unknown name, a wrong type or a value out of range.
    """
    if path is None:
        return Config()
    try:
        stated = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (ValueError, RecursionError) as error:  # of the decoder, of the encoding, of numbers without end
        raise InputError(
            f"{path}: {error}", "TOML in UTF-8", "begin with what 'triage config' prints"
        ) from error
    return configured(stated, str(path))


def configured(stated: Mapping[str, Any], where: str) -> Config:
    """The limits with those that are stated, by section and name, in place of the defaults.

    Raises
    ------
    InputError
        For an unknown name, a wrong type or a value out of range.
    """
    config = Config()
    changed = {}
    for name, section in stated.items():
        _require_known(name, [f.name for f in fields(config)], f"{where}: section [{name}]")
        if not isinstance(section, Mapping):
            raise InputError(f"{where}: {name} is {section!r}", f"a section [{name}]", REMEDY)
        changed[name] = _section(getattr(config, name), section, f"{where}: [{name}]")
    return replace(config, **changed)


def _require_known(name: str, known: list[str], seen: str) -> None:
    if name not in known:
        near = get_close_matches(name, known, n=1)
        raise InputError(seen, f"{near[0]}" if near else "one of " + ", ".join(known), REMEDY)


def _section(limits: Any, stated: Mapping[str, Any], where: str) -> Any:
    """A section's limits with those that are stated."""
    known = {f.name: f for f in fields(limits)}
    values = {}
    for name, value in stated.items():
        _require_known(name, list(known), f"{where} {name}")
        values[name] = _checked(known[name], getattr(limits, name), value, f"{where} {name}")
    return replace(limits, **values)


def _checked(field: Field[Any], default: Any, value: Any, where: str) -> Any:
    """A value of the field's type, within its range."""
    said = limit_of(field)
    if isinstance(default, tuple):
        return _table(said, value, where)
    whole = isinstance(default, int)
    if not _is_number(value, said, whole):
        kind = "a whole number" if whole else "a number"
        raise InputError(f"{where} is {value!r}", f"{kind} {_range(said)}", REMEDY)
    return value if whole else float(value)


def _is_number(value: Any, said: Limit, whole: bool = False) -> bool:
    """Whether a value is a number of the kind that is wanted, within its range."""
    if isinstance(value, bool) or not isinstance(value, int if whole else (int, float)):
        return False
    return bool(said.least <= value <= said.most)  # false of NaN


def _table(said: Limit, value: Any, where: str) -> tuple[tuple[str, float, float], ...]:
    """Rows of a loop's type and two numbers."""
    rows = value if isinstance(value, list) else [value]
    for row in rows:
        shaped = isinstance(row, list) and len(row) == 3 and isinstance(row[0], str)
        if not shaped or not all(_is_number(cell, said) for cell in row[1:]):
            raise InputError(
                f"{where} has {row!r}", f'rows such as ["flow", 60.0, 30.0], {_range(said)}', REMEDY
            )
    return tuple((row[0].lower(), float(row[1]), float(row[2])) for row in rows)


def limit_of(field: Field[Any]) -> Limit:
    """What is declared of a field."""
    said: Limit = field.metadata[KEY]
    return said


def _range(said: Limit) -> str:
    unit = "" if said.unit == "-" else f" [{said.unit}]"
    return f"from {said.least:g} to {said.most:g}{unit}"


def limits_document(config: Config) -> str:
    """Limits as TOML, each with unit, range, meaning and source as a comment."""
    parts = [_part(f.name, getattr(config, f.name)) for f in fields(config)]
    return "\n".join(
        ["# Limits of triage; a file given with --config needs only those that it changes.", *parts]
    )


def _part(name: str, limits: Any) -> str:
    first = (type(limits).__doc__ or "").splitlines()[0]
    lines = ["", f"# {first}", f"[{name}]"]
    for field in fields(limits):
        said = limit_of(field)
        text = f"{said.meaning}. {_range(said).capitalize()}; {said.source}."
        lines += [f"# {line}" for line in textwrap.wrap(text, WIDTH)]
        lines.append(f"{field.name} = {_value(getattr(limits, field.name))}")
    return "\n".join(lines)


def _value(value: Any) -> str:
    if isinstance(value, tuple):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    return repr(value)
