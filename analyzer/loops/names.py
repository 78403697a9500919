"""Loop and role of a tag from its name: by the endings of control systems, words, and ISA letters."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

from analyzer.loops.spec import ROLES, STATED

ENDINGS: Mapping[str, Mapping[str, Sequence[str]]] = STATED["endings"]
"""By control system and role."""
WORDS: Mapping[str, Mapping[str, Sequence[str]]] = STATED["words"]
"""The same for words that also occur in other tags: they count only if two of them occur together."""
SYSTEMS = (*ENDINGS.values(), *WORDS.values())


def _all(systems: Iterable[Mapping[str, Sequence[str]]]) -> frozenset[str]:
    return frozenset(ending for roles in systems for endings in roles.values() for ending in endings)


SURE = _all(ENDINGS.values())
_ENDINGS = "|".join(re.escape(e).replace("_", "[ _]?") for e in sorted(_all(SYSTEMS), key=len, reverse=True))
_BEHIND = re.compile(rf"^(?P<loop>.+?)(?P<mark>[._:/#|!\\-]| )(?P<ending>{_ENDINGS})$", re.IGNORECASE)
_BEFORE = re.compile(rf"^(?P<ending>{_ENDINGS})[._:/ -](?P<loop>.*\d.*)$", re.IGNORECASE)
_BARE = re.compile(rf"^(?P<ending>{_ENDINGS})$", re.IGNORECASE)
_NO_NAME = re.compile("|".join(STATED["naming"]["no_name"]), re.IGNORECASE)
"""Parts around a name that do not belong to it: units, the word value, the domain of a home's sensor."""
_BLOCK = re.compile(rf"^(?P<module>.+)/(?:{'|'.join(STATED['naming']['blocks'])})$", re.IGNORECASE)
_ISA = re.compile(
    r"^(?P<area>.*?)(?<![A-Za-z])(?P<kind>[A-Z])(?P<function>[A-Z]{1,2})(?P<mark>[-_. ]?)(?P<number>\d+[A-Z]?)$"
)
ISA: Mapping[str, Sequence[str]] = STATED["isa"]
"""Functions of ISA-5.1 by role: FT_211 measures the loop that FV_211 moves."""


def loops_of(tags: Iterable[str]) -> dict[str, dict[str, str]]:
    """Loops with at least a PV: name to the tag of each role ('sp', 'pv', 'op', 'mode', 'position').

    A function block is left out of the name if it is the only one of its module: FIC1/PID1/PV.CV is of loop FIC1.
    """
    groups: dict[str, dict[str, str]] = {}
    others = []
    for tag in tags:
        found = _parted(tag)
        if found is None:
            others.append(tag)
        else:
            groups.setdefault(found[0], {}).setdefault(found[1], tag)
    found_by_name = {loop: _roles(endings) for loop, endings in groups.items()}
    whole = {loop: roles for loop, roles in found_by_name.items() if _is_loop(loop, roles, groups[loop])}
    named = {loop or roles["pv"]: roles for loop, roles in _without_blocks(whole).items()}
    return {**_isa_pairs(others), **named}


def _parted(tag: str) -> tuple[str, str] | None:
    """Loop and ending of a tag; the loop is '' if the tag is only an ending."""
    name = _NO_NAME.sub("", tag).strip()
    found = _BEHIND.match(name)
    if found is not None and (
        found["mark"] != " " or len(found["ending"]) > 3 or re.search(r"\d", found["loop"])
    ):
        return found["loop"], _plain(found["ending"])
    found = _BEFORE.match(name)
    if found is not None:
        return found["loop"], _plain(found["ending"])
    found = _BARE.match(name)
    return None if found is None else ("", _plain(found["ending"]))


def _plain(ending: str) -> str:
    """An ending in the table's form."""
    upper = ending.upper()
    if upper in _SPELLED:
        return upper
    return _BY_LETTERS[re.sub("[ _]", "", upper)]


_SPELLED = _all(SYSTEMS)
_BY_LETTERS = {ending.replace("_", ""): ending for ending in _SPELLED}


def _is_loop(loop: str, roles: Mapping[str, str], endings: Mapping[str, str]) -> bool:
    """Whether tags of one name are a loop: with a PV, and, if one has only a word or no name, with another one."""
    if "pv" not in roles:
        return False
    ending = next(ending for ending, tag in endings.items() if tag == roles["pv"])
    if len(ending) == 1:  # X, Y and Z are also coordinates
        return "sp" in roles and "op" in roles
    return "sp" in roles or "op" in roles or (ending in SURE and loop != "")


def _roles(endings: Mapping[str, str]) -> dict[str, str]:
    """Tags by role, for the control system that explains most endings."""
    readings = [
        {
            role: next(endings[e] for e in system[role] if e in endings)
            for role in ROLES
            if not endings.keys().isdisjoint(system.get(role, ()))
        }
        for system in SYSTEMS
    ]
    roles = max(readings, key=lambda roles: ("pv" in roles, len(roles)))
    for role in ("sp", "op"):
        others = (ending for system in SYSTEMS for ending in system.get(role, ()))
        free = (endings[e] for e in others if e in endings and endings[e] not in roles.values())
        if role not in roles and (tag := next(free, None)) is not None:
            roles[role] = tag
    return roles


def _without_blocks(loops: dict[str, dict[str, str]]) -> dict[str, dict[str, str]]:
    modules = {loop: match["module"] for loop in loops if (match := _BLOCK.match(loop))}
    blocks = Counter(modules.values())
    single = {loop: module for loop, module in modules.items() if blocks[module] == 1}
    return {single.get(loop, loop) if single.get(loop) not in loops else loop: loops[loop] for loop in loops}


def _isa_pairs(tags: Iterable[str]) -> dict[str, dict[str, str]]:
    """Loops of tags with one letter and number, one measuring and one moving: FT_211 and FV_211 are FIC211."""
    found: dict[str, dict[str, str]] = {}
    for tag in tags:
        parts = _ISA.match(_NO_NAME.sub("", tag).strip())
        role = next(
            (r for r, letters in ISA.items() if parts is not None and parts["function"] in letters), None
        )
        if parts is not None and role is not None:
            loop = f"{parts['area']}{parts['kind']}IC{parts['number']}"
            found.setdefault(loop, {}).setdefault(role, tag)
    return {loop: roles for loop, roles in found.items() if {"pv", "op"} <= roles.keys()}
