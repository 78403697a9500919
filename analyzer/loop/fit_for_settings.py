"""What trends lack for new settings to be sought on them, whatever makes their loop cycle."""

from __future__ import annotations

from analyzer.config import Config
from analyzer.loop.decisions import Lack, Needs
from analyzer.loop.fit_for_cause import compressed
from analyzer.loop.quality import Prepared, op_range
from analyzer.words import settings as words
from identification.models import Pid


def unfit_for_settings(prepared: Prepared, config: Config) -> Needs | None:
    """What these trends lack for new settings; None where nothing that they show by themselves."""
    if not prepared.op_scaled:
        return Needs(Lack.OP_RANGE, op_range(prepared.scale, prepared.record.op))
    return compressed(prepared, None, config.quality)


def too_thin(dt_s: float, controller: Pid | None, config: Config) -> Needs | None:
    """What sampling new settings take, where the controller acts several times between two samples, unseen."""
    samples = config.settings.ti_samples
    if controller is None or dt_s <= controller.ti_s / samples:
        return None
    return Needs(Lack.FASTER, words.too_thin(dt_s, controller.ti_s, samples))
