"""loops.csv: the plant's statements about each loop."""

from __future__ import annotations

import csv
import io
import math
import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from analyzer.history.files import detect_encoding
from analyzer.history.plant_clock import UTC_NAME
from analyzer.history.stamps import parse_time
from analyzer.loops.gain_schedule import GainSchedule, gain_schedule
from identification.errors import InputError
from identification.models import ErrorForm, Form

MISSPELT = 0.75  # Similarity of a column's name to a known one from which it counts as misspelt

STATED: dict[str, Any] = tomllib.loads(Path(__file__).with_name("loops.toml").read_text(encoding="utf-8"))
"""Endings of tags, allowed contents of columns and their names in other systems, and defaults for empty cells."""
ROLES = ("sp", "pv", "op", "mode", "position")
CELLS: Mapping[str, Any] = STATED["cells"]
NUMBERS: Mapping[str, tuple[float, float]] = CELLS["numbers"]
CHOICES: Mapping[str, Sequence[str]] = CELLS["choices"]
VALID_FROM = "valid_from"
RECORDED = "recorded"
"""Value of the column `ranges` in a draft row whose PV range is only the recorded one, and so is not stated."""
COLUMNS = (*CELLS["texts"], *ROLES, *NUMBERS, *CHOICES, VALID_FROM)
OWN_COLUMNS = ("op_unit", "sp_unit", "ranges", "found_by", "sure_pct", "says")
"""Columns similar to a known name but not misspelt; and columns that `triage loops` adds."""
OTHER_NAMES = {other: ours for ours, others in STATED["other_names"].items() for other in others}


@dataclass(frozen=True, slots=True)
class Output:
    """Another controller's output: its tag, and its values at 0 and at 100 %."""

    tag: str
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class LoopSpec:
    """One row of loops.csv, or one loop found by its tags.

    Tags are None if not stated, and after `tags.match` if missing in the export; `wanted_pv` is then
    the requested tag. `master` is the loop whose output is this loop's set point, `ratio_of` the one to
    whose PV it keeps a ratio, `split_of` the controller of whose split range it is a half, `override_with` the one
    with which it shares a valve by a select; `partner_output` is the output of one of the latter two.
    `feedforward` is a loop or tag that acts on OP in addition to the error, `feed` its tag if the export has it.
    `kp`, `ti`, `td` are as stated, in `gain_unit`, `ti_unit` and `form`; `pv_lo`, `pv_hi` and `gap` in the PV's own
    unit, `op_lo`, `op_hi`, the limits of OP and of its rate (per second) in the OP's. `kp` is 0 for integral action
    alone.
    `upstream` is the loop (its PV) or tag of this loop's measured load, `load` its tag if the export has it.
    `in_ma` is True if OP looks like a current of 4 to 20 mA without a stated range.
    `gain_schedule` states a gain that depends on OP, PV or SP.
    `extra` are columns of the plant's own, `stated` the names of the filled columns. `valid_from_s` is the time from
    which the row's settings are valid [s since 1970-01-01 UTC], None if not stated; `earlier` are the
    loop's rows before it, oldest first.
    """

    loop: str
    description: str = ""
    type: str = ""
    area: str = ""
    master: str = ""
    ratio_of: str = ""
    split_of: str = ""
    override_with: str = ""
    feedforward: str = ""
    upstream: str = ""
    sp: str | None = None
    pv: str | None = None
    op: str | None = None
    mode: str | None = None
    position: str | None = None
    pv_lo: float | None = None
    pv_hi: float | None = None
    op_lo: float = 0.0
    op_hi: float = 100.0
    pv_unit: str = ""
    kp: float | None = None
    ti: float | None = None
    td: float | None = None
    form: Form = Form.IDEAL
    gain_unit: str = "percent"
    ti_unit: str = "s"
    scan_s: float | None = None
    gap: float = 0.0
    gap_gain: float = 0.0
    error_form: ErrorForm = ErrorForm.LINEAR
    pv_filter_s: float = 0.0
    op_rate: float | None = None
    op_lo_limit: float | None = None
    op_hi_limit: float | None = None
    sp_weight: float = 1.0
    td_filter: float | None = None
    gain_schedule: str = ""
    importance: float | None = None
    extra: Mapping[str, str] = field(default_factory=dict)
    stated: frozenset[str] = frozenset()
    wanted_pv: str = ""
    valid_from_s: float | None = None
    earlier: tuple[LoopSpec, ...] = ()
    partner_output: Output | None = None
    feed: str | None = None
    load: str | None = None
    in_ma: bool = False

    @property
    def tags(self) -> tuple[str, ...]:
        """The known tags of the loop, including those with which it is judged."""
        own = (
            *(getattr(self, role) for role in ROLES),
            self.partner_output.tag if self.partner_output else None,
            self.feed,
        )
        return tuple(dict.fromkeys(tag for tag in own if tag is not None))

    @property
    def op_unit(self) -> str:
        """Name of the unit of OP: percent if its range is 0 to 100, else OP, in its own unit."""
        return "%" if (self.op_lo, self.op_hi) == (0.0, 100.0) else "OP"

    @property
    def schedule(self) -> GainSchedule | None:
        """The stated schedule of the gain."""
        return gain_schedule(self.gain_schedule, self.loop) if self.gain_schedule else None

    @property
    def has_pv_range(self) -> bool:
        """Whether the row states the PV range for percent; otherwise percent is of the recorded range."""
        return self.pv_lo is not None and self.pv_hi is not None

    @property
    def defaults(self) -> tuple[str, ...]:
        """Defaults used for empty cells, for the output."""
        return tuple(text for column, text in STATED["defaults"].items() if column not in self.stated)


