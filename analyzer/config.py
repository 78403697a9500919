"""The limits of a run: stated in limits.toml by section, changed by a file, printed by `triage config`."""

from __future__ import annotations

import json
import math
import textwrap
import tomllib
from collections.abc import Mapping
from dataclasses import Field, dataclass, field, fields, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from identification.errors import InputError
from identification.limits import (
    KEY,
    ControllerLimits,
    ExplainLimits,
    Limit,
    Limits,
    RecorderLimits,
)
from tuning.limits import TuningLimits

REMEDY = "correct it; 'triage config' prints all limits with their ranges"
WIDTH = 100
"""Characters of a comment's line."""


class OscillationLimits(Limits, section="oscillation"):
    """Criteria of an oscillation in the spectrum."""

    def nearly(self) -> OscillationLimits:
        """The limits for a cycle that needs further confirmation: half-cycles may differ, because a valve slips when
        OP has moved far enough, at any time."""
        names = ("shape", "shape_least", "swing", "swing_least")
        return replace(
            self,
            **{name: getattr(self, name) - self.near for name in names},
            shape_prominence=self.near_prominence,
            share=self.near_share,
            swing_cycles=self.periods,
            swing_spread=math.inf,
        )


class QualityLimits(Limits, section="quality"):
    """Criteria of unusable samples or trends."""


class CauseLimits(Limits, section="cause"):
    """Criteria of a cause."""

    def needed(self, count: int, excited: bool, oscillating: bool) -> float:
        """Evidence required for a valve fault [nat]: a minimum, and a share of the samples judged, because no model
        is exact."""
        per_sample = self.evidence_per_sample * (1.0 if oscillating else self.quiet_factor)
        least = self.evidence if excited or oscillating else self.evidence_unexcited
        return max(least, per_sample * count)


class PlantLimits(Limits, section="plant"):
    """Criteria of a common oscillation of loops, and of its source."""


class SettingsLimits(Limits, section="settings"):
    """Criteria of settings in OP that differ from the stated ones."""


class AdviceLimits(Limits, section="advice"):
    """Minimum evidence for new settings and firm verdicts."""


class FigureLimits(Limits, section="figures"):
    """Samples that the assessments of a span leave out."""


class LaneLimits(Limits, section="lanes"):
    """Limits above which a loop is in a lane."""


class NightLimits(Limits, section="nights"):
    """Division of an export into nights, and choice between two records of a loop."""


class BeliefLimits(Limits, section="belief"):
    """Joint results of several nights on a loop, and when they are reported."""


class WearLimits(Limits, section="wear"):
    """Criteria of a wearing valve, and extrapolation of its wear."""


class ComparisonLimits(Limits, section="before_after"):
    """Comparability of the spans before and after a change, and the confidence of a verdict."""


class ChangeLimits(Limits, section="changes"):
    """When an unstated change of a controller is proposed."""


class WorkerLimits(Limits, section="workers"):
    """Limits of time and memory for one loop; a loop that exceeds them is given up."""


class OpeningLimits(Limits, section="opening"):
    """Limits of time and memory for opening an export, above which it is given up."""


@dataclass(frozen=True, slots=True)
class Config:
    """All limits of a run."""

    oscillation: OscillationLimits = field(default_factory=OscillationLimits)
    quality: QualityLimits = field(default_factory=QualityLimits)
    cause: CauseLimits = field(default_factory=CauseLimits)
    plant: PlantLimits = field(default_factory=PlantLimits)
    settings: SettingsLimits = field(default_factory=SettingsLimits)
    advice: AdviceLimits = field(default_factory=AdviceLimits)
    tuning: TuningLimits = field(default_factory=TuningLimits)
    figures: FigureLimits = field(default_factory=FigureLimits)
    lanes: LaneLimits = field(default_factory=LaneLimits)
    nights: NightLimits = field(default_factory=NightLimits)
    belief: BeliefLimits = field(default_factory=BeliefLimits)
    wear: WearLimits = field(default_factory=WearLimits)
    before_after: ComparisonLimits = field(default_factory=ComparisonLimits)
    changes: ChangeLimits = field(default_factory=ChangeLimits)
    explain_recorder: RecorderLimits = field(default_factory=RecorderLimits)
    explain_controller: ControllerLimits = field(default_factory=ControllerLimits)
    workers: WorkerLimits = field(default_factory=WorkerLimits)
    opening: OpeningLimits = field(default_factory=OpeningLimits)

    @property
    def explain(self) -> ExplainLimits:
        """Limits for the explanation of one recording."""
        return ExplainLimits(self.explain_recorder, self.explain_controller)


