"""What the signals of one loop are called: endings of tags by control system."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

ROLES = ("sp", "pv", "op", "mode", "position")

# The same ending means different things: CV is a current value in DeltaV and an output in Rockwell, MV an
# output in Yokogawa. So a loop follows one row as a whole: the one that explains most of its tags. What that row
# leaves without a tag is taken from the others, of tags that are free: where PV is PV, a CV is the output.
ENDINGS: Mapping[str, Mapping[str, tuple[str, ...]]] = {
    "plain": {
        "sp": ("SP", "SETPOINT", "SETP"),
        "pv": ("PV",),
        "op": ("OP", "OUT", "CO", "OUTPUT"),
        "mode": ("MODE", "MD"),
        "position": ("POS", "POSITION", "ZT"),
    },
    "Yokogawa": {"sp": ("SV",), "pv": ("PV",), "op": ("MV",), "mode": ("MODE",)},
    "Siemens": {"sp": ("SP", "SP_INT"), "pv": ("PV", "PV_IN"), "op": ("LMN", "MV"), "mode": ("MODE",)},
    "Rockwell": {"sp": ("SP",), "pv": ("PV",), "op": ("CV",), "mode": ("MODE",)},
    "Foxboro": {"sp": ("SPT",), "pv": ("MEAS",), "op": ("OUT",), "mode": ("MA",)},
    "DeltaV": {"sp": ("SP.CV",), "pv": ("PV.CV",), "op": ("OUT.CV",), "mode": ("MODE.ACTUAL", "MODE.CV")},
    "German": {
        "sp": ("SOLLWERT", "SOLL"),
        "pv": ("ISTWERT", "IST"),
        "op": ("STELLGRÖSSE", "STELLGRÖßE", "STELLGROESSE", "STELLWERT", "STELLSIGNAL"),
    },
    "Valmet": {"sp": ("SPA", "SP"), "pv": ("ME",), "op": ("CON",)},
}
_KNOWN = {ending for roles in ENDINGS.values() for endings in roles.values() for ending in endings}
_ENDINGS = "|".join(re.escape(ending) for ending in sorted(_KNOWN))
_SPLIT = re.compile(rf"^(?P<loop>.+?)(?:[._:/]| (?=\w{{4,}}$))(?P<ending>{_ENDINGS})$", re.IGNORECASE)
_BLOCK = re.compile(r"^(?P<module>.+)/[^/]+$")


def loops_of(tags: Iterable[str]) -> dict[str, dict[str, str]]:
    """Loops with at least a PV: name to the tag of each role ('sp', 'pv', 'op', 'mode', 'position').

    A function block is left out of the name where its module has no other: FIC1/PID1/PV.CV is of loop FIC1.
    """
    groups: dict[str, dict[str, str]] = {}
    for tag in tags:
        split = _SPLIT.match(tag)
        if split:
            groups.setdefault(split["loop"], {}).setdefault(split["ending"].upper(), tag)
    found = {loop: _roles(endings) for loop, endings in groups.items()}
    return _without_blocks({loop: roles for loop, roles in found.items() if "pv" in roles})


def _roles(endings: Mapping[str, str]) -> dict[str, str]:
    """Tags by role, as the control system has it that explains most endings."""
    readings = [_reading(endings, system) for system in ENDINGS]
    roles = max(readings, key=lambda roles: ("pv" in roles, len(roles)))
    for role in ("sp", "op"):
        others = (ending for system in ENDINGS.values() for ending in system.get(role, ()))
        free = (endings[e] for e in others if e in endings and endings[e] not in roles.values())
        if role not in roles and (tag := next(free, None)) is not None:
            roles[role] = tag
    return roles


def _reading(endings: Mapping[str, str], system: str) -> dict[str, str]:
    roles = ENDINGS[system]
    tags = {role: next((endings[e] for e in roles.get(role, ()) if e in endings), None) for role in ROLES}
    return {role: tag for role, tag in tags.items() if tag is not None}


def _without_blocks(loops: dict[str, dict[str, str]]) -> dict[str, dict[str, str]]:
    modules = {loop: match["module"] for loop in loops if (match := _BLOCK.match(loop))}
    single = {loop: module for loop, module in modules.items() if list(modules.values()).count(module) == 1}
    return {single.get(loop, loop) if single.get(loop) not in loops else loop: loops[loop] for loop in loops}