CONTROLLER_COLUMNS = (
    *("td", "td_filter", "scan_s", "pv_filter_s", "gap", "gap_gain", "error_form", "sp_weight"),
    *("op_rate", "op_lo_limit", "op_hi_limit", "op_lo", "op_hi"),
)
"""Columns that state the controller's law in addition to kp and ti, their units and the form."""


def controller_columns(spec: LoopSpec) -> dict[str, str | float]:
    """Those of CONTROLLER_COLUMNS that a loop states otherwise than the default, with their values."""
    plain = LoopSpec("")
    values = ((name, getattr(spec, name)) for name in CONTROLLER_COLUMNS)
    return {name: value for name, value in values if value != getattr(plain, name)}


def read_loops(path: Path, zone: str = UTC_NAME, day_first: bool | None = None) -> tuple[LoopSpec, ...]:
    """Read loops.csv: one loop per row, decimal point or comma, columns in any order.

    A loop may have several rows if each but the first states in `valid_from` from when its settings are valid, on the
    plant's clock unless a zone is stated; its last row is returned, with the `earlier` ones.

    Raises
    ------
    InputError
        The file is missing or empty, lacks the column `loop`, misspells a column, names a loop twice at one
        time, or contains an invalid number, an unknown form or unit, or a range that does not rise.
    """
    header, rows = csv_table(path, "loop")
    _check_header(path, header)
    if not rows:
        raise InputError(f"{path}: no loops", "one row a loop below the header", "add the loops")
    specs = [_spec(f"{path}, row {row}", cells, zone, day_first) for row, cells in rows]
    dated: dict[tuple[str, float | None], list[int]] = {}
    by_loop: dict[str, list[LoopSpec]] = {}
    for (row, _), spec in zip(rows, specs, strict=True):
        dated.setdefault((spec.loop, spec.valid_from_s), []).append(row)
        by_loop.setdefault(spec.loop, []).append(spec)
    twice = next(((loop, places) for (loop, _), places in dated.items() if len(places) > 1), None)
    if twice is not None:
        seen = f"{path}: loop {twice[0]} in rows {', '.join(map(str, twice[1]))}"
        expected = "each loop once, or its rows with different times in valid_from"
        raise InputError(seen, expected, "remove all but one, or date them")
    for own in by_loop.values():
        own.sort(key=lambda s: -math.inf if s.valid_from_s is None else s.valid_from_s)
    return tuple(replace(own[-1], earlier=tuple(own[:-1])) for own in by_loop.values())


def unknown_columns(specs: Sequence[LoopSpec]) -> tuple[str, ...]:
    """Columns of loops.csv without a meaning here, which are kept as the plant's own."""
    return tuple(dict.fromkeys(name for spec in specs for name in spec.extra if name not in OWN_COLUMNS))


def csv_table(path: Path, of: str) -> tuple[list[str], list[tuple[int, dict[str, str]]]]:
    """Header in lower case of a CSV of loops or of changes, and its filled rows with their line numbers.

    Raises
    ------
    InputError
        It cannot be opened, is empty, or has a line above the size limit.
    """
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        seen = f"{path}: cannot be opened ({error.strerror or error})"
        raise InputError(seen, f"a CSV of {of}s", f"correct --{of}s") from error
    text = data.decode(detect_encoding(data), errors="replace").lstrip("\ufeff")
    if max(map(len, text.split("\n"))) > csv.field_size_limit():
        raise InputError(f"{path}: a line of more than 128 kB", f"one row a {of}", "correct the file")
    first = next((line for line in text.splitlines() if line.strip() and line[:1] != "#"), "")
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=max(",;\t", key=first.count))
    rows = [(reader.line_num, [cell.strip() for cell in cells]) for cells in reader]
    rows = [(row, cells) for row, cells in rows if any(cells) and not cells[0].startswith("#")]
    if not rows:
        expected = f"a header with the column 'loop' and a row a {of}"
        raise InputError(f"{path}: empty file", expected, "fill it")
    header = [cell.lower() for cell in rows[0][1]]
    return header, [(row, dict(zip(header, cells, strict=False))) for row, cells in rows[1:]]


