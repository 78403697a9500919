"""Times and controller settings in words, with their units; no settings stand anywhere without them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def duration(seconds: float | None) -> str:
    """A length of time in the unit that reads best."""
    if seconds is None:
        return ""
    if seconds < 120:
        return f"{seconds:.3g} s"
    return f"{seconds / 60:.3g} min" if seconds < 7200 else f"{seconds / 3600:.3g} h"


def gain_unit(kind: str | None, pv_unit: str | None) -> str:
    """The unit of a controller gain as loops.csv states it."""
    if kind == "band":
        return "% band"
    return f"%/{pv_unit or 'PV unit'}" if kind == "engineering" else "%/%"


def settings(kp: float | None, ti: float | None, gain: str, time: str) -> str:
    """Kp and Ti with their units; '' where neither is known, 'no integral action' for a Ti of 0."""
    parts = [f"Kp {kp:.3g} {gain}"] if kp is not None else []
    if ti is not None:
        parts.append(f"Ti {ti:.3g} {time}" if ti else "no integral action")
    return ", ".join(parts)


def row_settings(row: Mapping[str, Any], kp: str = "kp", ti: str = "ti") -> str:
    """The settings in two columns of a row of the night, with the units that the row states."""
    gain = gain_unit(row["gain_unit"], row["pv_unit"])
    return settings(row[kp], row[ti], gain, row["ti_unit"] or "s")
