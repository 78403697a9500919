"""Functions for notebooks: read an export, assess a loop, fit, simulate, tune, explain, read a store into pandas.

From the project's folder:
>>> import analyzer as triage
>>> plant = triage.read("sample_data/mill.parquet", loops="sample_data/loops.csv", changes="sample_data/changes.csv")
>>> len(plant.loops), plant.nights[0]
(22, '2026-03-02')
>>> loop = plant.loop("TIC2106", night="2026-03-03")
>>> loop.record.dt_s, loop.controller.kp
(10.0, 4.0)
>>> found = triage.assess(loop)
>>> str(found.verdict.cause), str(found.verdict.fault)
('valve', 'backlash')
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from analyzer.config import Config
from analyzer.loop import assess as of_night
from analyzer.loop.advice import tune as of_settings
from analyzer.loop.advice.advise import withheld
from analyzer.night.nights import Plant, PlantLoop
from analyzer.night.opened import opened
from analyzer.night.request import export_request
from analyzer.store.store import Store
from identification.errors import InputError, NotAssessedError
from identification.models import Estimate, Loop, Pid, Process, Valve
from identification.record import Floats, LoopRecord
from identification.simulation.closed_loop import closed_loop

if TYPE_CHECKING:
    import pandas as pd

    from analyzer.explain.explained import Explained

__all__ = [
    "Identified",
    "Plant",
    "PlantLoop",
    "assess",
    "explain",
    "fit",
    "nights",
    "read",
    "simulate",
    "tune",
]

Paths = str | Path | Sequence[str | Path]


def read(
    export: Paths,
    loops: str | Path | None = None,
    changes: str | Path | None = None,
    config: Config | None = None,
    **reading: Any,
) -> Plant:
    """Open an export. Raises InputError if the export or a table cannot be used; the text names what was seen, what
    was expected and what to do.

    Parameters
    ----------
    export : path or sequence of paths
        CSV or Parquet, wide or long, or folders of them.
    loops, changes : path or None
        loops.csv and changes.csv; without loops.csv loops are found by the endings of tags.
    config : Config or None
        Thresholds; None: the defaults.
    **reading
        Format of text files: timezone, delimiter, decimal, encoding, day_first, date_format, time_column,
        quality_column, good_quality.
    """
    paths = [Path(p) for p in ([export] if isinstance(export, str | Path) else export)]
    stated, dated = (None if path is None else Path(path) for path in (loops, changes))
    request = export_request(paths, stated, dated, config or Config(), None, None, **reading)
    return opened(request)


def assess(loop: PlantLoop) -> of_night.Assessment:
    """Assess a loop as in a night: oscillation, cause, and figures. Raises NotAssessedError if the record is not
    sufficient; the text gives the requirement."""
    return of_night.assess(loop.prepared, loop.controller, loop.plant.config, loop.spec.type, loop.earlier)


@dataclass(frozen=True)
class Identified:
    """Identified process and valve: the most likely model, and its parameters with 90 % intervals by name."""

    process: Process
    valve: Valve
    estimates: Mapping[str, Estimate]


def fit(loop: PlantLoop) -> Identified:
    """Identify process and valve from the trends of a loop. Raises NotAssessedError if they give no model; the text
    gives the missing data.

    >>> import analyzer as triage
    >>> plant = triage.read("sample_data/mill.parquet", loops="sample_data/loops.csv")
    >>> model = triage.fit(plant.loop("TIC2106", night="2026-03-03"))
    >>> type(model.process).__name__, type(model.valve).__name__
    ('Fopdt', 'Backlash')
    >>> estimate = model.estimates["backlash_pct"]
    >>> bool(estimate.low < estimate.value < estimate.high), estimate.unit
    (True, '% of OP')
    """
    return Identified(*of_settings.identified(assess(loop), loop.plant.config.advice))


def simulate(
    process: Process, controller: Pid, sp: Floats, load: Floats, valve: Valve = None, op_start: float = 50.0
) -> LoopRecord:
    """A closed loop under set point and load, stepped at the controller's scan; see `closed_loop`.

    >>> import numpy as np
    >>> import analyzer as triage
    >>> from identification.models import Backlash, Fopdt, Pid
    >>> still = np.zeros(7200)
    >>> load = np.where(np.arange(7200) < 10, 0.0, 5.0)
    >>> worn, ideal = (
    ...     triage.simulate(Fopdt(1.5, 20.0, 3.0), Pid(3.0, 8.0), still, load, valve)
    ...     for valve in (Backlash(2.0), None)
    ... )
    >>> [bool(np.ptp(r.pv[-3600:]) > 0.5) for r in (worn, ideal)]
    [True, False]

    Parameters
    ----------
    process : Fopdt or Integrator
    controller : Pid
    sp, load : ndarray of shape (n,)
        Set point, and load plus noise as they add to PV, at each scan [% PV].
    valve : Backlash, Stiction or None
    op_start : float
        OP of the loop at rest [% OP].
    """
    return closed_loop(Loop(process, controller, valve), np.asarray(sp), np.asarray(load), op_start)


def tune(loop: PlantLoop) -> of_settings.Tuning:
    """New settings for a loop, their expected effect, and the reason. Raises InputError if loops.csv does not state
    the present settings; NotAssessedError if the trends give no model."""
    controller, found = loop.controller, assess(loop)
    if controller is None:
        raise InputError(f"{loop.spec.loop}: no kp and ti in loops.csv", "both", "state them")
    if found.verdict.measured is None:
        raise NotAssessedError(f"{loop.spec.loop}: {found.verdict.needs or 'no model can be identified'}")
    keep = withheld(found, loop.spec, controller, loop.prepared.scale.span, loop.plant.config)
    return of_settings.tune(found, controller, loop.plant.config, keep, loop.prepared, loop.spec.type)


def explain(loop: PlantLoop) -> Explained:
    """Effects that the loop's baseline model does not include; `.data` is the output of
    `triage explain --format json`. Raises NotAssessedError if OP or PV is missing or never moves."""
    from analyzer.explain.case import case, tags_of
    from analyzer.explain.explained import explained

    plant, spec = loop.plant, loop.spec
    series = plant.trends(tags_of(spec, plant.specs), loop.night)
    return explained(case(spec, plant.specs, series, plant.config), lambda _: None)


def nights(store: str | Path, table: str = "nights") -> pd.DataFrame:
    """Every night of a store as one frame, with the column `night`. Raises InputError if there is no such store.

    Parameters
    ----------
    store : path
        A folder that `triage run` wrote.
    table : str
        nights (one row per loop, from that night alone), beliefs (joint results of nights), hours, trends,
        groups or explained.
    """
    import pandas as pd

    kept = Store(Path(store))
    kept.require()
    found = {night: kept.read_if_there(table, night) for night in kept.nights()}
    frames = [t.to_pandas().assign(night=night) for night, t in found.items() if t is not None]
    return pd.concat(frames, ignore_index=True) if frames else pd.DataFrame({"night": []})