def _check_header(path: Path, header: Sequence[str]) -> None:
    for name in header:
        known = name in (*COLUMNS, *OWN_COLUMNS)
        near = [] if known else get_close_matches(name, COLUMNS, 1, MISSPELT)
        if near and near[0] not in header:
            remedy = f"did you mean '{near[0]}'? Rename it"
            raise InputError(f"{path}: column '{name}'", f"'{near[0]}'", remedy)
    for name in header if "loop" in header else ():
        meant = OTHER_NAMES.get(name.replace(" ", "_"), "")
        if meant and meant.split("'")[0] not in header:
            remedy = f"rename it to '{meant}', or remove it"
            raise InputError(f"{path}: column '{name}'", f"'{meant}'", remedy)
    if "loop" not in header:
        seen = f"{path}: no column 'loop' among {', '.join(header[:8])}"
        raise InputError(seen, "a column 'loop'", "add it")
    twice = [name for name, count in Counter(header).items() if count > 1 and name]
    if twice:
        raise InputError(f"{path}: column '{twice[0]}' occurs twice", "each column once", "remove one")


def _spec(where: str, cells: Mapping[str, str], zone: str, day_first: bool | None) -> LoopSpec:
    """The loop of a row; `where` is its location for messages."""
    filled = {name: cell for name, cell in cells.items() if cell}
    if "loop" not in filled:
        raise InputError(f"{where}: no loop name", "a name in column 'loop'", "name the loop")
    given: dict[str, Any] = {name: filled[name] for name in (*CELLS["texts"], *ROLES) if name in filled}
    numbers = {name: _number_in_bounds(where, name, filled[name]) for name in NUMBERS if name in filled}
    off = [name for name in CELLS["off_is_empty"] if not (name == "kp" and numbers.get("ti"))]
    given |= {name: value for name, value in numbers.items() if value or name not in off}
    if given.get("ti", 0.0) < 0.0 and given.get("kp") != 0.0:
        seen = f"{where}, column 'ti': {given['ti']:g}"
        raise InputError(
            seen, "a number, not below 0 where kp, whose sign says how it acts, is not 0", "correct the cell"
        )
    given |= {name: _choice(where, name, filled[name]) for name in CHOICES if name in filled}
    if VALID_FROM in filled:
        place = f"{where}, column '{VALID_FROM}'"
        given["valid_from_s"] = parse_time(filled[VALID_FROM], place, zone, day_first)
    if "gain_schedule" in filled:
        gain_schedule(filled["gain_schedule"], f"{where}, column 'gain_schedule'")
    extra = {name: cell for name, cell in cells.items() if name and name not in COLUMNS}
    spec = LoopSpec(**given, extra=extra, stated=frozenset(given))
    for signal, low, high in (("pv", spec.pv_lo, spec.pv_hi), ("op", spec.op_lo, spec.op_hi)):
        if (low, high) == (None, None):
            continue
        if low is None or high is None or not high - low > 1e-9 * max(abs(low), abs(high), 1.0):
            seen = f"{where}: {signal}_lo {low} and {signal}_hi {high}"
            raise InputError(seen, f"{signal}_hi above {signal}_lo, both or neither", "correct the range")
    drafted = extra.get("ranges", "").lower() == RECORDED
    return replace(spec, pv_lo=None, pv_hi=None, stated=spec.stated - {"pv_lo", "pv_hi"}) if drafted else spec


def _number_in_bounds(where: str, name: str, cell: str) -> float:
    if name == "ti" and cell.lower() in CELLS["no_integral"]:
        return 0.0
    try:
        number = float(cell if "." in cell else cell.replace(",", "."))
    except ValueError:
        number = math.nan
    least, most = NUMBERS[name]
    sized = least <= abs(number) <= most or number == 0.0  # false of NaN and inf
    if sized and (number >= 0.0 or name in CELLS["signed"]):
        return number
    sign = "" if name in CELLS["signed"] else ", not below 0"
    expected = f"a number{sign}, of {least:g} to {most:g} in size"
    raise InputError(f"{where}, column '{name}': '{cell[:40]}'", expected, "correct the cell or empty it")


def _choice(where: str, name: str, cell: str) -> str:
    if cell.lower() not in CHOICES[name]:
        seen = f"{where}, column '{name}': '{cell}'"
        raise InputError(seen, f"one of {', '.join(CHOICES[name])}", "correct the cell or empty it")
    kinds = {"form": Form, "error_form": ErrorForm}
    return kinds[name](cell.lower()) if name in kinds else cell.lower()


def spec_of(specs: Sequence[LoopSpec], loop: str) -> LoopSpec:
    """The row of one loop.

    Raises
    ------
    InputError
        There is no such loop; the message lists the nearest names.
    """
    for spec in specs:
        if spec.loop == loop:
            return spec
    near = ", ".join(get_close_matches(loop, [s.loop for s in specs], n=3)) or "none is near"
    seen = f"loop {loop} is not among the {len(specs)} loops"
    raise InputError(seen, f"one of them ({near})", "correct --loop")
