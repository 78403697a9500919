"""Which columns of a wide table say how good another one's values are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pyarrow as pa
import pyarrow.compute as pc

from analyzer.history.codes import is_understood, scheme_of
from analyzer.history.names import LONGEST, QUALITY_BEGINNING, QUALITY_ENDING, QUALITY_NAMES, plain
from analyzer.history.table import Table


def quality_columns(table: Table, free: Sequence[int]) -> tuple[dict[int, int], list[str]]:
    """Value column to quality column, by position, and sentences on columns that look like quality and are not used.

    A quality column is named for its tag (FIC101.PV_Q, Qual FIC101.PV), or stands right of its values under a bare
    name that comes several times (Status), or is the only one of its kind and speaks for the whole row.

    Parameters
    ----------
    table : Table
    free : sequence of int
        Columns that are not the time's.
    """
    names = table.names
    by_name = {names[i]: i for i in reversed(free)}
    named = {i: by_name[tag] for i in free if (tag := _tag_of(names[i], by_name)) is not None}
    found = {tag: i for i, tag in named.items() if _is_coded(table, i)}
    bare = [i for i in free if plain(names[i]) in QUALITY_NAMES and i not in found.values()]
    values = [i for i in free if i not in bare and i not in found.values()]
    said: list[str] = []
    if len(bare) > 1:
        beside = {i - 1: i for i in bare if i - 1 in values}
        return {**beside, **found}, said
    for i in bare:
        if _is_coded(table, i):
            found = {**dict.fromkeys(values, i), **found}
        elif looks_coded(table.head([i])[0]):
            said.append(
                f"column '{names[i]}' looks like quality and is not understood: its codes are not used; name those "
                "that are good with --good-quality if it is"
            )
    return found, said


def _tag_of(name: str, others: Mapping[str, int]) -> str | None:
    """The other column that a quality column is named for."""
    for pattern in (QUALITY_ENDING, QUALITY_BEGINNING):
        match = pattern.match(name) if len(name) <= LONGEST else None
        if match is not None and match["tag"] in others and match["tag"] != name:
            return match["tag"]
    return None


def _is_coded(table: Table, i: int) -> bool:
    """Whether a column named as quality holds codes: few kinds, whole numbers or known texts.

    A loop's flow may be called Q.
    """
    codes = table.head([i])[0].drop_null()
    if len(codes) == 0:
        return True
    if pa.types.is_floating(codes.type) and not pc.all(pc.equal(codes, pc.floor(codes))).as_py():
        return False
    return looks_coded(codes) and is_understood(codes, scheme_of(table.names[i], codes))


def looks_coded(codes: pa.Array) -> bool:
    """Whether a column has few distinct values, as codes have."""
    return len(codes) > 0 and len(codes.unique()) <= max(len(codes) // 10, 8)