def read_config(path: Path | None) -> Config:
    """The limits of a file, with defaults for missing ones; only the defaults without a file. Raises InputError if
    the file is not TOML, or has an unknown name, a wrong type or a value out of range."""
    if path is None:
        return Config()
    try:
        stated = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (ValueError, RecursionError) as error:  # of the decoder, of the encoding, of endless numbers
        remedy = "begin with what 'triage config' prints"
        raise InputError(f"{path}: {error}", "TOML in UTF-8", remedy) from error
    return configured(stated, str(path))


def configured(stated: Mapping[str, Any], where: str) -> Config:
    """The limits with the stated ones, by section and name, instead of the defaults. Raises InputError for an unknown
    name, a wrong type or a value out of range."""
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
    """A section's limits with the stated ones."""
    known = {f.name: f for f in fields(limits)}
    values = {}
    for name, value in stated.items():
        _require_known(name, list(known), f"{where} {name}")
        values[name] = _checked(known[name], getattr(limits, name), value, f"{where} {name}")
    return replace(limits, **values)


def _checked(field: Field[Any], default: Any, value: Any, where: str) -> Any:
    """A value of the field's type, within its range."""
    limit, whole = limit_of(field), isinstance(default, int)
    if isinstance(default, tuple):
        return _rows_by_type(limit, value, where)
    if not _is_number(value, limit, whole):
        kind = "a whole number" if whole else "a number"
        raise InputError(f"{where} is {value!r}", f"{kind} {_range(limit)}", REMEDY)
    return value if whole else float(value)


def _is_number(value: Any, limit: Limit, whole: bool = False) -> bool:
    """Whether a value is a number of the required kind, within its range."""
    if isinstance(value, bool) or not isinstance(value, int if whole else (int, float)):
        return False
    return bool(limit.least <= value <= limit.most)  # false of NaN


def _rows_by_type(limit: Limit, value: Any, where: str) -> tuple[tuple[str, float, float], ...]:
    """Rows of a loop's type and two numbers."""
    rows = value if isinstance(value, list) else [value]
    for row in rows:
        shaped = isinstance(row, list) and len(row) == 3 and isinstance(row[0], str)
        if not shaped or not all(_is_number(cell, limit) for cell in row[1:]):
            expected = f'rows such as ["flow", 60.0, 30.0], {_range(limit)}'
            raise InputError(f"{where} has {row!r}", expected, REMEDY)
    return tuple((row[0].lower(), float(row[1]), float(row[2])) for row in rows)


def limit_of(field: Field[Any]) -> Limit:
    """The declaration of a field."""
    limit: Limit = field.metadata[KEY]
    return limit


def _range(limit: Limit) -> str:
    unit = "" if limit.unit == "-" else f" [{limit.unit}]"
    return f"from {limit.least:g} to {limit.most:g}{unit}"


def limits_document(config: Config) -> str:
    """Limits as TOML, each with unit, range, meaning and source as a comment."""
    head = "# Limits of triage; a file given with --config needs only those that it changes."
    return "\n".join([head, *(_part_of_file(f.name, getattr(config, f.name)) for f in fields(config))])


def _part_of_file(name: str, limits: Any) -> str:
    first = (type(limits).__doc__ or "").splitlines()[0]
    lines = ["", f"# {first}", f"[{name}]"]
    for each in fields(limits):
        limit = limit_of(each)
        text = f"{limit.meaning}. {_range(limit).replace('from', 'From', 1)}; {limit.source}."
        lines += [f"# {line}" for line in textwrap.wrap(text, WIDTH)]
        value = getattr(limits, each.name)  # JSON's numbers, text and lists are TOML's
        lines.append(f"{each.name} = {json.dumps(value, ensure_ascii=False)}")
    return "\n".join(lines)
