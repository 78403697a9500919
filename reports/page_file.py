"""Conversion of a page to text for a store, and back: computed once, rendered when needed.

Every part is a mapping with its kind under "is"; arrays are base64, times in double precision and other numbers in
single precision. Only the kinds of pages.py are known; nothing is executed.
"""

from __future__ import annotations

import base64
import binascii
import dataclasses
import json
from typing import Any

import numpy as np

from reports import pages

KINDS = {k.__name__: k for k in vars(pages).values() if isinstance(k, type) and dataclasses.is_dataclass(k)}
"""The classes of page parts."""
FULL = 1e5
"""Arrays with values above this are kept in double precision: they are times."""
TYPES = {"f4": np.float32, "f8": np.float64, "b1": np.bool_}
ENDS = {"inf": float("inf"), "-inf": float("-inf"), "nan": float("nan")}


def dumps(page: pages.Page) -> str:
    """A page as text."""
    return json.dumps(_data(page), separators=(",", ":"), allow_nan=False)


def _data(x: Any) -> Any:
    if dataclasses.is_dataclass(x):
        own = {f.name: _data(getattr(x, f.name)) for f in dataclasses.fields(x)}
        return {"is": type(x).__name__} | own
    if isinstance(x, np.ndarray):
        return {"is": "array"} | _array(x)
    if isinstance(x, list | tuple):
        return [_data(v) for v in x]
    if isinstance(x, np.generic):
        x = x.item()
    if isinstance(x, float) and not np.isfinite(x):
        return {"is": "number", "value": repr(x)}
    return x


def _array(x: np.ndarray) -> dict[str, Any]:
    large = x.dtype != np.bool_ and x.size > 0 and float(np.nanmax(np.abs(x), initial=0.0)) >= FULL
    code = "b1" if x.dtype == np.bool_ else "f8" if large else "f4"
    shape = {"shape": list(x.shape)} if x.ndim > 1 else {}
    values = base64.b64encode(np.ascontiguousarray(x, TYPES[code]).tobytes()).decode()
    return shape | {"type": code, "values": values}


def loads(text: str) -> pages.Page | None:
    """A page from its text; None if the text is not a page, or one of another version."""
    try:
        found = _part(json.loads(text))
    except (ValueError, KeyError, TypeError, binascii.Error, RecursionError):
        return None
    return found if isinstance(found, pages.Page) else None


def _part(x: Any) -> Any:
    if isinstance(x, list):
        return tuple(_part(v) for v in x)
    if not isinstance(x, dict):
        return x
    kind = x.pop("is")
    if kind == "number":
        return ENDS[x["value"]]
    if kind == "array":
        values: np.ndarray = np.frombuffer(base64.b64decode(x["values"], validate=True), TYPES[x["type"]])
        values = values.reshape(x.get("shape", -1))
        return values.copy() if x["type"] == "b1" else values.astype(np.float64)
    return KINDS[kind](**{k: _part(v) for k, v in x.items()})
