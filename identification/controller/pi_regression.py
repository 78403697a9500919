"""The PI law from SP and PV to OP, by regression of levels over spans of an integral time.

Each span has a constant of its own; kp and Ti avoid the bias that increments of rounded trends cause
(pid_regression.py), and include PV's lateness and the filter before the controller.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from identification.limits import LIMITS, ControllerLimits
from identification.record import Floats, Mask
from identification.simulation.lag import first_order

SHIFTS = (-2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0)
"""Latenesses of PV that are tried [samples]."""
FILTERS = (0.5, 1.0, 2.0, 4.0, 8.0)
"""Time constants of a filter between PV and the controller that are tried [samples]."""
GUESSES = (10.0, 40.0, 160.0, 640.0)
"""Integral times from which the search starts if none is stated [samples]; each one finds those within a
factor of four."""
LATE_STEP = 0.25  # Part of a sample to which lateness is estimated [samples]
OWN = (1, 2, 3)  # Moves of OP's own past that predict its next one [samples]
SEEN = (1, 2, 4, 8)
"""Delays over which the change of PV up to now is used [samples]: as long as a proportional action lasts."""


@dataclass(frozen=True, slots=True)
class ControlLaw:
    """An identified PI law: kp [% OP/% PV], ki [% OP/(% PV sample)], the PV's lateness in samples, the residual of OP
    (scatter, in % OP, and per sample, shape (n,), less each span's constant), the share that the law explains, the
    time constant of the filter of PV before the controller [samples], and the constant by which the error that the
    controller acts on exceeds the recorded one [% PV]: digits of SP and PV hide it, and the integral sums it up."""

    kp: float
    ki: float
    late: float
    scatter: float
    explained: float
    length: int
    residual: Floats = field(repr=False)
    smoothed: float = 0.0
    offset: float = 0.0

    def error(self, sp: Floats, pv: Floats) -> Floats:
        """The error that the controller acts on, shape (n,)."""
        return sp - first_order(shifted(pv, self.late), self.smoothed) + self.offset


@dataclass(frozen=True, slots=True)
class Trends:
    """Data for the identification of a control law.

    sp, pv, op : shape (n,) [% of span]; usable : bool, shape (n,), False in gaps, in manual and at OP's limits.
    """

    sp: Floats
    pv: Floats
    op: Floats
    usable: Mask
    limits: ControllerLimits = LIMITS.controller


def shifted(x: Floats, late: float) -> Floats:
    """The signal `late` samples earlier, shape (n,), by linear interpolation."""
    k = np.arange(x.size)
    return np.interp(k + late, k, x)


def centred(x: Floats, length: int) -> Floats:
    """The signal less its mean in each span, shape (m * length,)."""
    m = x.size // length
    cut = x[: m * length].reshape(m, length)
    return (cut - cut.mean(axis=1, keepdims=True)).ravel()


def regress(e: Floats, op: Floats, length: int, keep: Mask) -> tuple[float, float, float, Floats]:
    """kp [% OP/% PV], ki [% OP/(% PV sample)], offset of the error [% PV] and residual of OP [% OP], shape (m *
    length,): OP on e, its sum and time, shape (n,) each, with a constant for each span."""
    rows = np.stack([centred(x, length) for x in (e, np.cumsum(e), np.arange(e.size, dtype=float), op)])
    use = keep[: rows.shape[1]]
    gram = (rows * use) @ rows.T
    scale = np.sqrt(np.diag(gram)[:3]) + 1e-300
    both = gram[:3, :3] / np.outer(scale, scale)
    kp, ki, ramp = (float(x) for x in np.linalg.lstsq(both, gram[:3, 3] / scale, rcond=None)[0] / scale)
    return kp, ki, ramp / ki if ki else 0.0, rows[3] - kp * rows[0] - ki * rows[1] - ramp * rows[2]


def trusted(residual: Floats, length: int, limits: ControllerLimits) -> Mask:
    """True in the spans whose residual is not far above the median span's, shape (m * length,)."""
    size = np.sqrt((residual.reshape(-1, length) ** 2).mean(axis=1))
    return np.repeat(size <= limits.trusted * np.median(size) + 1e-9, length)


def law(x: Trends, length: int, late: float, smoothed: float = 0.0) -> ControlLaw:
    """The PI law at a given lateness of PV and filter time constant [samples]; spans that deviate are excluded twice.

    Only fully usable spans count, or all samples if these are too few: a limit or a gap within a span changes the
    constant of the integral.
    """
    e = x.sp - first_order(shifted(x.pv, late), smoothed)
    n = (e.size // length) * length
    whole = np.repeat(x.usable[:n].reshape(-1, length).all(axis=1), length)
    keep = fit = whole if whole.sum() >= x.limits.spans * length else x.usable[:n]
    for _ in range(3):
        kp, ki, offset, residual = regress(e[:n], x.op[:n], length, keep)
        keep = fit & trusted(residual, length, x.limits)
    moved = centred(x.op[:n], length)
    mean_square = float((residual[keep] ** 2).mean()) if keep.any() else math.inf
    power = float((moved[keep] ** 2).mean()) if keep.any() else 1.0
    return ControlLaw(
        kp,
        ki,
        late,
        math.sqrt(mean_square),
        1.0 - mean_square / max(power, 1e-12),
        length,
        residual,
        smoothed,
        offset,
    )


def span_length(n: int, ti_samples: float, limits: ControllerLimits) -> int:
    """Samples in a span of the regression: an integral time, limited by the least number of spans in the record."""
    return int(np.clip(ti_samples, limits.span_samples, max(n // limits.spans, limits.span_samples)))


def recovered_law(x: Trends, ti_samples: float, stated_kp: float = 1.0, late: bool = True) -> ControlLaw:
    """The PI law, with PV's lateness searched in whole samples and then between them.

    Under an oscillation a law of the wrong sign, half a period late, reproduces OP as well; only laws with the stated
    sign of gain are searched. late : whether PV's clock may be late at all. A filter before the controller also
    delays OP, so lateness is searched together with filters, up to its value without a filter.
    """
    at = partial(law, x, span_length(x.op.size, ti_samples, x.limits))

    def scatter(found: ControlLaw) -> float:
        return found.scatter if found.kp * stated_kp > 0 and found.kp * found.ki > 0 else math.inf

    shifts = SHIFTS if late else (0.0,)
    plain = min((at(s) for s in shifts), key=scatter)
    filtered = min((at(s, f) for f in FILTERS for s in shifts if s <= max(plain.late, 0.0)), key=scatter)
    best = filtered if scatter(filtered) < x.limits.filter_leaves * scatter(plain) else plain
    if math.isinf(scatter(best)):
        return at(0.0)
    for step in (0.5, 0.25, 0.125, 0.06) if best.smoothed else (0.5, 0.25):
        search_late = late and step >= LATE_STEP
        later = [at(best.late + way * step, best.smoothed) for way in (-1, 1) if search_late]
        slower = [at(best.late, best.smoothed * (1 + way * step)) for way in (-1, 1) if best.smoothed]
        best = min([best, *later, *slower], key=scatter)
    return best


def unstated_law(x: Trends) -> ControlLaw | None:
    """The PI law of a controller without stated settings; None where no law reproduces OP.

    The spans of the regression have the length of the integral time, so it is identified in two steps.
    """
    best = None
    for guess in GUESSES:
        first = law(x, span_length(x.op.size, guess, x.limits), 0.0)
        if first.kp * first.ki > 0.0 and (best is None or first.explained > best.explained):
            best = first
    if best is None:
        return None
    found = recovered_law(x, best.kp / best.ki, best.kp)
    moved = centred(x.op, found.length)
    over_all = 1.0 - float(found.residual @ found.residual) / max(float(moved @ moved), 1e-12)
    believed = found.explained >= x.limits.law_explains and over_all >= x.limits.law_gives
    return found if found.kp * found.ki > 0.0 and believed else None


def feedback_share(op: Floats, pv: Floats) -> float:
    """Share [-] of OP's moves, unexplained by OP's own past, that PV's value and its last moves explain, 0 to 1.

    Both of shape (n,). 0 for a record of fewer samples than twenty times the constants.
    """
    reach = max(max(OWN) + 1, max(SEEN))
    k = np.arange(reach, op.size)
    if k.size < 20 * (2 + len(OWN) + 1 + len(SEEN)):
        return 0.0
    moved = op[k] - op[k - 1]
    own = [np.ones(k.size), op[k - 1], *(op[k - i] - op[k - i - 1] for i in OWN)]
    seen = [pv[k], *(pv[k] - pv[k - i] for i in SEEN)]
    alone, together = _residual_squares(moved, own), _residual_squares(moved, own + seen)
    return 1.0 - together / alone if alone > 0.0 else 0.0


def _residual_squares(y: Floats, columns: list[Floats]) -> float:
    """Residual sum of squares of a regression."""
    x = np.stack(columns, axis=1)
    x = x / np.maximum(np.abs(x).max(axis=0), 1e-12)
    r = y - x @ np.linalg.lstsq(x, y, rcond=1e-10)[0]
    return float(r @ r)
